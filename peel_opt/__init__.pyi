"""The public names, each with the module it lives in, from which it is imported when first used."""

from .analysis.branch_potential import branch_potential as branch_potential
from .analysis.critical import Transition as Transition
from .analysis.critical import critical_length as critical_length
from .analysis.derivatives import Sensitivities as Sensitivities
from .analysis.design_relations import maxwell_length as maxwell_length
from .analysis.energies import energies as energies
from .analysis.flaws import held_length as held_length
from .analysis.flaws import holding_pressure as holding_pressure
from .analysis.flaws import readhesion_pressure as readhesion_pressure
from .analysis.hysteresis import hysteresis as hysteresis
from .analysis.largest_flap import LargestFlap as LargestFlap
from .analysis.largest_flap import largest_flap as largest_flap
from .analysis.loading import LoadingCurve as LoadingCurve
from .analysis.loading import loading_curve as loading_curve
from .analysis.maxwell import maxwell_curve as maxwell_curve
from .analysis.normal_form import NormalForm as NormalForm
from .analysis.peel import PeelPeak as PeelPeak
from .analysis.peel import energy_release_rate as energy_release_rate
from .analysis.peel import initiation_force as initiation_force
from .analysis.peel import peel_force as peel_force
from .analysis.reduction import lyapunov_schmidt as lyapunov_schmidt
from .analysis.sensitivities import sensitivities as sensitivities
from .analysis.stability import Stability as Stability
from .analysis.stability import control_table as control_table
from .analysis.stability import stability as stability
from .analysis.stability_along import stability_changes as stability_changes
from .analysis.unbonded import FlawLimit as FlawLimit
from .analysis.unbonded import critical_flaw as critical_flaw
from .analysis.unbonded import safe_pressure as safe_pressure
from .analysis.unfolding import Unfolding as Unfolding
from .analysis.unfolding import unfolding as unfolding
from .analysis.volume_limits import VolumeLimit as VolumeLimit
from .analysis.volume_limits import volume_limits as volume_limits
from .app.cards import Card as Card
from .app.cards import load_card as load_card
from .app.citation import Citation as Citation
from .app.citation import citation as citation
from .base.errors import (
    AmbiguousState as AmbiguousState,
)
from .base.errors import (
    AtFold as AtFold,
)
from .base.errors import (
    CardError as CardError,
)
from .base.errors import (
    CardWarning as CardWarning,
)
from .base.errors import (
    Infeasible as Infeasible,
)
from .base.errors import (
    InvalidInput as InvalidInput,
)
from .base.errors import (
    MissingExtra as MissingExtra,
)
from .base.errors import (
    NoEquilibrium as NoEquilibrium,
)
from .base.errors import (
    NotCertified as NotCertified,
)
from .base.errors import (
    NotConverged as NotConverged,
)
from .base.errors import (
    OutOfRange as OutOfRange,
)
from .base.errors import (
    PeelOptError as PeelOptError,
)
from .base.errors import (
    WorkersLost as WorkersLost,
)
from .equilibria.answers import Answers as Answers
from .equilibria.answers import answers as answers
from .equilibria.ask import equilibrium as equilibrium
from .equilibria.ask import length_given_pressure as length_given_pressure
from .equilibria.ask import pressure_given_length as pressure_given_length
from .equilibria.branch import Branch as Branch
from .equilibria.branch_parts import SpecialPoint as SpecialPoint
from .equilibria.every import equilibria as equilibria
from .equilibria.fold_curve import FoldCurve as FoldCurve
from .equilibria.fold_curve import fold_curve as fold_curve
from .equilibria.fold_optimum import least_lambda as least_lambda
from .equilibria.follow import Walk as Walk
from .equilibria.follow import follow as follow
from .equilibria.grown import grown_flap as grown_flap
from .equilibria.methods import Method as Method
from .equilibria.result import Equilibrium as Equilibrium
from .equilibria.scenes import solve as solve
from .equilibria.tip_on_plate import flat_fold as flat_fold
from .equilibria.tip_on_plate import touching as touching
from .equilibria.trace import trace as trace
from .model import profiles as profiles
from .model.blister import Blister as Blister
from .model.bond import CohesiveLaw as CohesiveLaw
from .model.layer import ElasticLayer as ElasticLayer
from .model.loads import Drag as Drag
from .model.loads import Pressure as Pressure
from .model.loads import SkinFriction as SkinFriction
from .model.loads import Weight as Weight
from .model.mixed_bonds import EffectiveOpening as EffectiveOpening
from .model.mixed_bonds import ShearSprings as ShearSprings
from .model.named_laws import exponential as exponential
from .model.named_laws import trapezoidal as trapezoidal
from .model.place import Place as Place
from .model.rod import Rod as Rod
from .model.scene import Scene as Scene
from .model.tips import Contact as Contact
from .model.tips import TipLoad as TipLoad
from .model.walls import Circle as Circle
from .model.walls import Flat as Flat
from .motion.history import History as History
from .motion.history import history as history
from .motion.rates import critical_drag as critical_drag
from .motion.rates import growth_rate as growth_rate
from .motion.snap import snap as snap
from .motion.trajectory import Snap as Snap
from .residual.collocation import Collocation as Collocation
from .residual.programme import Ipopt as Ipopt
from .residual.shooting import Shooting as Shooting
from .residual.spectral import Spectral as Spectral
from .studies.calibrate.data import MeasuredShape as MeasuredShape
from .studies.calibrate.data import Measurements as Measurements
from .studies.calibrate.fit import calibrate as calibrate
from .studies.calibrate.read import read_measurements as read_measurements
from .studies.calibrate.read import read_shape as read_shape
from .studies.calibrate.result import Calibration as Calibration
from .studies.design.run import Design as Design
from .studies.design.run import design as design
from .studies.design.targets import Target as Target
from .studies.sweep.run import sweep as sweep
from .studies.sweep.table import Sweep as Sweep
from .studies.tradeoff.run import tradeoff as tradeoff
from .studies.tradeoff.table import WorkPrecision as WorkPrecision
from .studies.uncertainty.result import Uncertainty as Uncertainty
from .studies.uncertainty.run import uncertainty as uncertainty

__all__: list[str]
__version__: str
