"""Files of equilibria: bit for bit, and nothing foreign or damaged is believed."""

import json
import math
import pickle
import re
import zipfile
from dataclasses import asdict, fields, replace

import numpy as np
import pytest

import peel_opt as po
from peel_opt.base.errors import InvalidInput
from peel_opt.equilibria.ask import equilibrium, pressure_given_length
from peel_opt.equilibria.result import Equilibrium
from peel_opt.model.rod import Rod
from peel_opt.residual.shape import Shape

from ..rods import FLAP

QUESTIONS = {
    "si": lambda: pressure_given_length(FLAP, 1.9e-3),
    "ratio": lambda: pressure_given_length(Rod.from_ratio(0.566), 3.5),
    "groups": lambda: equilibrium(beta0=53.16, beta1=113.1),
    "beta0=0": lambda: equilibrium(beta0=0.0, lam=1.0),
    "nothing": lambda: pressure_given_length(Rod.from_ratio(1.0), 9.0, throw=False),
}


@pytest.fixture(scope="module")
def answers():
    return {name: ask() for name, ask in QUESTIONS.items()}


def write(eq, path):
    return eq.save(path) if path.suffix == ".npz" else eq.to_csv(path)


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
@pytest.mark.parametrize("name", QUESTIONS)
def test_a_round_trip_keeps_every_bit(answers, name, suffix, tmp_path):
    eq = answers[name]
    path = tmp_path / f"answer{suffix}"
    assert write(eq, path) == path
    back = Equilibrium.load(path)
    for f in fields(Equilibrium):
        if f.name not in ("source", "stats"):
            assert repr(getattr(back, f.name)) == repr(getattr(eq, f.name)), f.name
    assert repr(asdict(back.stats)) == repr(asdict(eq.stats))
    assert back.rod == eq.rod
    for array in (f.name for f in fields(Shape)):
        assert getattr(back.shape, array).tobytes() == getattr(eq.shape, array).tobytes(), array
    for array in ("s", "x", "y", "theta", "curvature", "Nx", "Ny"):
        assert getattr(back, array).tobytes() == getattr(eq, array).tobytes(), array
    assert repr(back.summary()) == repr(eq.summary())


def test_the_csv_can_be_read_by_others(answers, tmp_path):
    eq = answers["si"]
    path = eq.to_csv(tmp_path / "answer.csv")
    table = np.genfromtxt(path, delimiter=",", names=True, comments=None, skip_header=_comments(path))
    np.testing.assert_array_equal(table["s_m"], eq.s)
    np.testing.assert_array_equal(table["y_m"], eq.y)
    text = path.read_text()
    assert f"# pressure [Pa] = {eq.pressure!r}\n" in text
    assert "s [m],x [m],y [m],curvature [1/m],Nx [N/m],Ny [N/m],s/sbar" in text


def _comments(path):
    return sum(line.startswith("#") for line in path.read_text().splitlines())


def test_units_follow_the_rod(answers):
    assert answers["si"].summary()["pressure [Pa]"] == answers["si"].pressure
    assert answers["ratio"].summary()["length [eta]"] == pytest.approx(3.5)
    assert answers["groups"].summary()["pressure [k/sbar^3]"] == answers["groups"].alpha
    assert math.isnan(answers["nothing"].summary()["tip_height [eta]"])


def test_a_message_with_line_breaks_survives_csv(tmp_path):
    eq = Equilibrium.nothing(None, "alpha1", 1e-8, "failed", "one\n# two = 3\nthrée")
    assert Equilibrium.load(eq.to_csv(tmp_path / "a.csv")).message == eq.message


# --- scenes -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def in_an_artery():
    scene = po.Scene(FLAP, [po.Weight(50.0)], wall=po.Circle(-100.0 / 3.0), natural_curvature=-100.0 / 3.0)
    return po.solve(scene, free="length", pressure=100e3)


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
def test_a_state_of_a_scene_comes_back_with_its_scene(in_an_artery, suffix, tmp_path):
    eq = in_an_artery
    back = Equilibrium.load(write(eq, tmp_path / f"state{suffix}"))
    assert back.scene == eq.scene
    assert repr(back) == repr(eq)
    assert back.numbers == eq.numbers
    assert back.y.tobytes() == eq.y.tobytes()
    again = Equilibrium.load(write(back, tmp_path / f"again{suffix}"))
    assert again.scene == eq.scene
    if suffix == ".csv":
        text = (tmp_path / "state.csv").read_text()
        (tmp_path / "other.csv").write_text(text.replace('"w": 50.0', '"w": 51.0'))
        with pytest.raises(InvalidInput, match=r"weight.*not what its scene is made of"):
            Equilibrium.load(tmp_path / "other.csv")


