"""Time of a fit and of its intervals against the number of observations.

Run from the root of the repository::

    OMP_NUM_THREADS=1 python -m benchmarks.calibration
"""

from __future__ import annotations

import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np

import peel_opt as po

TRUTH = po.Rod(2.3e-5, 140e3, 0.73e-3)
START = po.Rod(2.3e-5, 110e3, 1e-3)


def data(count: int, seed: int = 0) -> po.Measurements:
    """Pairs with one percent of noise in both."""
    rng = np.random.default_rng(seed)
    p = np.linspace(0.23, 0.95, count) * TRUTH.adhesion_strength
    length = np.array([po.length_given_pressure(TRUTH, v).length for v in p])
    noise = 1.0 + 0.01 * rng.standard_normal((2, count))
    return po.Measurements(noise[0] * length, noise[1] * p, length_sd=0.01 * length, pressure_sd=0.01 * p)


def main() -> None:
    """Print the table: first fit of a process, the next one, two intervals; processor time alone."""
    print("observations  first [s]  again [s]  intervals [s]  rods tried")
    for count in (10, 30, 100, 1000):
        taken, measured = [], data(count)
        for _ in range(2):
            began = time.process_time()
            fit = po.calibrate(measured, free=["adhesion_strength", "adhesion_range"], rod=START)
            taken.append(time.process_time() - began)
        began = time.process_time()
        for name in fit.free:
            fit.interval(name)
        intervals = time.process_time() - began
        print(f"{count:12d}  {taken[0]:9.2f}  {taken[1]:9.2f}  {intervals:13.2f}  {fit.iterations:10d}")


if __name__ == "__main__":
    main()
