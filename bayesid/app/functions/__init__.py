"""The functions of the commands: each takes a study, as a file or as objects, and a seed, and returns its result."""
