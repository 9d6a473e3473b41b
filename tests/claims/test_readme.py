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
COMMANDS = README + (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", COMMANDS, flags=re.MULTILINE | re.DOTALL)


#: A comment that says what is printed on its line, not why: a value, or a text with "..." in it.
CLAIM = re.compile(r"^ *print\(.*\)  # ((?:[-\[({'\"\d]|.*\.\.\.).*)$")

#: Stands before a script: what is printed begins with a mark and the line that printed it.
MARKING = "import sys; print = lambda *v, p=print: p(f'\\x1e{sys._getframe(1).f_lineno}', *v)"


def run_as_script(text: str, folder: Path) -> list[str]:
    """Run the Python of a page as a reader would, its blocks below each other in a file of this folder.

    What a page writes stays there; the cards of the project are in reach.
    Returns what it prints; fails where a comment beside a print says something else.
    """
    if not (cards := folder / "problems").exists():
        cards.symlink_to(ROOT / "problems")
    blocks = re.findall(r"^```python\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    lines = "\n".join([MARKING, *blocks]).splitlines()
    (script := folder / "script.py").write_text("\n".join(lines), encoding="utf-8")
    run = subprocess.run(
        [sys.executable, "-W", "error", str(script)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (run.stderr, run.returncode) == ("", 0)
    printed = []
    for record in run.stdout.split("\x1e")[1:]:
        number, _, said = record.removesuffix("\n").partition(" ")
        printed.append(said)
        if claim := CLAIM.match(lines[int(number) - 1]):
            same = doctest.OutputChecker().check_output(claim[1], said, doctest.ELLIPSIS)
            assert same, f"the page says {claim[1]!r}, printed is {said!r}"
    return printed


def test_python_blocks_run_in_order_and_print_what_their_comments_say(tmp_path: Path) -> None:
    printed = run_as_script(README, tmp_path)
    assert any("(lower, cohesive law)" in text for text in printed)
    assert any("nearest that does exist" in text for text in printed)


def page_of(code: str) -> str:
    return f"```python\n{code}\n```\n"


def test_a_comment_that_claims_something_else_is_found(tmp_path: Path) -> None:
    for claim in ("[1, 2]", "... and more", "1, ...", "-1.5"):
        with pytest.raises(AssertionError, match="the page says"):
            run_as_script(page_of(f"print(2)  # {claim}"), tmp_path)
    true = "print(2)  # 2\nprint(2)  # because\nfor i in (1, 2):\n    print('at', i)  # at ..."
    assert run_as_script(page_of(true), tmp_path) == ["2", "2", "at 1", "at 2"]


def test_what_a_page_writes_stays_in_its_folder(tmp_path: Path) -> None:
    code = """
from pathlib import Path
Path("of_a_page.txt").touch()
print(len(list(Path("problems").glob("*.toml"))))
"""
    assert int(run_as_script(page_of(code), tmp_path)[0]) > 10
    assert (tmp_path / "of_a_page.txt").exists()
    assert not (ROOT / "of_a_page.txt").exists()


def test_the_groups_of_the_readme_are_those_of_a_valid_state() -> None:
    calls = re.findall(r"`(po\.equilibrium\([^`]*\))`", README)
    assert calls
    for call in calls:
        assert eval(call, {"po": peel_opt}).valid, call


@pytest.mark.parametrize(
    "line",
    [
        # Each card is answered by a fast test as well; all at once take a minute.
        pytest.param(line.split("&& .venv/bin/")[-1], marks=[pytest.mark.slow] if "*" in line else [])
        for language, code in BLOCKS
        if language == "sh"
        for line in code.splitlines()
        if "peel-opt" in line and not line.startswith("$")
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
            arguments.append(str(tmp_path / word) if word.startswith("results") else word)
    assert main(arguments) == 0
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("module", [m.name for m in pkgutil.walk_packages(peel_opt.__path__, "peel_opt.")])
def test_docstring_examples(module: str) -> None:
    if module.endswith("__main__"):
        pytest.skip("runs the command line when imported")
    assert doctest.testmod(importlib.import_module(module)).failed == 0


PAGES = sorted((ROOT / "docs").glob("*.md"))

#: Pages whose examples take no more than a second; a reader's way through the others is for the slow run.
SHORT = {"choosing_a_method", "citing", "figures"}


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[] if page.stem in SHORT else [pytest.mark.slow], id=page.stem)
        for page in PAGES
        # Tutorials are run with their command lines, in test_tutorials.py.
        if not page.stem.startswith("tutorial") and "```python" in page.read_text(encoding="utf-8")
    ],
)
def test_pages_of_the_documentation_run(page: Path, tmp_path: Path) -> None:
    run_as_script(page.read_text(encoding="utf-8"), tmp_path)


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda p: p.stem)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target
