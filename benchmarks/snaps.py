"""Time beside error of snaps whose orbits are known: ``python -m benchmarks.snaps``."""

from __future__ import annotations

import time

import numpy as np

import peel_opt as po

#: eta/y0, p/T0, mass and drag.
SNAPS = (
    (0.3, 0.9, 0.0, 1.0),
    (0.05, 0.97, 0.0, 1.0),
    (0.566, 0.4, 0.0, 1.0),
    (1.0, 0.3, 0.0, 1.0),
    (0.3, 0.9, 1.0, 0.0),
)


def main() -> None:
    """Print a line for each."""
    po.snap(po.Rod.from_ratio(0.4), 0.7, until=1.0)  # what is imported once
    print("eta/y0  p/T0   mass drag  CPU [s]  steps  error    time error  certificate  ledger   outcome")
    for r, P, mass, drag in SNAPS:
        began = time.process_time()
        snapped = po.snap(po.Rod.from_ratio(r), P, mass=mass, drag=drag, until="contact")
        spent = time.process_time() - began
        certificate, ledger = (np.abs(v).max() for v in (snapped.certificate, snapped.energy.defect))
        print(
            f"{r:<7g} {P:<6g} {mass:<4g} {drag:<5g} {spent:<8.2f} {len(snapped):<6} {snapped.error:<8.1e}"
            f" {snapped.time_error:<11.1e} {certificate:<12.1e} {ledger:<8.1e} {snapped.outcome}"
        )


if __name__ == "__main__":
    main()
