"""The Franka Panda builds what a plan says: `build_with_panda`."""

from neurosym.simulation.panda.builder import build_with_panda, starting_places
from neurosym.simulation.panda.report import BuildReport, BuildSettings, Placement
from neurosym.simulation.panda.watching import CellFilm

__all__ = ["BuildReport", "BuildSettings", "CellFilm", "Placement", "build_with_panda", "starting_places"]
