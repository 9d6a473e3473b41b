"""What happens when it does not go well: killed, interrupted, out of disk, two at once, out of memory.

Wherever a run is cut off, every file under its own name is whole; a sweep goes on where it was.
"""

from __future__ import annotations

import contextlib
import gc
import json
import math
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from matplotlib import image

import peel_opt as po
from peel_opt.app.cli.main import main

ROOT = Path(__file__).parents[2]
PROBLEMS = [str(ROOT / "problems" / f"{name}.toml") for name in ("office_tape", "foil_tape", "graphene")]
RUN = ["run", *PROBLEMS]
# Point by point, so that there is time to disturb it.
SWEEP = ["sweep", "--ratio", "0.5:2:40", "--pressure-ratio", "0.3:0.9:25", "--workers", "1", "--no-plot"]
SWEEP += ["--method", "spectral"]
FIGURES = ["figures", "4", "5", "7", "--points", "8"]

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


def environment(**more: str) -> dict[str, str]:
    return {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT), **more}


def started(arguments: list[str], folder: Path, **options) -> subprocess.Popen[bytes]:
    """Start the command line in a folder; warnings are shown, so that none goes unseen."""
    command = [sys.executable, "-W", "error::ResourceWarning", "-m", "peel_opt", *arguments]
    options.setdefault("env", environment())
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **options)


def ended(arguments: list[str], folder: Path, **options) -> tuple[int, str, str]:
    with started(arguments, folder, **options) as process:
        out, err = process.communicate(timeout=300)
    return process.returncode, out.decode(), err.decode()


def one_line(err: str) -> bool:
    return err.count("\n") == 1 and err.startswith("peel-opt: ") and "Traceback" not in err


def check_whole(folder: Path) -> int:
    """Read every file that stands under its own name; return how many there are."""
    count = 0
    for path in sorted(folder.rglob("*")):
        if path.name.startswith(".") or path.is_dir():
            continue  # a draft, which nobody takes for a result
        count += 1
        content = path.read_bytes()
        if path.suffix == ".npz":
            load = po.Sweep.load if path.stem == "sweep" else po.Equilibrium.load
            repr(load(path))
        elif path.name in ("summary.csv", "sweep.csv", "written.json"):
            assert content.endswith(b"\n")
        elif path.suffix == ".csv":
            repr(po.Equilibrium.load(path))
        elif path.suffix == ".png":
            assert image.imread(path).size
        elif path.suffix == ".pdf":
            assert content.startswith(b"%PDF")
            assert content.rstrip().endswith(b"%%EOF")
        else:
            assert path.suffix == ".journal", path
    return count


def killed_after(seconds: float, arguments: list[str], folder: Path, by: int = signal.SIGKILL) -> int:
    """Start a command and send it a signal; return its code."""
    with started(arguments, folder) as process:
        try:
            process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.send_signal(by)
            process.communicate(timeout=60)
    return process.returncode


def until(condition, process: subprocess.Popen[bytes], seconds: float = 60.0) -> None:
    """Wait for something that a process does, as long as it runs."""
    deadline = time.monotonic() + seconds
    while not condition() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)


# --- killed ---------------------------------------------------------------------------------


@posix
def test_a_run_that_is_killed_among_its_files_leaves_whole_ones(tmp_path):
    with started([*RUN, "--out", "out"], tmp_path) as process:
        until(lambda: len(list(tmp_path.glob("out/*.npz"))) >= 2, process)
        process.kill()
        process.communicate()
    assert check_whole(tmp_path / "out") >= 3
    assert ended([*RUN, "--out", "out", "--no-plot"], tmp_path)[0] == 0  # and the folder can be used again
    check_whole(tmp_path / "out")


@posix
def test_a_sweep_that_is_killed_goes_on_and_gives_the_same_bits(tmp_path):
    journal = tmp_path / "cut" / "sweep.journal"
    with started([*SWEEP, "--out", "cut"], tmp_path) as process:
        until(lambda: journal.exists() and journal.read_bytes().count(b"\n") >= 3, process)
        process.kill()
        process.communicate()
    assert process.returncode == -signal.SIGKILL
    kept = journal.read_bytes()
    assert 3 <= kept.count(b"\n") < 11
    assert ended([*SWEEP, "--out", "cut", "--resume"], tmp_path)[0] in (0, 1)
    assert journal.read_bytes().startswith(kept[: kept.rindex(b"\n") + 1])  # nothing was computed twice
    axes = {"ratio": np.linspace(0.5, 2, 40), "pressure_ratio": np.linspace(0.3, 0.9, 25)}
    wanted = po.sweep(axes, workers=1, method="spectral")
    found = po.Sweep.load(tmp_path / "cut" / "sweep.npz")
    for name in ("length_ratio", "error", "certificate"):
        assert found[name].tobytes() == wanted[name].tobytes()


