"""What is where, and what is possible: assemblies as data, and the questions about them, a room each."""
