"""Charts of held lengths in SI units for every material card: which flap is in equilibrium at a pressure."""

from __future__ import annotations

import argparse
from pathlib import Path

import peel_opt as po
from peel_opt.app.any_card import load_any
from peel_opt.app.cards import Card, load_card
from peel_opt.plots import plot_held_lengths, save_figure

CARDS = Path(__file__).parent.parent / "problems"


def limits() -> dict[str, tuple[float, float]]:
    """Pressures [Pa] of each material between which a detached equilibrium exists."""
    found = {}
    for path in sorted(CARDS.glob("*.toml")):
        card = load_any(path)
        # Calibrations have no rod yet, and what acts in a scene is not in the chart.
        rod = card.rod() if isinstance(card, Card) and card.scene_table is None else None
        if rod is not None and not rod.dimensionless:
            found[path.stem] = (po.readhesion_pressure(rod).pressure, rod.adhesion_strength)
    return found


def main(out: Path | None = None) -> dict[str, tuple[float, float]]:
    """Return the limits; with ``out``, write a chart of each material there."""
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    found = limits()
    for name in found if out is not None else ():
        assert out is not None
        rod = load_card(CARDS / f"{name}.toml").rod()
        branch = po.trace(rod, points=48, tol=1e-7)
        out.mkdir(parents=True, exist_ok=True)
        save_figure(plot_held_lengths(branch).figure, out / f"{name}.png")
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="write the charts to this folder")
    for name, (low, high) in main(parser.parse_args().out).items():
        print(f"{name:<16} equilibria from {low:12.6g} Pa to {high:12.6g} Pa, where the bond fails")
