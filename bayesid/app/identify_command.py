"""Command ``bayesid identify``, which samples the unknown bodies of a study by emcee."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from bayesid._io.progress import Progress, part_of
from bayesid.app.options import Output, Samples, Scheduler, Seed, StudyFile, executor_of

if TYPE_CHECKING:
    from bayesid.inference import Identification

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    effective_samples: Samples = 4000.0,
    scheduler: Scheduler = None,
) -> Iterator[str]:
    """Compute the posterior distribution of the inertial parameters of the unknown bodies."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    import numpy as np

    from bayesid._io.files import claimed_folder, complete_folder, write_json
    from bayesid._io.progress import PhaseClock
    from bayesid.app.functions.identify_study import identify
    from bayesid.app.functions.study_source import recorded_posterior
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_draft import open_places
    from bayesid.inference.posterior_as_prior import write_identified
    from bayesid.inference.posterior_file import write_netcdf
    from bayesid.report import identification_report

    clock = PhaseClock()
    with executor_of(scheduler) as executor:
        posterior = recorded_posterior(study, progress=part_of(progress, 0.0, 0.05), executor=executor)
    yield f"{study.title}: {posterior.samples} samples, {posterior.size} unknowns, step {posterior.step:g} s."
    yield from open_places(study)
    clock.ends("load")
    with claimed_folder(output):
        progress(0.0, "fitting")
        kept = output / "samples.h5"
        result = identify(posterior, seed, effective_samples=effective_samples, file=kept, progress=progress)
        clock.ends("fit")
        clock.moves("fit", "sample", result.seconds)
        with complete_folder(output) as folder:
            write_netcdf(result, folder / "posterior.nc", np.random.default_rng(seed))
            if result.posterior.model.priors:
                write_identified(result, folder)
            origin = report_origin(study, "identify", seed, output=output, samples=effective_samples)
            identification_report(result, study.title, [], folder / "report.pdf", origin=origin)
            clock.ends("report")
            write_json(
                folder / "identification.json",
                result.to_dict() | {"noise": study.model.noise, "seconds": clock.seconds},
            )
        kept.unlink(missing_ok=True)
    yield from _summary(result)
    yield f"Wrote {output / 'report.pdf'}."


def _summary(result: Identification) -> Iterator[str]:
    from bayesid.identifiability.directions import unidentifiable_sentences
    from bayesid.report.identification_report import LIMIT
    from bayesid.report.numbers import format_quantity

    samples, (expected, spread) = result.posterior.samples, result.expected_chi2
    misfit = "" if result.chi2_deviation <= LIMIT else " The model does not explain the data: run bayesid diagnose."
    yield (
        f"Chi-square per sample is {result.optimum.chi2 / samples:.3f}; noise alone gives {expected / samples:.3f} ± "
        f"{spread / samples:.3f}.{misfit}"
    )
    for name, body in result.bodies.items():
        yield f"{name}: mass {format_quantity(body.mean[0], body.sd[0])} kg"
    yield from unidentifiable_sentences(result)
    yield from result.disagreements
