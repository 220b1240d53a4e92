"""What the commands do, apart from the terminal: each yields sentences to show and writes its files.

Files are complete or absent (`bayesid._io.files`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.files import complete_folder, write_json
from bayesid._io.progress import Progress
from bayesid.app.demonstration import copy_demonstration
from bayesid.app.schema import Study
from bayesid.app.study_to_design import ASSUMED, assumed_encoders, encoders, fingerprint, load_problem
from bayesid.app.study_to_model import load_manoeuvres, load_model, load_posterior
from bayesid.design import Search, Store, best_design, design
from bayesid.design.base_prediction import BasePredictor
from bayesid.diagnosis import Diagnosis, diagnose, identify_extended
from bayesid.identifiability.unidentifiable import unidentifiable_sentences
from bayesid.inference import Identification
from bayesid.inference import identify as identify_posterior
from bayesid.inference.identified_robot import write_identified
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_file import write_netcdf
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.inference.recording_check import RecordingCheck, check_recording, refuse_wrong_units
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.plausibility import refuse_impossible_joints
from bayesid.recording.recording import Recording
from bayesid.report import (
    check_report,
    design_report,
    diagnosis_report,
    format_quantity,
    identification_report,
    prediction_report,
    simulation_report,
)
from bayesid.report.design_text import design_sentences
from bayesid.report.diagnosis_report import diagnosis_sentences

__all__ = ["run_check", "run_demo", "run_design", "run_diagnose", "run_identify", "run_predict", "run_simulate"]


def run_check(file: Path, output: Path) -> Iterator[str]:
    """Write check.json and report.pdf of a study."""
    study, posterior = _read(file)
    count = len(posterior.manoeuvres)
    yield f"{study.title}: {count} recordings, {posterior.samples} samples, {posterior.size} unknowns."
    checks = [check_recording(posterior, index) for index in range(len(posterior.manoeuvres))]
    with complete_folder(output) as folder:
        write_json(
            folder / "check.json", {"title": study.title, "recordings": [_check_dict(check) for check in checks]}
        )
        check_report(posterior, checks, study.title, folder / "report.pdf")
    for check in checks:
        yield f"{check.name}: {check.duration:.4g} s. " + (" ".join(check.warnings) or "Nothing conspicuous.")
    yield f"Wrote {output / 'report.pdf'}."


def run_identify(file: Path, output: Path, *, seed: int, effective_samples: float, progress: Progress) -> Iterator[str]:
    """Write identification.json, posterior.nc, the identified robot and report.pdf of a study."""
    study, posterior = _read(file)
    if not posterior.size:
        raise InputError("nothing is unknown", file=file, place="unknowns.bodies", remedy="Name a body to identify")
    yield f"{study.title}: {posterior.samples} samples, {posterior.size} unknowns, step {posterior.step:g} s."
    result = _identify(posterior, output, seed, effective_samples, progress)
    _write_identification(result, study.title, output, seed)
    yield from _summary(result)
    yield f"Wrote {output / 'report.pdf'}."


def run_diagnose(
    file: Path,
    output: Path,
    *,
    seed: int,
    effective_samples: float,
    sample: bool,
    progress: Progress,
    keep: Callable[[Diagnosis], None] | None = None,
) -> Iterator[str]:
    """Write diagnosis.json, unexplained.csv, posterior.nc of the extended model and report.pdf of a study.

    ``keep`` is handed the result.
    """
    study = Study.load(file)
    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    refuse_wrong_units(Posterior.of(model, manoeuvres))
    knows = all(section.argument_of_latitude is not None for section in study.recordings)
    result = diagnose(model, manoeuvres, seed, knows_latitude=knows, progress=progress)
    if keep is not None:
        keep(result)
    yield from diagnosis_sentences(result)
    identification = None
    if sample and result.posterior.size:
        progress(0.9, "sampling the extended model")
        identification = identify_extended(result, seed, effective_samples=effective_samples)
    with complete_folder(output) as folder:
        write_json(folder / "diagnosis.json", result.to_dict(identification))
        result.unexplained.write(folder / "unexplained.csv")
        if identification is not None:
            write_netcdf(identification, folder / "posterior.nc", np.random.default_rng(seed))
        diagnosis_report(result, identification, study.title, folder / "report.pdf")
    yield f"Wrote {output / 'report.pdf'}."


def run_simulate(file: Path, output: Path, *, seed: int, noise: bool) -> Iterator[str]:
    """Write simulated recordings, simulation.json and report.pdf of a study."""
    study, posterior = _read(file)
    recordings = simulate_recordings(posterior, np.random.default_rng(seed) if noise else None)
    error = integration_error_at(posterior, posterior.starting_point())
    with complete_folder(output) as folder:
        for recording in recordings:
            recording.write(folder / f"{recording.name}.csv")
        content = {
            "recordings": [
                {
                    "file": f"{recording.name}.csv",
                    "largest": {
                        kind.value: [
                            float(np.nanmax(np.abs(recording.channels[f"{kind.value}.{axis}"]))) for axis in "xyz"
                        ]
                        for kind in (sensor.kind for sensor in posterior.model.sensors)
                        if kind.mounted
                    },
                }
                for recording in recordings
            ],
            "noise": noise,
            "integration": {"step": posterior.step, "error_in_sigma": error},
        }
        write_json(folder / "simulation.json", content)
        simulation_report(posterior, recordings, study.title, folder / "report.pdf")
    yield f"Simulated {len(recordings)} recordings; integration step {posterior.step:g} s, error {error:.2g} sigma."
    yield f"Wrote {output / 'report.pdf'}."


def run_predict(
    file: Path, output: Path, *, posterior: Path | None, seed: int, draws: int, progress: Progress
) -> Iterator[str]:
    """Write prediction.json and report.pdf of the planned manoeuvres of a study.

    ``posterior`` takes the place of the study's prior.
    """
    study = Study.load(file)
    if posterior is not None:
        study = study.with_posterior(posterior)
    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    for manoeuvre in manoeuvres:
        refuse_impossible_joints(manoeuvre.recording, model.robot)
    tip = None if study.design is None else study.design.tip_frame
    streams, predictors, predictions = np.random.SeedSequence(seed).spawn(len(manoeuvres)), [], []
    for index, (manoeuvre, stream) in enumerate(zip(manoeuvres, streams, strict=True)):
        progress(index / len(manoeuvres), f"predicting {manoeuvre.recording.name}")
        predictors.append(BasePredictor(model, manoeuvre, tip))
        predictions.append(predictors[-1].predict(draws, np.random.default_rng(stream)))
    with complete_folder(output) as folder:
        write_json(folder / "prediction.json", {"recordings": [prediction.to_dict() for prediction in predictions]})
        prediction_report(predictors[0].posterior, manoeuvres, predictions, study.title, folder / "report.pdf")
    for prediction in predictions:
        final = prediction.tip.pose().millimetres
        place = ", ".join(format_quantity(float(m), float(s)) for m, s in zip(final.mean, final.sd, strict=True))
        yield f"{prediction.name}: {prediction.tip_frame} ends at ({place}) mm from where the base started."
    yield f"Wrote {output / 'report.pdf'}."


def run_design(
    file: Path, output: Path, *, seed: int, starts: int, iterations: int, progress: Progress
) -> Iterator[str]:
    """Write design.json, a recording of the joints of every designed manoeuvre, and report.pdf of a study."""
    study = Study.load(file)
    problem = load_problem(study)
    noise = encoders(study, problem.plan.model.robot)
    yield (
        f"{study.title}: {len(problem.criteria)} criteria, {problem.plan.family.size} parameters of "
        f"{problem.plan.family.name}, {problem.plan.family.duration:g} s."
    )
    if guessed := assumed_encoders(study, problem.plan.model.robot):
        yield f"The study gives no sensors.encoder.sigma of {', '.join(guessed)}: {ASSUMED:g} rad or m is assumed."
    progress(0.0, "compiling")
    key = f"{fingerprint(study)} {seed} {starts} {iterations}"
    store = Store.open(output / "search.json", key)
    try:
        designs = design(problem, seed, noise, Search(starts, iterations), store=store, progress=progress)
        best = best_design(designs)
    except InputError as error:
        raise error.within(file=file) from None
    with complete_folder(output) as folder:
        content = {"title": study.title, "seed": seed, "manoeuvres": [item.to_dict() for item in designs]}
        write_json(folder / "design.json", {**content, "best": best.name})
        for item in designs:
            joints = {key: values for key, values in item.manoeuvre.recording.channels.items() if "position." in key}
            Recording(item.name, None, item.manoeuvre.recording.time, joints).write(folder / f"{item.name}.csv")
        design_report(designs, best, study.title, folder / "report.pdf")
    (output / "search.json").unlink(missing_ok=True)
    yield from design_sentences(designs, best)
    yield f"Wrote {output / 'report.pdf'}."


def run_demo(output: Path, *, seed: int, effective_samples: float, progress: Progress) -> Iterator[str]:
    """Diagnose the shipped recordings, say what was hidden in them, and write the report."""
    answer = copy_demonstration(output / "study")
    yield f"Recordings of an independent simulator, with something hidden in them: {output / 'study'}."
    result: list[Diagnosis] = []
    yield from run_diagnose(
        output / "study" / "study.toml",
        output,
        seed=seed,
        effective_samples=effective_samples,
        sample=True,
        progress=progress,
        keep=result.append,
    )
    named = result[0].verdict.causes
    for cause, values in answer.items():
        parts = ", ".join(f"{key} {value:.4g}" for key, value in values.items())
        yield f"Hidden was {cause}: {parts}. {'It was found.' if cause in named else 'It was not found.'}"


def _read(file: Path) -> tuple[Study, Posterior]:
    study = Study.load(file)
    posterior = load_posterior(study)
    refuse_wrong_units(posterior)
    return study, posterior


def _identify(posterior: Posterior, output: Path, seed: int, wanted: float, show: Progress) -> Identification:
    output.mkdir(parents=True, exist_ok=True)
    show(0.0, "fitting")

    return identify_posterior(posterior, seed, effective_samples=wanted, file=output / "samples.h5", progress=show)


def _write_identification(result: Identification, title: str, output: Path, seed: int) -> None:
    with complete_folder(output) as folder:
        result.write_json(folder / "identification.json")
        write_netcdf(result, folder / "posterior.nc", np.random.default_rng(seed))
        if result.posterior.model.priors:
            write_identified(result, folder)
        identification_report(result, title, [], folder / "report.pdf")
    (output / "samples.h5").unlink(missing_ok=True)


def _summary(result: Identification) -> Iterator[str]:
    yield f"chi-square {result.optimum.chi2:.0f} over {result.posterior.samples} samples."
    for name, body in result.bodies.items():
        yield f"{name}: mass {body.mean[0]:.6g} +- {body.sd[0]:.2g} kg"
    yield from unidentifiable_sentences(result)
    yield from result.disagreements


def _check_dict(check: RecordingCheck) -> dict[str, Any]:
    content = asdict(check)
    for sensor in content["sensors"]:
        sensor["kind"] = sensor["kind"].value
    content["warnings"] = list(check.warnings)
    return content
