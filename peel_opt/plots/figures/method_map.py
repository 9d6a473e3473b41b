"""Where each method works and what it takes: over (eta/y0, p) and over the paper's groups."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from ...base.errors import NoEquilibrium
from ...equilibria.ask import equilibrium, length_given_pressure
from ...model.labels import CERTIFIED
from ...model.rod import RATIOS, Rod
from ...studies.tradeoff.compare import METHODS, Compared, compare
from .. import style
from ..work import METHOD_STYLES
from . import look
from .minimum_pressure import least_pressure

#: Ends of the scan: (1 - P)/(1 - P_min) from T to the minimum pressure, and the paper's groups.
SHARES = (1e-9, 1.0 - 1e-9)
BETA0 = (0.1, 1e4)
BETA1 = (1.0, 1e9)

#: Milliseconds between which the colours change.
COST = (0.1, 100.0)

#: Methods on a mesh.
MESHES = ("spectral", "collocation", "shooting")

#: The rungs of "auto", by how what it used begins.
RUNGS = {
    "series(order=12": (style.RANGE, "series, order 12"),
    "series(order=24": ("#56B4E9", "series, order 24"),
    "Spectral": (style.ADHESION, "spectral"),
    "Collocation": (style.PRESSURE, "collocation"),
}

#: What is not an answer: one marker for a state that does not exist, one for a refusal.
NOTHING, REFUSED = "no such state", "refused"


def rods(points: int, seed: int = 1) -> Iterator[tuple[float, float, float]]:
    """Yield about ``points`` triples of eta/y0, p/T0 and (1 - P)/(1 - P_min), jittered on a grid.

    All ratios that a walk is tested for, from 1e-9 off the transition to 1e-9 off the minimum
    pressure.
    """
    rng = np.random.default_rng(seed)
    side = max(2, round(math.sqrt(points)))
    low, high = (_logit(share) for share in SHARES)
    for i in range(side):
        ratio = RATIOS[0] * (RATIOS[1] / RATIOS[0]) ** ((i + rng.random()) / side)
        span = 1.0 - least_pressure(ratio)
        for j in range(side):
            share = 1.0 / (1.0 + math.exp(-(low + (high - low) * (j + rng.random()) / side)))
            yield ratio, 1.0 - share * span, share


def groups(points: int, seed: int = 1) -> Iterator[tuple[float, float]]:
    """Yield about ``points`` pairs of beta0 and beta1, jittered on a logarithmic grid."""
    rng = np.random.default_rng(seed)
    side = max(2, round(math.sqrt(points)))
    for i in range(side):
        for j in range(side):
            u, v = (i + rng.random()) / side, (j + rng.random()) / side
            yield BETA0[0] * (BETA0[1] / BETA0[0]) ** u, BETA1[0] * (BETA1[1] / BETA1[0]) ** v


def scan_rods(points: int, seed: int = 1, methods: Sequence[str] = METHODS) -> list[Compared]:
    """Ask all methods for the length at given pressure, under law (8)."""
    return [
        compare(partial(length_given_pressure, Rod.from_ratio(ratio), P), ratio, share, methods)
        for ratio, P, share in rods(points, seed)
    ]


def scan_groups(
    points: int, seed: int = 1, methods: Sequence[str] = METHODS, law: str = "cohesive"
) -> list[Compared]:
    """Ask all methods for alpha1 at given groups."""
    return [
        compare(partial(equilibrium, beta0=beta0, beta1=beta1, law=law), beta0, beta1, methods)
        for beta0, beta1 in groups(points, seed)
    ]


def scan_transition(points: int, seed: int = 1, methods: Sequence[str] = METHODS) -> list[Compared]:
    """Ask for alpha1 about T, 1e-8 <= |lambda| <= 10, on every state there is: x is beta0, y lambda."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(points):
        beta0 = 10.0 ** rng.uniform(*np.log10(BETA0))
        lam = (-1.0) ** i * 10.0 ** rng.uniform(-8.0, 1.0)
        # Before T both states hold as long as the fold is not reached, beyond it the lower one.
        state = "middle" if i % 4 == 1 else None
        ask = partial(equilibrium, beta0=beta0, lam=lam, state=state)
        found.append(compare(ask, beta0, lam, methods))
    return found


