"""Meshes that follow a shape."""

from __future__ import annotations

import numpy as np

from ..model.equations import bending
from .discretisation import Profile

#: Points per phase on which a shape is looked at.
RESOLUTION = 257

#: What is left of the monitor where nothing bends; bounds how far a mesh may be stretched.
FLOOR = 1e-4

#: Breakpoints are multiples of this, so that a mesh can be told from its own rounding.
QUANTUM = 2.0**-30


def equidistributing(profile: Profile, phase: int, intervals: int) -> np.ndarray:
    """Breakpoints 0 < zeta < 1 of one phase that crowd where the shape changes fast.

    The monitor is Theta'', and its derivative where it changes sign.  Where a layer decays like
    exp(-k xi) all derivatives are proportional to these, and the power of the monitor decides how
    the mesh follows it.  Of the powers 1 to 1/8 the square root has the smallest errors, or nearly,
    in layers under law (8) and under the exponential law, at a factor of two or three for shapes
    that need no mesh.
    """
    zeta = np.linspace(0.0, 1.0, RESOLUTION)
    Theta, _, nx, ny, _ = profile.in_phase(phase, zeta).T
    curl = np.asarray(bending(Theta, nx, ny, profile.scalars)).ravel()
    change = np.gradient(curl, zeta)
    monitor = sum(np.abs(part) / (np.max(np.abs(part)) or 1.0) for part in (curl, change))
    density = np.sqrt(monitor + FLOOR)
    share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    return quantised(np.interp(np.arange(1, intervals) / intervals, share / share[-1], zeta))


def uniform(intervals: int) -> np.ndarray:
    """Breakpoints at equal distances."""
    return quantised(np.arange(1, intervals) / intervals)


def quantised(breaks: np.ndarray) -> np.ndarray:
    """Round to multiples of the quantum."""
    return np.round(breaks / QUANTUM) * QUANTUM
