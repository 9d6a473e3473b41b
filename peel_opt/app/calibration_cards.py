"""Calibration cards: measurements in CSV files beside the card, and what to fit to them; see docs/cards.md.

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
from ..model.scene import Scene
from ..studies.calibrate.data import MeasuredShape, Measurements
from ..studies.calibrate.fit import calibrate
from ..studies.calibrate.profile import require_level
from ..studies.calibrate.read import read_measurements, read_shape
from ..studies.calibrate.result import Calibration
from ..studies.calibrate.scene_fit import SceneCalibration
from .card_tables import CardTable, Length, Number, Pressure, RodTable
from .cards import SourcedCard, is_calibration, read_card
from .scene_table import MEASURES, SET, SceneTable

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
    known = (*MATERIAL, *MEASURES)
    if not isinstance(value, list) or not value or any(name not in known for name in value):
        raise InvalidInput(
            f"free must list some of {', '.join(MATERIAL)}, and of the numbers under [scene], got {value!r}."
        )
    return tuple(value)


File = Annotated[str, BeforeValidator(_file)]
State = Annotated[str, BeforeValidator(partial(known_state, among=OBSERVABLE))]


class FitTable(CardTable):
    """``[calibration]``: what is free, and how residuals count."""

    free: Annotated[tuple[str, ...], BeforeValidator(_free)] = Field(
        MATERIAL, description="the numbers of the rod that are fitted, and of [scene]"
    )
    state: State | None = Field(None, description="that all data show, where their files do not say")
    loss: Literal["least-squares", "pseudo-huber"] = Field(
        "least-squares", description="how residuals count; the latter for data with outliers"
    )
    loss_scale: Number = Field(1.5, description="of pseudo-huber, in standard deviations")
    level: Number = Field(0.95, description="probability of the intervals")

    @model_validator(mode="after")
    def _level_is_a_probability(self) -> Self:
        require_level(self.level)
        return self


class PairsTable(CardTable):
    """``[[pairs]]``: a file of lengths and pressures."""

    file: File = Field(description="CSV beside the card, with units in its titles")
    length_sd: Length | None = Field(None, description="standard deviation, for files without the column")
    pressure_sd: Pressure | None = Field(None, description="standard deviation, for files without the column")
    state: State | None = Field(None, description="that they show, for files without the column")

    def read(self, folder: Path) -> Measurements:
        """Return its rows."""
        return read_measurements(
            folder / self.file, length_sd=self.length_sd, pressure_sd=self.pressure_sd, state=self.state
        )


class ShapeTable(CardTable):
    """``[[shapes]]``: a file of points of one shape, and what was held."""

    file: File = Field(description="CSV beside the card: x, y and sd, with units in its titles")
    sd: Length | None = Field(
        None, description="standard deviation of the points, for files without the column"
    )
    pressure: Pressure | None = Field(None, description="under which the picture was taken")
    length: Length | None = Field(None, description="detached length in the picture; one of the two or both")
    pressure_sd: Pressure | None = Field(None, description="standard deviation; exact if not given")
    length_sd: Length | None = Field(None, description="standard deviation; exact if not given")
    state: State | None = Field(None, description="that it shows")
    free_origin: bool = Field(False, description="whether the position of the picture is fitted as well")
    tip: bool = Field(False, description="whether the first point is the tip")

    def read(self, folder: Path) -> MeasuredShape:
        """Return its points."""
        known: dict[str, Any] = self.model_dump(exclude={"file", "sd"})
        return read_shape(folder / self.file, sd=self.sd, **known)


class CalibrationCard(SourcedCard):
    """A calibration: a rod to start from, measurements, and what to fit.

    Every number of the rod and the scene that is not free should have a source or an estimate.

    Parameters
    ----------
    rod_table : RodTable
    scene_table : SceneTable, optional
    calibration : FitTable
    pairs, shapes : tuple
        At least one of them.
    """

    tables: ClassVar = {
        "rod": RodTable,
        "scene": SceneTable,
        "calibration": FitTable,
        "pairs": PairsTable,
        "shapes": ShapeTable,
    }

    rod_table: RodTable = Field(alias="rod")
    scene_table: SceneTable | None = Field(default=None, alias="scene")
    calibration: FitTable
    pairs: tuple[PairsTable, ...] = ()
    shapes: tuple[ShapeTable, ...] = ()

    @property
    def given(self) -> set[str]:
        """Names of all numbers of its rod and its scene."""
        scene = set() if self.scene_table is None else self.scene_table.given
        return set(self.rod_table.model_fields_set) | scene

    @property
    def _read_somewhere(self) -> set[str]:
        free = set(self.calibration.free)
        return {name for name in self.given if not FEEDS.get(name, {name}) <= free} - set(SET)

    def rod(self) -> Rod:
        """Return the rod with the known numbers, and the start of the free ones."""
        return self.rod_table.rod()

    def subject(self) -> Rod | Scene:
        """Return the rod with what acts on it besides."""
        rod = self.rod()
        return rod if self.scene_table is None else self.scene_table.scene(rod)

    def data(self, folder: Path) -> list[Measurements | MeasuredShape]:
        """Read the files, which lie in ``folder``."""
        return [*(t.read(folder) for t in self.pairs), *(t.read(folder) for t in self.shapes)]

    def fit(self, folder: Path) -> Calibration | SceneCalibration:
        """Read the files and fit."""
        asked = self.calibration
        return calibrate(
            self.data(folder),
            free=asked.free,
            rod=self.subject(),
            state=asked.state,
            loss=asked.loss,
            loss_scale=asked.loss_scale,
        )

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        if not self.pairs and not self.shapes:
            raise InvalidInput("a calibration card needs an entry under [[pairs]] or [[shapes]].")
        if "ratio" in self.given:
            raise InvalidInput("a calibration needs a rod with units, not ratio alone.")
        free = set(self.calibration.free)
        try:
            subject = self.subject()
        except InvalidInput as error:
            raise InvalidInput(f"[scene]: {error}") from error
        numbers = subject.numbers if isinstance(subject, Scene) else {}
        if strange := free - set(MATERIAL) - set(numbers):
            raise InvalidInput(
                f"free names {min(strange)!r}, which is no number under [scene].",
                remedy="Name it there, where the fit starts.",
            )
        if isinstance(subject, Scene) and self.shapes:
            raise InvalidInput("a scene is fitted to [[pairs]], and not to [[shapes]].")
        self.require_sources_of_what_is_given()
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
