"""Equilibria of a rod peeled off a plate by pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .answer import Method
    from .branch import Branch, SpecialPoint
    from .cohesion import CohesiveLaw, exponential, trapezoidal
    from .detachment import equilibrium, length_given_pressure, pressure_given_length
    from .errors import (
        AmbiguousState,
        CardError,
        InvalidInput,
        MissingExtra,
        NoEquilibrium,
        NotCertified,
        NotConverged,
        OutOfRange,
        PeelOptError,
    )
    from .fold_curves import FoldCurve, fold_curve
    from .fold_optimum import least_lambda
    from .following import Walk, follow
    from .many_states import equilibria
    from .nlp import Ipopt
    from .result import Equilibrium
    from .rod import Rod
    from .tracing import trace
    from .transcription import Collocation, Shooting, Spectral

#: Where each public name lives; imported when first used, so that ``import peel_opt`` is free.
_HOMES = {
    "Rod": "rod",
    "CohesiveLaw": "cohesion",
    "exponential": "cohesion",
    "trapezoidal": "cohesion",
    "Equilibrium": "result",
    "pressure_given_length": "detachment",
    "length_given_pressure": "detachment",
    "equilibrium": "detachment",
    "Collocation": "transcription",
    "Shooting": "transcription",
    "Spectral": "transcription",
    "Method": "answer",
    "trace": "tracing",
    "fold_curve": "fold_curves",
    "FoldCurve": "fold_curves",
    "least_lambda": "fold_optimum",
    "follow": "following",
    "Walk": "following",
    "equilibria": "many_states",
    "Branch": "branch",
    "SpecialPoint": "branch",
    "Ipopt": "nlp",
    "PeelOptError": "errors",
    "InvalidInput": "errors",
    "CardError": "errors",
    "NoEquilibrium": "errors",
    "AmbiguousState": "errors",
    "NotConverged": "errors",
    "NotCertified": "errors",
    "OutOfRange": "errors",
    "MissingExtra": "errors",
}

__all__ = [
    "AmbiguousState",
    "Branch",
    "CardError",
    "CohesiveLaw",
    "Collocation",
    "Equilibrium",
    "FoldCurve",
    "InvalidInput",
    "Ipopt",
    "Method",
    "MissingExtra",
    "NoEquilibrium",
    "NotCertified",
    "NotConverged",
    "OutOfRange",
    "PeelOptError",
    "Rod",
    "Shooting",
    "SpecialPoint",
    "Spectral",
    "Walk",
    "equilibria",
    "equilibrium",
    "exponential",
    "fold_curve",
    "follow",
    "least_lambda",
    "length_given_pressure",
    "pressure_given_length",
    "trace",
    "trapezoidal",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'peel_opt' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
