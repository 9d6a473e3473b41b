"""Fold and Maxwell point: normal forms against traced branches, and what more orders bring.

Usage: python examples/normal_form_errors.py [PICTURE]
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.model.series import uniform_series
from peel_opt.plots import picture_file, save_figure

BETA0 = (1.0, 2.0, 4.0, 10.0, 20.0)
ORDERS = (1, 2, 3, 6, 12, 24, 40)
WIDE = (1.0, 2.0, 4.0, 7.0, 10.0, 14.0, 20.0, 25.0, 30.0, 33.0, 36.0)

Points = dict[str, tuple[float, float]]


def fold_and_maxwell(beta0: float) -> Points:
    """Return (lambda_F, lambda_M) of the traced branch, of exact(), uniform(12) and paper()."""
    branch = po.trace(beta0=beta0, lam=(-97.0, 0.002 * beta0**2), points=256)
    found = {"branch": (branch.special("LP-lambda")[0].lam, po.branch_potential(branch).maxwell()[0])}
    forms = (po.NormalForm.paper(), po.NormalForm.exact(), po.NormalForm.uniform(12))
    return found | {form.kind: (form.fold(beta0)[0], form.maxwell(beta0)[0]) for form in forms}


def series_errors() -> np.ndarray:
    """Return abs(error) of lambda at the extra pressure of the fold, by order and beta0."""
    mesh = po.Spectral(nodes=24)  # the series has more digits than a branch needs by default
    traces = [po.trace(beta0=b, lam=(-97.0, 0.002 * b * b), transcription=mesh) for b in WIDE]
    folds = [branch.special("LP-lambda")[0] for branch in traces]
    return np.array(
        [[abs(float(uniform_series(n).curve(f.alpha1, f.beta0)) - f.lam) for f in folds] for n in ORDERS]
    )


def main(picture: str | None = None) -> tuple[dict[float, Points], np.ndarray]:
    """Return the table and the errors of the series, and draw the latter."""
    if picture is not None:
        picture_file(picture)
    table, errors = {beta0: fold_and_maxwell(beta0) for beta0 in BETA0}, series_errors()
    if picture is not None:
        figure = Figure(figsize=(6.4, 4.4), layout="constrained")
        ax = figure.subplots()
        for order, row in zip(ORDERS, errors, strict=True):
            ax.loglog(WIDE, np.maximum(row, 1e-16), "o-", markersize=4, label=f"order {order}")
        ax.set_xlabel(r"$\beta_0$")
        ax.set_ylabel(r"error of $\lambda$ at the fold")
        ax.spines[["top", "right"]].set_visible(False)
        ax.legend(frameon=False, fontsize=9)
        save_figure(figure, picture, dpi=100)
    return table, errors


if __name__ == "__main__":
    found, errors = main(*sys.argv[1:2])
    print("| beta0 | lambda_F | exact | uniform | lambda_M | exact | uniform |")
    print("|---|---|---|---|---|---|---|")
    for beta0, row in found.items():
        fold, maxwell = row["branch"]
        cells = [f"{beta0:g}", f"{fold:.9f}", *(f"{row[k][0] - fold:+.1e}" for k in ("exact", "uniform"))]
        cells += [f"{maxwell:.9f}", *(f"{row[k][1] - maxwell:+.1e}" for k in ("exact", "uniform"))]
        print(f"| {' | '.join(cells)} |")
    print("\n| order | " + " | ".join(f"{b:g}" for b in WIDE) + " |\n|" + "---|" * (len(WIDE) + 1))
    for order, row in zip(ORDERS, errors, strict=True):
        print(f"| {order} | " + " | ".join(f"{e:.0e}" for e in row) + " |")
