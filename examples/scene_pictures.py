"""The pictures of the pages about scenes, each with the numbers that its page speaks of."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import save_figure

#: A flap of aortic media, and a transparent tape.
FLAP = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
TAPE = po.Rod(bending_stiffness=9.5e-6, adhesion_strength=0.5e6, adhesion_range=0.4e-3)

Numbers = dict[str, float]


def flaws(figure: Figure) -> Numbers:
    """An edge without glue of 0.5 mm: as it opens, and its pressure up to the snap."""
    left, right = figure.subplots(1, 2)
    po.length_given_pressure(po.Scene(FLAP, unbonded=0.5e-3), 50e3).plot(left)
    curve = po.loading_curve(FLAP, 0.5e-3)
    curve.plot(right)
    return {"snap": float(curve.pressure[-1])}


def pressure(figure: Figure) -> Numbers:
    """One length under a uniform pressure, and under one that falls towards the root."""
    found = {}
    for ax, c in zip(figure.subplots(1, 2), (0.0, -0.5), strict=True):
        scene = po.Scene(FLAP, [po.Pressure(po.profiles.linear(c) if c else None)])
        eq = po.solve(scene, free="pressure", length=2e-3, state="unfolded")
        eq.plot(ax)
        found[f"c = {c:g}"] = eq.pressure
    return found


def friction(figure: Figure) -> Numbers:
    """An edge without glue of 0.5 mm in a stream that drags on it, one way or the other."""
    left, right = figure.subplots(1, 2)
    found = {}
    lengths = np.linspace(0.501e-3, 1.5e-3, 18)
    for traction, words in ((0.0, "no friction"), (5e3, "5 kPa to the root"), (-5e3, "5 kPa to the tip")):
        scene = po.Scene(FLAP, [po.SkinFriction(traction=traction)], unbonded=0.5e-3)
        held = [po.pressure_given_length(scene, length).pressure for length in lengths]
        right.plot(1e3 * lengths, 1e-3 * np.array(held), label=words)
        eq = po.length_given_pressure(scene, 50e3)
        found[f"{traction:g}"] = eq.length
        if traction > 0.0:
            eq.plot(left)
    _label(right, r"front $\bar s$ [mm]", "pressure $p$ [kPa]")
    return found


def weight(figure: Figure) -> Numbers:
    """One pressure under a light rod, and under one that weighs a tenth of T0."""
    found = {}
    for ax, w in zip(figure.subplots(1, 2), (0.0, 14e3), strict=True):
        eq = po.length_given_pressure(po.Scene(FLAP, [po.Weight(w)]), 80e3)
        eq.plot(ax)
        found[f"w = {w:g}"] = eq.length
    return found


def peel(figure: Figure) -> Numbers:
    """The peel test at 90 and 150 degrees: the force against the arm, and the state at its peak."""
    left, right = figure.subplots(1, 2)
    lengths = np.concatenate([np.linspace(0.05, 1.0, 30), np.linspace(1.1, 3.0, 15)]) * 1e-3
    G, found = TAPE.work_of_separation, {}
    for degrees in (90.0, 150.0):
        phi = math.radians(degrees)
        scene = po.Scene(TAPE, tip=po.TipLoad(angle=phi))
        pulled = [po.solve(scene, free="force", length=length) for length in lengths]
        force = np.array([eq.numbers["force"] for eq in pulled])
        (drawn,) = right.plot(1e3 * lengths, force, label=rf"${degrees:.0f}^\circ$")
        right.axhline(G / (1.0 - math.cos(phi)), color=drawn.get_color(), linestyle=":", linewidth=1.2)
        found[f"peak at {degrees:.0f}"] = float(force.max())
        found[f"end at {degrees:.0f}"] = float(force[-1])
        if degrees == 90.0:
            pulled[int(force.argmax())].plot(left)
    _label(right, r"detached arm $\bar s$ [mm]", "peel force $F$ [N/m]")
    right.set_title(r"dotted: $G / (1 - \cos\varphi)$", fontsize=9, loc="left")
    return found


def walls(figure: Figure) -> Numbers:
    """One flap at one pressure outside a cylinder, and inside a vessel, of 3 mm radius."""
    found = {}
    for ax, kw in zip(figure.subplots(1, 2), (-1.0 / 3e-3, 1.0 / 3e-3), strict=True):
        eq = po.length_given_pressure(po.Scene(FLAP, wall=po.Circle(kw), natural_curvature=kw), 50e3)
        eq.plot(ax)
        found["outside" if kw < 0.0 else "inside"] = eq.length
    return found


def bonds(figure: Figure) -> Numbers:
    """A bond that pulls straight down, and one that resists sliding as much as opening."""
    found = {}
    for ax, zeta in zip(figure.subplots(1, 2), (0.0, 1.0), strict=True):
        eq = po.length_given_pressure(po.Scene(FLAP, law=po.EffectiveOpening(zeta)), 50e3)
        eq.plot(ax)
        found[f"zeta = {zeta:g}"] = eq.length
    return found


def blisters(figure: Figure) -> Numbers:
    """A strip with 0.05 mm of slack: at 50 kPa, and its pressure against its half width."""
    left, right = figure.subplots(1, 2)
    scene = po.Blister(FLAP, slack=0.05e-3)
    rest = po.solve(scene, free="length", pressure=0.0)
    po.solve(scene, free="length", pressure=50e3).plot(left)
    pressures = np.linspace(0.0, 70e3, 15)
    widths = [po.solve(scene, free="length", pressure=p).length for p in pressures]
    right.plot(1e3 * np.array(widths), 1e-3 * pressures, color="black")
    _label(right, r"half width $\bar s$ [mm]", "pressure $p$ [kPa]")
    return {"at rest": rest.length, "at 70 kPa": widths[-1]}


#: By the family that its page is about.
PICTURES: dict[str, Callable[[Figure], Numbers]] = {
    made.__name__: made for made in (flaws, pressure, friction, weight, peel, walls, bonds, blisters)
}


def _label(ax: Axes, across: str, up: str) -> None:
    ax.set(xlabel=across, ylabel=up)
    ax.spines[["top", "right"]].set_visible(False)
    if ax.get_legend_handles_labels()[1]:
        ax.legend(frameon=False, fontsize=9)


def main(out: Path | None = None, names: tuple[str, ...] = tuple(PICTURES)) -> dict[str, Numbers]:
    """Return the numbers of some pictures; with ``out``, write them there."""
    found = {}
    for name in names:
        figure = Figure(figsize=(10.4, 4.4), layout="constrained")
        found[name] = PICTURES[name](figure)
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            save_figure(figure, out / f"scene_{name}.png", dpi=85)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(PICTURES), help=f"of {', '.join(PICTURES)}")
    parser.add_argument("--out", type=Path, help="write the pictures to this folder")
    arguments = parser.parse_args()
    for name, numbers in main(arguments.out, tuple(arguments.names)).items():
        print(name, numbers)
