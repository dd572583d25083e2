"""What every room uses and none owns: files that are written whole, and lists of names in sentences."""