@posix
@pytest.mark.slow
@pytest.mark.parametrize("arguments", [RUN, SWEEP, FIGURES], ids=["run", "sweep", "figures"])
def test_killed_at_random_moments(arguments, tmp_path):
    rng = random.Random(1)
    whole = 0
    began = time.monotonic()
    assert ended([*arguments, "--out", "whole"], tmp_path)[0] in (0, 1)
    length = time.monotonic() - began
    for n in range(20):
        resume = ["--resume"] if arguments is SWEEP else []
        folder = "cut" if arguments is SWEEP else f"cut{n}"
        by = rng.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
        code = killed_after(rng.uniform(0.0, length), [*arguments, "--out", folder, *resume], tmp_path, by)
        assert code in (0, 1, 130, -signal.SIGKILL, -signal.SIGTERM, -signal.SIGINT), code
        whole += check_whole(tmp_path / folder)
    assert whole > 20
    if arguments is SWEEP:
        assert ended([*SWEEP, "--out", "cut", "--resume"], tmp_path)[0] in (0, 1)
        found, wanted = (po.Sweep.load(tmp_path / f / "sweep.npz") for f in ("cut", "whole"))
        assert found["length_ratio"].tobytes() == wanted["length_ratio"].tobytes()


@posix
@pytest.mark.parametrize("arguments", [RUN, SWEEP], ids=["run", "sweep"])
def test_ctrl_c_is_130_one_line_and_whole_files(arguments, tmp_path):
    with started([*arguments, "--out", "out"], tmp_path) as process:
        sign = "*.npz" if arguments is RUN else "*.journal"
        until(lambda: any(path.stat().st_size > 1000 for path in tmp_path.glob(f"out/{sign}")), process)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.decode() == "peel-opt: interrupted\n"
    assert check_whole(tmp_path / "out") >= 1
    assert not list(tmp_path.glob("out/.*"))  # an interrupt has the time to take its draft away


# --- no room, no folder, no screen ----------------------------------------------------------


def limited(most: int):
    """Return what makes a process unable to write files above some bytes, as on a full disk."""

    def apply() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # then writing fails with an error
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    return apply


@posix
@pytest.mark.parametrize(
    ("arguments", "most"),
    [
        ([*RUN, "--out", "out"], 0),
        ([*RUN, "--out", "out"], 3000),
        pytest.param([*SWEEP, "--out", "out"], 20_000, marks=pytest.mark.slow),
        (["trace", "--beta0", "4", "--points", "8", "--out", "out"], 2000),
        pytest.param(["figures", "7", "--out", "out"], 4000, marks=pytest.mark.slow),
    ],
    ids=["nothing", "an answer", "a journal", "a branch", "a figure"],
)
def test_a_disk_that_is_full_is_one_line_and_no_half_file(arguments, most, tmp_path):
    environ = environment(MPLCONFIGDIR=str(tmp_path / "mpl"))
    code, _, err = ended(arguments, tmp_path, preexec_fn=limited(most), env=environ)
    assert code == 2
    ours = [line for line in err.splitlines() if line.startswith("peel-opt: ")]
    assert ours == err.splitlines()[-1:], err
    assert "File too large" in ours[0]
    check_whole(tmp_path / "out")
    assert not list(tmp_path.glob("out/.*"))
    if arguments[0] == "sweep":
        assert ended([*SWEEP, "--out", "out", "--resume"], tmp_path)[0] in (0, 1)  # once there is room


@pytest.mark.parametrize(
    "arguments",
    [
        RUN,
        SWEEP,
        FIGURES,
        ["trace", "--beta0", "4"],
        ["hysteresis", "--beta0", "4"],
        ["length", "--pressure", "0.8", "--ratio", "1"],
        ["calibrate", str(ROOT / "problems" / "calibrate_flap.toml")],
    ],
    ids=lambda arguments: arguments[0],
)  # fmt: skip
@pytest.mark.parametrize(
    "refusal", [PermissionError(13, "Permission denied"), OSError(30, "Read-only file system")]
)
def test_a_folder_that_cannot_be_written_is_one_line_before_any_work(
    arguments, refusal, tmp_path, monkeypatch, capsys
):
    def refuse(self: Path, *_, **__) -> None:
        raise refusal

    monkeypatch.setattr(Path, "mkdir", refuse)
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert one_line(err), err
    assert refusal.strerror in err


