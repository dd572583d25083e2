"""The commands of `neurosym`, a module each or two. Importing them loads nothing heavy: `--help` is immediate."""
