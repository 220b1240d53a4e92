"""The search through sets of causes: linearise, enumerate, refit, weigh."""