def test_of_a_profile_of_the_readers_own_the_words_come_back(in_an_artery, tmp_path):
    mine = po.Scene(FLAP, [po.Pressure(lambda at: 1.0)])
    back = Equilibrium.load(replace(in_an_artery, scene=mine, numbers={}).save(tmp_path / "state.npz"))
    assert back.scene.startswith("Scene(rod=")
    assert " at 0x" not in back.scene
    assert Equilibrium.load(back.save(tmp_path / "again.npz")).scene == back.scene


# --- what others do to a CSV --------------------------------------------------------------


@pytest.mark.parametrize("name", QUESTIONS)
@pytest.mark.parametrize(
    "passed",
    [
        lambda data: data.replace(b"\n", b"\r\n"),  # git under autocrlf
        lambda data: b"\xef\xbb\xbf" + data,  # Excel
        lambda data: data + b"\n\n",
        lambda data: b"\xef\xbb\xbf" + data.replace(b"\n", b"\r\n") + b" \r\n",
    ],
)
def test_a_csv_with_other_line_ends_a_mark_or_blank_lines_is_read(answers, tmp_path, name, passed):
    path = answers[name].to_csv(tmp_path / "a.csv")
    path.write_bytes(passed(path.read_bytes()))
    back = Equilibrium.load(path)
    assert repr(back.summary()) == repr(answers[name].summary())
    assert back.shape.y.tobytes() == answers[name].shape.y.tobytes()


#: What a CSV says once: how good the answer is and what it took, not what it is.
ONCE = ("schema", "points", "error", "certificate", "tol", "message", "stats.", "answered", "law", "state")


@pytest.mark.parametrize("name", ["si", "ratio", "groups", "beta0=0"])
def test_a_csv_that_contradicts_itself_is_refused(answers, tmp_path, name):
    path = answers[name].to_csv(tmp_path / "a.csv")
    lines = path.read_text().splitlines(keepends=True)
    changed = 0
    for i, line in enumerate(lines):
        key, _, value = line[2:].partition(" = ")
        digits = re.search(r"\d\.\d", value)
        if not line.startswith("# ") or key.startswith(ONCE) or digits is None:
            continue
        at = len(line) - len(value) + digits.end() - 1
        edited = line[:at] + str((int(line[at]) + 1) % 10) + line[at + 1 :]
        path.write_text("".join([*lines[:i], edited, *lines[i + 1 :]]))
        refused(path, "follows from|eta/y0")
        changed += 1
    assert changed >= 7


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('status = "certified"', 'status = "not-certified"'),
        ("# valid = true", "# valid = false"),
        ("# flags = []", '# flags = ["y > y0"]'),
        ("# tol = 1e-08", "# tol = 1e-18"),
    ],
)
def test_a_csv_whose_words_contradict_its_numbers_is_refused(answers, tmp_path, old, new):
    path = answers["si"].to_csv(tmp_path / "a.csv")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    refused(path)


def test_a_changed_point_of_a_shape_is_seen_where_the_file_holds_it_twice(answers, tmp_path):
    path = answers["si"].to_csv(tmp_path / "a.csv")
    lines = path.read_text().splitlines()
    cells = lines[-20].split(",")
    cells[1] = repr(float(cells[1]) * 1.001)
    path.write_text("\n".join([*lines[:-20], ",".join(cells), *lines[-19:]]) + "\n")
    refused(path, r"'x \[m\]' is not what follows")


def test_flags_are_a_list_wherever_they_are_data(answers):
    assert answers["si"].summary()["flags"] == []
    assert answers["groups"].summary()["flags"] == ["y > y0"]


# --- reading ------------------------------------------------------------------------------


def refused(path, words="file|read"):
    with pytest.raises(InvalidInput, match=words) as caught:
        Equilibrium.load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", [".npz", ".csv"])
@pytest.mark.parametrize("keep", [0, 1, 10, 0.3, 0.9, -1])
def test_truncated_files_are_refused(answers, tmp_path, suffix, keep):
    path = write(answers["si"], tmp_path / f"a{suffix}")
    data = path.read_bytes()
    path.write_bytes(data[: keep if isinstance(keep, int) else int(keep * len(data))])
    refused(path)