def test_files_that_cannot_be_replaced_are_named(tmp_path, capsys):
    (tmp_path / "summary.csv").mkdir()  # a folder where a file should go
    assert main([*RUN, "--out", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert one_line(err)
    assert "summary.csv" in err


def test_pictures_need_no_screen_and_texts_no_alphabet(tmp_path):
    plain = {"LC_ALL": "C", "LANG": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    environ = environment(**plain, PYTHONIOENCODING="ascii")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "MPLBACKEND", "HOME"):
        environ.pop(name, None)
    card = tmp_path / "ünïcode ∞.toml"
    question = '[[questions]]\nname = "σ̄ bei p = 0,8"\npressure_ratio = 0.8\n'
    card.write_text(f'title = "Δp ≤ 1 ∞"\n[rod]\nratio = 1.0\n{question}', "utf-8")
    code, out, err = ended(["run", os.fsencode(card.name), "--out", "öut"], tmp_path, env=environ)
    assert (code, err) == (0, "")
    assert out.isascii()
    assert len(list(tmp_path.rglob("*.png"))) == 1
    for path in tmp_path.rglob("*.csv"):
        path.read_bytes().decode("utf-8")


# --- two at once ----------------------------------------------------------------------------


@pytest.mark.slow
def test_two_runs_in_one_folder_leave_whole_files(tmp_path):
    with started([*RUN, "--out", "out"], tmp_path) as one, started([*RUN, "--out", "out"], tmp_path) as other:
        results = [process.communicate(timeout=120) for process in (one, other)]
    assert (one.returncode, other.returncode) == (0, 0), results
    assert results[0] == results[1]
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert check_whole(tmp_path / "out") == len(names)


@pytest.mark.slow
@posix
def test_two_sweeps_with_one_journal_do_not_mix(tmp_path):
    with started([*SWEEP, "--out", "out"], tmp_path) as one:
        until(lambda: any(p.stat().st_size > 1000 for p in tmp_path.glob("out/*.journal")), one)
        code, _, err = ended([*SWEEP, "--out", "out", "--resume"], tmp_path)
        assert one.poll() is None
        one.send_signal(signal.SIGINT)
        one.communicate()
    assert code == 2
    assert one_line(err)
    assert "being written by another process" in err


# --- memory ---------------------------------------------------------------------------------


def used() -> int:
    """Bytes of this process that are in memory now."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def growth(repeat, first: int, then: int) -> float:
    """Bytes that a repetition adds after the first ones have filled what is kept."""
    for n in range(first):
        repeat(n)
    before = used()
    for n in range(first, first + then):
        repeat(n)
    return (used() - before) / then


memory = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs Linux")
ROD = po.Rod.from_ratio(1.0)


def solved(n: int) -> None:
    po.length_given_pressure(ROD, 0.3 + 0.6 * (n * 0.618 % 1.0), method="spectral")


def another_rod(n: int) -> None:
    rod = po.Rod.from_ratio(0.8 + 0.4 * (n * 0.618 % 1.0))
    po.length_given_pressure(rod, 0.7, method="spectral")


def traced(n: int) -> None:
    po.trace(beta0=3.0 + (n * 0.618 % 1.0), lam=(-1, 1), points=8)


def by_ipopt(n: int) -> None:
    # No two questions are the same, so that what is kept of each would show.
    po.equilibrium(beta0=4.0, lam=0.5 + (n * math.sqrt(2.0) % 1.0), method="shooting")


def refused(n: int) -> None:
    with contextlib.suppress(po.PeelOptError):
        po.length_given_pressure(ROD, 1.1 + n * 1e-3)


@memory
@pytest.mark.parametrize(
    ("repeat", "first", "then"),
    [
        (solved, 100, 400),
        pytest.param(refused, 30, 100, marks=pytest.mark.slow),
        (traced, 10, 30),
        pytest.param(solved, 500, 10_000, marks=pytest.mark.slow),
        pytest.param(another_rod, 300, 1000, marks=pytest.mark.slow),
        pytest.param(traced, 100, 1000, marks=pytest.mark.slow),
        # Each question has a branch of its own: the heap is flat once those that are kept come and go.
        pytest.param(by_ipopt, 1500, 1000, marks=pytest.mark.slow),
        pytest.param(refused, 500, 10_000, marks=pytest.mark.slow),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_memory_does_not_grow(repeat, first, then):
    """A leaked solve keeps its programme, some 50 kB; a leaked result its arrays, some 5 kB."""
    assert growth(repeat, first, then) * then < max(2e6, 500.0 * then)


def test_what_is_kept_is_bounded():
    """Every cache of the package has a size, so that a long life does not fill the memory."""
    for path in sorted((ROOT / "peel_opt").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert "maxsize=None" not in text, path
        assert "@cache\n" not in text, path


def test_the_record_of_a_failed_run_is_whole_json(tmp_path, capsys):
    card = tmp_path / "card.toml"
    card.write_text('title = "x"\n[rod]\nratio = 1.0\n[[questions]]\npressure_ratio = 2.0\n')
    assert main(["run", str(card), "--json"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["cards"][0]["answers"][0]["status"] == "no-equilibrium"
    assert one_line(err)
