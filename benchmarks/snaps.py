"""Time beside error of snaps: ``python -m benchmarks.snaps`` prints the table of docs/motion.md."""

from __future__ import annotations

import time

import numpy as np

import peel_opt as po

#: eta/y0, p/T0, mass, drag, and until when: before contact, and through it to rest.
SNAPS = (
    (0.3, 0.9, 0.0, 1.0, "arrest"),
    (0.05, 0.97, 0.0, 1.0, "arrest"),
    (0.566, 0.4, 0.0, 1.0, "arrest"),
    (1.0, 0.3, 0.0, 1.0, "arrest"),
    (0.3, 0.9, 1.0, 0.0, "contact"),
    (0.5, 0.5, 0.0, 1.0, "arrest"),
    (0.4, 0.99, 0.0, 1.0, "arrest"),
    (0.566, 0.9, 0.0, 1.0, "arrest"),
    (1.0, 0.5, 0.0, 1.0, "arrest"),
    (1.0, 0.99, 0.0, 1.0, "arrest"),
    (2.0, 0.5, 0.0, 1.0, "arrest"),
    (2.0, 0.9, 0.0, 1.0, "arrest"),
    (2.0, 0.99, 0.0, 1.0, "arrest"),
    (25.0, 0.73, 0.0, 1.0, "arrest"),
)


def main() -> None:
    """Print a line for each."""
    po.snap(po.Rod.from_ratio(0.4), 0.7, until=1.0)  # what is imported once
    print("eta/y0  p/T0   mass drag  CPU [s]  steps  error    time error  certificate  ledger   outcome")
    for r, P, mass, drag, until in SNAPS:
        began = time.process_time()
        snapped = po.snap(po.Rod.from_ratio(r), P, mass=mass, drag=drag, until=until)
        spent = time.process_time() - began
        certificate, ledger = (np.abs(v).max() for v in (snapped.certificate, snapped.energy.defect))
        print(
            f"{r:<7g} {P:<6g} {mass:<4g} {drag:<5g} {spent:<8.2f} {len(snapped):<6} {snapped.error:<8.1e}"
            f" {snapped.time_error:<11.1e} {certificate:<12.1e} {ledger:<8.1e} {snapped.outcome}"
        )


if __name__ == "__main__":
    main()
