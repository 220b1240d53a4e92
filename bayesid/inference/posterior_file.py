"""Results as ArviZ data: posterior, log likelihood, posterior predictive and observed data, with units and frames."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bayesid._io.files import complete_file
from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import BODY_QUANTITIES, bodies_of, reported_effect
from bayesid.inference.ensemble import Chains
from bayesid.inference.importance import Evidence
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import noisy, predicted_readings
from bayesid.simulation.sensors import SensorKind

if TYPE_CHECKING:
    from xarray import DataTree

__all__ = ["SampledResult", "to_arviz", "write_draws", "write_netcdf"]


STORED = 1000
"""Number of draws stored per ensemble; draws closer than an autocorrelation time carry little information."""

PREDICTED = 50
"""Number of posterior predictive draws per ensemble, each of which takes a simulation."""

CENTRAL = "link axes; the inertia is about the centre of mass"
"""Frame of the reported quantities of a body."""

LINEAR = ("m", "mc.x", "mc.y", "mc.z", "xx", "xy", "yy", "xz", "yz", "zz")
"""Names of the linear parameters of a body (`InertialParameters.vector`), which a later study reads."""


class SampledResult(Protocol):
    """Posterior with its samples."""

    @property
    def posterior(self) -> Posterior:
        """Posterior that was sampled."""
        ...

    @property
    def chains(self) -> Chains:
        """Posterior samples."""
        ...

    @property
    def evidence(self) -> Evidence:
        """Evidence by importance sampling."""
        ...


def to_arviz(result: SampledResult, rng: np.random.Generator) -> DataTree:
    """Return a result as ArviZ data, in which each independent ensemble is a chain.

    The group ``posterior`` holds the physical quantities, ``inertial`` with the linear parameters of all bodies,
    marginalised ones included, and ``z`` with the coordinates of standard-normal prior; ``prior`` holds the same. The
    other groups are ``sample_stats`` with the log density over ``z``, ``log_likelihood`` by recording,
    ``posterior_predictive`` with sensor noise, and ``observed_data``.

    Parameters
    ----------
    result : Identification
    rng : numpy.random.Generator
        Of the sensor noise.
    """
    import arviz_base as az  # imported here, since it takes a second that commands without samples save

    z = _thin(result.chains.z, STORED)
    few = z[:, :: max(1, z.shape[1] // PREDICTED)][:, :PREDICTED]
    posterior, dims, attributes = _posterior_group(result, z)
    predictive = _predictive(result, few, rng)
    prior, _, _ = _posterior_group(result, rng.normal(size=(1, STORED, result.posterior.size)))
    data = az.from_dict(
        {
            "posterior": posterior,
            "prior": prior,
            "sample_stats": {
                "lp": result.posterior.log_prior(z) + _thin(result.chains.log_likelihood, STORED).sum(axis=2)
            },
            "log_likelihood": _log_likelihood(result),
            "posterior_predictive": predictive,
            "observed_data": _observed(result),
        },
        dims={**dims, **_sensor_dims(result)},
        coords=_coords(result),
    )
    for name, described in attributes.items():
        data["posterior"][name].attrs.update(described)
        data["prior"][name].attrs.update(described)
    for group in (data["posterior_predictive"], data["observed_data"]):
        for sensor in result.posterior.model.sensors:
            for manoeuvre in result.posterior.manoeuvres:
                variable = group[_name(sensor.kind, manoeuvre.recording.name)]
                variable.attrs.update(unit=sensor.kind.unit, frame=sensor.kind.frame)
        for manoeuvre in result.posterior.manoeuvres if result.posterior.model.torque is not None else ():
            group[f"torque.{manoeuvre.recording.name}"].attrs.update(unit="N m or N", frame="along the joint's axis")
    data["posterior"].attrs.update(
        unknowns=list(result.posterior.unknowns.names),
        log_evidence=result.evidence.value,
        log_evidence_error=result.evidence.error,
        pareto_k=result.evidence.pareto_k,
    )
    return data


def write_netcdf(result: SampledResult, file: Path, rng: np.random.Generator) -> None:
    """Write `to_arviz` to a NetCDF file, whole or not at all.

    Parameters
    ----------
    result : Identification
    file : Path
    rng : numpy.random.Generator
        Of the sensor noise.
    """
    with complete_file(file) as part:
        to_arviz(result, rng).to_netcdf(str(part))


def write_draws(names: Sequence[str], values: Floats, file: Path) -> None:
    """Write draws (chains, draws, bodies, 10) of the linear parameters of bodies to a file, whole or not at all.

    `InertialDraws.read` reads them as it reads the file of a whole posterior.

    Parameters
    ----------
    names : (bodies,) sequence of str
        Names of the bodies.
    values : (chains, draws, bodies, 10) array
        Linear parameters, SI.
    file : Path
    """
    import arviz_base as az  # imported here, since it takes a second that commands without samples save

    dims, coords = {"inertial": ["body", "parameter"]}, {"body": list(names), "parameter": list(LINEAR)}
    data = az.from_dict({"posterior": {"inertial": values}}, dims=dims, coords=coords)
    with complete_file(file) as part:
        data.to_netcdf(str(part))


def _thin(draws: Floats, count: int) -> Floats:
    return draws[:, :: max(1, draws.shape[1] // count)][:, :count]


def _posterior_group(
    result: SampledResult, z: Floats
) -> tuple[dict[str, Floats], dict[str, list[str]], dict[str, dict[str, str]]]:
    """Return the variables, each (chains, draws, ...), their further dimensions, and their units and frames."""
    chains, draws, size = z.shape
    flat = z.reshape(-1, size)
    group: dict[str, Floats] = {"z": z}
    dims: dict[str, list[str]] = {"z": ["unknown"]}
    attributes = {"z": {"unit": "1"}}
    for name, body in bodies_of(result.posterior, flat).items():
        for column, (key, unit) in enumerate(BODY_QUANTITIES.items()):
            group[f"{name}.{key}"] = body.values[:, column].reshape(chains, draws)
            attributes[f"{name}.{key}"] = {"unit": unit, "frame": CENTRAL}
    values = result.posterior.unknowns.values_of(flat)
    if result.posterior.model.priors:
        group["inertial"] = np.asarray(values.inertial).reshape(chains, draws, -1, 10)
        dims["inertial"] = ["body", "parameter"]
        attributes["inertial"] = {"unit": "kg, kg m, kg m2", "frame": "link axes, about the origin of the link"}
    for effect, parameters in zip(result.posterior.model.effects, values.effects, strict=True):
        reported = reported_effect(effect, np.asarray(parameters)) if effect.parameters else np.zeros((0, 0))
        for column, (key, unit) in enumerate(effect.quantities):
            name = f"{effect.label}.{key}"
            group[name] = reported[..., column].reshape(chains, draws, *reported.shape[1:-1])
            attributes[name] = {"unit": unit}
            if effect.per_recording:
                dims[name] = ["recording"]
    group["initial-rate"] = np.asarray(values.rate).reshape(chains, draws, -1, 3)
    dims["initial-rate"] = ["recording", "axis"]
    attributes["initial-rate"] = {"unit": "rad/s", "frame": "base axes"}
    return group, dims, attributes


def _coords(result: SampledResult) -> dict[str, Any]:
    coords: dict[str, Any] = {
        "unknown": list(result.posterior.unknowns.names),
        "body": [prior.name for prior in result.posterior.model.priors],
        "parameter": list(LINEAR),
        "recording": [manoeuvre.recording.name for manoeuvre in result.posterior.manoeuvres],
        "axis": ["x", "y", "z"],
        "quaternion": ["x", "y", "z", "w"],
    }
    coords |= {_axis(kind): list(kind.axes) for kind in result.posterior.model.channels.kinds}
    if (torque := result.posterior.model.torque) is not None:
        coords["joint"] = list(torque.joints)
    for index, manoeuvre in enumerate(result.posterior.manoeuvres):
        coords[f"time.{manoeuvre.recording.name}"] = result.posterior.data.times(index)
    return coords


def _sensor_dims(result: SampledResult) -> dict[str, list[str]]:
    recordings = [manoeuvre.recording.name for manoeuvre in result.posterior.manoeuvres]
    dims = {
        _name(kind, name): [f"time.{name}", _axis(kind)]
        for kind in result.posterior.model.channels.kinds
        for name in recordings
    }
    if result.posterior.model.torque is not None:
        dims |= {f"torque.{name}": [f"time.{name}", "joint"] for name in recordings}
    return dims


def _axis(kind: SensorKind) -> str:
    """Return the name of the dimension of a sensor's components."""
    return {("x", "y", "z"): "axis", ("x", "y", "z", "w"): "quaternion"}.get(kind.axes, f"axis.{kind.value}")


