"""The tutorials work as they stand, in an empty folder: commands with what they print, then the Python."""

from __future__ import annotations

import doctest
import re
import shlex
from pathlib import Path

import pytest

from peel_opt.app.cli.main import main

from .test_readme import run_as_script

DOCS = Path(__file__).parents[2] / "docs"
TUTORIALS = sorted(DOCS.glob("tutorial_*.md"))

#: A block with its language; of command lines, and of what they print.
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def test_there_is_one_for_each_trade() -> None:
    trades = {"adhesion_test", "biomechanics", "mems", "numerics", "lecture"}
    assert {path.stem.removeprefix("tutorial_") for path in TUTORIALS} == trades


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS, ids=lambda p: p.stem)
def test_a_tutorial_runs_in_an_empty_folder(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    printed = ""
    for language, block in BLOCK.findall(text):
        if language == "sh":
            for line in block.replace("\\\n", "").splitlines():
                program, *words = shlex.split(line)
                assert program == "peel-opt"
                assert main(words) == 0, line
            printed = capsys.readouterr().out
        elif language == "text":
            same = doctest.OutputChecker().check_output(
                block, printed, doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
            )
            assert same, f"the page says\n{block}\nprinted is\n{printed}"
    run_as_script(text, tmp_path)


@pytest.mark.slow
def test_a_tutorial_is_a_notebook_whose_results_show_themselves(tmp_path: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    text = (DOCS / "tutorial_biomechanics.md").read_text(encoding="utf-8")
    blocks = [code for language, code in BLOCK.findall(text) if language == "python"]
    assert len(blocks) > 4
    cells = [nbformat.v4.new_code_cell(code) for code in [*blocks, "snapped", "flat"]]
    book = nbformat.v4.new_notebook(cells=cells)
    client = nbclient.NotebookClient(book, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()  # raises where a cell does
    for cell in book["cells"][-2:]:
        assert {"text/html", "image/png"} <= set(cell["outputs"][-1]["data"])
