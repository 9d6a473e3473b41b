"""How far long work is: a bar for people at a terminal, a call for programs, or nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .errors import InvalidInput

#: What ``progress=`` takes: None for a bar where somebody can see it, False for none, or a
#: function of how many steps are done and how many there are (None where nobody knows).
Progress = bool | Callable[[int, int | None], object] | None

#: Seconds that nobody minds to wait without a bar.
PATIENCE = 1.0


@contextmanager
def progress(unit: str, total: int | None = None, told: Progress = None) -> Iterator[Callable[..., None]]:
    """Yield what to call at every step, or with the number of steps just done.

    Parameters
    ----------
    unit : str
        What a step is.
    total : int, optional
        How many there are.
    told : None, bool or callable
        By default a bar on stderr after a second, if that is a terminal; False for silence;
        a function is called with the steps done and ``total``.

    Raises
    ------
    InvalidInput
        If ``told`` is none of these.

    Examples
    --------
    >>> with progress("rod", 2, lambda done, total: print(done, "of", total)) as step:
    ...     step()
    1 of 2
    """
    done = 0
    if callable(told):

        def step(steps: int = 1) -> None:
            nonlocal done
            done += steps
            told(done, total)

        yield step
    elif not isinstance(told, bool | None):
        raise InvalidInput(f"progress must be None, False or a function of two numbers, got {told!r:.60}.")
    elif told is False or not at_terminal(sys.stderr):
        yield lambda steps=1: None
    else:
        from tqdm import tqdm

        with tqdm(total=total, unit=f" {unit}", delay=PATIENCE, miniters=1, leave=False) as bar:
            yield lambda steps=1: bar.update(steps) and None


def at_terminal(stream: object) -> bool:
    """Whether a stream is a terminal; it may be None (a service), or an object of a program's own."""
    try:
        return bool(stream.isatty())  # type: ignore[attr-defined]
    except (AttributeError, OSError, ValueError):  # ValueError: it is closed
        return False
