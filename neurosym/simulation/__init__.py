"""Simulation in PyBullet: settling, an oracle in the loop, pictures. Importing this package loads no simulator."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
