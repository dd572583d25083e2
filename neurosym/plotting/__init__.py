"""Figures. They are returned, never shown, and touch no global state of matplotlib: the caller saves or shows them."""

from typing import TYPE_CHECKING

from neurosym.plotting.curves import Curves, Spread, curves_figure
from neurosym.plotting.density import density_figure, kernel_density
from neurosym.plotting.errors import classes_figure, confusion_figure, repeats_figure
from neurosym.plotting.graphs import blocking_figure, contact_figure
from neurosym.plotting.iterations import LAST_BAR, iterations_figure
from neurosym.plotting.learning import learning_figure
from neurosym.plotting.points import Panel, points_figure
from neurosym.plotting.scores import scores_figure
from neurosym.plotting.search import search_figure
from neurosym.plotting.style import COLOURS, COLUMN, look_of, save, save_both

if TYPE_CHECKING:
    from neurosym.plotting.style import Figure as Figure

__all__ = [
    "COLOURS",
    "COLUMN",
    "LAST_BAR",
    "Curves",
    "Panel",
    "Spread",
    "blocking_figure",
    "classes_figure",
    "confusion_figure",
    "contact_figure",
    "curves_figure",
    "density_figure",
    "iterations_figure",
    "kernel_density",
    "learning_figure",
    "look_of",
    "points_figure",
    "repeats_figure",
    "save",
    "save_both",
    "scores_figure",
    "search_figure",
]
