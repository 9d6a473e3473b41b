"""Branches on disk: the same bits back, a table others can read, and nothing foreign believed."""

import csv
import json
import zipfile
from contextlib import suppress
from dataclasses import fields, replace

import casadi as ca
import numpy as np
import pytest

import peel_opt as po
from peel_opt.equilibria.branch import COLUMNS, Branch
from peel_opt.equilibria.branch_parts import Solutions
from peel_opt.equilibria.branch_points import law_of
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.law_samples import samples
from peel_opt.model.named_laws import exponential, trapezoidal

from ..rods import FLAP


@pytest.fixture(scope="module")
def branches():
    rod = FLAP
    traced = po.trace(rod, points=24, tol=1e-6)
    fixed = po.trace(beta0=4, lam=(-1, 3), points=24)
    return {
        "rod": traced,
        "beta0": fixed,
        "beta0 = 0": po.trace(beta0=0, lam=(-1, 1), points=12),
        "slice": fixed[30:5:-3],
        "empty": fixed[:0],
        "with index": replace(fixed, index=np.arange(len(fixed)) % 3),
        "without solutions": replace(fixed, solutions=None, trivial=None),
        "exponential": po.trace(po.Rod.from_ratio(0.3), law=exponential(), points=12, tol=1e-5),
    }


def same_bits(a, b):
    if isinstance(a, np.ndarray):
        assert (a.dtype, a.shape) == (b.dtype, b.shape)
        assert a.tobytes() == b.tobytes()
    else:
        assert repr(a) == repr(b)


NAMES = ("rod", "beta0", "beta0 = 0", "slice", "empty", "with index", "without solutions", "exponential")


@pytest.mark.parametrize("name", NAMES)
def test_a_round_trip_keeps_every_bit(branches, name, tmp_path):
    branch = branches[name]
    path = tmp_path / "branch.npz"
    assert branch.save(path) == path
    back = Branch.load(path)
    for f in fields(Branch):
        if f.name not in ("solutions", "trivial"):
            same_bits(getattr(branch, f.name), getattr(back, f.name))
    assert (back.trivial is None) == (branch.trivial is None)
    if branch.trivial is not None:
        same_bits(branch.trivial.lam, back.trivial.lam)
        same_bits(branch.trivial.special_points, back.trivial.special_points)
    assert (back.solutions is None) == (branch.solutions is None)
    if branch.solutions is not None:
        assert back.solutions.law is None
        assert back.solutions.mesh is None  # known by its name from then on
        for f in fields(Solutions):
            mine, other = getattr(branch.solutions, f.name), getattr(back.solutions, f.name)
            if f.name in ("unknowns", "tangents"):
                assert len(mine) == len(other)
                for a, b in zip(mine, other, strict=True):
                    same_bits(a, b)
            elif f.name == "law_samples":
                assert other == samples(branch.solutions.law)
            elif f.name not in ("law", "mesh"):
                assert mine == other
    assert repr(back) == repr(branch)


def test_the_same_branch_is_the_same_file(branches, tmp_path):
    first, second = (branches["beta0"].save(tmp_path / name) for name in ("a.npz", "b.npz"))
    assert first.read_bytes() == second.read_bytes()
    assert Branch.load(first).save(tmp_path / "c.npz").read_bytes() == first.read_bytes()


def test_points_of_a_loaded_branch_are_equilibria(branches, tmp_path):
    branch = branches["rod"]
    back = Branch.load(branch.save(tmp_path / "branch.npz"))
    i = branch.special("LP-pressure")[0].index
    mine, other = branch[i], back[i]
    assert other.pressure == mine.pressure
    assert other.certified
    same_bits(mine.y, other.y)
    with pytest.raises(ValueError, match="read-only"):
        back.lam[0] = 1.0


