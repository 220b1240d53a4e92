"""What a perturbation of the model does to the whitened residual, and fits with perturbations."""