def _name(kind: SensorKind, recording: str) -> str:
    return f"{kind.value}.{recording}"


def _log_likelihood(result: SampledResult) -> dict[str, Floats]:
    values = _thin(result.chains.log_likelihood, STORED)
    return {m.recording.name: values[:, :, index] for index, m in enumerate(result.posterior.manoeuvres)}


def _observed(result: SampledResult) -> dict[str, Floats]:
    observed = {}
    for index, manoeuvre in enumerate(result.posterior.manoeuvres):
        times = result.posterior.data.times(index)
        for sensor in result.posterior.model.sensors:
            time, values = result.posterior.data.measured(index, sensor.kind)
            grid = np.full((len(times), values.shape[1]), np.nan)
            grid[np.searchsorted(times, time)] = values
            observed[_name(sensor.kind, manoeuvre.recording.name)] = grid
        if result.posterior.model.torque is not None:
            time, values = result.posterior.data.torques(index)
            grid = np.full((len(times), values.shape[1]), np.nan)
            grid[np.searchsorted(times, time)] = values
            observed[f"torque.{manoeuvre.recording.name}"] = grid
    return observed


def _predictive(result: SampledResult, z: Floats, rng: np.random.Generator) -> dict[str, Floats]:
    """Return predicted readings with fresh noise of the sensors, for draws of shape (chains, draws, size)."""
    chains, draws, size = z.shape
    points = [predicted_readings(result.posterior, point) for point in z.reshape(-1, size)]
    predictive = {}
    for index, manoeuvre in enumerate(result.posterior.manoeuvres):
        name = manoeuvre.recording.name
        read = [noisy(result.posterior, index, point[index], rng) for point in points]
        series = {_name(kind, name): [one.channels[kind] for one in read] for kind in read[0].channels}
        if result.posterior.model.torque is not None:
            series[f"torque.{name}"] = [one.torque for one in read]
        for key, values in series.items():
            predictive[key] = np.stack(values).reshape(chains, draws, *values[0].shape)
    return predictive
