"""How to cite a result: this software, the paper it implements, and the libraries that found it.

``python -m peel_opt.app.citation CITATION.cff`` writes what reference managers read; a test compares it.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import __version__
from ..base.errors import InvalidInput
from ..equilibria.result import Equilibrium


@dataclass(frozen=True)
class Reference:
    """What is cited.

    Parameters
    ----------
    key : str
        Its name in BibTeX.
    title : str
    authors : tuple of str
        Family name first where there is a comma; otherwise a group.
    journal, volume, pages, doi : str
    year : int, optional
    version : str
        Of software.
    note : str
        What of it is used.
    """

    key: str
    title: str
    authors: tuple[str, ...]
    journal: str = ""
    volume: str = ""
    pages: str = ""
    year: int | None = None
    doi: str = ""
    version: str = ""
    note: str = ""

    @property
    def kind(self) -> str:
        """What it is: "software", or an "article"."""
        return "software" if self.version else "article"

    @property
    def text(self) -> str:
        """It in one line, for people."""
        said = [f"{'; '.join(self.authors)}{f' ({self.year})' if self.year else ''}: {self.title}"]
        where = " ".join(filter(None, (self.journal, self.volume)))
        said.append(f"{where}{f', {self.pages}' if self.pages else ''}")
        said += [f"Version {self.version}" if self.version else "", f"doi:{self.doi}" if self.doi else ""]
        return ". ".join(filter(None, said)) + "."

    @property
    def bibtex(self) -> str:
        """It as an entry of BibTeX."""
        # A group keeps its name in one piece by a second pair of braces.
        names = [name if "," in name else f"{{{name}}}" for name in self.authors]
        fields = {
            "title": f"{{{self.title}}}".replace("_", r"\_"),
            "author": " and ".join(names).replace("_", r"\_"),
            "journal": self.journal,
            "volume": self.volume,
            "pages": self.pages.replace("-", "--"),
            "year": str(self.year or ""),
            "doi": self.doi,
            "version": self.version,
            "note": self.note,
        }
        lines = [f"  {name} = {{{value}}}," for name, value in fields.items() if value]
        return "\n".join([f"@{self.kind}{{{self.key},", *lines, "}"])


PAPER = Reference(
    "peel_paper",
    "Bifurcation analysis of pressure-induced detachment of a rod adhered to a plate",
    ("The authors of the paper",),
    note="The model, equations (1)-(51), and Figures 3-10",
)
SOFTWARE = Reference(
    "peel_opt",
    "peel_opt: equilibria of a rod peeled off a plate by pressure",
    ("The peel_opt developers",),
    version=__version__,
)
CASADI = Reference(
    "casadi",
    "CasADi: a software framework for nonlinear optimization and optimal control",
    ("Andersson, Joel A. E.", "Gillis, Joris", "Horn, Greg", "Rawlings, James B.", "Diehl, Moritz"),
    "Mathematical Programming Computation",
    "11",
    "1-36",
    2019,
    "10.1007/s12532-018-0139-4",
)
IPOPT = Reference(
    "ipopt",
    "On the implementation of an interior-point filter line-search algorithm for large-scale nonlinear"
    " programming",
    ("Wächter, Andreas", "Biegler, Lorenz T."),
    "Mathematical Programming",
    "106",
    "25-57",
    2006,
    "10.1007/s10107-004-0559-y",
)
SCIPY = Reference(
    "scipy",
    "SciPy 1.0: fundamental algorithms for scientific computing in Python",
    ("Virtanen, Pauli", "Gommers, Ralf", "Oliphant, Travis E.", "SciPy 1.0 Contributors"),
    "Nature Methods",
    "17",
    "261-272",
    2020,
    "10.1038/s41592-019-0686-2",
)

#: By the first word of `Stats.method`: how an equilibrium was found, and by which libraries.
SOLVED: dict[str, tuple[str, tuple[Reference, ...]]] = {
    "series": ("the expansion about the transition", ()),
    "Spectral": ("a spectral form on Gauss nodes and Newton's method", (CASADI,)),
    "Collocation": ("Gauss-Legendre collocation and Newton's method", (CASADI,)),
    "Shooting": ("direct multiple shooting as a square programme for IPOPT", (CASADI, IPOPT)),
}

#: By the name of its class: how any other result was found.
FOUND: dict[str, tuple[str, tuple[Reference, ...]]] = {
    "Answers": ("A batch of equilibria by Newton's method in stacks", (CASADI,)),
    "Branch": ("A branch by pseudo-arclength continuation, special points located on it", (CASADI,)),
    "Calibration": ("A fit by non-linear least squares, every fitted state certified", (CASADI, SCIPY)),
    "Design": ("A design by sequential quadratic programming, confirmed by an equilibrium", (CASADI, SCIPY)),
    "FoldCurve": ("A curve of folds by pseudo-arclength continuation", (CASADI,)),
    "History": ("A loading history in time on a fixed mesh, by Radau IIA", (CASADI, SCIPY)),
    "Sensitivities": ("Derivatives by the implicit function theorem", (CASADI,)),
    "Snap": ("A motion in time, by Radau IIA", (CASADI, SCIPY)),
    "Stability": ("Eigenvalues of the linearised equations", (CASADI, SCIPY)),
    "Sweep": ("A sweep of equilibria by Newton's method", (CASADI,)),
    "Uncertainty": ("A scrambled Sobol sequence of rods, each with its equilibrium", (CASADI, SCIPY)),
}


@dataclass(frozen=True)
class Citation:
    """What to cite for a result.

    Parameters
    ----------
    method : str
        How it was found, in a sentence; empty where no result was given.
    references : tuple of Reference
        The software, the paper, and the libraries that found it.
    """

    method: str
    references: tuple[Reference, ...]

    @property
    def text(self) -> str:
        """The method and the references in plain lines."""
        return "\n".join(filter(None, (self.method, *(reference.text for reference in self.references))))

    @property
    def bibtex(self) -> str:
        """The references as entries of BibTeX."""
        return "\n\n".join(reference.bibtex for reference in self.references)

    def __str__(self) -> str:
        """Return both."""
        return f"{self.text}\n\n{self.bibtex}"


def citation(result: object = None) -> Citation:
    """Return what to cite for a result: the paper, this software, and the method with its libraries.

    Parameters
    ----------
    result : optional
        Anything that a call of `peel_opt` returned; nothing for the software and the paper alone.

    Returns
    -------
    Citation
        ``.text`` in plain lines, ``.bibtex``, ``.method`` in a sentence, ``.references`` one by one.

    Raises
    ------
    InvalidInput
        If it is no result of this package.

    Examples
    --------
    >>> print(citation().text.splitlines()[0])  # doctest: +ELLIPSIS
    The peel_opt developers: peel_opt: equilibria of a rod peeled off a plate by pressure. Version ...
    """
    method, libraries = _method(result)
    return Citation(method, (SOFTWARE, PAPER, *libraries))


def _method(result: object) -> tuple[str, tuple[Reference, ...]]:
    if result is None:
        return "", ()
    if isinstance(result, Equilibrium):
        name = re.match(r"\w*", result.stats.method)
        words, libraries = SOLVED.get(name[0] if name else "", ("peel_opt", ()))
        settings = f" ({result.stats.method})" if result.stats.method else ""
        trust = f"error {result.error:.0e}, certificate {result.certificate:.0e}, {result.status}"
        return f"An equilibrium under the {result.law} law by {words}{settings}: {trust}.", libraries
    room = type(result).__module__.partition("peel_opt.")[2]
    if not room or room.startswith("model."):
        raise InvalidInput(
            f"a {type(result).__name__} is no result of peel_opt.",
            remedy="Pass what one of its calls returned.",
        )
    words, libraries = FOUND.get(type(result).__name__, ("Read off certified equilibria", (CASADI,)))
    return f"{words}.", libraries


def cff() -> str:
    """Return CITATION.cff."""
    lines = ["cff-version: 1.2.0", *_cff(SOFTWARE)]
    lines.insert(2, 'message: "If you use this software, please cite it and the paper it implements."')
    lines += ["license: MIT", f"abstract: {json.dumps(ABSTRACT)}", "keywords:"]
    lines += [*(f"  - {word}" for word in ("elastica", "adhesion", "peeling", "bifurcation")), "references:"]
    for reference in (PAPER, CASADI, IPOPT, SCIPY):
        first, *others = _cff(reference)
        lines += [f"  - {first}", *(f"    {line}" for line in others)]
    return "\n".join(lines) + "\n"


ABSTRACT = (
    "Equilibria, branches and effective potentials of a rod peeled off a plate by pressure,"
    " each with its certificate"
)


def _cff(reference: Reference) -> Iterator[str]:
    def line(key: str, value: Any) -> Iterator[str]:
        if value:
            yield f"{key}: {json.dumps(value, ensure_ascii=False)}"

    yield f"type: {reference.kind}"
    yield from line("title", reference.title)
    yield "authors:"
    for author in reference.authors:
        family, comma, given = author.partition(", ")
        yield from line("  - family-names" if comma else "  - name", family)
        yield from line("    given-names", given)
    for key in ("journal", "volume", "year", "doi", "version"):
        yield from line(key, getattr(reference, key))
    first, _, last = reference.pages.partition("-")
    yield from line("start", first)
    yield from line("end", last)
    yield from line("notes", reference.note)


def main(argv: list[str]) -> None:
    """Write CITATION.cff to the file that is named."""
    (path,) = argv
    Path(path).write_text(cff(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
