"""Geometry: assemblies, contacts, blocking and stability. The only place where FCL is spoken to."""
