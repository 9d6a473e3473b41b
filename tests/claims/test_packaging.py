"""The package as it is uploaded: archives, what a wheel holds, and the recipe for conda-forge."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

import peel_opt

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = (ROOT / "packaging" / "recipe.yaml").read_text(encoding="utf-8")

#: What conda-forge calls the packages that have another name there.
ON_CONDA = {"matplotlib": "matplotlib-base", "lazy_loader": "lazy-loader"}


def test_the_recipe_is_of_this_version_and_needs_what_the_project_needs() -> None:
    assert f'version: "{peel_opt.__version__}"' in RECIPE
    assert f'python_min: "{PROJECT["requires-python"].removeprefix(">=")}"' in RECIPE
    run = RECIPE.partition("  run:\n")[2].partition("\n\n")[0]
    needed = {tuple(line.removeprefix("    - ").split(" ")) for line in run.splitlines()}
    wanted = {("python", ">=${{", "python_min", "}}")}
    for text in PROJECT["dependencies"]:
        name, limits = re.fullmatch(r"(\w+)(.*)", text).groups()  # type: ignore[union-attr]
        wanted.add((ON_CONDA.get(name, name), limits))
    assert needed == wanted
    (entry,) = PROJECT["scripts"].items()
    assert f"- {entry[0]} = {entry[1]}" in RECIPE
    assert f"summary: {PROJECT['description']}\n" in RECIPE


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the archive of sources and, from it, the wheel, as a release does."""
    for tool in ("build", "hatchling", "twine"):
        if importlib.util.find_spec(tool) is None:
            pytest.skip("needs pip install '.[release]'")
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return out


@pytest.mark.slow
def test_the_archives_are_what_an_index_takes(dist: Path) -> None:
    files = sorted(dist.iterdir())
    version = peel_opt.__version__
    assert [f.name for f in files] == [f"peel_opt-{version}-py3-none-any.whl", f"peel_opt-{version}.tar.gz"]
    subprocess.run(
        [sys.executable, "-m", "twine", "check", "--strict", *files], check=True, capture_output=True
    )


@pytest.mark.slow
def test_the_wheel_has_the_package_its_data_and_nothing_else(dist: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    for name in ("py.typed", "__init__.pyi", "continuation/seeds.npz", "problems/office_tape.toml"):
        assert f"peel_opt/{name}" in names
    assert {name.split("/")[0] for name in names} == {
        "peel_opt",
        f"peel_opt-{peel_opt.__version__}.dist-info",
    }
    assert wheel.stat().st_size < 2_000_000
    (archive,) = dist.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        inside = {name.split("/", 1)[1] for name in opened.getnames() if "/" in name}
    assert {"README.md", "mkdocs.yml", "tests/conftest.py", "packaging/recipe.yaml", "CITATION.cff"} <= inside


@pytest.mark.slow
def test_what_a_wheel_installs_answers_far_from_the_sources(dist: Path, tmp_path: Path) -> None:
    (wheel,) = dist.glob("*.whl")
    site, away = tmp_path / "site", tmp_path / "away"
    away.mkdir()
    zipfile.ZipFile(wheel).extractall(site)  # what pip does with a wheel of pure Python
    env = os.environ | {"PYTHONPATH": str(site), "MPLBACKEND": "agg"}

    def run(*words: str) -> str:
        done = subprocess.run(
            [sys.executable, *words], cwd=away, env=env, capture_output=True, text=True, check=False
        )
        assert (done.stderr, done.returncode) == ("", 0)
        return done.stdout

    assert str(site) in run("-c", "import peel_opt; print(peel_opt.__file__)")
    run("-m", "peel_opt", "new", "tape.toml", "--kind", "sheet")
    assert run("-m", "peel_opt", "run", "tape.toml", "--out", "results").count("certified") == 3
    assert (away / "results" / "tape-summary.csv").exists()
    assert (
        "office" in run("-c", "from peel_opt.app.explorer.presets import presets; print(presets())").lower()
    )
