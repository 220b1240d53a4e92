"""Array types, rotations, interpolation, integration and small linear algebra, each in one place."""
