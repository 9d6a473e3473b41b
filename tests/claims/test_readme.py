"""What the README says works as it stands there; so do the examples in the docstrings."""

from __future__ import annotations

import doctest
import importlib
import os
import pkgutil
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import peel_opt
from peel_opt.app.cli.main import main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


def run_as_script(text: str, folder: Path) -> str:
    """Run the Python of a page as a reader would, below each other in a file, and return what it prints."""
    blocks = re.findall(r"^```python\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    (script := folder / "script.py").write_text("\n".join(blocks), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-W", "error", str(script)],
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (run.stderr, run.returncode) == ("", 0)
    return run.stdout


def test_python_blocks_run_in_order(tmp_path: Path) -> None:
    printed = run_as_script(README, tmp_path)
    assert "(lower, cohesive law)" in printed
    assert "nearest that does exist" in printed


@pytest.mark.parametrize(
    "line",
    [
        line.split("&& .venv/bin/")[-1]
        for language, code in BLOCKS
        if language == "sh"
        for line in code.splitlines()
        if "peel-opt" in line
    ],
)
def test_command_lines_run(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    words = shlex.split(line)
    assert words[0] == "peel-opt"
    arguments = []
    for word in words[1:]:
        if "*" in word:
            arguments += sorted(str(p) for p in ROOT.glob(word))
        else:
            arguments.append(str(tmp_path / word) if word == "results" else word)
    assert main(arguments) == 0
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("module", [m.name for m in pkgutil.walk_packages(peel_opt.__path__, "peel_opt.")])
def test_docstring_examples(module: str) -> None:
    if module.endswith("__main__"):
        pytest.skip("runs the command line when imported")
    assert doctest.testmod(importlib.import_module(module)).failed == 0


@pytest.mark.parametrize("page", sorted((ROOT / "docs").glob("*.md")), ids=lambda p: p.stem)
def test_pages_of_the_documentation_run(page: Path, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if "```python" in text:
        run_as_script(text, tmp_path)
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", text):
        assert (page.parent / target).exists(), target


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", README):
        assert (ROOT / target).exists(), target
