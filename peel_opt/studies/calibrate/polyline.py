"""The place of a polyline that is nearest to a point."""

from __future__ import annotations

import numpy as np


def nearest(
    points: np.ndarray, begin: np.ndarray, step: np.ndarray, unit: float | np.ndarray = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nearest of some lines to each point, where on it that is, and how far.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
    begin, step : ndarray, shape (lines, 2)
        Where each line begins, and from there to its end.
    unit : float or ndarray, shape (n, 2)
        By which distances from each point are multiplied; 0 for a coordinate that does not count.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Number of the line, share of the way along it, and distance; infinite without lines.
    """
    if not len(begin):
        return np.zeros(len(points), int), np.zeros(len(points)), np.full(len(points), np.inf)
    unit = np.broadcast_to(unit, points.shape)[:, None]
    away, along = (points[:, None] - begin) * unit, step * unit
    share = (away * along).sum(axis=2) / np.maximum((along**2).sum(axis=2), 1e-300)
    share = np.clip(share, 0.0, 1.0)
    gaps = np.linalg.norm(away - share[..., None] * along, axis=2)
    line, rows = np.argmin(gaps, axis=1), np.arange(len(points))
    return line, share[rows, line], gaps[rows, line]
