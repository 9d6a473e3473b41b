"""Compiled functions, called on arrays without conversions.

CasADi's front end turns every argument and result into a matrix of its own and back, which
for a few dozen unknowns costs more than the arithmetic: 70 us for a 35 x 37 Jacobian that is
evaluated in 47 us, where its buffers take 3 us.  The problems used last stay compiled, up to a bound
on the memory they take.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import casadi as ca
import numpy as np

if TYPE_CHECKING:
    import scipy.sparse as sp

#: Systems up to this size are solved dense, and larger ones of which so large a share is not zero.
DENSE_LIMIT, DENSE_SHARE = 150, 0.3


def is_dense(jacobian: ca.Sparsity) -> bool:
    """Whether dense algebra is the faster way to solve with such a matrix."""
    return jacobian.size2() <= DENSE_LIMIT or jacobian.nnz() > DENSE_SHARE * jacobian.numel()


@dataclass(frozen=True, eq=False)
class _Buffers:
    """Memory that one thread's calls go through."""

    arguments: list[np.ndarray]
    results: list[np.ndarray]
    evaluate: Callable[[], None]
    owner: object  # the buffer must outlive its ``evaluate``


class Compiled:
    """A CasADi function from dense vectors to dense matrices, or the nonzeros of sparse ones.

    Parameters
    ----------
    function : casadi.Function
    """

    def __init__(self, function: ca.Function) -> None:
        self.function = function
        self._local = threading.local()

    def __call__(self, *arguments: np.ndarray) -> list[np.ndarray]:
        """Values of all outputs, the caller's own: column vectors flat, matrices in column order."""
        buffers = self._buffers()
        for slot, argument in zip(buffers.arguments, arguments, strict=True):
            slot[:] = argument
        buffers.evaluate()
        return [result.copy(order="F") for result in buffers.results]

    def many(self, *arguments: np.ndarray) -> list[np.ndarray]:
        """Values of all outputs for each row of the arguments, stacked along the first axis."""
        buffers = self._buffers()
        stacks = [np.empty((len(arguments[0]), *result.shape)) for result in buffers.results]
        for i, row in enumerate(zip(*arguments, strict=True)):
            for slot, argument in zip(buffers.arguments, row, strict=True):
                slot[:] = argument
            buffers.evaluate()
            for stack, result in zip(stacks, buffers.results, strict=True):
                stack[i] = result
        return stacks

    def _buffers(self) -> _Buffers:
        try:
            buffers: _Buffers = self._local.buffers
        except AttributeError:
            buffers = self._local.buffers = self._allocate()
        return buffers

    def _allocate(self) -> _Buffers:
        function = self.function
        owner, evaluate = function.buffer()
        arguments = [np.empty(function.nnz_in(i)) for i in range(function.n_in())]
        results = []
        for i in range(function.n_out()):
            rows, columns = function.size_out(i)
            dense = function.sparsity_out(i).is_dense() and columns > 1
            results.append(np.empty((rows, columns), order="F") if dense else np.empty(function.nnz_out(i)))
        for i, argument in enumerate(arguments):
            owner.set_arg(i, argument.data)
        for i, result in enumerate(results):
            owner.set_res(i, result.T.data)
        return _Buffers(arguments, results, evaluate, owner)


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where the nonzeros of a compiled sparse matrix lie."""

    shape: tuple[int, int]
    pointers: np.ndarray
    rows: np.ndarray

    @classmethod
    def of(cls, sparsity: ca.Sparsity) -> Pattern:
        """Read a CasADi sparsity."""
        pointers, rows = (np.array(part, dtype=np.int32) for part in (sparsity.colind(), sparsity.row()))
        return cls(sparsity.shape, pointers, rows)

    def matrix(self, nonzeros: np.ndarray) -> sp.csc_matrix:
        """Return the matrix with these nonzeros."""
        import scipy.sparse as sp

        # A matrix without zeros comes out of `Compiled` as a full one.
        return sp.csc_matrix((np.ravel(nonzeros, order="F"), self.rows, self.pointers), shape=self.shape)


#: The BLAS that comes with CasADi since 3.8; its own loops take two to four times as long.
BLAS = ("classic",) if hasattr(ca, "has_blas") and ca.has_blas("classic") else ()


def product(a: Any, b: Any) -> Any:
    """Return the product of two dense matrices."""
    return ca.mtimes(a, b, *BLAS)


def scaled(factors: Any, matrix: Any) -> Any:
    """Return the matrix with each row times a factor."""
    return ca.repmat(factors, 1, matrix.shape[1]) * matrix


class Compilable(Protocol):
    """A problem that is compiled when asked for."""

    @property
    def weight(self) -> int:
        """What it takes, in numbers of its matrices."""

    def release(self) -> None:
        """Drop what is compiled."""


#: Sum of the weights of the problems whose compiled functions are kept: some 300 MB, 80 problems
#: of law (8) or a handful of a law with twenty kinks, of which every sequence of phases is one.
MOST_KEPT = 500_000

_KEPT: OrderedDict[Compilable, int] = OrderedDict()
_KEPT_LOCK = threading.Lock()


def keep(problem: Compilable) -> None:
    """Keep what is compiled of a problem, and drop that of the ones not used for longest."""
    with _KEPT_LOCK:
        if _KEPT and next(reversed(_KEPT)) is problem:
            return
        _KEPT.pop(problem, None)
        _KEPT[problem] = problem.weight
        total = sum(_KEPT.values())
        while total > MOST_KEPT and len(_KEPT) > 1:
            oldest, weight = _KEPT.popitem(last=False)
            oldest.release()
            total -= weight
