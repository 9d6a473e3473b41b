"""The figures of the paper, recomputed, and charts it does not have.

Each function returns a Matplotlib figure made from traced branches, with the paper's curve
beside them where the two differ.  `make` writes them to files.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...base.checks import whole
from ...base.errors import InvalidInput
from ...base.progress import progress

if TYPE_CHECKING:
    from .diagrams import figure_4, figure_5, figure_6
    from .flaw_charts import figure_held_lengths
    from .fold_chart import figure_fold_curve
    from .method_map import figure_method_map
    from .minimum_pressure import figure_p_min
    from .pressure_profiles import figure_8
    from .reduced import figure_7, figure_9
    from .rod_shapes import figure_10
    from .three_kinds import figure_3
    from .work_precision import figure_work_precision

#: Where each figure is drawn, by the name it is asked for: the paper's number, or a chart beyond it.
FIGURES = {
    "3": ("three_kinds", "figure_3"),
    "4": ("diagrams", "figure_4"),
    "5": ("diagrams", "figure_5"),
    "6": ("diagrams", "figure_6"),
    "7": ("reduced", "figure_7"),
    "8": ("pressure_profiles", "figure_8"),
    "9": ("reduced", "figure_9"),
    "10": ("rod_shapes", "figure_10"),
    "p-min": ("minimum_pressure", "figure_p_min"),
    "held-lengths": ("flaw_charts", "figure_held_lengths"),
    "fold-curve": ("fold_chart", "figure_fold_curve"),
    "method-map": ("method_map", "figure_method_map"),
    "work-precision": ("work_precision", "figure_work_precision"),
}

FORMATS = ("pdf", "png")

__all__ = [
    "FIGURES",
    "figure_3",
    "figure_4",
    "figure_5",
    "figure_6",
    "figure_7",
    "figure_8",
    "figure_9",
    "figure_10",
    "figure_fold_curve",
    "figure_held_lengths",
    "figure_method_map",
    "figure_p_min",
    "figure_work_precision",
    "make",
]


def make(
    names: Sequence[str | int] = (),
    out: str | Path = ".",
    *,
    points: int | None = None,
    formats: Sequence[str] = FORMATS,
    dpi: float = 200.0,
) -> list[Path]:
    """Compute figures and write each to files; a bar on stderr tells people how far it is.

    Parameters
    ----------
    names : sequence of str or int, optional
        Which of `FIGURES`; by default all.
    out : str or Path
        Folder, made if it does not exist.
    points : int, optional
        Points on each curve, or scanned; by default as many as print well.
    formats : sequence of str
        Of "pdf", "png", "svg".
    dpi : float
        Dots per inch of a PNG.

    Returns
    -------
    list of Path
        The files, in the order of the names.

    Raises
    ------
    InvalidInput
        If there is no such figure or format, or the folder cannot be written.
    """
    wanted = _known(names)
    if points is not None:
        points = whole("points", points, 8)

    from ...base.files import make_folder
    from .. import picture_file, save_figure

    folder = make_folder(out)
    for end in formats:
        picture_file(folder / f"figure.{end}")
    files = []
    with progress("figure", len(wanted)) as step:
        for name in wanted:
            module, function = FIGURES[name]
            draw = getattr(import_module(f".{module}", __name__), function)
            takes = "points" in signature(draw).parameters  # a potential, a table of times: none
            figure = draw(points=points) if takes and points is not None else draw()
            files += [save_figure(figure, folder / f"{_stem(name)}.{end}", dpi=dpi) for end in formats]
            step()
    return files


def stems(names: Sequence[str | int] = ()) -> list[str]:
    """Return the names of the files that `make` writes, without their endings."""
    return [_stem(name) for name in _known(names)]


def _known(names: Sequence[str | int]) -> list[str]:
    wanted = [str(name) for name in names] or list(FIGURES)
    if unknown := [name for name in wanted if name not in FIGURES]:
        raise InvalidInput(f"there is no figure {unknown[0]!r}.", remedy=f"Choose from {', '.join(FIGURES)}.")
    return wanted


def _stem(name: str) -> str:
    return f"figure_{name.replace('-', '_')}"


def __getattr__(name: str) -> Any:
    for module, function in FIGURES.values():
        if name == function:
            return getattr(import_module(f".{module}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
