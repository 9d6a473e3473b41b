"""Cards with a scene: what they may say, what they answer, what is refused, and the command line on them."""

import json
import math
from pathlib import Path

import pytest

from peel_opt import (
    Blister,
    Circle,
    Equilibrium,
    Pressure,
    Rod,
    Scene,
    ShearSprings,
    length_given_pressure,
    profiles,
)
from peel_opt.analysis.unbonded import FlawLimit
from peel_opt.app.cards import load_card
from peel_opt.app.explorer.state_cards import from_card
from peel_opt.app.scene_report import describe_scene
from peel_opt.app.scene_table import MEASURES, SceneTable
from peel_opt.base.errors import CardError, CardWarning, InvalidInput

PROBLEMS = Path(__file__).parents[2] / "problems"
SCENES = ("aortic_tear", "artery_flap", "paint_blister", "peel_test", "tape_in_stream")

SI = """
title = "a strip"
[rod]
bending_stiffness = "23 uN m"
adhesion_strength = "140 kPa"
adhesion_range = "0.73 mm"
[scene]
weight = "2.8 kPa"
tilt = "30 deg"
[estimates]
bending_stiffness = "guess"
adhesion_strength = "guess"
adhesion_range = "guess"
weight = "guess"
tilt = "guess"
[[questions]]
pressure = "100 kPa"
"""
RATIO = 'title = "a ratio"\n[rod]\nratio = 1.0\n[scene]\n{scene}\n[[questions]]\n{question}\n'


@pytest.fixture
def answer(card):
    """Answer the one question of a rod of ratio 1 in a scene."""

    def ask(scene, question):
        ((_, found),) = card(RATIO.format(scene=scene, question=question)).ask()
        return found

    return ask


# --- what is answered ---------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENES)
def test_every_card_of_a_scene_is_answered(name):
    for label, found in load_card(PROBLEMS / f"{name}.toml").ask():
        assert isinstance(found, Equilibrium | FlawLimit), f"{label}: {found}"
        assert isinstance(found, FlawLimit) or found.valid, label
        assert max(found.error, found.certificate) <= 1e-8


# Forces over T0 eta by Gauss collocation and by DOP853, which agree to these digits.
@pytest.mark.parametrize(
    ("angle", "length", "force"),
    [("90 deg", "length = 2.0", 0.76934344674), ("90°", "length_ratio = 5.0", 0.50587816688)],
)
def test_the_free_number_of_a_scene(answer, angle, length, force):
    found = answer(f'angle = "{angle}"', f'free = "force"\n{length}')
    assert found.numbers["force"] == pytest.approx(force, abs=2e-11)


def test_weight_is_that_of_a_stronger_bond(answer):
    # T0 -> T0 + w, y0 -> y0 (1 + w/T0) at the same pressure, as long as the tip is within y0.
    heavy = answer("weight = 0.02", "pressure = 0.8")
    rod = Rod(1.0, 1.02, 1.02)
    assert heavy.length == pytest.approx(length_given_pressure(rod, 0.8).length, abs=1e-9)


def test_a_moment_peels_at_the_root_of_2kG(answer):
    # |M| = sqrt(2 k G) as soon as the tip is beyond y0, at every length; here k = 1 and G = 1/2.
    for length in (2.5, 2.75, 3.0):
        found = answer("moment = -1.0", f'free = "moment"\nlength = {length}')
        assert found.y[0] > 1.0
        assert found.numbers["moment"] == pytest.approx(-1.0, abs=1e-12)


def test_flaws_are_asked_for_both_ways(card):
    # p_max/T0 of an edge of eta at eta/y0 = 1, by DOP853.
    text = RATIO.format(scene="unbonded = 1.0", question="flaw = 1.0")
    text += '[[questions]]\nfree = "flaw"\npressure_ratio = 0.3535512998\n'
    (safe, pressure), (critical, flaw) = card(text).ask()
    assert (safe, critical) == ("safe pressure for a flaw of 1", "critical flaw at p/T0 = 0.353551")
    assert pressure.pressure_ratio == pytest.approx(0.3535512998, abs=1e-10)
    assert flaw.flaw_ratio == pytest.approx(1.0, abs=1e-8)
    # The same of a card that names nothing else.
    ((_, plain),) = card(text.split("[scene]")[0] + "[[questions]]\nflaw = 1.0\n").ask()
    assert plain.pressure_ratio == pressure.pressure_ratio


def test_what_a_scene_does_not_take_is_said_of_it_alone(card):
    text = RATIO.format(scene="unbonded = 1.0", question="length = 2.0")
    ((_, found),) = card(text).ask(method="series")
    assert isinstance(found, InvalidInput)
    ((_, found),) = card(text).ask()
    assert found.valid
    ((_, other),) = card(text).ask(method="shooting")
    assert other.pressure == pytest.approx(found.pressure, abs=1e-9)


# --- what a scene may say -----------------------------------------------------------------


