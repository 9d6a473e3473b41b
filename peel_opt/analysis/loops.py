"""What all hysteresis loops have in common: two sweeps, the jumps between them, and an area.

Every loop here is quasi-static, a sequence of equilibria, and its bond is reversible: where the rod
comes back to the plate it holds as it did before.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, Self, TypeVar

import numpy as np

from ..base.arrays import Columns, read_only
from ..base.records import Column, Table, Tabled
from ..base.units import digits_left
from ..equilibria.branch import Branch

#: Which way a jump goes.
Direction = Literal["up", "down"]

#: What kind of loop this is, wherever one is told.
KIND = "quasi-static, reversible bond"

#: Name of the state that has not peeled.
ADHERED = "adhered"


@dataclass(frozen=True)
class Jump:
    """A jump between two states at one value of what is swept; its kinds name the three numbers.

    Parameters
    ----------
    direction : {"up", "down"}
        "up" peels the rod off, "down" lets it re-adhere.
    swept : float
    before, after : float
        The response; 0 for the adhered rod.
    """

    direction: Direction
    swept: float
    before: float
    after: float

    @property
    def size(self) -> float:
        """Change of the response."""
        return abs(self.after - self.before)


@dataclass(frozen=True, eq=False, repr=False)
class VisitedStates(Columns):
    """States in the order in which a sweep visits them; at a jump both, at the same swept value.

    Parameters
    ----------
    swept, response : ndarray
        Its kinds name them.
    state : ndarray of str
        "adhered", or the label of the detached state.
    error : ndarray
        Of each solved state, in the metric of the branch; 0 for the adhered rod, which is exact,
        NaN on a normal form.
    row : ndarray of int
        Position in the branch of the loop, -1 where the state is not one of its.
    """

    swept: np.ndarray
    response: np.ndarray
    state: np.ndarray
    error: np.ndarray
    row: np.ndarray

    def __post_init__(self) -> None:
        for name in ("swept", "response", "state", "error", "row"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.swept)

    @classmethod
    def adhered(cls, swept: np.ndarray) -> Self:
        """Return the adhered rod at these values."""
        none = np.zeros(len(swept))
        return cls(swept, none, np.full(len(swept), ADHERED), none, np.full(len(swept), -1))

    def then(self, other: Self) -> Self:
        """Return this sweep followed by another."""
        names = ("swept", "response", "state", "error", "row")
        return type(self)(*(np.concatenate([getattr(self, n), getattr(other, n)]) for n in names))


J = TypeVar("J", bound=Jump)
S = TypeVar("S", bound=VisitedStates)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Loop(Tabled, Generic[S, J]):
    """A loop: two sweeps and the jumps between them; quasi-static, with a reversible bond.

    Parameters
    ----------
    up, down : VisitedStates
    jumps : tuple of Jump
        In the order of the loop: up, then down.
    area : float
        Enclosed in the plane of what is swept and the response.
    area_error : float
        Of the area; NaN on a normal form.
    not_computed : str
        What happens in a jump.
    branch : Branch or None
        The solved branch: ``branch[row]`` of a sweep is an `Equilibrium` with its shape.
    """

    up: S
    down: S
    jumps: tuple[J, ...]
    area: float
    area_error: float
    not_computed: str
    branch: Branch | None = field(default=None)

    @property
    def visited(self) -> tuple[str, ...]:
        """Names of the states in the order of the loop, each once."""
        return tuple(dict.fromkeys([*self.up.state.tolist(), *self.down.state.tolist()]))

    @property
    def area_digits(self) -> int:
        """Digits of the area that its error leaves, at most 10."""
        return digits_left(self.area, self.area_error, 10)

    @property
    def legs(self) -> dict[str, S]:
        """The sweeps by name, and what lies between them."""
        return {"up": self.up, "down": self.down}

    def joined(self, name: str) -> np.ndarray:
        """Return a column of all legs, one after another."""
        return np.concatenate([getattr(leg, name) for leg in self.legs.values()])

    @property
    @abstractmethod
    def plane(self) -> dict[str, Column]:
        """What is swept and the response, of all legs."""

    @property
    def columns(self) -> dict[str, Column]:
        """All states in the order of the legs, which "leg" names."""
        names = np.repeat(list(self.legs), [len(leg) for leg in self.legs.values()])
        checks = {name: Column(self.joined(name)) for name in ("state", "error")}
        return {"leg": Column(names), **self.plane, **checks}

    def _table(self) -> Table:
        return Table({"area": self.area, "area_error": self.area_error}.items(), self.columns)

    def _rows_shown(self) -> list[dict[str, Any]]:
        return []  # the jumps, which are the words, say it all

    def tree(self, title: str, jumps: list[str], area: str, *last: Any) -> str:
        """Return the loop in a few lines."""
        lines = [f"{title}, {KIND}", *jumps, f"states: {', '.join(self.visited)}", f"area {area}", *last]
        return "\n".join([lines[0], *(f"├─ {line}" for line in lines[1:-1]), f"└─ {lines[-1]}"])
