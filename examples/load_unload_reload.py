"""A rod is loaded, unloaded and loaded again, with a bond that heals and with one that does not.

Usage: python examples/load_unload_reload.py [PICTURE]
"""

import sys

from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import picture_file, save_figure

#: A snap at p/T0 = 0.5, unloading to 0.06, a rest, loading to 0.8, in c eta/T0.
LOAD = [0.0, 60.0, 420.0, 520.0, 900.0], [0.5, 0.5, 0.06, 0.06, 0.8]


def main(picture: str | None = None) -> dict[str, float]:
    """Return lengths over eta and energies over T0 eta^2, and draw the loops if ``picture`` names a file."""
    if picture is not None:
        picture_file(picture)
    rod = po.Rod.from_ratio(1.0)
    heals = po.history(rod, pressure=LOAD)
    damaged = po.history(rod, pressure=LOAD, bond="damage")
    if picture is not None:
        figure = Figure(figsize=(11.0, 4.4), layout="constrained")
        loops, spent = figure.subplots(1, 2)
        branch = po.trace(rod, points=60, tol=1e-6)
        equilibria = branch.length_ratio, branch.pressure_ratio
        loops.plot(*equilibria, color="0.7", label="equilibria, bond that heals")
        pressures = [0.125 + 0.0125 * i for i in range(55)]
        grown = [po.grown_flap(rod, p).length for p in pressures]
        loops.plot(grown, pressures, ":", color="0.2", label="growing flap, no healing")
        for run, colour, label in ((heals, "C0", "heals"), (damaged, "C3", "does not heal")):
            loops.plot(run.front, run.pressure, color=colour, label=label)
            spent.plot(run.t, run.dissipated, color=colour, label=label)
        loops.set(xlabel=r"detached length $\bar{s}/\eta$", ylabel="pressure $p/T_0$")
        loops.set(xlim=(2.0, 6.0), ylim=(0.0, 1.0))
        spent.set(xlabel=r"time [$c\,\eta/T_0$]", ylabel=r"dissipated energy [$T_0\eta^2$]")
        # No corner of the loops is free of curves.
        loops.legend(frameon=False, fontsize=9, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
        spent.legend(frameon=False, fontsize=9)
        save_figure(figure, picture, dpi=100)
    return {
        "stops at": float(damaged.front[damaged.t < LOAD[0][1]][-1]),
        "after unloading": float(damaged.front[damaged.t < LOAD[0][3]][-1]),
        "after loading again": float(damaged.front[-1]),
        "longest flap": po.largest_flap(rod).length,
        "heals below": float(heals.pressure[-1]),
        "dissipated": float(damaged.dissipated[-1]),
    }


if __name__ == "__main__":
    for name, value in main(*sys.argv[1:2]).items():
        print(f"{name:20s} {value:12.6f}")
