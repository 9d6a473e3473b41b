"""The scan of reactions at the edge: starts of every state, and how far nothing is missed."""

from __future__ import annotations

import numpy as np
import pytest

from peel_opt.continuation.edge_scan import scan
from peel_opt.continuation.edge_shooting import EdgeShooting
from peel_opt.model.bond import COHESIVE
from peel_opt.model.law_arrays import tip_heights


def test_a_rod_that_stays_at_the_plate_ends_what_is_known() -> None:
    # State follows state by a wave in the adhesive layer, and reactions agree to more and more digits.
    found = scan(EdgeShooting(COHESIVE, 32.0, 0.25, tip_heights(COHESIVE, 0.25)[0], 35.0))
    scalars = [start.scalars for start in found.starts]
    held = sorted(s.sigma for s in scalars if abs(s.A - 0.0613) < 1e-3)
    assert len(held) >= 5
    assert np.diff(held) == pytest.approx(np.diff(held).mean(), abs=5e-3)
    assert held[3] < found.reached < 20.0
    assert min(abs(s.sigma - 9.2349634174) + abs(s.A - 4.2550988487) for s in scalars) < 1e-3
