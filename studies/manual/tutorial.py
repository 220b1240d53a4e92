# %% [markdown]
"""
The demonstration of the command line, step by step in Python. The package includes its files: three recordings of a
servicer with a robot arm, simulated by MuJoCo with one effect that the study does not mention. The study names the
robot, the sensors with their noise, the recordings and what is unknown. This page was executed when the site was
built.
"""

# %%
from pathlib import Path

import bayesid

folder = Path(bayesid.__file__).parent / "app" / "demonstration_data"
study = folder / "study.toml"
print(study.read_text())

# %% [markdown]
"""
## Check the recordings

Wrong axes, signs and units are the most frequent mistakes. `check` fits nothing.
"""

# %%
checked = bayesid.check(study)
print(checked)

# %%
bayesid.plot_manoeuvre(checked.posterior, 0)

# %% [markdown]
"""
## Diagnose

Every command is a function with a seed. `diagnose` fits the study as it is, compares the causes of the catalogue, and
samples the posterior of the model with the named cause.
"""

# %%
diagnosis = bayesid.diagnose(study, seed=0, effective_samples=500)
print(diagnosis)

# %% [markdown]
"""
The picture contains the robot with the cause, and the residual of the sensor axis that the cause changes most, without
it and with it.
"""

# %%
bayesid.plot_verdict(diagnosis)

# %% [markdown]
"""
What was hidden in the recordings:
"""

# %%
print((folder / "hidden.json").read_text())

# %% [markdown]
"""
## Use the result

The identification of the extended model has named fields. Quantities have a mean, a standard deviation, a unit and
intervals.
"""

# %%
result = diagnosis.identification
assert result is not None  # None if not sampled
base = result.bodies["base_link"]
print("mass:", base.mass)
print("inertia xx, 95 %:", base.inertia.xx.interval(0.95))
print("chi-square per sample with the cause:", diagnosis.to_dict()["gain"]["chi2_per_sample"]["after"])

# %%
bayesid.plot_posterior(result, "base_link")

# %% [markdown]
"""
The robot with the posterior mean of the base, for another program:
"""

# %%
result.to_urdf("identified.urdf")
print(Path("identified.urdf").read_text()[:220])
