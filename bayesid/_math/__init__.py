"""Array types, rotations and small linear algebra, each once."""
