"""Equilibria of a rod peeled off a plate by pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .answer import Method
    from .branch import Branch
    from .branch_parts import SpecialPoint
    from .calibration_data import MeasuredShape, Measurements
    from .calibration_files import read_measurements, read_shape
    from .calibration_fit import calibrate
    from .calibration_result import Calibration
    from .cohesion import CohesiveLaw
    from .design_relations import maxwell_length
    from .design_targets import Target
    from .detachment import equilibrium, length_given_pressure, pressure_given_length
    from .errors import (
        AmbiguousState,
        AtFold,
        CardError,
        Infeasible,
        InvalidInput,
        MissingExtra,
        NoEquilibrium,
        NotCertified,
        NotConverged,
        OutOfRange,
        PeelOptError,
        WorkersLost,
    )
    from .flaws import critical_flaw, readhesion_pressure, safe_pressure
    from .fold_curves import FoldCurve, fold_curve
    from .fold_optimum import least_lambda
    from .following import Walk, follow
    from .hysteresis_loops import hysteresis
    from .implicit_derivatives import Sensitivities, sensitivities
    from .inverse_design import Design, design
    from .landau import NormalForm
    from .many_states import equilibria
    from .maxwell_points import maxwell_curve
    from .named_laws import exponential, trapezoidal
    from .nlp import Ipopt
    from .propagation import uncertainty
    from .propagation_result import Uncertainty
    from .reduction import lyapunov_schmidt
    from .result import Equilibrium
    from .rod import Rod
    from .small_motions import Stability, control_table, stability
    from .stability_along import stability_changes
    from .sweep_table import Sweep
    from .sweeping import sweep
    from .traced_potential import branch_potential
    from .tracing import trace
    from .transcription import Collocation, Shooting, Spectral
    from .work_balance import energies
    from .work_precision import WorkPrecision, tradeoff

#: Where each public name lives; imported when first used, so that ``import peel_opt`` is free.
_HOMES = {
    "Rod": "rod",
    "CohesiveLaw": "cohesion",
    "exponential": "named_laws",
    "trapezoidal": "named_laws",
    "Equilibrium": "result",
    "pressure_given_length": "detachment",
    "length_given_pressure": "detachment",
    "equilibrium": "detachment",
    "Collocation": "transcription",
    "Shooting": "transcription",
    "Spectral": "transcription",
    "Method": "answer",
    "trace": "tracing",
    "tradeoff": "work_precision",
    "WorkPrecision": "work_precision",
    "stability": "small_motions",
    "control_table": "small_motions",
    "stability_changes": "stability_along",
    "Stability": "small_motions",
    "energies": "work_balance",
    "critical_flaw": "flaws",
    "safe_pressure": "flaws",
    "readhesion_pressure": "flaws",
    "fold_curve": "fold_curves",
    "FoldCurve": "fold_curves",
    "least_lambda": "fold_optimum",
    "follow": "following",
    "Walk": "following",
    "equilibria": "many_states",
    "Branch": "branch",
    "SpecialPoint": "branch_parts",
    "lyapunov_schmidt": "reduction",
    "NormalForm": "landau",
    "branch_potential": "traced_potential",
    "maxwell_curve": "maxwell_points",
    "maxwell_length": "design_relations",
    "hysteresis": "hysteresis_loops",
    "design": "inverse_design",
    "Design": "inverse_design",
    "Target": "design_targets",
    "Sensitivities": "implicit_derivatives",
    "sensitivities": "implicit_derivatives",
    "Ipopt": "nlp",
    "calibrate": "calibration_fit",
    "Calibration": "calibration_result",
    "Measurements": "calibration_data",
    "MeasuredShape": "calibration_data",
    "read_measurements": "calibration_files",
    "read_shape": "calibration_files",
    "PeelOptError": "errors",
    "InvalidInput": "errors",
    "CardError": "errors",
    "NoEquilibrium": "errors",
    "AmbiguousState": "errors",
    "NotConverged": "errors",
    "NotCertified": "errors",
    "AtFold": "errors",
    "Infeasible": "errors",
    "OutOfRange": "errors",
    "WorkersLost": "errors",
    "sweep": "sweeping",
    "Sweep": "sweep_table",
    "uncertainty": "propagation",
    "Uncertainty": "propagation_result",
    "MissingExtra": "errors",
}

__all__ = [
    "AmbiguousState",
    "AtFold",
    "Branch",
    "Calibration",
    "CardError",
    "CohesiveLaw",
    "Collocation",
    "Design",
    "Equilibrium",
    "FoldCurve",
    "Infeasible",
    "InvalidInput",
    "Ipopt",
    "MeasuredShape",
    "Measurements",
    "Method",
    "MissingExtra",
    "NoEquilibrium",
    "NormalForm",
    "NotCertified",
    "NotConverged",
    "OutOfRange",
    "PeelOptError",
    "Rod",
    "Sensitivities",
    "Shooting",
    "SpecialPoint",
    "Spectral",
    "Stability",
    "Sweep",
    "Target",
    "Uncertainty",
    "Walk",
    "WorkPrecision",
    "WorkersLost",
    "branch_potential",
    "calibrate",
    "control_table",
    "critical_flaw",
    "design",
    "energies",
    "equilibria",
    "equilibrium",
    "exponential",
    "fold_curve",
    "follow",
    "hysteresis",
    "least_lambda",
    "length_given_pressure",
    "lyapunov_schmidt",
    "maxwell_curve",
    "maxwell_length",
    "pressure_given_length",
    "read_measurements",
    "read_shape",
    "readhesion_pressure",
    "safe_pressure",
    "sensitivities",
    "stability",
    "stability_changes",
    "sweep",
    "trace",
    "tradeoff",
    "trapezoidal",
    "uncertainty",
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