def figure_method_map(points: int = 100) -> Figure:
    """Draw where each method answers, and in what time; what "auto" takes; growth of unknowns.

    Parameters
    ----------
    points : int
        Questions in each of the two planes, rounded to a square; 36 take a few seconds, 400 a
        minute or two.
    """
    return draw(scan_rods(points), scan_groups(points))


def draw(on_rods: Sequence[Compared], in_groups: Sequence[Compared]) -> Figure:
    """Draw two scans that are at hand."""
    figure = look.new_figure(13.0, 7.4)
    axes = figure.subplots(2, 4)
    coloured = None
    for ax, method in zip(axes.flat, METHODS[:-1], strict=False):
        coloured = _cost(ax, on_rods, method) or coloured
        if ax is not axes[0, 0]:
            ax.set(ylabel="", yticklabels=[])
    if coloured is not None:
        bar = figure.colorbar(coloured, ax=axes[0, :], pad=0.01, aspect=25)
        bar.set_label("one answer, branch known [ms]", fontsize=look.SMALL)
        bar.ax.tick_params(labelsize=look.SMALL)
    _rungs(axes[1, 0], on_rods)
    _plane_of_rods(axes[1, 0], "what auto takes")
    _legend_below(axes[1, 0])
    _rungs(axes[1, 1], in_groups)
    _plane_of_groups(axes[1, 1], "auto in the paper's groups, law (8)")
    _growth(axes[1, 2], [*on_rods, *in_groups])
    _times(axes[1, 3], on_rods)
    return figure


def _cost(ax: Axes, scan: Sequence[Compared], method: str) -> PathCollection | None:
    """Show where a method answers, coloured by its time, and where it refuses."""
    answered = [
        (place.x, place.y, 1e3 * place.by(method).seconds) for place in scan if place.by(method).certified
    ]
    _without(ax, scan, method)
    drawn = None
    if answered:
        x, y, ms = zip(*answered, strict=True)
        drawn = ax.scatter(x, y, c=ms, s=14, marker="s", norm=LogNorm(*COST), cmap=style.FAMILY_COLOURMAP)
    _plane_of_rods(ax, f"{method}: {len(answered)} of {len(scan)}")
    return drawn


def _without(ax: Axes, scan: Sequence[Compared], method: str) -> None:
    """Mark what a method gave no answer to."""
    tried = [(place.x, place.y, place.by(method).status) for place in scan]
    nothing = [(x, y) for x, y, status in tried if status == NoEquilibrium.status]
    refused = [(x, y) for x, y, status in tried if status not in (CERTIFIED, NoEquilibrium.status)]
    for places, colour, marker, size, words in (
        (nothing, look.SPURIOUS, ".", 5, NOTHING),
        (refused, look.STRAIGHT, "x", 10, REFUSED),
    ):
        if places:
            x, y = zip(*places, strict=True)
            ax.scatter(x, y, s=size, marker=marker, color=colour, linewidths=0.8, label=words)


def _rungs(ax: Axes, scan: Sequence[Compared]) -> None:
    """Colour each question by the rung on which "auto" answered it."""
    _without(ax, scan, "auto")
    for start, (colour, words) in RUNGS.items():
        at = [(place.x, place.y) for place in scan if place.by("auto").used.startswith(start)]
        if at:
            x, y = zip(*at, strict=True)
            ax.scatter(x, y, s=14, marker="s", color=colour, label=words)


