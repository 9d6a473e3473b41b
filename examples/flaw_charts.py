"""Charts of flaws in SI units for every material card: the pressure at which an edge without glue snaps."""

from __future__ import annotations

import argparse
from pathlib import Path

import peel_opt as po
from peel_opt.app.any_card import load_any
from peel_opt.app.cards import Card
from peel_opt.app.flaw_report import CHARTED, limits_of
from peel_opt.plots import plot_safe_pressures, save_figure

CARDS = Path(__file__).parent.parent / "problems"


def main(
    out: Path | None = None, flaws: tuple[float, ...] = CHARTED, cards: str = "*"
) -> dict[str, list[po.FlawLimit]]:
    """Return the limits of each material; with ``out``, write a chart of each that has two there."""
    found = {}
    for path in sorted(CARDS.glob(f"{cards}.toml")):
        card = load_any(path)
        # Calibrations have no rod yet, and what acts in a scene is not in the chart.
        rod = card.rod() if isinstance(card, Card) and card.scene_table is None else None
        if rod is None or rod.dimensionless:
            continue
        found[path.stem] = limits_of(rod, flaws)
        if out is not None and len(found[path.stem]) > 1:
            out.mkdir(parents=True, exist_ok=True)
            save_figure(plot_safe_pressures(rod, found[path.stem]).figure, out / f"{path.stem}.png")
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="write the charts to this folder")
    for name, limits in main(parser.parse_args().out).items():
        longest = limits[-1]
        print(f"{name:<16} an edge without glue on {longest.flaw:.3g} m snaps at {longest.pressure:.6g} Pa")
