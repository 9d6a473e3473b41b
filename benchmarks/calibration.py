"""Time of a fit against the number of observations, and what the exact Hessian costs.

Run from the root of the repository::

    OMP_NUM_THREADS=1 python -m benchmarks.calibration
"""

from __future__ import annotations

import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from peel_opt.calibration_programme import Solver

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
    """Print the table: first fit of a process, the next one, and processor time alone."""
    print("observations  hessian       first [s]  again [s]  iterations")
    for count in (10, 30, 100):
        for exact in (False, True):
            taken = []
            for seed in (0, 0, 0):
                measured = data(count, seed)
                began = time.process_time()
                fit = po.calibrate(
                    measured,
                    free=["adhesion_strength", "adhesion_range"],
                    rod=START,
                    solver=Solver(exact_hessian=exact),
                )
                taken.append(time.process_time() - began)
            name = "exact" if exact else "Gauss-Newton"
            print(f"{count:12d}  {name:12s}  {taken[0]:9.2f}  {min(taken[1:]):9.2f}  {fit.iterations:10d}")


if __name__ == "__main__":
    main()
