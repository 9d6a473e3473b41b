"""Branches of scenes: where they begin and end, what their parts are called, and what lies on them.

Known states of every scene are those of the tests of `equilibria`: `test_scenes`, `test_blisters`.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.primary import primary_branch
from peel_opt.continuation.scene_family import SceneBranch, SceneFamily, entered_branch, gap_at_tip
from peel_opt.model.bond import COHESIVE
from peel_opt.residual.closures import Closure
from peel_opt.residual.scene_spectral import SceneSpectral
from peel_opt.residual.spectral import Spectral


def branch_of_scene(scene: po.Scene) -> SceneBranch:
    """The branch of a scene with a rod of ratio 1, on a coarse mesh."""
    return entered_branch(SceneFamily(COHESIVE, SceneSpectral(scene, Spectral(16)), Closure("ratio", 1.0)))


def test_an_edge_without_glue_is_lifted_from_rest_until_it_snaps() -> None:
    branch = branch_of_scene(po.Scene(po.Rod.from_ratio(1.0), unbonded=1.0))
    assert branch.rises
    assert branch.ends[0] == "rest"
    snap = branch.snap
    assert snap is not None
    assert snap.point.scalars.pressure_ratio == pytest.approx(0.3535513, abs=1e-5)
    at = snap.point.arclength
    assert [branch.state_at(at + step) for step in (-1e-6, 1e-6)] == ["lifted", "middle"]
    before = [p for p in branch.points if p.arclength < at]
    assert all(a.scalars.pressure_ratio < b.scalars.pressure_ratio for a, b in pairwise(before))
    assert branch.holds(before[len(before) // 2])
    assert np.all(np.diff([p.arclength for p in branch.points]) > 0.0)
    assert min(gap_at_tip(p) for p in branch.points) > -1e-9


def test_a_bond_that_feels_all_but_no_load_has_the_branch_of_the_paper() -> None:
    branch = branch_of_scene(po.Scene(po.Rod.from_ratio(1.0), loads=[po.Weight(1e-9)]))
    assert branch.ends[0] == "T"
    assert not branch.rises
    folded = next(f for f in branch.folds if f.kind == "LP-pressure")
    paper = primary_branch(COHESIVE, Closure("ratio", 1.0))
    least = paper.continue_to("LP-pressure")
    assert least is not None
    for name in ("pressure_ratio", "sigma", "A"):
        there, here = (getattr(f.point.scalars, name) for f in (least, folded))
        assert here == pytest.approx(there, rel=1e-6)
    given = Closure("pressure", 0.6)
    states = {c.state: c.profile.scalars.sigma for c in branch.candidates(given)}
    assert states["lower"] == pytest.approx(3.01661969919912, rel=1e-2)
