"""What stands in the way of what, along straight lines: the directional blocking graph."""
