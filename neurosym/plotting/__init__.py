"""Figures. They are returned, never shown, and touch no global state of matplotlib: the caller saves or shows them."""

from neurosym.plotting.iterations import LAST_BAR, iterations_figure
from neurosym.plotting.style import COLOURS, COLUMN, save

__all__ = ["COLOURS", "COLUMN", "LAST_BAR", "iterations_figure", "save"]
