"""Simulation in PyBullet: settling, an oracle in the loop, pictures. Importing this package loads no simulator."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from neurosym.simulation.client import Client, open_clients
    from neurosym.simulation.looks import STYLES, VIEWS, Camera, Style
    from neurosym.simulation.oracle import PhysicsOracle
    from neurosym.simulation.physics import Physics
    from neurosym.simulation.picture_cache import cached_pictures
    from neurosym.simulation.render import PictureStudio, render_many, render_views
    from neurosym.simulation.replay import replay_plan, replay_staging
    from neurosym.simulation.replay_report import ReplayReport, StepReplay
    from neurosym.simulation.scene import PALETTE
    from neurosym.simulation.world import World, stands

_HOME = {
    "client": ("Client", "open_clients"),
    "looks": ("STYLES", "VIEWS", "Camera", "Style"),
    "oracle": ("PhysicsOracle",),
    "physics": ("Physics",),
    "picture_cache": ("cached_pictures",),
    "render": ("PictureStudio", "render_many", "render_views"),
    "replay": ("replay_plan", "replay_staging"),
    "replay_report": ("ReplayReport", "StepReplay"),
    "scene": ("PALETTE",),
    "world": ("World", "stands"),
}

__all__ = [
    "PALETTE",
    "STYLES",
    "VIEWS",
    "Camera",
    "Client",
    "Physics",
    "PhysicsOracle",
    "PictureStudio",
    "ReplayReport",
    "StepReplay",
    "Style",
    "World",
    "cached_pictures",
    "open_clients",
    "render_many",
    "render_views",
    "replay_plan",
    "replay_staging",
    "stands",
]


def __getattr__(name: str) -> Any:
    for module, names in _HOME.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
