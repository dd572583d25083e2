"""Triangles, topology and bounds. No module here knows what a part is."""
