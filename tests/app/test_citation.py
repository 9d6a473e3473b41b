"""What to cite for a result, and the file that says it to reference managers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import peel_opt as po
from peel_opt.app import citation as module

ROOT = Path(__file__).parents[2]


def keys(cited: po.Citation) -> list[str]:
    return re.findall(r"^@\w+\{(\w+),$", cited.bibtex, re.MULTILINE)


def test_the_file_is_what_its_command_makes(tmp_path: Path) -> None:
    module.main([str(tmp_path / "CITATION.cff")])
    made = (tmp_path / "CITATION.cff").read_text(encoding="utf-8")
    assert made == (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_without_a_result_it_is_the_software_and_the_paper() -> None:
    cited = po.citation()
    assert (keys(cited), cited.method) == (["peel_opt", "peel_paper"], "")
    assert f"Version {po.__version__}." in cited.text
    assert "pressure-induced detachment of a rod adhered to a plate" in cited.text


@pytest.mark.parametrize(
    ("method", "words", "libraries"),
    [
        ("series", "expansion about the transition", []),
        ("spectral", "spectral form on Gauss nodes", ["casadi"]),
        ("collocation", "Gauss-Legendre collocation", ["casadi"]),
        ("shooting", "multiple shooting", ["casadi", "ipopt"]),
    ],
)
def test_an_equilibrium_says_how_it_was_found(method: str, words: str, libraries: list[str]) -> None:
    eq = po.equilibrium(beta0=4, lam=1.0, method=method)
    cited = po.citation(eq)
    assert words in cited.method
    assert eq.stats.method in cited.method
    assert f"error {eq.error:.0e}" in cited.method
    assert keys(cited) == ["peel_opt", "peel_paper", *libraries]
    assert str(cited) == f"{cited.text}\n\n{cited.bibtex}"


def test_every_method_and_every_named_result_exists() -> None:
    assert {"series", *(cls.__name__ for cls in (po.Spectral, po.Collocation, po.Shooting))} == set(
        module.SOLVED
    )
    for name in module.FOUND:
        assert hasattr(po, name), name


def test_other_results_name_their_method_or_what_they_were_read_off() -> None:
    assert "Newton's method in stacks" in po.citation(po.answers(ratio=1.0, pressure_ratio=[0.8])).method
    assert (
        po.citation(po.readhesion_pressure(po.Rod.from_ratio(1.0))).method == "Read off certified equilibria."
    )
    for wrong, name in ((0.5, "float"), (po.Rod.from_ratio(1.0), "Rod")):
        with pytest.raises(po.InvalidInput, match=f"a {name} is no result of peel_opt"):
            po.citation(wrong)


def test_bibtex_holds_what_latex_can_set() -> None:
    entries = po.citation(po.equilibrium(beta0=4, lam=1.0, method="shooting")).bibtex.split("\n\n")
    for entry in entries:
        assert entry.count("{") == entry.count("}")
        assert not re.search(r"(title|author) = .*(?<!\\)[_&%#]", entry)
    assert "author = {{The peel\\_opt developers}}" in entries[0]
    assert "pages = {25--57}" in entries[-1]
