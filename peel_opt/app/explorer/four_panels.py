"""The four panels and their headline as one: what the page and the exported page both show."""

from __future__ import annotations

from typing import Any

from bokeh.models import GridBox

from . import look
from .figures import DiagramFigure, LoopFigure, PotentialFigure, RodFigure
from .panel_figure import Panel
from .screen import Scene
from .texts import headline, text_box, wrapped


class FourPanels:
    """Rod, diagram, potential and loop under a headline."""

    def __init__(self) -> None:
        self.rod, self.diagram = RodFigure(), DiagramFigure()
        self.potential, self.loop = PotentialFigure(), LoopFigure()
        self.width = 2 * (look.FRAME_WIDTH + look.LEFT)
        self.headline = text_box("headline", "status", self.width)
        self.headline.height = 42  # so that the panels stay where they are

    @property
    def all(self) -> tuple[Panel, ...]:
        """In reading order."""
        return self.rod, self.diagram, self.potential, self.loop

    @property
    def named(self) -> dict[str, Any]:
        """The figures by what they show."""
        names = ("shape of the rod", "bifurcation diagram", "effective potential", "hysteresis loop")
        return {name: panel.figure for name, panel in zip(names, self.all, strict=True)}

    def grid(self) -> Any:
        """Return the layout of the panels."""
        return GridBox(
            children=[(panel.figure, i // 2, i % 2) for i, panel in enumerate(self.all)],
            name="panels",
            styles={"background": look.PAPER},  # of the saved picture too
        )

    def show(self, scene: Scene) -> None:
        """Draw a scene."""
        self.show_moving(scene)
        self.diagram.show(scene.diagram)
        if scene.loop is None:
            self.loop.empty("Hysteresis loop", wrapped(scene.no_loop))
        else:
            self.loop.show(scene.loop)

    def show_moving(self, scene: Scene) -> None:
        """Draw what changes with every frame of a sweep."""
        if scene.rod is None:
            self.rod.clear("no such state: see below")
        else:
            self.rod.show(scene.rod)
        if scene.potential is None:
            self.potential.empty("Effective potential (35)", wrapped(scene.no_potential))
        else:
            self.potential.show(scene.potential)
        self.headline.text = headline(scene)
