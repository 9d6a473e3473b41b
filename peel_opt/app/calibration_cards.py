"""Calibration cards: measurements in CSV files beside the card, and what to fit to them.

::

    title = "Flap in a test rig"
    note = "..."

    [rod]                                   # known numbers, and where to start with the free ones
    bending_stiffness = "23 uN m"
    adhesion_strength = "100 kPa"
    adhesion_range = "1 mm"

    [sources]                               # of the known numbers, as in a problem card
    bending_stiffness = "three-point bending"

    [calibration]
    free = ["adhesion_strength", "adhesion_range"]
    level = 0.95                            # also state, loss and loss_scale

    [[pairs]]
    file = "calibrate_flap.csv"             # beside the card; see peel_opt.studies.calibrate.read
    pressure_sd = "0.5 kPa"                 # also length_sd and state, for files without the column

    [[shapes]]
    file = "shape.csv"                      # x, y and sd
    pressure = "60 kPa"                     # also length, their _sd, sd, state, free_origin and tip

A card with a table ``[calibration]`` is one of these; ``peel-opt run`` does what it asks for.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from ..base.errors import CardError, InvalidInput
from ..model.labels import OBSERVABLE, known_state
from ..model.rod import MATERIAL, Rod
from ..studies.calibrate.data import MeasuredShape, Measurements
from ..studies.calibrate.fit import calibrate
from ..studies.calibrate.profile import require_level
from ..studies.calibrate.read import read_measurements, read_shape
from ..studies.calibrate.result import Calibration
from .card_tables import CardTable, Length, Number, Pressure, RodTable
from .cards import SourcedCard, is_calibration, read_card

#: Which numbers of a rod a field of ``[rod]`` goes into.
FEEDS = {
    "youngs_modulus": {"bending_stiffness"},
    "thickness": {"bending_stiffness"},
    "poisson_ratio": {"bending_stiffness"},
    "work_of_separation": {"adhesion_strength", "adhesion_range"},
}


def _file(value: object) -> object:
    """Accept the plain name of a file beside the card."""
    if not isinstance(value, str) or not value.strip():
        raise InvalidInput(f"file must be the name of a CSV file, got {value!r}.")
    path = PurePosixPath(value.replace("\\", "/"))
    if len(path.parts) != 1 or path.name in ("..", ".") or ":" in value or "\0" in value:
        raise InvalidInput(f"file must lie beside the card, got {value!r}.", remedy="Give its name alone.")
    return value


def _free(value: object) -> object:
    if not isinstance(value, list) or not value or any(name not in MATERIAL for name in value):
        raise InvalidInput(f"free must list some of {', '.join(MATERIAL)}, got {value!r}.")
    return tuple(value)


File = Annotated[str, BeforeValidator(_file)]
State = Annotated[str, BeforeValidator(partial(known_state, among=OBSERVABLE))]


class FitTable(CardTable):
    """``[calibration]``: what is free, and how residuals count."""

    free: Annotated[tuple[str, ...], BeforeValidator(_free)] = MATERIAL
    state: State | None = None
    loss: Literal["least-squares", "pseudo-huber"] = "least-squares"
    loss_scale: Number = 1.5
    level: Number = 0.95

    @model_validator(mode="after")
    def _level_is_a_probability(self) -> Self:
        require_level(self.level)
        return self


class PairsTable(CardTable):
    """``[[pairs]]``: a file of lengths and pressures."""

    file: File
    length_sd: Length | None = None
    pressure_sd: Pressure | None = None
    state: State | None = None

    def read(self, folder: Path) -> Measurements:
        """Return its rows."""
        return read_measurements(
            folder / self.file, length_sd=self.length_sd, pressure_sd=self.pressure_sd, state=self.state
        )


class ShapeTable(CardTable):
    """``[[shapes]]``: a file of points of one shape, and what was held."""

    file: File
    sd: Length | None = None
    pressure: Pressure | None = None
    length: Length | None = None
    pressure_sd: Pressure | None = None
    length_sd: Length | None = None
    state: State | None = None
    free_origin: bool = False
    tip: bool = False

    def read(self, folder: Path) -> MeasuredShape:
        """Return its points."""
        known: dict[str, Any] = self.model_dump(exclude={"file", "sd"})
        return read_shape(folder / self.file, sd=self.sd, **known)


class CalibrationCard(SourcedCard):
    """A calibration: a rod to start from, measurements, and what to fit.

    Every number of the rod that is not free has a source or an estimate.

    Parameters
    ----------
    rod_table : RodTable
    calibration : FitTable
    pairs, shapes : tuple
        At least one of them.
    """

    tables: ClassVar = {"rod": RodTable, "calibration": FitTable, "pairs": PairsTable, "shapes": ShapeTable}

    rod_table: RodTable = Field(alias="rod")
    calibration: FitTable
    pairs: tuple[PairsTable, ...] = ()
    shapes: tuple[ShapeTable, ...] = ()

    def rod(self) -> Rod:
        """Return the rod with the known numbers, and the start of the free ones."""
        return self.rod_table.rod()

    def data(self, folder: Path) -> list[Measurements | MeasuredShape]:
        """Read the files, which lie in ``folder``."""
        return [*(t.read(folder) for t in self.pairs), *(t.read(folder) for t in self.shapes)]

    def fit(self, folder: Path) -> Calibration:
        """Read the files and fit."""
        asked = self.calibration
        return calibrate(
            self.data(folder),
            free=asked.free,
            rod=self.rod(),
            state=asked.state,
            loss=asked.loss,
            loss_scale=asked.loss_scale,
        )

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        if not self.pairs and not self.shapes:
            raise InvalidInput("a calibration card needs an entry under [[pairs]] or [[shapes]].")
        given = self.rod_table.model_fields_set
        if "ratio" in given:
            raise InvalidInput("a calibration needs a rod with units, not ratio alone.")
        free = set(self.calibration.free)
        known = {name for name in given if not FEEDS.get(name, {name}) <= free}
        self.require_sources(given, known, " is not free and")
        return self


def load_calibration(path: str | Path) -> CalibrationCard:
    """Read and check a calibration card; its data files are read by `CalibrationCard.fit`.

    Raises
    ------
    CardError
        If the file cannot be read or does not mean anything, in one line.
    """
    content = read_card(path)
    if not is_calibration(content):
        raise CardError(
            f"card {str(path)!r} has no [calibration].", remedy="Answer a problem card with peel-opt run."
        )
    return CalibrationCard.checked(path, content)
