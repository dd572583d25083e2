"""From a folder or a file to an assembly: a reader for each format, and the checks of what was read."""
