"""Strength and range of a bond from measured pressures and lengths, with errors in both.

Usage: python examples/calibrate_flap.py [PICTURE]
"""

import sys
from pathlib import Path

import peel_opt as po
from peel_opt.plots import picture_file, save_figure

DATA = Path(__file__).parents[1] / "problems" / "calibrate_flap.csv"


def main(picture: str | None = None) -> dict[str, float]:
    """Return the fitted numbers, and draw the fit if ``picture`` names a file."""
    if picture is not None:
        picture_file(picture)
    data = po.read_measurements(DATA)
    fit = po.calibrate(data, free=["adhesion_strength", "adhesion_range"], rod={"bending_stiffness": 23e-6})
    if picture is not None:
        from peel_opt.plots.fit import fit_figure

        save_figure(fit_figure(fit), picture, dpi=110)
    return {
        "T0 [kPa]": 1e-3 * fit.rod.adhesion_strength,
        "T0, sd [kPa]": 1e-3 * fit.sd["adhesion_strength"],
        "y0 [mm]": 1e3 * fit.rod.adhesion_range,
        "y0, sd [mm]": 1e3 * fit.sd["adhesion_range"],
        "chi-square": fit.chi2,
    }


if __name__ == "__main__":
    for name, value in main(*sys.argv[1:2]).items():
        print(f"{name:14s} {value:10.5f}")
