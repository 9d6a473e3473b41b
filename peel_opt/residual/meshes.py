"""The meshes that are not the caller's: one table, with the reason for each.

A law of one piece is smooth along the rod, so that the error of n nodes falls faster than any power
of n; a law with kinks cuts the rod into phases, each with as many nodes.  What a caller asks for is
refined until it is as accurate as wanted, whatever mesh it starts on.
"""

from __future__ import annotations

from ..model.hierarchy import NODES
from .spectral import Spectral

#: Walks that answers are looked up on: folds to some 1e-11 of p/T0, in a third of the time of 24 nodes.
PATH = Spectral(nodes=16)

#: Single answers from seeds, which are of states on that mesh: what the bond has let go needs no nodes.
SEEDED = Spectral(nodes=16, free_arc=True)

#: That of the shapes that the series sums.
SUMMED = Spectral(nodes=NODES)

#: Curves at fixed beta0 under the linear law, their folds and Maxwell points: to rounding for beta0 up
#: to 100 (24 and 36 nodes agree to 1e-12).
GROUPS = Spectral(nodes=24)

#: Curves followed from a given state, of any law: kinks and short phases do not stop them.
FOLLOWED = Spectral(nodes=24)

#: States off the primary branch, whose shapes are longer than those on it: on this the starts of a grid
#: are corrected and walked from.
SEARCHED = Spectral(nodes=24)

#: On these those of a scan are corrected in turn, until one leads to the state that the start shows.
SCANNED = (Spectral(), SEARCHED, Spectral(nodes=24, elements=3))

#: Folds of a rod that are numbers themselves, such as its least pressure: the difference is the error.
AT_FOLDS = (Spectral(nodes=20), Spectral(nodes=30))

#: Traced curves, tried in turn until some points of the walk are accurate to a share of ``tol``: for
#: laws of one piece, where a finer mesh costs little and what is read off a branch (folds, areas) gains
#: by it; and for laws with kinks, whose shapes have up to three phases.
TRACED = (
    tuple(Spectral(nodes) for nodes in (12, 16, 24, 36, 54)),
    tuple(Spectral(nodes) for nodes in (24, 36, 54)),
)

#: States that come from a mesh with an order, solved again on one without: their motions and energies.
FINER = Spectral(nodes=32)

#: The reference of a comparison of methods: three times the nodes the spectral one starts with.
REFERENCE = Spectral(nodes=54)

#: Branches of scenes that answers are looked up on, and the first of those an answer is solved on.
SCENES = Spectral(nodes=16)

#: Traced branches of scenes, tried in turn until all points are accurate to ``tol``.
SCENES_TRACED = tuple(Spectral(nodes) for nodes in (16, 24, 36, 54))

#: Snaps of edges without glue: the difference is the error.
SNAPS = (Spectral(nodes=16), Spectral(nodes=24))

#: Fits, refined until the states of a row move by a small share of its standard deviation.
FITTED = tuple(Spectral(nodes) for nodes in (16, 24, 36, 54))

#: Pictures of the explorer in its two coarse accuracies, and of any accuracy while a slider moves.
SKETCH, DRAFT, MOVING = Spectral(nodes=6), Spectral(nodes=8), Spectral(nodes=14)
