"""Motions on paper: front and tip against time, the ledger of energies, shapes, the orbit, films."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.checks import whole
from ..base.errors import InvalidInput, MissingExtra
from ..base.files import as_path, write_bytes
from ..base.progress import Progress
from ..base.progress import progress as telling
from ..equilibria.branch import Branch, require_branch
from ..model.scene import Scene
from ..motion.arc import Arc
from ..motion.history import History
from ..motion.trajectory import Snap
from . import style
from .axes import axes_or, own_axes
from .dispatch import drawn_by
from .motion_panels import MotionPanels, scene_words, seen
from .mpl import draw_panel, finish
from .words import AxisUnit, length_unit, pressure_unit

if TYPE_CHECKING:
    from matplotlib.animation import AbstractMovieWriter

#: What a film is written by, by the suffix of its file.
FILMS = (".gif", ".html", ".mp4")

#: Height of a picture over its width below which heights are drawn larger than lengths.
FLAT = 0.15

#: Highest pressure of a diagram of a scene, over that of what is drawn over it.
_ROOM = 1.2

#: Dots per inch of a film.
DPI = 100.0


@drawn_by.register
def plot_motion(motion: Snap, ax: Axes | None = None) -> Axes:
    """Draw front and tip of a rod in motion against time.

    Parameters
    ----------
    motion : Snap
    ax : Axes, optional

    Returns
    -------
    Axes
        Lengths against time, in the rod's units; named moments are marked on the front.
    """
    return draw_panel(MotionPanels(motion).lengths, axes_or(ax, own_axes(6.0, 3.8)), columns=3)


def plot_ledger(motion: Snap, ax: Axes | None = None) -> Axes:
    """Draw where the work of the pressure goes: energies of a rod in motion against time.

    Parameters
    ----------
    motion : Snap
    ax : Axes, optional

    Returns
    -------
    Axes
        Energies per width, stored and lost stacked, the work as a line on top; in the rod's units.
    """
    return draw_panel(MotionPanels(motion).ledger, axes_or(ax, own_axes(6.0, 3.8)), columns=3)


def plot_orbit(motion: Snap, branch: Branch, ax: Axes | None = None) -> Axes:
    """Draw a motion over the diagram of its rod: along its pressure from one equilibrium to another.

    Parameters
    ----------
    motion : Snap
    branch : Branch
        Of the same rod or scene, from `peel_opt.trace`.
    ax : Axes, optional

    Returns
    -------
    Axes
        Detached length against pressure, as in the diagram.

    Raises
    ------
    InvalidInput
        If the branch is of another rod or scene.
    """
    ax = axes_or(ax, own_axes(6.0, 4.2))
    lengths = length_unit(motion.rod, float(max(branch.length.max(), motion.front.max())))
    pressures = pressure_unit(motion.rod, motion.rod.adhesion_strength)
    plot_equilibria(ax, branch, motion, pressures, lengths)
    p, front = motion.pressure / pressures.size, motion.front / lengths.size
    ax.plot(np.full(len(front), p), front, color=style.PRESSURE, linewidth=style.ROD_WIDTH, label="snap")
    ax.plot(p, front[0], "o", color=style.PRESSURE, markerfacecolor="white")
    ax.plot(p, front[-1], "D", color=style.PRESSURE)
    ax.set_xlabel(pressures.axis("p"))
    ax.set_ylabel(lengths.axis(r"\bar s"))
    ends = f"circle: where it starts; diamond: {motion.outcome}{scene_words(motion)}"
    ax.set_title(ends, fontsize=style.SMALL, loc="left")
    return finish(ax, columns=3)


def plot_equilibria(
    ax: Axes, branch: Branch, moved: Snap | History, pressures: AxisUnit, lengths: AxisUnit
) -> None:
    """Draw the equilibria of a rod for what it goes through to be drawn over: what is stable as a full line.

    Raises
    ------
    InvalidInput
        If they are those of another rod or scene.
    """
    if require_branch(branch).rod != moved.rod or branch.scene != moved.scene:
        raise InvalidInput(
            "the diagram must be that of the rod that moves, with what acts on it.",
            remedy="Trace its rod or its scene.",
        )
    x, y, state = branch.pressure / pressures.size, branch.length / lengths.size, branch.state
    # A scene has states on which the tip is all but down up to pressures at which nothing is attached.
    beyond = branch.pressure > max(_ROOM * float(np.max(moved.pressure)), moved.rod.adhesion_strength)
    x = np.where(beyond & (branch.scene is not None), np.nan, x)
    stable = {name: state == name for name in ("lifted", "folded")}
    others = ~np.any(list(stable.values()), axis=0)
    for name, here in {"unfolded": others, **stable}.items():
        if here.any():
            dashes = (0, (5.0, 2.0)) if here is others else "-"
            drawn = here | np.append(False, here[:-1])  # up to the next kind
            colour = style.RANGE if name == "lifted" else style.ADHESION
            ax.plot(np.where(drawn, x, np.nan), y, color=colour, linestyle=dashes, label=name)


def plot_shapes(motion: Snap, ax: Axes | None = None, *, count: int = 7) -> Axes:
    """Draw the shapes that a rod in motion takes, evenly over the turning of its tip.

    Parameters
    ----------
    motion : Snap
    ax : Axes, optional
    count : int, optional
        How many, the first and the last among them.

    Returns
    -------
    Axes
        Height above the plate against the place along it, in the rod's units; dots mark where the glue of
        a rod with an unglued edge begins.
    """
    ax = axes_or(ax, own_axes(6.0, 3.6))
    stage = _Stage(motion, ax)
    turned = np.append(0.0, np.cumsum(np.abs(np.diff(motion.tip.angle))))
    times = np.interp(
        np.linspace(0.0, turned[-1], whole("count", count, 2)), turned + 1e-12 * motion.t, motion.t
    )
    colours = style.family_colours(len(times))
    for i, t in enumerate(times):
        stage.rod(float(t), colours[i], f"{(t - seen(motion)[0]) / stage.times.size:.3g}")
    unit = stage.times.name if not stage.times.is_symbol else f"${stage.times.name}$"
    return finish(ax, columns=7, title=f"$t$ [{unit}]")


#: How a wall is drawn.
_PLATE: dict[str, Any] = {"color": style.PLATE, "linewidth": 4.0, "zorder": 0}


@dataclass
class _Stage:
    """The plate, and the room that all shapes of a motion take."""

    motion: Snap
    ax: Axes

    def __post_init__(self) -> None:
        motion, ax = self.motion, self.ax
        panels = MotionPanels(motion)
        self.lengths, self.times = panels.lengths_in, panels.times_in
        size = self.lengths.size
        self.right = 1.15 * max(float(motion.front.max()), float(motion.x.max())) / size
        left, top = float(motion.x.min()) / size, 1.1 * float(motion.y.max()) / size
        low = 1.1 * float(motion.y.min()) / size
        bent, along = panels.bent, np.linspace(0.0, 2.0 * self.right, 401)
        reach = along if not bent else along[along * abs(bent) < np.pi]
        self.wall = reach, *Arc(bent).at(reach)
        if bent:
            behind = Arc(bent).at(-reach[::-1])
            ax.plot(*(np.append(*both) for both in zip(behind, self.wall[1:], strict=True)), **_PLATE)
        else:
            ax.axhline(0.0, **_PLATE)
        if not bent and (y0 := motion.rod.adhesion_range / size) < top:
            ax.axhline(y0, color=style.RANGE, linewidth=0.9, linestyle=(0, (2.0, 2.0)), zorder=0)
        ax.set(xlim=(left - 0.05 * self.right, self.right), ylim=(min(low, -0.06 * top), top))
        ax.set_aspect("equal" if top > FLAT * self.right or bent else "auto")
        ax.set_xlabel(self.lengths.axis("x"))
        ax.set_ylabel(self.lengths.axis("y"))

    def places(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Return where the rod is, detached and attached."""
        pose, size = self.motion.shape(t), self.lengths.size
        along, x, y = self.wall
        ahead = along > pose.s[-1] / size
        return np.append(pose.x / size, x[ahead]), np.append(pose.y / size, y[ahead])

    def glue(self, t: float) -> tuple[list[float], list[float]]:
        """Return the place on the rod at which its glue begins, where an edge of it has none."""
        scene = self.motion.scene
        if not isinstance(scene, Scene) or not scene.unbonded:
            return [], []
        pose, a, size = self.motion.shape(t), scene.unbonded, self.lengths.size
        flat = pose.s[-1] + a  # where a rod that has come down goes on along the plate
        s, x, y = np.append(pose.s, flat), np.append(pose.x, pose.x[-1] + a), np.append(pose.y, 0.0)
        return [float(np.interp(a, s, x)) / size], [float(np.interp(a, s, y)) / size]

    def rod(self, t: float, colour: Any, label: str) -> None:
        """Draw it, with a dot where the glue begins."""
        self.ax.plot(*self.places(t), color=colour, linewidth=1.8, label=label)
        self.ax.plot(*self.glue(t), "o", color=colour, markersize=3.5)


