"""The commands of `neurosym`, a module each or two. Importing them loads nothing heavy: `--help` is immediate."""

import os

# Set before numpy is loaded: its matrices are small here, and threads that wait for one another take four times the
# time on a machine that has other work. torch has threads of its own.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
