"""Inverse design: the material that makes a rod do what is wanted.

Targets are met by the public calls themselves, whose elasticities are exact: along one free number
every bracket of a scan is solved, over several SLSQP descends from the best of some designs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...base.errors import Infeasible, NotConverged, PeelOptError
from ...model.bond import CohesiveLaw
from ...model.rod import RATIOS, Rod
from .material import Free
from .search import BINDING, Reached, Search
from .targets import SENSES, Achieved, Target

#: Distance of log(eta/y0) from an end of the range at which it counts as being there.
AT_END = 1e-3

#: Elasticity below which nothing is shown.
NEGLIGIBLE = 5e-5

#: Share of T0 from which on a pressure counts as being all of it.
NEARLY = 0.9995


@dataclass(frozen=True)
class Design:
    """A rod that meets its targets, each confirmed by the public call for it.

    Parameters
    ----------
    rod : Rod
    free : dict of float
        The numbers that were free [SI].
    targets : tuple of Target
    achieved : tuple of Achieved
        In the order of the targets.
    binding : tuple of str
        Inequalities and bounds that hold the design where it is.
    of : str
        The free number that was minimised or maximised; the first one if nothing was.
    elasticities : dict of float
        d log(``of``) / d log(value of the target), by what it sets; 0 where it does not bind.
    others : tuple of Rod
        Further rods that meet the same targets, where nothing was minimised.
    settled : bool
        Whether the search came to an optimum; if not, the design meets its targets, but a
        better one is near.
    iterations : int
        Of SLSQP; 0 where a bracket was solved.
    """

    rod: Rod
    free: dict[str, float]
    targets: tuple[Target, ...]
    achieved: tuple[Achieved, ...]
    binding: tuple[str, ...]
    of: str
    elasticities: dict[str, float]
    others: tuple[Rod, ...] = ()
    settled: bool = True
    iterations: int = 0
    shown: tuple[str, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        lines = [f"Design({', '.join(self.shown)}; {self.rod!r})"]
        for target, found in zip(self.targets, self.achieved, strict=True):
            value = target.shown(found.value)
            words = f"{target.label}: {value} ({SENSES[target.sense]} {target.shown(target.value)})"
            response = self.elasticities.get(target.label, 0.0)
            if abs(response) > NEGLIGIBLE and (target.sense == "equal" or _binds(target, found)):
                words += f", d log {self.of} / d log = {response:+.4f}"
            lines.append(f"├─ {words}")
        if self.others:
            lines.append(f"├─ {len(self.others)} other designs meet the same targets")
        if not self.settled:
            lines.append(f"├─ not shown to be the best: the search for {self.of} did not come to an end")
        return "\n".join([*lines, f"└─ binding: {', '.join(self.binding) or 'nothing'}"])


def design(
    known: Rod | Mapping[str, object],
    *,
    free: Free,
    targets: Target | Sequence[Target],
    minimise: str | None = None,
    maximise: str | None = None,
    law: str | CohesiveLaw = "auto",
    tol: float = 1e-7,
) -> Design:
    """Find the free material numbers that meet targets.

    As many free numbers as targets ``equal`` to something are a square problem.  Everything
    else needs a free number to ``minimise`` or ``maximise``.

    Parameters
    ----------
    known : Rod or mapping
        Material numbers: ``bending_stiffness``, or ``youngs_modulus``, ``thickness`` and
        ``poisson_ratio``; two of ``adhesion_strength``, ``adhesion_range`` and
        ``work_of_separation``.  SI numbers or text with a unit.  Values of free ones are where
        the search starts.
    free : str, sequence of str or mapping
        Names of the free numbers; as a mapping with bounds, ``{"thickness": ("0.1 mm", None)}``.
        Bounds that are not given lie a factor of a million away.
    targets : Target or sequence of Target
    minimise, maximise : str, optional
        A free number.
    law : str or CohesiveLaw
        As in `pressure_given_length`.  The work of separation and the Maxwell length belong to law (8).
    tol : float
        Relative distance from a target, by the public call, up to which it counts as met.

    Returns
    -------
    Design
        The best of the local optima reached from a scan over the bounds.

    Raises
    ------
    Infeasible
        If nothing within the bounds meets all targets: ``nearest`` is the closest reachable
        value [SI] of the one that is missed by most, ``candidates`` the rod that reaches it.
    InvalidInput
        If an argument cannot be meant.
    NotConverged
        If SLSQP fails though nothing says that there is no design.

    Examples
    --------
    >>> rod = Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
    >>> stiffer = design(rod, free="bending_stiffness", targets=Target("maxwell_length", equal="2 mm"))
    >>> f"{stiffer.rod.bending_stiffness:.7g}"
    '3.767268e-05'
    """
    search = Search.posed(known, free, targets, minimise, maximise, law, tol)
    found, closest, looked_at = search.run()
    if found:
        return _described(search, found)
    raise _no_state(search, looked_at) if closest is None else _infeasible(search, closest)


def _described(search: Search, found: Sequence[Reached]) -> Design:
    best = found[0]
    values = search.material.values(best.z)
    sign = float(search.objective.sum())
    elasticities = dict.fromkeys((t.label for t in search.targets), 0.0)
    for target, multiplier in zip(search.targets, best.multipliers, strict=True):
        # Of "at least" and "at most" the same number one binds.
        elasticities[target.label] += sign * float(multiplier)
    return Design(
        rod=search.material.rod(best.z),
        free=values,
        targets=search.targets,
        achieved=best.achieved,
        binding=_binding(search, best),
        of=search.of,
        elasticities=elasticities,
        others=tuple(search.material.rod(r.z) for r in found[1:]) if search.square else (),
        settled=best.settled or search.square,
        iterations=best.iterations,
        shown=tuple(f"{name} = {search.material.shown(name, v)}" for name, v in values.items()),
    )


def _binding(search: Search, best: Reached) -> tuple[str, ...]:
    """Inequalities that hold with equality, bounds of free numbers, and ends of what exists."""
    rod, pairs = search.material.rod(best.z), list(zip(search.targets, best.achieved, strict=True))
    held = [t.label for t, a in pairs if t.sense != "equal" and _binds(t, a)]
    for name, v, low, high in zip(
        search.material.free, best.z, search.material.lower, search.material.upper, strict=True
    ):
        if v - low < BINDING:
            held.append(f"{name} at its lower bound")
        elif high - v < BINDING:
            held.append(f"{name} at its upper bound")
    if min(abs(math.log(rod.ratio / end)) for end in RATIOS) < AT_END:
        held.append(f"eta/y0 = {rod.ratio:.4g}, beyond which no branch is walked: its bound")
    held += [
        f"{t.label}: adhesion_strength no lower than the pressure"
        for t in search.targets
        if t.quantity == "length" and t.given > NEARLY * rod.adhesion_strength
    ]
    return tuple(held)


def _binds(target: Target, found: Achieved) -> bool:
    """Whether a value is the one that a target bounds it by."""
    return abs(target.gap(found.value)) < BINDING


def _no_state(search: Search, looked_at: Sequence[np.ndarray]) -> Infeasible:
    """Say that a state that a target is about was never met."""
    words, reason = "; ".join(repr(t) for t in search.targets), ""
    for target in search.targets if looked_at else ():
        try:
            target.achieved(search.material.rod(looked_at[0]), search.law)
        except PeelOptError as error:
            reason = f" At the first of them: {error}"
    return Infeasible(
        f"none of the {len(looked_at)} designs looked at within the bounds has the state asked for:"
        f" {words}.{reason}",
        remedy="Widen the bounds, or give a pressure or length that such rods hold.",
    )


def _infeasible(search: Search, closest: Reached) -> PeelOptError:
    """Say which target is missed, by how little, and what holds it there."""
    z, achieved = closest.z, closest.achieved
    if closest.missed <= search.tol:
        rod = search.material.rod(z)
        return NotConverged(
            f"{rod!r} meets the targets, but SLSQP found no optimum from it.",
            remedy="Start from that rod, or give narrower bounds.",
            candidates=(rod,),
        )
    pairs = list(zip(search.targets, achieved, strict=True))
    target, value = max(pairs, key=lambda pair: pair[0].shortfall(pair[1].value))
    numbers = ", ".join(f"{n} = {search.material.shown(n, v)}" for n, v in search.material.values(z).items())
    bounds = [words for words in _binding(search, closest) if words.endswith("bound")]
    met = [
        f"{t.label} {SENSES[t.sense]} {t.shown(t.value)}" for t, a in pairs if t.shortfall(a.value) <= BINDING
    ]
    holds = f" What holds it there: {', '.join(bounds + met)}." if bounds or met else ""
    return Infeasible(
        f"no design within the bounds meets all targets. Missed: {target.label} {SENSES[target.sense]}"
        f" {target.shown(target.value)}; the closest reachable is"
        f" {target.shown(value.value)}, with {numbers}.{holds}",
        remedy="Widen a bound, free another number, or relax a target.",
        nearest=value.value,
        candidates=(search.material.rod(z),),
    )
