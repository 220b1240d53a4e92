"""Independent sources of truth: simulators and hidden causes that share no code with the package.

`mujoco` and `basilisk` fly robots with hidden parts and write studies; `stepwise` integrates Pinocchio's equations in
the plainest way; `hidden_causes` is the catalogue of what a study may hide. Nothing here imports `bayesid`.
"""
