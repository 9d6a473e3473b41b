"""Many answers about a scene: those of single calls, and what is refused.

Modules: `answers`, and `renumbered` of the model.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import peel_opt as po
from peel_opt.model.renumbered import renumbered

from ..rods import FLAP

ROD = po.Rod.from_ratio(1.0)
STREAM = po.Scene(
    ROD, [po.Weight(0.02), po.SkinFriction(share=0.1), po.Pressure(po.profiles.exponential(8.0))]
)


def test_answers_are_those_of_single_calls_bit_by_bit_whatever_else_is_asked(tmp_path: Path) -> None:
    found = po.answers(STREAM, pressure_ratio=[0.5, 0.8], weight=np.array([[0.0], [0.05]]), decay=9.0)
    assert found.shape == (2, 2)
    assert found.certified.all()
    for i, weight in enumerate((0.0, 0.05)):
        for j, pressure in enumerate((0.5, 0.8)):
            one = po.solve(
                renumbered(STREAM, {"weight": weight, "decay": 9.0}), free="length", pressure=pressure
            )
            assert found.length_ratio[i, j] == one.length_ratio
            assert found.errors[i, j] == one.error
    alone = po.answers(STREAM, pressure_ratio=0.8, weight=0.05, decay=9.0)
    assert float(alone.length_ratio) == found.length_ratio[1, 1]
    found.save(tmp_path / "found.npz")
    read = po.Answers.load(tmp_path / "found.npz")
    np.testing.assert_array_equal(read.numbers["weight"], found.numbers["weight"])
    assert "scene" in read.options


def test_what_has_no_equilibrium_costs_its_own_answer_only() -> None:
    """A strip round a cylinder springs back where k kw^2/2 > T0 y0/2, without any pressure."""
    scene = po.Scene(FLAP, wall=po.Circle(-100.0))
    tight = 1.2 / (FLAP.eta * FLAP.ratio**0.5)
    found = po.answers(scene, pressure_ratio=0.4, curvature=[-100.0, -tight])
    assert found.certified.tolist() == [True, False]
    assert found.statuses[1] in ("no-equilibrium", "not-converged")
    assert found.reasons[1]
    assert np.isnan(found.length_ratio[1])


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (
            lambda: po.answers(STREAM, pressure_ratio=0.5, friction=0.1),
            "'friction' is no number of this scene",
        ),
        (lambda: po.answers(STREAM, weight=0.1), "no question"),
        (lambda: po.answers(STREAM, ratio=1.0, pressure_ratio=0.5), "no question"),
        (lambda: po.answers(STREAM, pressure_ratio=0.5, law="linear"), "its own law"),
        (lambda: po.answers(ratio=1.0, pressure_ratio=0.5, weight=0.1), "no number of a question"),
        (lambda: po.answers(STREAM, pressure_ratio=[0.5, 0.6], weight=[1.0, 2.0, 3.0]), "no common one"),
        (lambda: po.answers(ROD, pressure_ratio=0.5), "many rods by their eta/y0"),
        (lambda: po.answers("stream", pressure_ratio=0.5), "must be a Scene"),
        (
            lambda: po.answers(STREAM, pressure=0.5),
            "pressure given of a scene is no question. Give pressure_ratio",
        ),
    ],
)
def test_what_is_no_question_about_a_scene_is_refused(ask: Any, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        ask()


@pytest.mark.parametrize(
    ("scene", "numbers"),
    [
        (
            po.Scene(
                ROD,
                [
                    po.Pressure(po.profiles.linear(0.1), dead=0.5, until=3.0),
                    po.Weight(0.1, 0.2),
                    po.SkinFriction(traction=0.3),
                    po.Drag(0.4),
                ],
                po.Circle(0.1),
                po.TipLoad(0.1, 0.2, 0.3),
                natural_curvature=0.1,
                unbonded=0.5,
                line_energy=0.2,
            ),
            {},
        ),
        (po.Scene(ROD, law=po.EffectiveOpening(0.5)), {"zeta": 0.7}),
        (po.Scene(ROD, law=po.ShearSprings(5.0)), {"shear_stiffness": 7.0}),
        (po.Blister(ROD, slack=0.1), {"slack": 0.2}),
        (po.Blister(ROD, roller=0.1), {"roller": 0.0}),
        (
            po.Blister(ROD, stretch=20.0, glued_strain=0.1, line_energy=0.1),
            {"stretch": 30.0, "line_energy": 0.2},
        ),
    ],
    ids=["loads", "opening", "springs", "slack", "roller", "stretch"],
)
def test_each_number_of_a_scene_may_be_replaced(scene: po.Scene, numbers: dict[str, float]) -> None:
    wanted = numbers or {name: 0.9 * value for name, value in scene.numbers.items()}
    found = renumbered(scene, wanted)
    assert type(found) is type(scene)
    assert found.numbers == pytest.approx(scene.numbers | wanted)
