"""Fig 10a of the paper: the rod at beta0 = 53.16, beta1 = 113.1 under the linear law.

Usage: python examples/paper_fig10a.py [PICTURE]
"""

import sys

import peel_opt as po
from peel_opt.plots import picture_file, plot_equilibrium, save_figure


def main(picture: str | None = None) -> po.Equilibrium:
    """Return the equilibrium, and draw it if ``picture`` names a file."""
    if picture is not None:
        picture_file(picture)
    eq = po.equilibrium(beta0=53.16, beta1=113.1)
    if picture is not None:
        save_figure(plot_equilibrium(eq).figure, picture)
    return eq


if __name__ == "__main__":
    found = main(*sys.argv[1:2])
    print(f"alpha = {found.alpha:.8f}, error {found.error:.0e}")  # the paper: 14.86
    print(f"tip at {found.tip_height * found.beta1 / found.beta0:.4f} y0; flags: {', '.join(found.flags)}")
