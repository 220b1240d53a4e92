# %% [markdown]
"""
This page repeats the demonstration of the command line step by step in Python. Its files are part of the package:
three recordings of a servicer with a robot arm, simulated by MuJoCo with one effect that the study does not mention.
The study names the robot, the sensors and their noise, the recordings, and the unknowns. All output below was produced
when this site was built.
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

Most misfits come from wrong axes, signs or units. `check` looks for them without fitting anything.
"""

# %%
checked = bayesid.check(study)
print(checked)

# %%
bayesid.plot_manoeuvre(checked.posterior, 0)

# %% [markdown]
"""
## Diagnose

Every command is also a function, with a seed if it uses random numbers. `diagnose` fits the study as it is, compares
the causes of the catalogue, and samples the posterior of the model that includes the named cause.
"""

# %%
diagnosis = bayesid.diagnose(study, seed=0, effective_samples=500)
print(diagnosis)

# %% [markdown]
"""
The picture has the robot with the cause on the left, and on the right the residual of the sensor axis that the cause
affects most, before and after the cause is included.
"""

# %%
bayesid.plot_verdict(diagnosis)

# %% [markdown]
"""
The effect that was hidden in the recordings:
"""

# %%
print((folder / "hidden.json").read_text())

# %% [markdown]
"""
## Use the result

The identification of the extended model has named fields. Each quantity has a mean, a standard deviation, a unit and
intervals.
"""

# %%
result = diagnosis.identification
assert result is not None  # None if not sampled
base = result.bodies["base_link"]
print("mass:", base.mass)
print("inertia xx, 95 %:", base.inertia.xx.interval(0.95))
print("chi-square per sample with the cause:", diagnosis.gain.after.chi2_per_sample)

# %%
bayesid.plot_posterior(result, "base_link")

# %% [markdown]
"""
The robot with the posterior mean of the base can be written as URDF for use in other software:
"""

# %%
result.to_urdf("identified.urdf")
print(Path("identified.urdf").read_text()[:220])
