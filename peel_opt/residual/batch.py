"""Newton for a stack of states, and how far each of them is to be trusted.

Every state goes its own way: whether its Jacobian is renewed, and when it has converged, depends on
itself alone.  The inverse of its last Jacobian serves the steps after it, says how the answered number
responds to the equations, and with the residual on the next finer mesh what the nodes have left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..base.arrays import EPS
from ..model.bond import CohesiveLaw
from ..model.equations import Scalars
from ..model.groups import PI4
from .accuracy import SAFE, UNITS, certificates_of_ends
from .closures import EQUATIONS
from .compiled_stack import AnyStack
from .linear import IMAGINARY, count_closures_once, count_identity_once
from .newton import CONTRACTION
from .stack import TAIL, Stack, gradient

#: Size of an update from which on the inverse at hand does.  Whether it still fits shows in how fast updates
#: shrink: across a fold, where its determinant changes sign, they would not.
CHORD = 3e-3

#: Share of the update before, if that is larger than the second number, from which on the inverse at hand has
#: done its work and is no more that of the solution: beside folds.
STALE, FINE = 1e-3, 1e-6

#: States that go through the machine together: their matrices stay in the cache.
CHUNK = 128

#: Largest scaled update at which to stop, and iterations at most.
ENOUGH, MOST_ITERATIONS = 1e-11, 10

#: A start whose update is larger is none.
WILD = 10.0


@dataclass(frozen=True, eq=False)
class Solved:
    """States of a stack, solved for the numbers given; rows of those that did not converge mean nothing.

    Parameters
    ----------
    stack : Stack
    kinds : tuple of str
        Of the closures.
    given : ndarray, shape (states, closures)
    x : ndarray, shape (states, size)
    converged : ndarray of bool
    update : ndarray, shape (states, size)
        The last one.
    inverse : ndarray, shape (states, size, size)
    sizes : ndarray, shape (states, size)
        Of the terms of the equations.
    """

    stack: AnyStack
    kinds: tuple[str, ...]
    given: np.ndarray
    x: np.ndarray
    converged: np.ndarray
    update: np.ndarray
    inverse: np.ndarray
    sizes: np.ndarray

    @property
    def scalars(self) -> Scalars:
        """The four scalars, each an array."""
        return self.stack.scalars(self.x)

    def of(self, rows: np.ndarray) -> Solved:
        """Some of the states, in the order of the rows; all of them as they are are the same object."""
        if len(rows) == len(self.x) and np.array_equal(rows, np.arange(len(rows))):
            return self
        parts = (self.given, self.x, self.converged, self.update, self.inverse, self.sizes)
        return Solved(self.stack, self.kinds, *(part[rows] for part in parts))

    @classmethod
    def joined(cls, parts: Sequence[Solved]) -> Solved:
        """Return the states of several solutions of one stack, for the same closures, as one."""
        if len(parts) == 1:
            return parts[0]
        names = ("given", "x", "converged", "update", "inverse", "sizes")
        columns = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
        return cls(parts[0].stack, parts[0].kinds, *columns)

    @cached_property
    def missed(self) -> np.ndarray:
        """Residual of the states on the next finer mesh, as their own equations, shape (states, size)."""
        residual = self.stack.finer.equations(self.stack.prolonged(self.x), self.kinds, self.given)
        return self.stack.restricted(residual)

    @cached_property
    def shapes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Theta and Theta' at the nodes and at the plate, and the height u of the tip."""
        assert isinstance(self.stack, Stack)
        return self.stack.shapes(self.x)

    @cached_property
    def response(self) -> np.ndarray:
        """Derivatives of the scalars by the given numbers, shape (states, 4, closures)."""
        count = len(self.kinds)
        return -self.inverse[:, TAIL, -count:] * self._by_given[:, None, :]

    @cached_property
    def _by_given(self) -> np.ndarray:
        """Derivative of each closure by its number, shape (states, closures)."""
        rates = [
            np.broadcast_to(
                np.imag(EQUATIONS[kind](self.scalars, number + 1j * IMAGINARY)) / IMAGINARY, len(self.x)
            )
            for kind, number in zip(self.kinds, self.given.T, strict=True)
        ]
        return np.stack(rates, axis=1)

    def errors(self, read: Callable[[Scalars], Any]) -> np.ndarray:
        """Absolute error of a number read off the scalars, shape (states,).

        What the nodes left out is the residual of the solution on the next finer mesh, weighted with the
        response of the number to it.  It may be small by chance, but not in every scalar: as far as the
        same residues move the number, that of each scalar counts.  To it comes what rounding does.
        """
        slope = gradient(read, self.x)
        towards = self.inverse[:, TAIL, :]
        own = (slope[:, None, :] @ towards)[:, 0]
        missed = self.missed
        each = np.abs((towards @ missed[:, :, None])[:, :, 0])
        leverage = _norm(own)[:, None] / np.maximum(_norm(towards), np.finfo(float).tiny)
        left_out = np.maximum(np.abs((own * missed).sum(axis=1)), (leverage * each).max(axis=1))
        return SAFE * left_out + self._rounding(read, slope, own)

    def _rounding(self, read: Callable[[Scalars], Any], slope: np.ndarray, own: np.ndarray) -> np.ndarray:
        """What rounding of the terms, of the given numbers and of the number itself does to it."""
        count = len(self.kinds)
        by_given = np.abs(own[:, -count:] * self._by_given)
        # p/T0 enters as 1 - p/T0 and lambda as pi^4 + lambda: their rounding is that of the larger.
        least = {"pressure": 1.0, "lam": PI4}
        sizes = np.maximum(np.abs(self.given), [least.get(kind, 0.0) for kind in self.kinds])
        digits = np.abs(read(self.scalars)) + (by_given * sizes).sum(axis=1)
        last = np.abs((slope * self.update[:, TAIL]).sum(axis=1))
        # Once it has settled, the last update is rounding of the equations itself: it counts once.
        return np.maximum(4.0 * last, UNITS * EPS * _norm(own * self.sizes)) + 2.0 * EPS * digits

    def certificates(self, law: CohesiveLaw) -> np.ndarray:
        """What `certificate` says of each state, shape (states,)."""
        Theta, _, height = self.shapes
        return certificates_of_ends(law, self.scalars, height, Theta[:, -1])


