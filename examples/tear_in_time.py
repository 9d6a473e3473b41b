"""A tear in an aorta is loaded slowly beyond what it holds, snaps, and is let down again.

Usage: python examples/tear_in_time.py [PICTURE]

The edge is that of problems/aortic_tear.toml, 0.5 mm that nothing holds.  Times are in c eta/T0: the drag of
blood and tissue is known to orders of magnitude only.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import picture_file, plot_history, plot_shapes, plot_spent, save_figure

CARD = Path(__file__).parents[1] / "problems" / "aortic_tear.toml"

#: Up to 70 kPa, 525 mmHg, and down again, in c eta/T0 and Pa.
LOAD = [0.0, 800.0, 850.0, 1650.0], [0.0, 70e3, 70e3, 0.0]

#: Detached length [m] between those before and after the snap.
BETWEEN = 2.0e-3


def main(picture: str | None = None) -> dict[str, float]:
    """Return pressures [Pa], lengths [m] and energies [J/m], and draw all if ``picture`` names a file."""
    if picture is not None:
        picture_file(picture)
    tear = po.load_card(CARD).scene()
    assert tear is not None
    limit = po.safe_pressure(tear.rod, tear.unbonded)
    heals = po.history(tear, pressure=LOAD)
    torn = po.history(tear, pressure=LOAD, bond="damage")
    snapped = po.snap(tear, 1.02 * limit.pressure)
    if picture is not None:
        draw(tear, heals, torn, snapped, picture)
    open_ = np.flatnonzero(heals.front > BETWEEN)
    top = (heals.t > LOAD[0][1]) & (heals.t < LOAD[0][2])
    return {
        "holds up to": limit.pressure,
        "snaps at": float(heals.pressure[open_[0]]),
        "length before": limit.length,
        "length after": float(snapped.front[-1]),
        "at 70 kPa": float(heals.front[top][-1]),
        "comes back at": float(heals.pressure[open_[-1]]),
        "dissipated": float(heals.dissipated[-1]),
        "torn": float(torn.front[-1]),
        "dissipated, torn": float(torn.dissipated[-1]),
        "of which bond": float(np.ptp(torn.energy.bond_loss)),
    }


def draw(tear: po.Scene, heals: po.History, torn: po.History, snapped: po.Snap, picture: str) -> None:
    """Draw both paths over the equilibria of the tear, the shapes of its snap, and what was dissipated."""
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    paths, after, shapes, spent = figure.subplots(2, 2).ravel()
    branch = po.trace(tear, points=80, tol=1e-6)
    for run, ax in ((heals, paths), (torn, after)):
        plot_history(run, ax, branch=branch)
        ax.set(xlim=(0.0, 75.0), ylim=(0.0, 3.5))
    plot_shapes(snapped, shapes, count=5)
    plot_spent(torn, spent)
    save_figure(figure, picture, dpi=100)


if __name__ == "__main__":
    for name, value in main(*sys.argv[1:2]).items():
        print(f"{name:20s} {value:12.6g}")
