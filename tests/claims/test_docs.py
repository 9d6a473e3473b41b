"""What the pages of the documentation promise beyond that their code runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import peel_opt
from peel_opt.plots import figures

DOCS = Path(__file__).parents[2] / "docs"


@pytest.mark.parametrize("name", sorted(peel_opt.__all__))
def test_every_public_name_is_on_the_page_of_the_api(name: str) -> None:
    assert re.search(rf"\b{name}\b", (DOCS / "api.md").read_text(encoding="utf-8"))


def test_every_figure_is_on_the_page_of_the_figures() -> None:
    text = (DOCS / "figures.md").read_text(encoding="utf-8")
    for name in figures.FIGURES:
        assert f"figure_{name.replace('-', '_')}.png" in text or f"figures {name}" in text, name


def test_the_glossary_names_what_there_is_in_the_code() -> None:
    rows = (DOCS / "glossary.md").read_text(encoding="utf-8")
    code = "\n".join(path.read_text(encoding="utf-8") for path in Path(peel_opt.__path__[0]).rglob("*.py"))
    for name in re.findall(r"`([A-Za-z_.]+)`", rows):
        assert re.search(rf"\b{re.escape(name.rpartition('.')[2])}\b", code), name