def test_units_of_every_number(card):
    scene = card(SI).scene()
    assert scene.loads[1].w == 2800.0
    assert scene.loads[1].tilt == pytest.approx(math.pi / 6, rel=1e-15)
    same = SI.replace('"2.8 kPa"', '"0.02 T0"').replace('"30 deg"', "0.5235987755982988")
    assert card(same).scene().numbers == pytest.approx(scene.numbers, rel=1e-14)


def test_parts_by_their_words(card):
    def scene(text):
        return card(RATIO.format(scene=text, question="length = 3.0")).scene()

    rod = Rod.from_ratio(1.0)
    assert scene('profile = "jet"') == Scene(rod, [Pressure(profiles.jet())])
    assert scene('profile = "linear"\ngradient = -0.2') == Scene(rod, [Pressure(profiles.linear(-0.2))])
    assert scene("curvature = -0.1") == Scene(rod, wall=Circle(-0.1))
    springs = 'bond = "shear springs"\nshear_stiffness = 5.0\nsoftening = false'
    assert scene(springs) == Scene(rod, law=ShearSprings(5.0, softening=False))
    assert scene("blister = true\nslack = 0.1\nunbonded = 0.5") == Blister(rod, slack=0.1, unbonded=0.5)
    assert scene('law = "exponential"').bond.law.name == "exponential"


def test_the_table_has_every_number_that_scenes_have():
    assert set(MEASURES) <= set(SceneTable.model_fields)


def test_a_scene_in_words(card):
    text = SI.replace("[estimates]", 'curvature = "-0.1 1/mm"\n[estimates]\ncurvature = "guess"')
    words = describe_scene(card(text).scene())
    assert words == (
        "wall outside a circle of radius 10.00 mm, weight = 2.80000 kPa, tilt = 30 deg, curvature = -100 1/m"
    )


# --- what is refused ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("wieght = 0.02", r"'wieght' in \[scene\]; did you mean 'weight'"),
        ('weight = "heavy"', r"\[scene\]: weight must be a number"),
        ('weight = "2 kPa"', "weight cannot have a unit"),
        ("weight = inf", "weight.* must be finite"),
        ("weight = nan", "weight.* must be finite"),
        ("weight = [1]", "weight.* must be a number"),
        ("tilt = 0.3", "tilt goes with weight"),
        ("angle = 90", "angle must be between -3.1416 and 3.1416"),
        ('profile = "cubic"', "profile"),
        ('profile = "linear"', r"\[scene\]: profile = 'linear' needs gradient"),
        ("gradient = 0.2", "gradient goes with profile = 'linear'"),
        ('profile = "linear"\ngradient = -1.0', "gradient: c must be above -1"),
        ('profile = "linear"\ngradient = inf', "gradient must be finite"),
        ('profile = "exponential"\ndecay = 0.0', "decay must be positive"),
        ('profile = "mixed"\nmix = 1.5', "mix must be between 0 and 1"),
        ("dead = 1.2", "dead must be between 0 and 1"),
        ("friction = 0.1\nshare = 0.1", "one of friction and share"),
        ("unbonded = -0.1", "unbonded must be at least 0"),
        ("line_energy = -0.1", "line_energy must be at least 0"),
        ("zeta = 0.5", "zeta goes with bond = 'effective opening'"),
        ('bond = "shear springs"', "needs shear_stiffness"),
        ('bond = "shear springs"\nshear_stiffness = 1.0\nlaw = "linear"', "leave out law"),
        ('law = "quadratic"', "law of a scene cannot be 'quadratic'"),
        ("softening = false", "softening goes with"),
        ('tip = "contact"\nforce = 0.1', "force loads a free tip"),
        ("blister = true", "one of roller=, slack= and stretch="),
        ("blister = true\nslack = 0.0", "flat for ever, at any pressure"),
        ("blister = true\nstretch = 100.0", "no equilibrium on a bond .* Give line_energy="),
        ("stretch = 100.0", "no equilibrium on a bond that neither lets it slide nor has a line energy"),
        ("glued_strain = 0.1", "does not stretch has no glued_strain"),
        ('law = "none"', "held by its line_energy, and has none"),
        ("blister = true\nslack = 0.1\nroller = 0.0", "one of roller= and slack="),
        ("blister = true\nslack = 0.1\ncurvature = 0.1", "modelled on a flat wall"),
        ("blister = true\nslack = 0.1\nmoment = 0.1", "moment loads a free tip, and not one with blister"),
        ("blister = true\nslack = 0.1\nnatural_curvature = 0.1", "does nothing to a blister"),
        ("slack = 0.1", "slack goes with blister = true"),
        ("zeta = 0.5\nbond = 'effective opening'\ncurvature = 0.1", "modelled on a flat wall"),
    ],
)  # fmt: skip
def test_a_scene_that_means_nothing_is_one_line(refused, scene, words):
    refused(RATIO.format(scene=scene, question="length = 3.0"), words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"2.8 kPa"', '"2.8 mm"', r"\[scene\]: weight cannot be measured in 'mm'"),
        ('"30 deg"', '"30 kPa"', r"tilt cannot be measured in 'kPa'. Accepted are units such as deg"),
        ('"30 deg"', '"0.3"', "tilt needs a unit"),
        ('weight = "guess"', 'weight = "guess"\ndrag = "guess"', "names 'drag'"),
        ('pressure = "100 kPa"', 'free = "force"\nlength = "2 mm"', "'force' is no number of this scene"),
        ('pressure = "100 kPa"', 'free = "weight"', "length must be given to solve for the weight"),
        ('pressure = "100 kPa"', 'pressure = "100 kPa"\nlaw = "linear"', "law cannot be given here"),
        ('pressure = "100 kPa"', 'pressure = "100 kPa"\nmethod = "series"', "method cannot be given here"),
        ('pressure = "100 kPa"', 'pressure = "100 kPa"\nstate = "spurious"', "Choose one of lifted"),
        ('pressure = "100 kPa"', 'flaw = "1 mm"', r"no. 1: a flaw is asked of .* \[scene\] says more"),
        ('pressure = "100 kPa"', 'flaw = "1 mm"\nlength = "1 mm"', "flaw asks for the pressure"),
        ('pressure = "100 kPa"', 'free = "flaw"\nlength = "1 mm"', "critical one at a pressure"),
        ('pressure = "100 kPa"', 'flaw = "1 mm"\nstate = "lower"', "state cannot be given beside a flaw"),
        ("[scene]", "[scene]\nscene = 1", "unknown key 'scene'"),
    ],
)  # fmt: skip
def test_a_mistake_names_the_field(refused, old, new, words):
    assert old in SI
    refused(SI.replace(old, new), words)


