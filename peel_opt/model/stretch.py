"""Stretches of the rod between two switches, on each of which everything is smooth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from .bond import Piece


@dataclass(frozen=True)
class Stretch(Piece):
    """A piece of the law on rod that is past some material points, such as the end of an unbonded edge."""

    past: frozenset[str] = frozenset()

    @classmethod
    def of(cls, piece: Piece, past: frozenset[str]) -> Self:
        """Return a piece past some points."""
        return cls(piece.start, piece.stop, piece.drop, piece.lost, past=past)


def past_of(piece: Piece) -> frozenset[str]:
    """Return the material points that lie nearer to the tip."""
    return piece.past if isinstance(piece, Stretch) else frozenset()


def shared_kink(before: Piece, after: Piece) -> float:
    """Return the kink where two neighbouring pieces of a law meet."""
    return before.start if before.start == after.stop else before.stop
