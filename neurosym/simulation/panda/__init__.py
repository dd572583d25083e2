"""The Franka Panda builds what a plan says: `build_with_panda`."""

from neurosym.simulation.panda.builder import (
    BuildReport,
    BuildSettings,
    Placement,
    build_with_panda,
    starting_places,
)

__all__ = ["BuildReport", "BuildSettings", "Placement", "build_with_panda", "starting_places"]
