"""The file of starts: small, free of code, what the command makes, and near enough to the states."""

from dataclasses import replace
from importlib import import_module
from importlib.resources import files

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation import seeding, seeds
from peel_opt.model.bond import COHESIVE
from peel_opt.residual.batch import solve
from peel_opt.residual.meshes import PATH
from peel_opt.residual.stack import stack_of

CONTENT = files("peel_opt.continuation").joinpath(seeds.FILE)


def test_the_file_is_small_and_holds_plain_numbers_only():
    assert len(CONTENT.read_bytes()) < 250_000
    with CONTENT.open("rb") as file, np.load(file, allow_pickle=False) as data:
        assert set(data.files) == set(seeds.CHARTS)
        assert all(data[name].dtype == np.float32 and np.isfinite(data[name]).all() for name in data.files)


def test_the_charts_begin_where_the_least_pressure_is_half_the_strength():
    minimum = po.trace(po.Rod.from_ratio(seeds.LEAVES)).special("LP-pressure")[0]
    assert minimum.pressure_ratio == pytest.approx(0.5, abs=1e-10)


@pytest.mark.parametrize(
    ("name", "rod"),
    [("whole", 3), ("within", 10), ("beyond", 2), ("beyond", 21), ("folded", 5), ("returning", 20)],
)
def test_a_rod_made_anew_is_the_one_in_the_file(name, rod):
    rods, along = seeding.GRID[name]
    place, shares = float(seeding.nodes(rods)[rod]), seeding.nodes(along)[::4]
    anew = seeding.states(name, place, shares)
    ratio = seeding.ratio_at(name, place)
    assert seeds.place_of(np.array([ratio]), seeds.CHARTS[name][1])[0] == pytest.approx(place)
    kept = seeds.charts()[name].rods(np.full(len(shares), ratio)).starts(shares)
    stack = stack_of(PATH, seeds.CHARTS[name][0])
    # What is left is single precision.
    assert seeds.packed(stack, kept, folded=name in seeds.FOLDED) == pytest.approx(anew, abs=3e-5)


@pytest.mark.slow
def test_the_whole_file_made_anew_is_the_one_in_the_package(tmp_path):
    assert seeding.main([str(tmp_path / "seeds.npz")]) == 0
    with np.load(tmp_path / "seeds.npz") as anew, CONTENT.open("rb") as file, np.load(file) as kept:
        for name in kept.files:
            assert anew[name] == pytest.approx(kept[name], abs=3e-5)


@pytest.mark.parametrize("name", list(seeds.CHARTS))
def test_starts_are_a_few_steps_from_states(name):
    chart, rng = seeds.charts()[name], np.random.default_rng(2)
    ratio = np.exp(rng.uniform(*np.log(chart.ratios), 60))
    start = chart.rods(ratio).starts(rng.uniform(0.0, 0.98, 60))
    given = np.stack([ratio, chart.stack.scalars(start).A], axis=1)
    found = solve(chart.stack, ("ratio", "amplitude"), given, start)
    assert found.converged.all()
    apart = np.abs(found.x - start) / (1.0 + np.abs(start).max(axis=1, keepdims=True))
    assert np.median(apart.max(axis=1)) < 1e-4
    assert apart.max() < 5e-3


def test_a_share_is_found_first_or_last_and_a_little_beyond_the_ends():
    s = seeds.shares()
    values = np.stack([(s - 0.4) ** 2, s, s])
    sought = np.array([0.04, 1.0 + 1e-4, 1.1])
    last, first = seeds.share_of(values, sought), seeds.share_of(values, sought, last=False)
    assert last[0] == pytest.approx(0.6, abs=1e-3)
    assert first[0] == pytest.approx(0.2, abs=1e-3)
    assert last[1] == 1.0
    assert np.isnan(last[2])


@pytest.mark.parametrize("wrong", ["a little", "altogether"])
def test_wrong_seeds_cost_time_and_change_no_answer(monkeypatch, wrong):
    ratio, P = np.array([0.1, 0.7, 0.7, 1.0, 30.0]), np.array([0.95, 0.8, 0.4, 0.2, 0.1])
    right = po.answers(ratio=ratio, pressure_ratio=P)
    rng, known = np.random.default_rng(0), seeds.charts()
    size = 1e-3 if wrong == "a little" else 1.0
    noise = {name: 1.0 + size * rng.normal(size=c.coefficients.shape) for name, c in known.items()}
    bad = {name: replace(c, coefficients=c.coefficients * noise[name]) for name, c in known.items()}
    monkeypatch.setattr(import_module("peel_opt.equilibria.unfolded"), "charts", lambda: bad)
    still = po.answers(ratio=ratio, pressure_ratio=P)
    assert still.certified.all()
    assert still.states.tolist() == right.states.tolist()
    assert (np.abs(still.values - right.values) <= still.errors + right.errors).all()


def test_the_charts_are_of_law_8():
    assert {phases[-1] for phases, _ in seeds.CHARTS.values()} == {COHESIVE.pieces[0]}
