"""PDDL: a problem written for any classical planner, with what geometry found as facts."""
