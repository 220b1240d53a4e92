"""Command ``bayesid loop``, which plans a manoeuvre, has it executed, identifies the bodies and plans again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid.app.options import Output, Samples, Seed, StudyFile

if TYPE_CHECKING:
    from bayesid.design.loop_history import History

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    samples: Samples = 2000.0,
    spacecraft: Annotated[
        Path | None, typer.Option(help="Python file that executes plans; without it, put the recordings into DIR.")
    ] = None,
    wanted: Annotated[float, typer.Option(help="Relative sd of mass and principal moments at which to stop.")] = 0.01,
    at_most: Annotated[int, typer.Option(help="Largest number of manoeuvres.")] = 5,
) -> Iterator[str]:
    """Plan a manoeuvre, have it executed, identify, and plan again from the posterior: loop.json."""
    if not 0.0 < wanted < 1.0:
        raise InputError(
            f"{wanted:g} is not between 0 and 1", place="--wanted", remedy="Give a relative precision: 0.01 is 1 %"
        )
    if at_most < 1:
        raise InputError(f"{at_most} manoeuvres", place="--at-most", remedy="Allow at least one")

    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid.app.study_to_design import load_loop_problem
    from bayesid.app.study_to_encoders import encoder_noise
    from bayesid.app.user_spacecraft import Nobody, load_spacecraft
    from bayesid.design import Loop, Sampled

    problem = load_loop_problem(study)
    loop = Loop(
        problem,
        encoder_noise(study, problem.plan.model.robot),
        seed=seed,
        wanted=wanted,
        at_most=at_most,
        identifier=Sampled(samples),
    )
    history = loop.run(Nobody() if spacecraft is None else load_spacecraft(spacecraft), output, progress)
    yield from _sentences(history, wanted)


def _sentences(history: History, wanted: float) -> Iterator[str]:
    for step in history.steps:
        number, attempts = step["step"], step["plan"]["attempts"]
        if len(attempts) > 1:
            yield f"Step {number}: limits tightened {len(attempts) - 1} times until they held with 99 %."
        identification = step.get("identification")
        if identification is not None:
            for name, body in identification["bodies"].items():
                yield f"Step {number}: {name}: mass {body['mass']['mean']:.6g} +- {body['mass']['sd']:.2g} kg"
            precision = identification["precision"]
            yield f"Step {number}: the worst of mass and principal moments is known to {precision:.2%}."
            yield from identification["disagreements"]
    number = len(history.steps)
    if history.status == "waiting":
        yield f"Fly {history.path(number, 'plan')}: positions, velocities and accelerations of the joints."
        recording = history.path(number, "recording")
        yield f"Write the readings of the sensors and encoders to {recording}, then run this command again."
    elif history.status == "no-go":
        broken = [name for name, item in attempts[-1]["limits"].items() if not item["quantile_99"] <= item["limit"]]
        yield f"No go: {', '.join(broken)} would not hold with 99 %, however small the manoeuvre was made."
    elif history.status == "reached":
        yield f"The wanted {wanted:.2%} are reached after {number} manoeuvres."
    else:
        yield f"The wanted {wanted:.2%} are not reached after {number} manoeuvres; --at-most allows more."
    yield f"Wrote {history.folder / 'loop.json'}."
