"""Pictures of the effective potential with its named points and a state on it."""

from __future__ import annotations

import numpy as np
import pytest

import peel_opt as po
from peel_opt.plots import style
from peel_opt.plots.mpl import draw_panel
from peel_opt.plots.potential import named_panel
from peel_opt.plots.words import plain


def test_named_points_and_the_state_lie_on_their_curves() -> None:
    potential = po.branch_potential(po.trace(beta0=4.0, lam=(-1.0, 1.0)))
    named = {name: getattr(potential, name)() for name in ("fold", "maxwell", "delay")}
    alpha1 = po.equilibrium(beta0=4.0, lam=-0.2).alpha1
    panel = named_panel(potential, -0.2, named, alpha1)
    assert [line.look for line in panel.lines] == ["fold", "maxwell", "delay", "current"]
    assert panel.here == (alpha1, pytest.approx(float(potential(alpha1, -0.2))))
    marks = {mark.look: mark for mark in panel.marks}
    # Both minima are equally deep at the Maxwell point.
    assert marks["maxwell"].y == pytest.approx(0.0, abs=1e-9)
    assert plain(panel.lines[1].label) == "Maxwell -0.2391"
    assert plain(panel.x.label) == "extra pressure α₁"
    ax = draw_panel(panel)
    drawn = {line.get_gid(): line for line in ax.lines}
    np.testing.assert_array_equal(drawn["current"].get_ydata(), potential(drawn["current"].get_xdata(), -0.2))
    assert drawn["here"].get_xdata()[0] == alpha1
    assert drawn["here"].get_color() == style.HERE
    assert {"mark:F", "mark:M", "mark:D↓"} < drawn.keys()  # the landing of the delay is far below


def test_the_state_stays_in_view_and_far_ones_are_far_from_the_lines() -> None:
    potential = po.NormalForm.exact().at(4.0)
    panel = named_panel(potential, -0.2, {"fold": potential.fold()})
    far = (panel.x.high + 5.0, panel.y.low - 1.0)
    wider = panel.at(far)
    assert wider.x.low <= panel.x.low < far[0] < wider.x.high
    assert wider.y.low < far[1] < wider.y.high
    assert panel.distance(far) > 0.5
    line = panel.lines[-1]
    middle = 0.5 * (line.x[7] + line.x[8]), 0.5 * (line.y[7] + line.y[8])
    assert panel.distance(middle) < 1e-12
