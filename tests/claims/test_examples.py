"""Every example runs, and says the number it says."""

from __future__ import annotations

import importlib.util
import math
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import peel_opt

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", ROOT / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_aortic_flap(capsys: pytest.CaptureFixture[str]) -> None:
    found = load("aortic_flap").main()
    # p/T0 and sbar/eta by shooting from the tip, in code that is not the package's.
    assert found["pressure"] == pytest.approx(0.34746223558475 * 140.1e3, rel=1e-8)
    assert found["length"] == pytest.approx(3.71803495424891 * found["eta"], rel=1e-8)
    # p y_tip is the whole work of separation, T0 y0 / 2.
    assert found["pressure"] * found["tip_height"] == pytest.approx(0.5 * 140.1e3 * 0.73e-3, rel=1e-8)
    assert found["error"] < 1e-8
    assert capsys.readouterr().out == ""


def test_own_cohesive_law() -> None:
    found = load("own_cohesive_law").main()
    assert found == pytest.approx(
        {"cohesive": 3.13895499, "exponential by hand": 3.61621165, "trapezoid": 3.22824938}, abs=2e-8
    )


def test_own_laws_are_those_of_the_package() -> None:
    import peel_opt as po

    example = load("own_cohesive_law")
    for own, ready in ((example.exponential, po.exponential()), (example.trapezoid, po.trapezoidal(0.3))):
        for u in (0.0, 0.2, 0.3, 0.7, 1.0, 1.5):
            assert own.traction(u) == pytest.approx(ready.traction(u), abs=1e-14)


def test_linear_against_cohesive() -> None:
    module = load("linear_against_cohesive")
    found = module.main()
    assert found["linear"][-1] == pytest.approx(0.308, abs=5e-4)
    assert found["cohesive"][-1] == pytest.approx(0.396, abs=5e-4)
    for p, linear, cohesive in zip(module.PRESSURES, found["linear"], found["cohesive"], strict=False):
        assert (abs(linear - cohesive) < 2e-8) == (p >= 0.5)


def test_paper_fig10a(tmp_path: Path) -> None:
    eq = load("paper_fig10a").main(str(tmp_path / "fig10a.png"))
    assert eq.alpha == pytest.approx(14.8646046, abs=1e-7)
    assert eq.flags == ("y > y0",)
    assert (tmp_path / "fig10a.png").stat().st_size > 10_000


def test_readme_figure() -> None:
    figure, curve = load("readme_figure").main(points=8)
    assert all(eq.certified for eq in curve)
    pressures = [eq.pressure for eq in curve]
    assert pressures == sorted(pressures, reverse=True)
    assert curve[0].pressure_ratio == pytest.approx(0.999)
    assert curve[-1].length_ratio == pytest.approx(4.741, abs=0.02)
    assert [ax.get_xlabel() for ax in figure.axes] == ["$x$ [mm]", r"detached length $\bar s$ [mm]"]
    assert (ROOT / "docs" / "img" / "readme.png").stat().st_size <= 150_000


def test_hysteresis_loop(tmp_path: Path) -> None:
    found = load("hysteresis_loop").main(str(tmp_path / "loops.png"))
    assert found["leaves at"] == pytest.approx(-0.26900108827, abs=1e-10)
    assert found["lands at"] == pytest.approx(-2.787971627, abs=1e-9)
    assert found["Maxwell point"] == pytest.approx(-0.239053836, abs=1e-9)
    assert found["area"] == pytest.approx(0.624880670, abs=1e-9)
    assert found["area, paper"] == pytest.approx(0.696**3 * 4.0**3 / 6.0 * 5.0 / (4.0 * 7.29), rel=1e-3)
    assert found["area, fit"] == pytest.approx(0.6189, abs=2e-4)
    assert found["least p/T0"] == pytest.approx(0.121837041296, abs=1e-9)
    assert found["area in T0 eta"] == pytest.approx(3.82307, abs=2e-5)
    assert (tmp_path / "loops.png").stat().st_size > 10_000


