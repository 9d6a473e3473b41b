"""Arrays that are handed out and must not change."""

from __future__ import annotations

from typing import Any

import numpy as np


def read_only(values: Any) -> np.ndarray:
    """Return values as an array that cannot be written to; one that is so already is not copied.

    Examples
    --------
    >>> read_only([1.0, 2.0]).flags.writeable
    False
    """
    if isinstance(values, np.ndarray) and not values.flags.writeable and values.base is None:
        return values
    array = np.array(values)
    array.flags.writeable = False
    return array