@np.errstate(all="ignore")  # what goes astray is no number for a step, and left out
def solve(
    stack: AnyStack,
    kinds: tuple[str, ...],
    given: np.ndarray,
    start: np.ndarray,
    chord: float = CHORD,
    *,
    sharp: bool = False,
) -> Solved:
    """Solve for the numbers given, each state from its own start.

    Parameters
    ----------
    stack : Stack
    kinds : tuple of str
        Two keys of `EQUATIONS` that take one number each.
    given : ndarray, shape (states, 2)
    start : ndarray, shape (states, size)
    chord : float
        Size of an update from which on the inverse at hand does.
    sharp : bool
        Whether the inverse is to be that at the solution itself, to rounding.

    Returns
    -------
    Solved
    """
    x, count = start.copy(), len(start)
    update, sizes = np.zeros_like(x), np.zeros_like(x)
    inverse = np.zeros((count, stack.size, stack.size))
    step, before = np.full(count, np.inf), np.full(count, np.inf)
    converged, stale, going = np.zeros(count, bool), np.zeros(count, bool), np.arange(count)
    for _ in range(MOST_ITERATIONS):
        keeps = step[going] < np.minimum(chord, CONTRACTION * before[going])
        renewed = going[~keeps]
        values = np.empty((count, stack.size))
        if renewed.size:
            values[renewed], jacobian = stack.linearise(x[renewed], kinds, given[renewed])
            sizes[renewed] = _sizes(stack, x[renewed], jacobian, kinds, given[renewed])
            inverse[renewed] = _inverses(jacobian)
        if keeps.any():
            kept = going[keeps]
            values[kept] = stack.equations(x[kept], kinds, given[kept])
        update[going] = -_applied(inverse[going], values[going])
        before[going] = step[going]
        step[going] = (np.abs(update[going]) / _scale(stack, x[going])).max(axis=1)
        # How fast updates shrink says by how much the Jacobian has changed, as long as rounding does not.
        stale[going] = keeps & (
            stale[going] | ((step[going] > STALE * before[going]) & (before[going] > FINE))
        )
        sound = step[going] <= WILD  # also not where it is no number
        going, keeps = going[sound], keeps[sound]
        x[going] += update[going]
        # Where rounding lets an update get no smaller, it stops as well.
        settled = (step[going] < 1e4 * ENOUGH) & (step[going] > 0.5 * before[going])
        settled &= ~keeps | (chord < FINE)
        done = (step[going] < ENOUGH) | settled
        converged[going[done]] = True
        going = going[~done]
        if not going.size:
            break
    again = np.flatnonzero(converged & (stale | sharp))
    if again.size:
        _, jacobian = stack.linearise(x[again], kinds, given[again])
        inverse[again] = _inverses(jacobian)
    return Solved(stack, kinds, given, x, converged, update, inverse, sizes)


def _sizes(
    stack: AnyStack, x: np.ndarray, jacobian: np.ndarray, kinds: Sequence[str], given: np.ndarray
) -> np.ndarray:
    """Sizes of the terms of the equations, as `Linearised.sizes`."""
    moduli, size, row = np.abs(jacobian), np.abs(x), stack.identity_row
    sizes, s = _applied(moduli, size), stack.scalars(x)
    count_closures_once(sizes, s, kinds, [(number,) for number in given.T])
    if row is not None:
        through_shape = (moduli[:, row, : stack.shape] * size[:, : stack.shape]).sum(axis=1)
        count_identity_once(sizes, s, row, stack.phases[0], through_shape)
    return sizes


def _inverses(matrices: np.ndarray) -> np.ndarray:
    """Inverses of a stack, not numbers where there is none."""
    try:
        return np.linalg.inv(matrices)
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full_like(matrices, np.nan)
        return np.concatenate([_inverses(matrix[None]) for matrix in matrices])


def _scale(stack: AnyStack, x: np.ndarray) -> np.ndarray:
    """Size of each unknown's block: the nodes together, every other number for itself."""
    scale = 1.0 + np.abs(x)
    scale[:, : stack.nodes] = scale[:, : stack.nodes].max(axis=1, keepdims=True)
    return scale


def _applied(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the matrix of every state times its vector."""
    product: np.ndarray = (matrices @ vectors[:, :, None])[:, :, 0]
    return product


def _norm(values: np.ndarray) -> np.ndarray:
    """Euclidean norm along the last axis."""
    return np.sqrt((values * values).sum(axis=-1))
