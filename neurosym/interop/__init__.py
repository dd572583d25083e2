"""What other planning libraries know this one by: an engine for unified-planning."""

from neurosym.interop.registration import register_engine

__all__ = ["register_engine"]
