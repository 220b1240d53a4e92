"""Kinds of causes: what each would change in the residual."""
