"""Which parts stand still under gravity, which fall without which, and what to hold."""
