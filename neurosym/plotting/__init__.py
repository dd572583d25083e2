"""Figures. They are returned, never shown, and touch no global state of matplotlib: the caller saves or shows them."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
