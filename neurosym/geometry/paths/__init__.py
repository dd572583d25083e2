"""Ways out that are no straight line: lattices, moves of voxel parts, and sampling (OMPL)."""
