"""What is true on paper: rod, bond, groups, equations, series.

No solver is in here.  It may know `base`.
"""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    # The module of profiles is itself a public name, and is imported like the others when first used.
    if name == "profiles":
        return import_module(f"{__name__}.profiles")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
