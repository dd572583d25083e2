"""From a folder or a file to an assembly: a reader for each format, and the checks of what was read.

A reader takes a path and gives `Contents`; what it cannot read is an `AssemblyError` that says why.
"""
