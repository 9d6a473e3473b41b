"""What can go wrong, as types a caller can tell apart.

Every message says what was asked, what was found and what to try.
"""

from __future__ import annotations

from typing import Any


class PeelOptError(Exception):
    """Base class of all errors raised on purpose by this package.

    Parameters
    ----------
    message : str
        What was asked and what was found.
    remedy : str, optional
        What to try; appended to the message.
    nearest : float, optional
        The nearest value that does have an answer, in the unit of the question.
    candidates : sequence, optional
        The answers among which the caller has to choose.
    """

    #: Short machine-readable name, also used as ``Equilibrium.status``.
    status = "failed"

    def __init__(
        self,
        message: str,
        *,
        remedy: str = "",
        nearest: float | None = None,
        candidates: tuple[Any, ...] = (),
    ) -> None:
        super().__init__(f"{message} {remedy}".strip())
        self.remedy = remedy
        self.nearest = nearest
        self.candidates = candidates


class InvalidInput(PeelOptError, ValueError):
    """A value, unit, key or option that cannot be meant."""

    status = "invalid-input"


class NoEquilibrium(PeelOptError):
    """The question is well posed but no such equilibrium exists."""

    status = "no-equilibrium"


class AmbiguousState(PeelOptError):
    """Several equilibria fit the description; ``near=`` picks one."""

    status = "ambiguous"


class NotConverged(PeelOptError):
    """A solver stopped before it met its own tolerance."""

    status = "not-converged"


class NotCertified(PeelOptError):
    """An answer was found, but its error or its certificate exceeds ``tol``."""

    status = "not-certified"


class AtFold(PeelOptError):
    """A derivative was asked for at a fold, where there is none."""

    status = "at-fold"


class Infeasible(PeelOptError):
    """No design within the bounds meets all targets."""

    status = "infeasible"


class WorkersLost(PeelOptError):
    """The processes that share the work died, or do not compute alike."""

    status = "workers-lost"


class OutOfRange(PeelOptError):
    """The question lies outside the range this version is tested for."""

    status = "out-of-range"


class CardError(InvalidInput):
    """A problem card that cannot be read or does not mean anything."""

    status = "invalid-card"


class CardWarning(UserWarning):
    """A card that can be answered, but does not say where its numbers are from."""


class MissingExtra(PeelOptError, ImportError):
    """An optional dependency is needed and absent."""

    status = "missing-extra"