@pytest.mark.parametrize("name", ["rod", "beta0"])
def test_a_loaded_branch_goes_on(branches, name, tmp_path):
    branch = branches[name]
    part = branch[: len(branch) // 2]
    again = Branch.load(part.save(tmp_path / "part.npz"))
    more = po.follow(again, hold=branch.hold, steps=3)
    assert more.A[0] == pytest.approx(part.A[-1], abs=1e-9)
    assert (more.A[1] - more.A[0]) * (part.A[-1] - part.A[-2]) > 0


def test_no_array_of_a_branch_can_be_written_to(branches):
    branch = branches["with index"]
    for array in (branch.index, branch.trivial.lam, *branch.solutions.unknowns, *branch.solutions.tangents):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_held_is_what_was_asked_for_and_options_are_those_in_use(branches):
    cohesive = po.trace(beta0=8.9, law="cohesive", lam=(-0.5, 0.1), points=4, tol=1e-5)
    assert (branches["beta0"].held, cohesive.held) == (4.0, 8.9)
    assert "lam" in cohesive.options
    assert "lam" not in branches["rod"].options


def test_named_laws_come_back_and_others_are_asked_for(branches, tmp_path):
    laws = {"beta0": LINEAR, "rod": COHESIVE, "exponential": exponential()}
    for name, law in laws.items():
        assert law_of(Branch.load(branches[name].save(tmp_path / "b.npz"))) == law
    own = Branch.load(replace(branches["rod"], law="own").save(tmp_path / "own.npz"))
    assert own.pressure[0] == branches["rod"].pressure[0]
    with pytest.raises(po.InvalidInput, match="not stored"):
        own[0]


def own_law(rate, name="my law"):
    return po.CohesiveLaw(lambda u: ca.exp(-rate * u), name=name)


def test_a_branch_under_a_law_of_ones_own_goes_on_under_that_law_only(tmp_path):
    branch = po.trace(po.Rod.from_ratio(0.6), law=own_law(2.0), points=8, tol=1e-5)[:6]
    path = branch.save(tmp_path / "own.npz")
    mine = po.follow(branch, hold="ratio", steps=2)
    taken_up = (
        po.follow(Branch.load(path), hold="ratio", steps=2, law=own_law(2.0)),
        po.follow(Branch.load(path, law=own_law(2.0)), hold="ratio", steps=2),
    )
    for again in taken_up:
        np.testing.assert_allclose(again.length_ratio, mine.length_ratio, rtol=1e-9)
    assert Branch.load(path, law=own_law(2.0))[3].certified
    for other in (
        own_law(2.0 + 1e-6),
        exponential(),
        po.CohesiveLaw(lambda u: 1 / (1 + u) ** 2, name="my law"),
    ):
        with pytest.raises(po.InvalidInput, match="traced with another law"):
            Branch.load(path, law=other)
        with pytest.raises(po.InvalidInput, match="traced with another law"):
            po.follow(Branch.load(path), hold="ratio", steps=2, law=other)


def test_a_file_whose_law_is_named_otherwise_is_not_taken_up_by_its_name(branches, tmp_path):
    path = replace(branches["rod"], law="exponential").save(tmp_path / "b.npz")
    with pytest.raises(po.InvalidInput, match="not stored"):
        Branch.load(path)[0]


def test_files_of_earlier_releases_go_by_the_name(branches, tmp_path):
    path = branches["rod"].save(tmp_path / "b.npz")
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files if key != "law_samples"}
    np.savez(tmp_path / "old.npz", **arrays)
    assert law_of(Branch.load(tmp_path / "old.npz")) == COHESIVE


def test_a_trapezoidal_law_is_taken_up_by_its_name(tmp_path):
    law = trapezoidal(1 / 3)
    branch = po.trace(po.Rod.from_ratio(1.0), law=law, points=8, tol=1e-5)[:6]
    again = Branch.load(branch.save(tmp_path / "t.npz"))
    assert law_of(again) == law
    assert again[2].certified


@pytest.mark.parametrize("name", ["auto", "linear", "cohesive", "exponential", "trapezoidal(0.3)"])
def test_names_of_the_package_are_not_for_other_laws(name):
    with pytest.raises(po.InvalidInput, match="cannot be called"):
        own_law(2.0, name)


# --- CSV --------------------------------------------------------------------------------------


def table(path):
    lines = path.read_text(encoding="ascii").splitlines()
    notes = [line for line in lines if line.startswith("# ")]
    rows = list(csv.DictReader(lines[len(notes) :]))
    return notes, rows


def test_csv_has_units_and_every_digit(branches, tmp_path):
    branch = branches["rod"]
    notes, rows = table(branch.to_csv(tmp_path / "branch.csv"))
    assert len(rows) == len(branch)
    columns = {
        "pressure [Pa]": branch.pressure,
        "length [m]": branch.length,
        "tip_height [m]": branch.tip_height,
        "pressure_ratio": branch.pressure_ratio,
        "tip_angle [rad]": branch.tip_angle,
        "lam": branch.lam,
        "error": branch.error,
    }
    for title, values in columns.items():
        np.testing.assert_array_equal([float(row[title]) for row in rows], values)
    assert [row["state"] for row in rows] == branch.state.tolist()
    assert "# adhesion_strength [Pa] = 140000.0" in notes
    points = [json.loads(line.split(" = ", 1)[1]) for line in notes if line.startswith("# special point")]
    assert [p["kind"] for p in points] == [p.kind for p in branch.special_points]
    assert points[1]["lam"] == branch.special_points[1].lam


def test_csv_without_a_rod_has_the_groups_only(branches, tmp_path):
    _, rows = table(branches["with index"].to_csv(tmp_path / "branch.csv"))
    assert not any("[Pa]" in title or "[m]" in title for title in rows[0])
    assert [int(row["index"]) for row in rows] == branches["with index"].index.tolist()
    assert "pressure [T0]" in branches["exponential"].to_csv(tmp_path / "e.csv").read_text()


# --- what cannot be read or written ---------------------------------------------------------------


def refused(path):
    with pytest.raises(po.InvalidInput) as caught:
        Branch.load(path)
    text = str(caught.value)
    assert "\n" not in text
    assert path.name in text
    return text


