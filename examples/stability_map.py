"""Map of stability at fixed pressure: every state of every rod, by eta/y0 and tip angle."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import picture_file, save_figure

KINDS = {
    "index 1": ("#D55E00", "falls away (index 1)"),
    "stable": ("#0072B2", "stable"),
    "flutter": ("#CC79A7", "flutters, drag stabilises"),
    "flutter even under drag": ("#A3327C", "flutters even under drag"),
    "index 2": ("#7A3B00", "falls away (index 2)"),
}


def spans(ratio: float, points: int) -> list[tuple[str, float, float]]:
    """Kinds of stability along one rod's branch, with the tip angles between which they hold."""
    branch = po.trace(po.Rod.from_ratio(ratio), points=points, tol=1e-7)
    found, start = [], 0.0
    changes = po.stability_changes(branch)
    for change in changes:
        found.append((change.before, start, change.tip_angles[0]))
        start = change.tip_angles[1]
    last = changes[-1].after if changes else "stable"
    return [*found, (last, start, float(branch.tip_angle[-1]))]


def main(ratios: np.ndarray | None = None, points: int = 40, out: Path | None = None) -> dict[float, list]:
    """Return the spans of each ratio; with ``out``, draw them."""
    if out is not None:
        picture_file(out)
    ratios = np.geomspace(0.05, 20.0, 49) if ratios is None else ratios
    found = {float(ratio): spans(float(ratio), points) for ratio in ratios}
    if out is not None:
        ax = Figure(figsize=(7.0, 4.2), layout="constrained").add_subplot()
        half = 0.5 * np.log(ratios[1] / ratios[0])
        for ratio, rows in found.items():
            for kind, top, bottom in rows:
                colour, label = KINDS.get(kind, ("#555555", "index and flutter together"))
                edges = (ratio * np.exp(-half), ratio * np.exp(half))
                ax.fill_between(edges, bottom, top, color=colour, linewidth=0, label=label)
        ax.set(xscale="log", xlabel=r"$\eta/y_0$", ylabel=r"tip angle $\theta(0)$ [rad]", ylim=(-4.25, 0.0))
        ax.set_xlim(ratios[0], ratios[-1])
        handles, labels = ax.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        ax.figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=3, fontsize=9)
        save_figure(ax.figure, out)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("stability_map.png"))
    out = parser.parse_args().out
    main(out=out)
    print(f"wrote {out}")