# --- films ---------------------------------------------------------------------------------------


def film(
    motion: Snap, path: str | Path, *, frames: int = 60, fps: int = 25, progress: Progress = None
) -> Path:
    """Write a film of a motion: the rod, its front and tip, and the ledger.

    Parameters
    ----------
    motion : Snap
    path : str or Path
        Its suffix chooses: .gif, .html, or .mp4, which needs ffmpeg.
    frames : int
    fps : int
        Frames per second.
    progress : None, bool or callable

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        If the suffix names no film, or the file cannot be written.
    MissingExtra
        If ffmpeg is needed and not there.
    """
    path, frames, fps = as_path(path), whole("frames", frames, 2), whole("fps", fps, 1, 1000)
    writer = _writer(path, fps)
    figure, moments = _screen(motion, np.linspace(*seen(motion), frames))
    with TemporaryDirectory() as folder, mpl.rc_context({"animation.embed_limit": 2**10}):
        draft = Path(folder) / f"film{path.suffix.lower()}"
        with writer.saving(figure, str(draft), DPI), telling("frame", frames, progress) as step:
            for _ in moments:
                writer.grab_frame()
                step()
        content = draft.read_bytes()
    return write_bytes(path, content)


def _writer(path: Path, fps: int) -> AbstractMovieWriter:
    """Return what writes a film of this suffix."""
    from matplotlib.animation import FFMpegWriter, HTMLWriter, PillowWriter

    suffix = path.suffix.lower()
    if suffix not in FILMS:
        raise InvalidInput(
            f"cannot tell the format of a film from {path.name!r}.",
            remedy=f"End the name in one of {', '.join(FILMS)}.",
        )
    if suffix == ".mp4":
        if which("ffmpeg") is None:
            raise MissingExtra(
                "an MP4 needs the program ffmpeg.", remedy="Install it, or write a .gif or .html."
            )
        return FFMpegWriter(fps=fps)
    return PillowWriter(fps=fps) if suffix == ".gif" else HTMLWriter(fps=fps, embed_frames=True)


def _screen(motion: Snap, times: np.ndarray) -> tuple[Figure, Iterator[float]]:
    """Return the picture of a film, and what moves it on and yields the time of each frame."""
    figure = Figure(figsize=(8.0, 6.4), layout="constrained")
    panels = figure.subplot_mosaic([["rod", "rod"], ["lengths", "energies"]], height_ratios=[1.1, 1.0])
    stage = _Stage(motion, panels["rod"])
    stage.rod(float(times[0]), style.ROD, "")
    rod, glue = panels["rod"].lines[-2:]
    rod.set_linewidth(style.ROD_WIDTH)
    panels["rod"].set_title(MotionPanels(motion).title, fontsize=style.SMALL, loc="left")
    plot_motion(motion, panels["lengths"]).set_title("", loc="left")
    plot_ledger(motion, panels["energies"])
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # it need not be found again for every frame
    hands = [panels[name].axvline(0.0, color=style.HERE) for name in ("lengths", "energies")]

    def moved() -> Iterator[float]:
        for t in times:
            rod.set_data(*stage.places(float(t)))
            glue.set_data(*stage.glue(float(t)))
            for hand in hands:
                hand.set_xdata([(t - times[0]) / stage.times.size] * 2)
            yield float(t)

    return figure, moved()
