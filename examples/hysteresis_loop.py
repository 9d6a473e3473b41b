"""Hysteresis: solved states against the normal form at beta0 = 4, and a rod under a pressure.

Usage: python examples/hysteresis_loop.py [PICTURE]
"""

import sys

from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import picture_file, save_figure
from peel_opt.plots.potential import plot_potential


def main(picture: str | None = None) -> dict[str, float]:
    """Return jumps and areas, and draw the loops if ``picture`` names a file."""
    if picture is not None:
        picture_file(picture)
    solved = po.hysteresis(beta0=4.0)
    paper = po.hysteresis(beta0=4.0, form=po.NormalForm.paper())
    fitted = po.hysteresis(beta0=4.0, form=po.NormalForm.fit(po.trace(beta0=4.0, lam=(-1.0, 3.0))))
    maxwell = po.hysteresis(beta0=4.0, convention="maxwell")
    rod = po.hysteresis(po.Rod.from_ratio(1.0))
    if picture is not None:
        figure = Figure(figsize=(13.0, 4.2), layout="constrained")
        panels = figure.subplots(1, 3)
        plot_potential(po.NormalForm.paper().at(4.0), ax=panels[0])
        solved.plot(panels[1])
        panels[1].plot(paper.down.lam, paper.down.alpha1, ":", color="0.2", label="normal form of the paper")
        panels[1].legend(frameon=False, fontsize=9, loc="lower left")
        rod.plot(panels[2])
        save_figure(figure, picture, dpi=100)
    return {
        "lands at": solved.jumps[0].alpha1_after,
        "leaves at": solved.jumps[1].lam,
        "Maxwell point": maxwell.jumps[0].lam,
        "area": solved.area,
        "area, paper": paper.area,
        "area, fit": fitted.area,
        "least p/T0": rod.jumps[1].pressure,
        "area in T0 eta": rod.area,
    }


if __name__ == "__main__":
    for name, value in main(*sys.argv[1:2]).items():
        print(f"{name:15s} {value:14.9f}")