def test_a_csv_that_lost_lines_is_refused(answers, tmp_path):
    path = answers["si"].to_csv(tmp_path / "a.csv")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:-3]))
    refused(path, "numbers")
    path.write_text("".join(line for line in lines if not line.startswith("# alpha1 =")))
    refused(path, "alpha1")


def test_a_damaged_npz_is_refused(answers, tmp_path):
    path = answers["si"].save(tmp_path / "a.npz")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    refused(path)


def test_foreign_files_are_refused(answers, tmp_path):
    path = tmp_path / "foreign"
    for content in (b"", b"\0" * 100, b"x,y\n1,2\n", b"\xff\xfe\x00", b"PK\x03\x04 no zip"):
        path.write_bytes(content)
        refused(path)
    np.savez(tmp_path / "foreign.npz", a=np.arange(3))
    refused(tmp_path / "foreign.npz", "metadata")
    np.save(tmp_path / "foreign.npy", np.arange(3))
    refused(tmp_path / "foreign.npy")
    refused(tmp_path / "missing.npz", "No such file")
    refused(tmp_path, "directory")


class Trap:
    """What unpickling must never run."""

    def __reduce__(self):
        return (pytest.fail, ("a pickle was run",))


def test_pickles_are_refused(tmp_path):
    path = tmp_path / "trap"
    path.write_bytes(pickle.dumps(Trap()))
    refused(path)
    with zipfile.ZipFile(tmp_path / "trap.npz", "w") as archive, archive.open("metadata.npy", "w") as file:
        np.lib.format.write_array(file, np.array(Trap(), dtype=object), allow_pickle=True)
    refused(tmp_path / "trap.npz", "pickle|Object")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("schema", "something else", "something else"),
        ("schema_version", 2, "version"),
        ("alpha1", "three", "alpha1"),
        ("flags", "y > y0", "flags"),
        ("law", None, "law"),
        ("points", 7, "7 numbers"),
        ("bending_stiffness [N m]", -1.0, "positive"),
    ],
)
def test_metadata_that_means_nothing_is_refused(answers, tmp_path, key, value, words):
    path = answers["si"].save(tmp_path / "a.npz")
    with np.load(path, allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    head = json.loads(str(arrays.pop("metadata")))
    head[key] = value
    np.savez(path, metadata=np.array(json.dumps(head)), **arrays)
    refused(path, words)


def test_a_file_that_unpacks_to_far_too_much_is_refused(tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("metadata.npy", b"\0" * 80_000_000)
    refused(path, "too large")


@pytest.mark.parametrize("suffix", ["npz", "csv", "pickle"])
def test_a_law_of_ones_own_is_not_taken_for_another_of_its_name(tmp_path, suffix):
    steep, slow = (po.CohesiveLaw(lambda u, c=c: 1.0 / (1.0 + u) ** c, name="mine") for c in (2.0, 1.0))
    eq = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.6, law=steep)
    if suffix == "pickle":
        read = pickle.loads(pickle.dumps(eq))
    else:
        path = tmp_path / f"eq.{suffix}"
        eq.to_csv(path) if suffix == "csv" else eq.save(path)
        read = po.Equilibrium.load(path)
        again = tmp_path / f"again.{suffix}"
        read.to_csv(again) if suffix == "csv" else read.save(again)
        assert po.Equilibrium.load(again).law_samples == read.law_samples != ()
    walked = po.follow(read, hold="ratio", steps=2, law=steep)
    assert walked.law == "mine"
    with pytest.raises(po.InvalidInput, match="another law than this 'mine'"):
        po.follow(read, hold="ratio", steps=2, law=slow)


def test_files_from_before_laws_were_sampled_are_read(tmp_path):
    law = po.CohesiveLaw(lambda u: 1.0 / (1.0 + u) ** 2, name="mine")
    path = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.6, law=law).to_csv(tmp_path / "eq.csv")
    text = path.read_text(encoding="utf-8")
    kept = [line for line in text.splitlines(keepends=True) if not line.startswith("# law_samples")]
    assert len(kept) == text.count("\n") - 1
    path.write_text("".join(kept), encoding="utf-8")
    read = po.Equilibrium.load(path)
    assert read.law_samples == ()
    assert po.follow(read, hold="ratio", steps=2, law=law).law == "mine"