def test_groups_have_no_scene(card):
    text = 'title = "x"\n[groups]\nbeta0 = 4\nlam = 1\n[scene]\nweight = 0.1\n[[questions]]\n'
    with pytest.raises(CardError, match=r"\[scene\] is of a rod"):
        card(text)


def test_what_somebody_sets_needs_no_source(card):
    text = SI.replace('weight = "2.8 kPa"\ntilt = "30 deg"', 'force = "10 N/m"\nangle = "90 deg"')
    text = text.replace('weight = "guess"\ntilt = "guess"\n', "")
    assert card(text).unsourced == ()
    assert card(text).scene().numbers["force"] == pytest.approx(10.0 / (140e3 * card(text).rod().eta))


def test_what_acts_on_the_rod_is_from_somewhere(card):
    with pytest.warns(CardWarning, match="where weight is from"):
        card(SI.replace('weight = "guess"', ""))


def test_the_explorer_says_what_it_does_not_show(card):
    with pytest.raises(InvalidInput, match="this card asks for more"):
        from_card(card(SI))


# --- the command line ---------------------------------------------------------------------


def test_solve_frees_any_number_of_a_card(call, tmp_path):
    path = PROBLEMS / "peel_test.toml"
    asked = ("solve", "--card", path, "--free", "force", "--length", "6 mm")
    code, out, err = call(*asked, "--out", tmp_path, "--no-plot")
    assert (code, err) == (0, "")
    for words in ("scene", "angle = 90 deg", "force = 100.00000 N/m", "certified", "certificate", "wrote to"):
        assert words in out
    assert (tmp_path / "peel-test-force-at-6-mm.npz").exists()
    document = json.loads(call(*asked, "--json")[1])
    assert document["force [N/m]"] == pytest.approx(100.0, rel=1e-9)  # G / (1 - cos 90 deg)
    code, _, err = call("solve", "--card", path, "--free", "weight", "--length", "6 mm")
    assert code == 2
    assert "'weight' is no number of this scene" in err


def test_commands_take_the_scene_of_a_card_or_refuse_it(call, tmp_path):
    path = PROBLEMS / "aortic_tear.toml"
    code, out, _ = call("length", "--card", path, "--pressure", "200 mmHg")
    assert code == 0
    assert "unbonded = 500.000 um" in out
    assert "lifted" in out
    for command in (["peel", "--angle", "90 deg"], ["flaw", "--pressure", "200 mmHg", "--chart"]):
        code, out, err = call(*command, "--card", PROBLEMS / "artery_flap.toml")
        assert (code, out) == (2, "")
        assert "[scene], which this command does not cover" in err


def test_a_traced_scene_is_named(call, tmp_path):
    path = tmp_path / "heavy.toml"
    path.write_text(RATIO.format(scene="weight = 0.02", question="pressure = 0.8"))
    _, out, _ = call("trace", "--card", path, "--points", "12", "--tol", "1e-6")
    assert "scene: weight = 0.02 T0, tilt" not in out
    assert "scene: weight = 0.02 T0" in out
    # The least pressure of a rod of ratio 1 with this weight, by DOP853.
    assert "0.151810" in out


def test_run_writes_how_a_flaw_opens(call, tmp_path):
    path = PROBLEMS / "aortic_tear.toml"
    code, out, err = call("run", path, "--out", tmp_path, "--no-plot")
    assert (code, err) == (0, "")
    assert "flaw = 500.00000 um" in out
    assert "scene: unbonded = 500.000 um" in out
    table = (tmp_path / "aortic-tear-pressure-at-which-a-tear-of-0.5-mm-runs.csv").read_text()
    assert "pressure [Pa],length [m]" in table
