"""Meshes that follow a shape."""

from __future__ import annotations

import math

import numpy as np

#: Points per phase on which a shape is looked at.
RESOLUTION = 257

#: What is left of the monitor where nothing bends; bounds how far a mesh may be stretched.
FLOOR = 1e-4

#: Standard deviation, in mean intervals, of the weights with which the monitor is averaged.
SMOOTHED = 0.5

#: Breakpoints are multiples of this, so that a mesh can be told from its own rounding.
QUANTUM = 2.0**-30


def equidistributing(curl: np.ndarray, intervals: int) -> np.ndarray:
    """Breakpoints 0 < zeta < 1 of one phase that crowd where the shape changes fast.

    The monitor is Theta'', and its derivative where it changes sign.  Where a layer decays like
    exp(-k xi) all derivatives are proportional to these, and the power of the monitor decides how
    the mesh follows it.  Of the powers 1 to 1/8 the square root has the smallest errors, or nearly,
    in layers under law (8) and under the exponential law, at a factor of two or three for shapes
    that need no mesh.

    Where Theta'' and its derivative change sign the monitor has cusps, narrower than an interval, which
    interval they fall into changes with the number of intervals, and the error with it by factors of a
    hundred.  So the monitor is averaged over about an interval.  Averaged more, the mesh no longer
    follows thin layers.

    Parameters
    ----------
    curl : ndarray
        Theta'' of the phase at equal distances, both ends included.
    intervals : int
    """
    zeta = np.linspace(0.0, 1.0, len(curl))
    change = np.gradient(curl, zeta)
    monitor = sum(np.abs(part) / (np.max(np.abs(part)) or 1.0) for part in (curl, change))
    density = np.sqrt(_averaged(monitor, SMOOTHED * (len(curl) - 1) / intervals) + FLOOR)
    share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return quantised(np.interp(np.arange(1, intervals) / intervals, share / share[-1], zeta))


def _averaged(values: np.ndarray, width: float) -> np.ndarray:
    """Average over neighbours with normal weights of this width in points, mirrored at the ends."""
    reach = math.ceil(3.0 * width)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    return np.convolve(np.pad(values, reach, mode="reflect"), weights / weights.sum(), mode="valid")


def uniform(intervals: int) -> np.ndarray:
    """Breakpoints at equal distances."""
    return quantised(np.arange(1, intervals) / intervals)


def quantised(breaks: np.ndarray) -> np.ndarray:
    """Round to multiples of the quantum."""
    return np.round(breaks / QUANTUM) * QUANTUM