def rewritten(branch, path, **changes):
    """Save a branch with arrays, or entries of its metadata, replaced or (None) left out."""
    with np.load(branch.save(path)) as stored:
        arrays = dict(stored)
    head = json.loads(str(arrays.pop("metadata")))
    for name, value in changes.items():
        place = arrays if name in arrays or isinstance(value, np.ndarray) else head
        place[name] = value
        if value is None:
            del place[name]
    np.savez(path, metadata=np.array(json.dumps(head)), **arrays)
    return path


def test_a_later_or_foreign_schema_is_named(branches, tmp_path):
    path = tmp_path / "branch.npz"
    later = rewritten(branches["beta0"], path, schema_version=Branch.schema.version + 1)
    assert f"version is {Branch.schema.version + 1}" in refused(later)
    equilibrium = po.equilibrium(beta0=4, lam=1.0).save(tmp_path / "eq.npz")
    assert "peel_opt equilibrium" in refused(equilibrium)
    with pytest.raises(po.InvalidInput, match="peel_opt branch"):
        po.Equilibrium.load(branches["beta0"].save(path))


@pytest.mark.parametrize(
    "changes",
    [
        {"lam": None},
        {"law": 3},
        {"held": None},
        {"special_points": [{"kind": "BP"}]},
        {"points": 7},
        {"iterations": np.zeros(3)},
        {"state": np.array([1, 2])},
        {"unknowns": np.zeros(5)},
        {"phases": np.array(["0"])},
        {"m": np.array([{}], dtype=object)},
        {"transcription": None},
        {"adhesion_strength [Pa]": -1.0, "bending_stiffness [N m]": 1.0, "adhesion_range [m]": 1.0},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_a_file_that_does_not_hold_together_is_refused(branches, changes, tmp_path):
    refused(rewritten(branches["beta0"], tmp_path / "bad.npz", **changes))


def test_damage_never_goes_unseen(branches, tmp_path):
    data = branches["beta0"].save(tmp_path / "branch.npz").read_bytes()
    bad = tmp_path / "bad.npz"
    parts = [data[:length] for length in (0, 1, 100, len(data) // 2, len(data) - 1)]
    for content in (*parts, b"not an archive", b"PK\x03\x04 broken", b"\x80\x04pickle"):
        bad.write_bytes(content)
        refused(bad)
    rng = np.random.default_rng(5)
    whole = repr(branches["beta0"])
    for place in rng.integers(0, len(data), 60):
        hurt = bytearray(data)
        hurt[place] ^= 1 << int(rng.integers(8))
        bad.write_bytes(hurt)
        with suppress(po.InvalidInput):  # some bytes of a zip hold nothing that is read
            assert repr(Branch.load(bad)) == whole


def test_a_zip_bomb_and_a_missing_file_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(Branch, "schema", replace(Branch.schema, largest=10_000))
    bomb = tmp_path / "bomb.npz"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("lam.npy", bytes(1_000_000))
    assert "too large" in refused(bomb)
    assert "cannot read" in refused(tmp_path / "missing.npz")


def test_a_failed_write_leaves_the_old_file(branches, tmp_path):
    path = branches["beta0"].save(tmp_path / "branch.npz")
    before = path.read_bytes()
    strange = replace(branches["beta0"], options={"law": object()})
    for write in (strange.save, strange.to_csv):
        with pytest.raises(po.InvalidInput, match="cannot store"):
            write(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["branch.npz"]
    for name in ("no/branch.npz", "no/deep/\0"):
        with pytest.raises(po.InvalidInput, match="cannot write"):
            branches["beta0"].save(tmp_path / name)


def test_options_of_numpy_type_are_stored_as_plain_numbers(branches, tmp_path):
    branch = replace(branches["beta0"], options={"tol": np.float64(1e-9), "lam": np.array([0.5, 1.0])})
    assert Branch.load(branch.save(tmp_path / "b.npz")).options == {"tol": 1e-9, "lam": [0.5, 1.0]}


def test_every_column_is_stored(branches, tmp_path):
    with np.load(branches["beta0"].save(tmp_path / "b.npz"), allow_pickle=False) as stored:
        assert set(COLUMNS) < set(stored.files)


@pytest.mark.slow
def test_the_branch_of_a_scene_comes_back_with_its_scene_and_the_angles_of_its_tip(tmp_path):
    scene = po.Scene(po.Rod.from_ratio(1.0), wall=po.Circle(-0.1), natural_curvature=-0.1)
    branch = po.trace(scene, points=8)
    back = Branch.load(branch.save(tmp_path / "branch.npz"))
    assert back.scene == scene
    assert back.tip_angle.tobytes() == branch.tip_angle.tobytes()
    assert abs(branch.tip_angle + branch.A).max() > 0.1  # it counts from the wall
    assert back[3:5].tip_angle.tobytes() == branch[3:5].tip_angle.tobytes()
    assert back[3].length == branch[3].length
    unknown = replace(back, scene="a scene of my own")
    with pytest.raises(po.InvalidInput, match="does not hold its scene"):
        unknown[3]