def test_maxwell_length_chart(tmp_path: Path) -> None:
    module = load("maxwell_length_chart")
    chart = module.main(str(tmp_path / "chart.png"))
    for length, exponent in chart.values():
        assert exponent[-1] == pytest.approx(0.75, abs=1e-5)
        assert length[-1] == pytest.approx(558.6623, abs=1e-3)
    for source, expected in {"paper": 0.2103, "exact": 0.2100, "fit": 0.2102}.items():
        assert chart[source][0][0] == pytest.approx(expected, abs=1e-4)
        assert chart[source][1][0] == pytest.approx(0.972, abs=1e-3)
    missing = chart["branch"][0] != chart["branch"][0]
    assert (missing == (module.RATIOS < 0.4996)).all()
    assert (tmp_path / "chart.png").stat().st_size > 10_000


def test_normal_form_errors(tmp_path: Path) -> None:
    module = load("normal_form_errors")
    table, errors = module.main(str(tmp_path / "errors.png"))
    text = (ROOT / "docs" / "reduced_problem.md").read_text()
    for beta0, row in table.items():
        fold, maxwell = row["branch"]
        assert f"| {beta0:g} | {fold:.9f}" in text
        assert f"{maxwell:.9f}" in text
    wide = list(module.WIDE)
    by_order = dict(zip(module.ORDERS, errors, strict=True))
    assert by_order[12][wide.index(10.0)] < 1e-12 < by_order[6][wide.index(10.0)]
    assert by_order[40][wide.index(25.0)] < 1e-11
    assert by_order[40][wide.index(36.0)] > 1e-3
    assert (tmp_path / "errors.png").stat().st_size > 10_000


def test_inverse_design() -> None:
    import peel_opt as po

    found = load("inverse_design").main()
    assert found["by length"].free["thickness"] == pytest.approx(1.0692e-3, rel=1e-4)
    assert po.held_length(found["thinnest"].rod, 10e3).length == pytest.approx(6e-3, rel=1e-7)
    thickest = found["thickest that lies flat again"]
    assert po.readhesion_pressure(thickest.rod).pressure == pytest.approx(500.0, rel=1e-7)
    assert found["thinnest"].free["thickness"] < thickest.free["thickness"]


def test_every_picture_of_an_example_has_its_place_before_the_work() -> None:
    for path in EXAMPLES:
        text = path.read_text(encoding="utf-8")
        if "save_figure(" in text:
            assert "picture_file(" in text or "mkdir(parents=True" in text, path.name


def test_every_example_is_tested() -> None:
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parents[1].rglob("test_*.py"))
    assert [path.stem for path in EXAMPLES if f"def test_{path.stem}(" not in tests] == []


