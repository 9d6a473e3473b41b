"""Pictures: a rod and the forces on it, families of shapes, branches, figures on disk.

Functions draw into the axes they are given, or into a figure of their own, and return the axes.
Nothing here imports pyplot.  Where somebody else has, the figure is one of pyplot's, so that a notebook
shows it; elsewhere it works without a display.
"""

from .diagram import plot_branch
from .dispatch import draw
from .files import picture_file, png, save_figure
from .flaws import plot_held_lengths, plot_loading_curve, plot_safe_pressures
from .history import plot_history, plot_spent
from .motion import film, plot_ledger, plot_motion, plot_orbit, plot_shapes
from .rod import plot_equilibrium, plot_family

__all__ = [
    "draw",
    "film",
    "picture_file",
    "plot_branch",
    "plot_equilibrium",
    "plot_family",
    "plot_held_lengths",
    "plot_history",
    "plot_ledger",
    "plot_loading_curve",
    "plot_motion",
    "plot_orbit",
    "plot_safe_pressures",
    "plot_shapes",
    "plot_spent",
    "png",
    "save_figure",
]
