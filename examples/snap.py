"""After the snap: a flap of an artery and a beam of polysilicon, from where they let go to where it ends.

``python examples/snap.py --out snaps`` writes pictures and films.  What resists is an estimate, and it sets
the time: the blood that moves along with the flap and is squeezed under it, and the film of air under the
beam.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import peel_opt as po

#: Media of an aorta, circumferential, and a beam of polysilicon 2 um thick: k [N m], T0 [Pa], y0 [m].
FLAP = po.Rod(2.2867e-5, 140.1e3, 0.72805e-3)
BEAM = po.Rod(1.12092e-7, 890e3, 20e-9)

#: Pressure held [Pa], mass per area [kg/m^2], drag [Pa s/m], length of the rod [m].
ASKED: dict[str, tuple[po.Rod, dict[str, Any]]] = {
    "flap at 300 mmHg": (FLAP, {"pressure": 39996.7, "mass": 2.7, "drag": 2e4}),
    "beam at 1 bar": (BEAM, {"pressure": 1e5, "drag": 1.3e5, "rod_length": 150e-6}),
}


def main() -> dict[str, po.Snap]:
    """Return the two motions."""
    return {name: po.snap(rod, **asked) for name, (rod, asked) in ASKED.items()}


def draw(motions: dict[str, po.Snap], folder: Path) -> None:
    """Write four pictures of each motion, and a film."""
    from matplotlib.figure import Figure

    from peel_opt.plots import plot_ledger, plot_orbit, plot_shapes, save_figure

    folder.mkdir(parents=True, exist_ok=True)
    for name, motion in motions.items():
        figure = Figure(figsize=(10.0, 7.2), layout="constrained")
        shapes, front, ledger, orbit = figure.subplots(2, 2).ravel()
        plot_shapes(motion, shapes)
        motion.plot(front)
        plot_ledger(motion, ledger)
        plot_orbit(motion, po.trace(motion.rod), orbit)
        stem = name.replace(" ", "_")
        save_figure(figure, folder / f"{stem}.png", dpi=100.0)
        motion.film(folder / f"{stem}.gif")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="folder for pictures and films")
    folder = parser.parse_args().out
    motions = main()
    for name, motion in motions.items():
        print(f"{name}: {motion}")
    if folder is not None:
        draw(motions, folder)