def test_an_example_runs_as_a_script(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", str(ROOT / "examples" / "paper_fig10a.py")],
        check=True,
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert done.stdout.startswith("alpha = 14.86460")
    assert done.stderr == ""


def test_follower_work() -> None:
    full, retraced = load("follower_work").main()
    assert full == pytest.approx(0.003566, abs=2e-6)
    assert abs(retraced) < 1e-12


def test_held_length_charts(tmp_path: Path) -> None:
    found = load("held_length_charts").main()
    assert len(found) == 8
    low, high = found["aortic_flap"]
    assert low == pytest.approx(25942.2, rel=1e-5)
    assert high == 140100.0
    for low, high in found.values():
        assert 0.0 < low < high


@pytest.mark.slow
def test_flaw_charts(tmp_path: Path) -> None:
    found = load("flaw_charts").main(tmp_path, flaws=(0.1, 1.0), cards="a*")
    assert list(found) == ["aircraft_tape", "aortic_flap"]
    assert [path.name for path in tmp_path.iterdir()] == ["aortic_flap.png"]
    # At eta/y0 = 0.75063 shooting finds 0.3759996751 T0 for an edge of 1 eta; this flap has 0.7501.
    assert found["aortic_flap"][-1].pressure == pytest.approx(0.376 * 140.1e3, rel=1e-3)
    assert found["aortic_flap"][0].pressure > found["aortic_flap"][1].pressure
    assert len(found["aircraft_tape"]) == 1  # an edge of 1 eta grows stably there


@pytest.mark.slow
def test_scene_pictures(tmp_path: Path) -> None:
    found = load("scene_pictures").main(tmp_path, ("peel", "friction"))
    assert {path.name for path in tmp_path.iterdir()} == {"scene_peel.png", "scene_friction.png"}
    peel, friction = found["peel"], found["friction"]
    # Kendall's limit G / (1 - cos phi), which the arm has reached; at first it took more.
    assert peel["end at 90"] == pytest.approx(100.0, rel=1e-6)
    assert peel["end at 150"] == pytest.approx(100.0 / (1.0 - math.cos(math.radians(150.0))), rel=1e-4)
    assert peel["peak at 90"] > 1.19 * peel["end at 90"]
    assert peel["peak at 150"] > 2.6 * peel["end at 150"]
    assert friction["5000"] < friction["0"] < friction["-5000"]


def test_stability_map(tmp_path: Path) -> None:
    import numpy as np

    found = load("stability_map").main(np.array([0.2, 0.5]), points=24, out=tmp_path / "map.png")
    assert [kind for kind, *_ in found[0.2]] == ["index 1", "stable"]
    kinds = [kind for kind, *_ in found[0.5]]
    assert kinds[:4] == ["index 1", "stable", "flutter", "flutter even under drag"]
    assert found[0.5][0][2] == pytest.approx(-2.04257752, abs=2e-6)
    assert (tmp_path / "map.png").stat().st_size > 10_000


def test_pressure_chart_sweep(tmp_path: Path) -> None:
    module = load("pressure_chart_sweep")
    module.STRENGTHS, module.LENGTHS = module.STRENGTHS[[4, 8]], module.LENGTHS[[0, 6]]
    chart = module.main(str(tmp_path / "chart.png"), workers=1)
    assert chart["status"].tolist() == [["no-equilibrium", "certified"], ["no-equilibrium", "certified"]]
    assert chart["pressure"][:, 1] == pytest.approx([142148.524663, 151557.286544], rel=1e-8)
    assert (tmp_path / "chart.png").stat().st_size > 10_000


@pytest.mark.slow
def test_snap() -> None:
    found = load("snap").main()
    flap, beam = found["flap at 300 mmHg"], found["beam at 1 bar"]
    assert flap.outcome == "folded"
    fold = peel_opt.length_given_pressure(flap.rod, flap.pressure, state="folded")
    assert flap.front[-1] == pytest.approx(fold.length, rel=1e-7)
    assert 5e-3 < flap.event("angle").t < 20e-3
    assert beam.outcome == "end of rod"
    assert beam.front[-1] == pytest.approx(150e-6, rel=1e-9)
    unfolded = peel_opt.length_given_pressure(beam.rod, beam.pressure)
    assert beam.growth_rate == pytest.approx(peel_opt.growth_rate(unfolded, drag=1.3e5), rel=1e-6)


@pytest.mark.slow
def test_tear_in_time(tmp_path: Path) -> None:
    found = load("tear_in_time").main(str(tmp_path / "tear.png"))
    assert found["holds up to"] == pytest.approx(56191.4, abs=0.1)
    # Behind what equilibria say, by what the rate leaves: the snap, and the least pressure of 25.9 kPa.
    assert found["holds up to"] < found["snaps at"] < 1.1 * found["holds up to"]
    assert 15e3 < found["comes back at"] < 25.9e3
    tear = peel_opt.load_card(ROOT / "problems" / "aortic_tear.toml").scene()
    fold = peel_opt.solve(tear, free="length", pressure=70e3, state="folded")
    assert found["at 70 kPa"] == pytest.approx(fold.length, rel=2e-3)
    assert found["torn"] == pytest.approx(2.741e-3, abs=1e-5)
    assert found["dissipated, torn"] > found["dissipated"] > 2.0 * found["of which bond"] > 0.13
    assert (tmp_path / "tear.png").stat().st_size > 10_000


@pytest.mark.slow
def test_load_unload_reload() -> None:
    found = load("load_unload_reload").main()
    assert found["stops at"] == pytest.approx(5.25, abs=0.02)
    assert found["stops at"] + 0.2 < found["after unloading"] < found["longest flap"]
    assert found["after loading again"] == pytest.approx(found["longest flap"], abs=0.03)
    assert found["heals below"] < 0.1218
