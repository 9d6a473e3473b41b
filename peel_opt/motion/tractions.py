"""What a bond holds along a phase, for arrays of heights: traction, its slope and the work of separation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from ..base.quadrature import gauss
from ..model.bond import Affine, Piece

#: Gauss points for the work of separation of a law of a user's own, within one of its pieces.
POINTS = 24


class Held(NamedTuple):
    """Traction tau, its derivative by u = y/y0 and the work of separation over T0 y0, at given u."""

    traction: np.ndarray
    slope: np.ndarray
    work: np.ndarray


@dataclass(frozen=True)
class Traction:
    """One smooth stretch of a law."""

    piece: Piece

    def __call__(self, u: np.ndarray) -> Held:
        """Return what is held at heights u = y/y0."""
        piece = self.piece
        assert piece.lost is not None
        start, lost = (0.0, 0.0) if piece.is_first else (piece.start, piece.lost)
        if isinstance(piece.drop, Affine):
            offset, slope = piece.drop.offset, piece.drop.slope
            gone = lost + (u - start) * (offset + 0.5 * slope * (u + start))
        else:
            nodes, weights = gauss(POINTS)
            inside = _compiled(piece)(_row(start + np.multiply.outer(u - start, nodes)))[0].full()
            gone = lost + (u - start) * (inside.reshape(*np.shape(u), POINTS) @ weights)
        return Held(*self.pull(u), u - gone)

    def pull(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return traction and slope alone."""
        drop = self.piece.drop
        if isinstance(drop, Affine):
            return 1.0 - drop.offset - drop.slope * u, np.full(np.shape(u), -drop.slope)
        values, slopes = (part.full().reshape(np.shape(u)) for part in _compiled(self.piece)(_row(u)))
        return 1.0 - values, -slopes


def _row(u: np.ndarray) -> ca.DM:
    return ca.DM(np.reshape(u, (1, -1)))


@lru_cache(maxsize=64)
def _compiled(piece: Piece) -> ca.Function:
    """Drop and slope of a piece, of one height or of a row of them."""
    u = ca.SX.sym("u")
    drop = ca.SX(piece.drop(u))
    return ca.Function("drop", [u], [drop, ca.jacobian(drop, u)])


#: What holds rod that was never glued.
NOTHING = Traction(Piece(-math.inf, math.inf, Affine(1.0, 0.0)))
