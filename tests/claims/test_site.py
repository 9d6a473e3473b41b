"""The site is built without a complaint, and has every page, every public name and every example."""

from __future__ import annotations

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import peel_opt

ROOT = Path(__file__).parents[2]
DOCS = {path.name for path in (ROOT / "docs").glob("*.md")}
NAV = set(re.findall(r"([\w.]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE))
MADE = {"index.md", "gallery.md", "reference.md", "contributing.md", "changelog.md"}


def test_every_page_has_its_place() -> None:
    assert NAV == DOCS | MADE


def test_every_picture_of_the_gallery_is_there() -> None:
    text = (ROOT / "mkdocs_pages.py").read_text(encoding="utf-8")
    pictures = dict(re.findall(r'^    "(\w+)": "(\w+)",$', text.partition("ROOMS")[0], re.MULTILINE))
    assert "hysteresis_loop" in pictures
    for example, picture in pictures.items():
        assert (ROOT / "examples" / f"{example}.py").exists(), example
        assert (ROOT / "docs" / "img" / f"{picture}.png").exists(), picture


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("material") is None, reason="needs pip install '.[docs]'")
def test_the_site_is_built_strictly(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    env = os.environ | {"PYTHONPATH": str(ROOT), "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for page in NAV:
        assert (tmp_path / page).with_suffix(".html").exists(), page

    def ids(page: str) -> set[str]:
        return set(re.findall(r'id="([\w.]+)"', (tmp_path / page).read_text(encoding="utf-8")))

    named = {full.rpartition(".")[2] for full in ids("reference.html")}
    assert set(peel_opt.__all__) <= named
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} <= ids("gallery.html")
    found = (tmp_path / "search" / "search_index.json").read_text(encoding="utf-8")
    for words in ("pseudo-arclength", "safe_pressure", "aortic media"):
        assert words in found, words
    assert not re.search(
        r'src="https?://|<link [^>]*href="https?://', (tmp_path / "theory.html").read_text(encoding="utf-8")
    )