def _plane_of_rods(ax: Axes, title: str) -> None:
    ax.set_xscale("log")
    ax.set_yscale("logit")
    ax.set_xlim(RATIOS[0] / 1.5, RATIOS[1] * 1.5)
    ax.set_ylim(SHARES[0] / 4.0, 1.0 - (1.0 - SHARES[1]) / 4.0)
    ratio = np.geomspace(0.3, RATIOS[1], 15)
    half = [0.5 / (1.0 - least_pressure(float(r))) for r in ratio]
    drawn = [(r, h) for r, h in zip(ratio, half, strict=True) if h < 1.0]
    ax.plot(*zip(*drawn, strict=True), color="black", linewidth=0.8, linestyle=":", label="$p = T_0/2$")
    powers = (9, 6, 3)
    ax.set_yticks([*(10.0**-n for n in powers), 0.5, *(1.0 - 10.0**-n for n in reversed(powers))])
    below, above = ([f"${side}10^{{-{n}}}$" for n in powers] for side in ("", "1-"))
    ax.set_yticklabels([*below, "1/2", *reversed(above)])
    ax.minorticks_off()
    look.tidy(ax, r"$\eta/y_0$", "$(1 - P)/(1 - P_\\mathrm{min})$", title)


def _plane_of_groups(ax: Axes, title: str) -> None:
    ax.set_xscale("log")
    ax.set_yscale("log")
    beta0 = np.geomspace(*BETA0, 50)
    for ratio in RATIOS:
        label = r"limits of $\eta/y_0$" if ratio == RATIOS[0] else None
        ax.plot(beta0, ratio * beta0 ** (4.0 / 3.0), "k--", linewidth=0.8, label=label)
    ax.set_xlim(BETA0[0] / 1.5, BETA0[1] * 1.5)
    ax.set_ylim(BETA1[0] / 2.0, BETA1[1] * 2.0)
    look.tidy(ax, r"$\beta_0$", r"$\beta_1$", title)
    _legend_below(ax)


def _growth(ax: Axes, scan: Sequence[Compared]) -> None:
    """Show unknowns against beta1, beside the growth of what the thinnest layer would ask for."""
    for method in MESHES:
        colour, marker = METHOD_STYLES[method]
        found = [a for a in (place.by(method) for place in scan) if a.certified]
        if found:
            x, y = zip(*((a.beta1, a.unknowns) for a in found), strict=True)
            ax.plot(x, y, marker, color=colour, markersize=3.0, linestyle="none", label=method)
    ax.set_xscale("log")
    ax.set_yscale("log")
    beta1 = np.geomspace(math.pi**4, 1e11, 20)
    ax.plot(beta1, 28.0 * (beta1 / math.pi**4) ** 0.25, "k--", linewidth=0.8, label=r"$\propto\beta_1^{1/4}$")
    look.tidy(ax, r"$\beta_1$", "unknowns", "unknowns and layers")
    _legend_below(ax)


def _times(ax: Axes, scan: Sequence[Compared]) -> None:
    """Show the share of the questions each method has answered within a time."""
    for method in METHODS:
        ms = sorted(1e3 * a.seconds for a in (place.by(method) for place in scan) if a.certified)
        if ms:
            share = 100.0 * np.arange(1, len(ms) + 1) / len(scan)
            wide = 2.4 if method == "auto" else 1.2
            ax.step(ms, share, where="post", linewidth=wide, color=METHOD_STYLES[method][0], label=method)
    ax.set_xscale("log")
    ax.set_ylim(0.0, 104.0)
    look.tidy(ax, "one answer, branch known [ms]", "of the rods' questions answered [%]", "time")
    _legend_below(ax)


def _legend_below(ax: Axes) -> None:
    """Explain the marks where none of them can be covered."""
    look.legend(
        ax, loc="upper left", bbox_to_anchor=(-0.15, -0.2), ncol=2, columnspacing=0.8, handlelength=1.8
    )


def _logit(share: float) -> float:
    return math.log(share / (1.0 - share))
