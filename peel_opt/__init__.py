"""Equilibria of a rod peeled off a plate by pressure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from .analysis.branch_potential import branch_potential
    from .analysis.design_relations import maxwell_length
    from .analysis.energies import energies
    from .analysis.flaws import critical_flaw, readhesion_pressure, safe_pressure
    from .analysis.loops import hysteresis
    from .analysis.maxwell import maxwell_curve
    from .analysis.normal_form import NormalForm
    from .analysis.reduction import lyapunov_schmidt
    from .analysis.sensitivities import Sensitivities, sensitivities
    from .analysis.stability import Stability, control_table, stability
    from .analysis.stability_along import stability_changes
    from .base.errors import (
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
    from .equilibria.ask import equilibrium, length_given_pressure, pressure_given_length
    from .equilibria.branch import Branch
    from .equilibria.branch_parts import SpecialPoint
    from .equilibria.every import equilibria
    from .equilibria.fold_curve import FoldCurve, fold_curve
    from .equilibria.fold_optimum import least_lambda
    from .equilibria.follow import Walk, follow
    from .equilibria.methods import Method
    from .equilibria.result import Equilibrium
    from .equilibria.trace import trace
    from .model.bond import CohesiveLaw
    from .model.named_laws import exponential, trapezoidal
    from .model.rod import Rod
    from .residual.programme import Ipopt
    from .residual.transcriptions import Collocation, Shooting, Spectral
    from .studies.calibrate.data import MeasuredShape, Measurements
    from .studies.calibrate.files import read_measurements, read_shape
    from .studies.calibrate.fit import calibrate
    from .studies.calibrate.result import Calibration
    from .studies.design.run import Design, design
    from .studies.design.targets import Target
    from .studies.sweep.run import sweep
    from .studies.sweep.table import Sweep
    from .studies.tradeoff.run import WorkPrecision, tradeoff
    from .studies.uncertainty.result import Uncertainty
    from .studies.uncertainty.run import uncertainty

#: Where each public name lives; imported when first used, so that ``import peel_opt`` is free.
_HOMES = {
    "Rod": "model.rod",
    "CohesiveLaw": "model.bond",
    "exponential": "model.named_laws",
    "trapezoidal": "model.named_laws",
    "Equilibrium": "equilibria.result",
    "pressure_given_length": "equilibria.ask",
    "length_given_pressure": "equilibria.ask",
    "equilibrium": "equilibria.ask",
    "Collocation": "residual.transcriptions",
    "Shooting": "residual.transcriptions",
    "Spectral": "residual.transcriptions",
    "Method": "equilibria.methods",
    "trace": "equilibria.trace",
    "tradeoff": "studies.tradeoff.run",
    "WorkPrecision": "studies.tradeoff.run",
    "stability": "analysis.stability",
    "control_table": "analysis.stability",
    "stability_changes": "analysis.stability_along",
    "Stability": "analysis.stability",
    "energies": "analysis.energies",
    "critical_flaw": "analysis.flaws",
    "safe_pressure": "analysis.flaws",
    "readhesion_pressure": "analysis.flaws",
    "fold_curve": "equilibria.fold_curve",
    "FoldCurve": "equilibria.fold_curve",
    "least_lambda": "equilibria.fold_optimum",
    "follow": "equilibria.follow",
    "Walk": "equilibria.follow",
    "equilibria": "equilibria.every",
    "Branch": "equilibria.branch",
    "SpecialPoint": "equilibria.branch_parts",
    "lyapunov_schmidt": "analysis.reduction",
    "NormalForm": "analysis.normal_form",
    "branch_potential": "analysis.branch_potential",
    "maxwell_curve": "analysis.maxwell",
    "maxwell_length": "analysis.design_relations",
    "hysteresis": "analysis.loops",
    "design": "studies.design.run",
    "Design": "studies.design.run",
    "Target": "studies.design.targets",
    "Sensitivities": "analysis.sensitivities",
    "sensitivities": "analysis.sensitivities",
    "Ipopt": "residual.programme",
    "calibrate": "studies.calibrate.fit",
    "Calibration": "studies.calibrate.result",
    "Measurements": "studies.calibrate.data",
    "MeasuredShape": "studies.calibrate.data",
    "read_measurements": "studies.calibrate.files",
    "read_shape": "studies.calibrate.files",
    "PeelOptError": "base.errors",
    "InvalidInput": "base.errors",
    "CardError": "base.errors",
    "NoEquilibrium": "base.errors",
    "AmbiguousState": "base.errors",
    "NotConverged": "base.errors",
    "NotCertified": "base.errors",
    "AtFold": "base.errors",
    "Infeasible": "base.errors",
    "OutOfRange": "base.errors",
    "WorkersLost": "base.errors",
    "sweep": "studies.sweep.run",
    "Sweep": "studies.sweep.table",
    "uncertainty": "studies.uncertainty.run",
    "Uncertainty": "studies.uncertainty.result",
    "MissingExtra": "base.errors",
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
