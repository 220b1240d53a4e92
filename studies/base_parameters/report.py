"""The study's report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from bayesid import Robot
from bayesid.identifiability import Base, BaseParameters
from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, TRUTH, styled, wide_figure
from bayesid.report.numbers import format_number, format_percent, format_range, format_vector
from studies.base_parameters.structure import (
    STATES,
    WRONG,
    Comparison,
    Equations,
    Recovery,
    ScaleCase,
    Structure,
    compare,
    equations_at,
    identify_by_torques,
    scale_cases,
    structure,
)
from studies.common.ets7 import ets7
from studies.common.provenance import MODELS
from studies.common.report_parts import add_number_table
from studies.common.study import (
    CsvTable,
    Finding,
    Goal,
    Picture,
    Report,
    Setup,
    Severity,
    Statement,
    Study,
    Verdict,
    show,
)

_LOWERED = str.maketrans("0123456789-", "₀₁₂₃₄₅₆₇₈₉₋")

_LETTERS = {"mass": "m", "first": "h", "inertia": "I"}


def symbol(name: str, bodies: Sequence[str]) -> str:
    """Return ``m₂``, ``hz₂`` or ``Iyy₂`` for a parameter of body 2; the base is body 0."""
    body, quantity = name.split(".", 1)
    kind, _, axes = quantity.partition(".")
    return f"{_LETTERS[kind]}{axes}{str(bodies.index(body)).translate(_LOWERED)}"


def regrouping_rows(base: BaseParameters) -> list[list[str]]:
    """Return every base parameter that is a sum of standard parameters: the name of its first one, and the sum."""
    pairs = zip(base.independent, base.regrouping, strict=True)
    return [[name, symbol(name, _bodies(base)) + _sum(base, row)] for name, row in pairs if row.any()]


def unchanged(base: BaseParameters) -> list[str]:
    """Return the base parameters that are standard parameters."""
    pairs = zip(base.independent, base.regrouping, strict=True)
    return [symbol(name, _bodies(base)) for name, row in pairs if not row.any()]


def _bodies(base: BaseParameters) -> list[str]:
    return list(dict.fromkeys(name.split(".", 1)[0] for name in base.standard))


def _sum(base: BaseParameters, row: NDArray[np.floating]) -> str:
    """Return the terms of a sum; equal ones of successive bodies are drawn together, such as ``m₂₋₄``."""
    bodies, text = _bodies(base), ""
    letters = dict.fromkeys(name.split(".", 1)[1] for name in base.dependent)
    for letter in letters:
        terms = [
            (bodies.index(name.split(".", 1)[0]), round(float(value), 9))
            for name, value in zip(base.dependent, row, strict=True)
            if name.endswith(f".{letter}") and value
        ]
        # successive bodies with one coefficient: body less place is the same for all of them
        for _, alike in groupby(enumerate(terms), key=lambda numbered: (numbered[1][0] - numbered[0], numbered[1][1])):
            run_of = [term for _, term in alike]
            first, last, value = run_of[0][0], run_of[-1][0], run_of[0][1]
            one = symbol(f"{bodies[first]}.{letter}", bodies)
            group = one if first == last else one + f"-{last}".translate(_LOWERED)
            size = "" if abs(value) == 1.0 else f"{format_number(abs(value), 6)} "
            text += f" {'−' if value < 0.0 else '+'} {size}{group}"
    return text


COUNTS = (24, 52)  # numbers of base parameters by the paper's rules: 30 − 6 for two joints, 70 − 18 for six

# largest relative error of a parameter, and largest angle between two spaces [rad], that count as rounding
EXACT = 1e-9

# explanation of the symbols of tables
LETTERS = (
    "Body 0 is the base, body i the link behind joint i. m is a mass, h a first moment of mass and I an inertia about "
    "the origin of the body's frame, in its axes; m₂₋₄ stands for m₂ + m₃ + m₄."
)


@dataclass(frozen=True)
class Result:
    """Content of the report."""

    # identifiable parameters of the robot with two joints and of ETS-VII
    planar: Structure
    equations: Equations  # equations of the robot with two joints in one state
    arm: Structure
    grounded: tuple[Structure, Structure]  # identifiable parameters of both robots on a fixed base
    recovery: Recovery  # identification of ETS-VII from motion and joint torques
    scale: tuple[ScaleCase, ...]  # base parameters of ETS-VII that different data determine
    peers: tuple[Comparison, ...]  # comparison with other tools for both robots on a fixed base
    tilted: Comparison  # the same for ETS-VII in tilted gravity
    seed: int  # seed of the random states


@threadpool_limits.wrap(limits=1)  # threads would slow the many small factorisations down
def run(*, seed: int = 1, progress: Callable[[str], None] = show) -> Result:
    """Run the study with random states that follow from the seed."""
    planar, arm = Robot.shipped("planar"), ets7()
    rngs = [np.random.default_rng(stream) for stream in np.random.SeedSequence(seed).spawn(5)]
    return Result(
        planar=structure(planar),
        equations=equations_at(planar, rngs[0]),
        arm=structure(arm),
        grounded=(structure(planar, Base.FIXED), structure(arm, Base.FIXED)),
        recovery=identify_by_torques(arm, rngs[1]),
        scale=scale_cases(arm, rngs[2]),
        peers=tuple(compare(robot, rngs[3]) for robot in (planar, arm)),
        tilted=compare(arm, rngs[4], gravity=(3.0, 2.0, -9.0)),
        seed=seed,
    )


def _report(result: Result) -> Report[Result]:
    planar, arm = result.planar.base, result.arm.base
    open_cases = sum(case.open_scale for case in result.scale)
    return Report(
        title="Identifiability: base inertial parameters",
        subtitle="Section 3.1 of Lampariello and Hirzinger (IDETC 2005)",
        question="Ten numbers describe the inertia of a rigid body. Which combinations of the robot's 10 (n + 1) "
        "numbers do motion and joint torques determine, and what fixes the scale of the masses, which motion alone "
        "does not determine?",
        answer=f"Motion and joint torques determine {arm.count} independent linear combinations of the "
        f"{len(arm.standard)} inertial parameters of ETS-VII. Of a robot with two joints they determine {planar.count} "
        f"of {len(planar.standard)}. Motion alone does not determine the scale of all masses; the gravity gradient "
        "does not provide it either, but one known body, torque or thrust does.",
        goals=goals_of(result),
        valid="bodies are rigid and joints ideal, without friction and rotors. How well a manoeuvre with noisy sensors "
        "determines each sum is a separate question, which the posterior answers.",
        full=True,
        figure=Picture(
            singular_figure(result),
            "Singular values of the regressor in random states with columns of unit length, relative to the largest: "
            "those retained (blue) and those dropped (grey), which are rounding errors. The line is the threshold.",
        ),
        setup=Setup(
            robot="The example robot planar, a base of 60 kg and two links of about 5 kg that turn about z, in place "
            "of the paper's two-joint example, which has no numbers; and ETS-VII with six joints.",
            manoeuvre="None: random states with joint angles anywhere on the circle, speeds and accelerations of unit "
            "size, and either no wrench or a known one.",
            sensors="None: only the structure of the equations matters, without noise.",
            known="Kinematics.",
            unknown="All inertial parameters.",
            replicates=f"Random states of seed {result.seed}. A rank is accepted only if Gram-Schmidt, pivoted QR and "
            f"singular values agree with a threshold of 10⁻¹⁰. {len(result.scale)} kinds of data; {open_cases} do not "
            "determine the scale.",
        ),
        sections=[_negatives, _evidence],
        statements=_statements(result),
        tables=_tables(result),
        beside="Tables with this report: β of (24) for the two-joint robot ({0}), the sums of ETS-VII as formulas "
        "({1}), and the numbers of base parameters on a fixed base by bayesid, Pinocchio's rank and FIGAROH ({2}). "
        f"{LETTERS}",
    )


def goals_of(result: Result) -> list[Goal]:
    """Return the goals."""
    counts = (result.planar.base.count, result.arm.base.count)
    recovery, alike = result.recovery, np.abs(result.equations.regressor - result.equations.pinocchio).max()
    ranks = [(case.count, case.rank) for case in (*result.peers, result.tilted)]
    return [
        Goal(
            f"numbers of base parameters agree with the paper's rules: {COUNTS[0]} and {COUNTS[1]}",
            f"{counts[0]} and {counts[1]}",
            Verdict.of(counts == COUNTS),
            Severity.HIGH,
        ),
        Goal(
            "agreement with Pinocchio: wrench and torques of (23), all parameters recovered by (24) from its torques "
            "once the dependent ones are known, and rank on a fixed base, for both robots and for ETS-VII in tilted "
            "gravity",
            f"largest difference {format_number(float(alike), 1)} N, N m; largest relative error "
            f"{format_number(recovery.standard_error, 1)}; "
            + ", ".join(f"{count} and {rank}" for count, rank in ranks),
            Verdict.of(
                alike < EXACT and recovery.standard_error < EXACT and all(count == rank for count, rank in ranks)
            ),
            Severity.HIGH,
        ),
        _peer_goal(result),
    ]


def _peer_goal(result: Result) -> Goal:
    """Return the goal on the comparison with FIGAROH, not tested where that is not installed."""
    angles = [case.angle for case in (*result.peers, result.tilted)]
    known = [angle for angle in angles if angle is not None]
    if len(known) < len(angles):
        text = "the same space of base parameters as FIGAROH on a fixed base"
        return Goal(text, "FIGAROH not installed", Verdict.NOT_TESTED, Severity.HIGH)
    return Goal(
        f"the same space of base parameters as {result.tilted.tool} on a fixed base, three cases",
        f"largest angle {format_number(max(known), 1)} rad",
        Verdict.of(max(known) < EXACT),
        Severity.HIGH,
    )


def _negatives(document: Document, result: Result) -> None:
    document.section("What cannot be identified")
    recovery: Recovery = result.recovery
    name, true, wrong = recovery.shifted[0]
    links = [case.determined.gap[0] for case in _links(result)]
    document.items(
        [
            "No data of motion and torques determine the dependent parameters K₂ (mass, first moment along the joint's "
            f"axis and one moment of each link). K₂ that is {format_percent(WRONG - 1.0)} too large explains {STATES} "
            f"exact states equally well (torques differ by {format_number(recovery.torque_error, 1)} of the largest), "
            f"with other values of the independent parameters K₁: {name} becomes {format_number(wrong, 4)} instead of "
            f"{format_number(true, 4)} (SI units). "
            f"{recovery.untouched} parameters of K₁ do not change.",
            "Motion without torques does not determine the scale of all masses: multiplied by a common factor, they "
            "give the same motion. The gravity gradient does not help, since its wrench is linear in the same "
            "parameters (equivalence principle).",
            "The mass of the base alone does not fix the scale, because mass can be shifted from the base to the first "
            "joint's axis; nor does a known load on an unknown link, because the data depend on the sum of both only.",
            "A light known body fixes the scale only weakly: the smallest retained singular value is "
            f"{format_number(min(links), 1)} to {format_number(max(links), 1)} with one known link, compared with "
            f"{format_number(_case(result, 'motion, base_link known').determined.gap[0], 1)} with a known base.",
        ]
    )


def _links(result: Result) -> list[ScaleCase]:
    """Return the cases in which one link of ETS-VII is known."""
    joints = len(result.arm.robot.joints)
    return [_case(result, f"motion, link{index} known") for index in range(1, joints + 1)]


def _scale_rows(result: Result) -> list[list[str]]:
    """Return what every kind of data determines; one row for all links of which one is known."""
    links = _links(result)
    rows = []
    for case in result.scale:
        if case not in links:
            rows.append(_scale_row(case.data, [case]))
        elif case is links[0]:
            rows.append(_scale_row(f"motion, one of link1 to link{len(links)} known", links))
    return rows


def _scale_row(title: str, cases: list[ScaleCase]) -> list[str]:
    (open_scale,) = {case.open_scale for case in cases}
    (rank,) = {case.determined.rank for case in cases}
    kept, dropped = zip(*(case.determined.gap for case in cases), strict=True)
    scale = "open" if open_scale else "known"
    return [title, scale, str(rank), format_range(kept, 2), format_number(max(dropped), 1)]


def _case(result: Result, data: str) -> ScaleCase:
    return next(case for case in result.scale if case.data == data)


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    robots = [("free", one) for one in (result.planar, result.arm)] + [("fixed", one) for one in result.grounded]
    add_number_table(
        document,
        ["robot", "base", "standard", "base parameters", "dependent", "no effect", "last retained", "first dropped"],
        [
            [
                f"{one.robot.name}, {len(one.robot.joints)} joints",
                label,
                *(str(len(names)) for names in (one.base.standard, one.base.independent)),
                *(str(len(names)) for names in (one.base.dependent, one.base.without_effect)),
                format_number(one.base.gap[0], 2),
                format_number(one.base.gap[1], 1),
            ]
            for label, one in robots
        ],
        "Numbers of parameters, and singular values on both sides of the rank. On a fixed base in gravity along −z the "
        "base does not move and link 1 turns about the vertical only.",
        words=2,
    )
    add_number_table(
        document,
        ["measured or known", "scale", f"determined of {result.arm.base.count}", "last retained", "first dropped"],
        _scale_rows(result),
        "Base parameters of ETS-VII that different data determine, from the rank of the equations, and singular values "
        "on both sides of it. Each known parameter or action has the weight of one equation of motion.",
        words=2,
    )


def _tables(result: Result) -> list[CsvTable]:
    planar, arm = result.planar.base, result.arm.base
    bodies = _bodies(planar)
    beta = [
        [symbol(name, bodies), *(f"{value:.10g}" for value in row), f"{grouped:.10g}"]
        for name, row, grouped in zip(
            planar.independent, planar.regrouping, planar.project(result.planar.parameters), strict=True
        )
    ]
    sums = [*regrouping_rows(arm), *([name, name] for name in unchanged(arm))]
    peers: list[Comparison] = [*result.peers, result.tilted]
    return [
        CsvTable("beta", ["K1", *(symbol(name, bodies) for name in planar.dependent), "K1 + beta K2"], beta),
        CsvTable("sums", ["base parameter", "sum"], sums),
        CsvTable(
            "peers",
            ["robot", "gravity [m/s2]", "bayesid", "rank of Pinocchio", "FIGAROH", "largest angle [rad]"],
            [(case.robot, format_vector(case.gravity), case.count, case.rank, case.peer, case.angle) for case in peers],
        ),
    ]


def _statements(result: Result) -> list[Statement]:
    planar, arm = result.planar.base, result.arm.base
    free = (planar, arm)
    gradient = _case(result, "motion in the gravity gradient, tumbling")
    alone = _case(result, "motion, tumbling")
    return [
        Statement(
            "There are no parameters without effect on a free-floating robot (3.1, rule 1).",
            Finding.CONFIRMED if not any(base.without_effect for base in free) else Finding.REFUTED,
            f"None of {len(planar.standard)} and {len(arm.standard)}; on a fixed base there are "
            f"{' and '.join(str(len(one.base.without_effect)) for one in result.grounded)}.",
        ),
        Statement(
            "A revolute joint makes three parameters dependent: 30 − 6 = 24 with two joints (3.1, rule 2).",
            Finding.CONFIRMED if (planar.count, arm.count) == COUNTS else Finding.REFUTED,
            f"{planar.count} and, for ETS-VII, 70 − 18 = {arm.count}.",
        ),
        Statement(
            "The other parameters follow from the dependent ones once the base parameters are identified (24).",
            Finding.CONFIRMED if result.recovery.standard_error < EXACT else Finding.REFUTED,
            f"To {format_number(result.recovery.standard_error, 1)}, from Pinocchio's torques.",
        ),
        Statement(
            "With a right side of (nearly) zero, (19) is badly posed (3).",
            Finding.CONFIRMED if alone.open_scale and gradient.open_scale else Finding.REFUTED,
            "In exactly one direction, the scale, even with the gravity gradient. In problems 1 and 2 the known arm or "
            "base fixes it.",
        ),
    ]


@styled
def singular_figure(result: Result) -> Figure:
    """Draw the singular values of both robots' regressors, and the gap at the rank."""
    figure = wide_figure(2.2)
    for axes, one in zip(figure.subplots(1, 2), (result.planar, result.arm), strict=True):
        values = np.maximum(one.singular, 1e-18)
        place = np.arange(1, len(values) + 1)
        count = one.base.count
        axes.semilogy(place[:count], values[:count], ".", color=AFTER, label=f"{count} retained")
        axes.semilogy(place[count:], values[count:], ".", color=TRUTH, label=f"{len(values) - count} dropped")
        axes.axhline(1e-10, color=TRUTH, linewidth=0.7)
        axes.set_title(f"{one.robot.name}, {len(one.robot.joints)} joints")
        axes.set_xlabel("number")
        axes.set_ylabel("relative singular value")
        axes.legend(loc="center left")
    return figure


STUDY = Study(
    "base_parameters",
    "Determine which inertial parameters can be identified at all.",
    run=run,
    report=_report,
    seed=1,
    inputs=lambda options: [MODELS / f"{name}.urdf" for name in ("planar", "ets7")],
)
