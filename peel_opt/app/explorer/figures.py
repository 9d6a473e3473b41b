"""The four panels as Bokeh figures; each takes its part of a scene."""

from __future__ import annotations

import math

import numpy as np
from bokeh.models import BasicTickFormatter, BoxAnnotation, ColumnDataSource, Label, LegendItem, Span

from . import look
from .panel_figure import Panel
from .panels import Arrows, DiagramPanel, LoopPanel, PotentialPanel, RodPanel


class RodFigure(Panel):
    """The rod in its true shape with the plate, y0 and the forces."""

    def __init__(self) -> None:
        super().__init__("Rod", ("rod", "beyond"), "rod")
        fig = self.figure
        fig.x_range.update(start=-1.05, end=0.35)
        fig.y_range.update(start=-0.18, end=0.65)
        self.plate = BoxAnnotation(
            top=0.0,
            fill_color="#EFEFEF",
            fill_alpha=1.0,
            hatch_pattern="/",
            hatch_color="#C4C4C4",
            hatch_weight=1.0,
            line_color="#8A8A8A",
            level="underlay",
        )
        fig.add_layout(self.plate)
        fig.grid.grid_line_color = None
        self.range = Span(
            dimension="width",
            location=0.0,
            line_color=look.Y0,
            line_width=1.8,
            line_dash=[2, 3],
            visible=False,
        )
        self.range_name = Label(
            x=look.FRAME_WIDTH - 24,
            y=0.0,
            x_units="screen",
            text="y₀",
            text_color=look.Y0,
            text_font_size="15px",
            text_font_style="bold",
            y_offset=2,
            visible=False,
        )
        fig.add_layout(self.range)
        fig.add_layout(self.range_name)
        self.arrows: dict[str, tuple[ColumnDataSource, LegendItem]] = {}
        for name in ("pressure", "adhesion", "repulsion"):
            source = ColumnDataSource({key: [] for key in ("x0", "y0", "x1", "y1", "angle")})
            colour = look.STROKES[name].colour
            shaft = fig.segment("x0", "y0", "x1", "y1", source=source, line_color=colour, line_width=1.6)
            fig.scatter(
                "x1",
                "y1",
                source=source,
                marker="triangle",
                angle="angle",
                size=8,
                color=colour,
                line_color=None,
            )
            item = LegendItem(label=name, renderers=[shaft], visible=False)
            self.legend.items.append(item)
            self.arrows[name] = (source, item)

    def show(self, panel: RodPanel) -> None:
        """Show a rod; the scales of both axes are as ``panel.stretch`` says."""
        self.draw(panel.x, panel.y, panel.lines)
        shown: dict[str, Arrows] = {arrows.look: arrows for arrows in panel.arrows}
        for name, (source, item) in self.arrows.items():
            arrows = shown.get(name)
            item.visible = arrows is not None
            if arrows is None:
                source.data = {key: [] for key in ("x0", "y0", "x1", "y1", "angle")}
                continue
            item.label = {"value": arrows.label}
            turned = np.arctan2(panel.stretch * (arrows.y1 - arrows.y0), arrows.x1 - arrows.x0)
            source.data = {
                "x0": arrows.x0,
                "y0": arrows.y0,
                "x1": arrows.x1,
                "y1": arrows.y1,
                "angle": turned - 0.5 * math.pi,
            }
        self.range.visible = self.range_name.visible = panel.shows_y0
        if panel.shows_y0 and panel.y0 is not None:
            self.range.location = self.range_name.y = panel.y0
        wide, high = look.FRAME_WIDTH, look.FRAME_HEIGHT
        pixel = max((panel.x.high - panel.x.low) / wide, panel.stretch * (panel.y.high - panel.y.low) / high)
        middle = 0.5 * (panel.x.low + panel.x.high)
        x, y = self.figure.x_range, self.figure.y_range
        x.start, x.end = middle - 0.5 * pixel * wide, middle + 0.5 * pixel * wide
        y.start, y.end = panel.y.low, panel.y.low + pixel * high / panel.stretch

    def clear(self, text: str) -> None:
        """Show the plate and a few words."""
        super().clear(text)
        for source, item in self.arrows.values():
            source.data = {key: [] for key in source.data}
            item.visible = False
        self.range.visible = self.range_name.visible = False


class DiagramFigure(Panel):
    """The bifurcation diagram; a click picks the state."""

    def __init__(self) -> None:
        looks = ("straight", "straight-unstable", "spurious", "unknown", "unstable", "stable")
        super().__init__("Bifurcation diagram", looks, "diagram")

    def show(self, panel: DiagramPanel) -> None:
        """Show a diagram."""
        self.draw(panel.x, panel.y, panel.lines, panel.marks)
        self.place(panel.here)
        self.span(panel.x, panel.y)
        self.title(f"Bifurcation diagram, stability {panel.stability}")


class PotentialFigure(Panel):
    """The effective potential and the ball."""

    def __init__(self) -> None:
        super().__init__("Effective potential (35)", ("fold", "maxwell", "delay", "current"), "potential")
        # Short labels, so that the frame stays in line with those above it.
        self.figure.yaxis.formatter = BasicTickFormatter(power_limit_high=4, precision=1)

    def show(self, panel: PotentialPanel) -> None:
        """Show a potential."""
        self.draw(panel.x, panel.y, panel.lines, panel.marks)
        self.place(panel.ball)
        self.span(panel.x, panel.y)
        solved = panel.source.startswith("quadrature")
        self.title(f"Effective potential (35), {'by quadrature' if solved else panel.source}")


class LoopFigure(Panel):
    """The hysteresis loop; its dot follows the state and the sweep."""

    def __init__(self) -> None:
        super().__init__("Hysteresis loop", ("between", "down", "up"), "loop")

    def show(self, panel: LoopPanel) -> None:
        """Show a loop."""
        self.draw(panel.x, panel.y, panel.lines, panel.marks)
        self.place(panel.here)
        self.span(panel.x, panel.y)
        self.title(f"Hysteresis loop, {panel.area}")
