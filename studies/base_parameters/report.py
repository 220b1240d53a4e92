"""The study's report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_vector
from studies.base_parameters.peers import Comparison
from studies.base_parameters.recovery import STATES, WRONG, Recovery
from studies.base_parameters.scale import ScaleCase
from studies.base_parameters.structure import Equations, Structure
from studies.base_parameters.texts import regrouping_rows, symbol, unchanged
from studies.common.tables import add_number_table

__all__ = ["Result", "singular_figure", "write_report"]

ROWS = (
    *(f"force on the base, {axis} [N]" for axis in "xyz"),
    *(f"torque on the base, {axis} [N m]" for axis in "xyz"),
    *(f"torque of joint {index} [N m]" for index in (1, 2)),
)
"""Rows of (23) for the robot with two joints."""

LETTERS = (
    "Body 0 is the base, body i the link behind joint i. m is a mass, h a first moment of mass and I an inertia "
    "about the origin of the body's frame, in its axes; m₂₋₄ stands for m₂ + m₃ + m₄."
)
"""Explanation of the symbols of tables."""

EXAMPLE = (
    "m arrow.r quad m' + m, quad h' + m vec(x, y, z), quad I'_\"xx\" + m (y^2 + z^2), quad I'_\"yy\" + m (x^2 + z^2), "
    'quad I\'_"zz" + m (x^2 + y^2),',
    'quad I\'_"xy" - m x y, quad I\'_"xz" - m x z, quad I\'_"yz" - m y z',
    'h_z arrow.r quad h\'_z + h_z, quad I\'_"xx" + 2 z h_z, quad I\'_"yy" + 2 z h_z, quad I\'_"xz" - x h_z, '
    'quad I\'_"yz" - y h_z',
    'I_"yy" arrow.r quad I_"xx" - I_"yy", quad I\'_"xx" + I_"yy", quad I\'_"yy" + I_"yy"',
)
"""Regrouping by a revolute joint about z at (x, y, z), both axes parallel (Khalil & Dombre 2002)."""


@dataclass(frozen=True)
class Result:
    """Content of the report.

    Attributes
    ----------
    planar, arm : Structure
        Identifiable parameters of the robot with two joints and of ETS-VII.
    equations : Equations
        Equations of the robot with two joints in one state.
    grounded : tuple of Structure
        Identifiable parameters of both robots on a fixed base.
    recovery : Recovery
        Identification of ETS-VII from motion and joint torques.
    scale : tuple of ScaleCase
        Base parameters of ETS-VII that different data determine.
    peers : tuple of Comparison
        Comparison with other tools for both robots on a fixed base.
    tilted : Comparison
        The same for ETS-VII in tilted gravity.
    seed : int
        Seed of the random states.
    """

    planar: Structure
    equations: Equations
    arm: Structure
    grounded: tuple[Structure, Structure]
    recovery: Recovery
    scale: tuple[ScaleCase, ...]
    peers: tuple[Comparison, ...]
    tilted: Comparison
    seed: int


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document(
        "What can be identified at all: base inertial parameters", "Section 3.1 of Lampariello and Hirzinger (2005)"
    )
    _outcome(document, result)
    _example(document, result)
    _arm(document, result)
    _recovered(document, result.recovery)
    _scale(document, result)
    _peers(document, result)
    document.section("Assumptions")
    document.items(_assumptions(result.seed))
    document.write(output)


def _outcome(document: Document, result: Result) -> None:
    document.section("Questions and answers")
    arm = result.arm.base
    document.paragraph(
        "Ten numbers describe the inertia of a rigid body. Of the robot's 10 (n + 1) numbers, motion and joint torques "
        "show only certain sums, the base parameters. This study determines them for a free-flying robot with two "
        "joints, the paper's example, and for ETS-VII with six. It says which sums they are, and which further "
        "knowledge gives the masses their scale, which motion alone leaves open."
    )
    robots = [("free", one) for one in (result.planar, result.arm)] + [("fixed", one) for one in result.grounded]
    add_number_table(
        document,
        ["robot", "base", "standard", "base parameters", "dependent", "without effect", "last kept", "first dropped"],
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
        "Numbers of parameters. The last two columns are singular values on both sides of the rank, of the regressor "
        "in random states with columns of unit length, relative to the largest.",
        words=2,
    )
    document.paragraph(
        "Both of the paper's rules hold. Every parameter of the free flyer has an effect, and every revolute joint "
        f"makes three parameters dependent: 30 − 6 = {result.planar.base.count}, and 70 − {len(arm.dependent)} = "
        f"{arm.count}. Bolted to the ground in gravity along −z, the same robots show fewer sums, since the base does "
        "not move at all and link 1 turns about the vertical only."
    )


def _example(document: Document, result: Result) -> None:
    planar, equations = result.planar, result.equations
    base = planar.base
    bodies = list(dict.fromkeys(name.split(".", 1)[0] for name in base.standard))
    document.section("The paper's example: two joints")
    document.paragraph(
        "The paper gives no numbers for its two-joint robot; here it is the shipped robot planar: a base of 60 kg "
        "and two links of about 5 kg that turn about z, the joints at (0.3, 0.1, 0) m in the base and (1, 0, 0) m in "
        "link 1. All equations of motion, the base's balance and the joint torques, are linear in the 30 standard "
        "parameters:"
    )
    document.formula('Phi_"ff" p_"ff" = Lambda_"joint" = vec(0, tau)  quad (23)')
    document.paragraph("In one random state in which no wrench acts on the base they read as follows.")
    add_number_table(
        document,
        ["row of (23)", "regressor times parameters", "Pinocchio, recursive Newton-Euler"],
        [
            [name, *(format_fixed(float(value), 4) for value in values)]
            for name, *values in zip(ROWS, equations.regressor, equations.pinocchio, strict=True)
        ],
        "The equations of the two-joint robot in one state, from its regressor and from Pinocchio.",
    )
    document.figure(
        singular_figure(result),
        "Singular values of the regressor in random states with columns of unit length. Those below the line are "
        "rounding errors.",
    )
    document.paragraph(
        f"QR decomposition leaves {base.count} independent parameters K₁ and {len(base.dependent)} dependent ones K₂, "
        "which are the mass of each link, its first moment along the joint's axis and one moment of inertia:"
    )
    document.formula("K_B = K_1 + beta K_2  quad (24)")
    add_number_table(
        document,
        ["K₁", *(symbol(name, bodies) for name in base.dependent), "value of K₁", "with β K₂"],
        [
            [
                symbol(name, bodies),
                *(format_number(float(value), 6) if value else "·" for value in row),
                format_number(float(planar.parameters[base.standard.index(name)]), 5),
                format_number(float(grouped), 5),
            ]
            for name, row, grouped in zip(
                base.independent, base.regrouping, base.project(planar.parameters), strict=True
            )
            if row.any()
        ],
        "The matrix β, where a dot is zero, and the base parameters of the robot [kg, kg m, kg m²]. The other "
        f"{len(unchanged(base))} rows are zero: {', '.join(unchanged(base))}. {LETTERS}",
    )
    document.paragraph(
        "The numbers are those of three bodies whose presence a joint does not show: a mass on the joint's axis, its "
        "first moment along the axis, and a thin rod along the axis. For parallel axes, let the joint be at (x, y, z) "
        "in the previous body, whose parameters have a dash. Then"
    )
    for formula in EXAMPLE:
        document.formula(formula)
    document.paragraph(
        "Joint 1 with x = 0.3 and y = 0.1 gives 0.09, 0.01, 0.1 and −0.03 in the column of m₁. The mass of link 2 is "
        "added to link 1 with x = 1. The parameters m and Iyy of link 1 are dependent too and are added to the base, "
        "so that m₂ adds 0.01 + 1 to Ixx of the base."
    )


def _arm(document: Document, result: Result) -> None:
    base = result.arm.base
    document.section("ETS-VII: six joints")
    document.paragraph(
        f"The {len(base.standard)} standard parameters leave {base.count} sums. The dependent parameters are again "
        "mass, first moment along the joint's axis z and Iyy of each link, in the convention that regroups towards the "
        "base."
    )
    document.table(
        ["base parameter", "is the sum"],
        regrouping_rows(base),
        f"Base parameters of ETS-VII that are sums. Lengths are in metres. The other {len(unchanged(base))} are "
        f"standard parameters: {', '.join(unchanged(base))}. {LETTERS}",
    )


def _recovered(document: Document, recovery: Recovery) -> None:
    document.section("From the base parameters to those of each body")
    document.paragraph(
        f"Pinocchio gives base motion and joint torques of ETS-VII without noise in {STATES} random states in which no "
        "wrench acts. Linear least squares determine the base parameters from them to "
        f"{format_number(recovery.base_error, 2)} of the largest value of the same kind. Nothing more follows from any "
        "such data. Once K₂ is known, the independent K₁ follow from (24): with the true K₂ all 70 standard parameters "
        f"are recovered to {format_number(recovery.standard_error, 2)}. A K₂ that is {100.0 * (WRONG - 1.0):.0f} % too "
        f"large explains the same data as well (the largest torque error is {format_number(recovery.torque_error, 1)} "
        f"of the largest torque, computed by Pinocchio), but with other values of K₁; {recovery.untouched} of its "
        "parameters do not change."
    )
    add_number_table(
        document,
        ["parameter", "true", "recovered with the wrong K₂"],
        [[name, *(format_number(value, 6) for value in values)] for name, *values in recovery.shifted],
        "The parameters of K₁ that a wrong K₂ changes most, in SI units.",
    )


def _scale(document: Document, result: Result) -> None:
    document.section("The scale of the masses")
    document.paragraph(
        "If the joints' motion is prescribed and measured, and their torques are not, the equations are the base's "
        "balance alone, the paper's (19), whose right side is zero. All inertial parameters multiplied by the same "
        "number give the same motion: the problem is badly posed, as the paper says, by exactly one direction. The "
        "gravity gradient does not help. Its wrench is linear in the same parameters (equivalence principle), so it "
        "moves to the left side. What helps is an equation whose right side is known and not zero."
    )
    rows = [
        [
            case.data,
            "open" if case.open_scale else "known",
            str(case.determined.rank),
            format_number(case.determined.gap[0], 2),
            format_number(case.determined.gap[1], 1),
        ]
        for case in result.scale
    ]
    add_number_table(
        document,
        ["measured or known", "scale", f"determined of {result.arm.base.count}", "last kept", "first dropped"],
        rows,
        "Base parameters of ETS-VII that different data determine, from the rank of the equations in random states "
        "that satisfy the equations of motion, and their singular values on both sides of the rank. Where the scale is "
        "open, any multiple of the robot's base parameters satisfies the equations.",
        words=2,
    )
    document.paragraph(
        "Where a direction is missing, it is a single one, that of the robot's base parameters. A known body helps if "
        "its parameters cannot be explained by its neighbours: all ten of any body of the robot do, and so does the "
        "mass of the whole robot, a single number. The mass of the base alone does not, because mass may be shifted "
        "from the base to the first joint's axis; nor does a known load on an unknown link, because only the sum of "
        "both shows. A light body determines the scale weakly, as the small singular values of the links show. In the "
        "paper's problems 1 and 2 the arm is known and gives the scale."
    )


def _peers(document: Document, result: Result) -> None:
    document.section("Comparison with another tool")
    cases = (*result.peers, result.tilted)
    document.paragraph(
        f"{cases[0].tool} computes base parameters of robots on a fixed base by QR decomposition of Pinocchio's "
        "regressor. It was run on the same robots, bolted to the ground, in random states other than those of bayesid. "
        "Tools may choose other parameters as independent; what must agree is their number, and the "
        "space that the rows of [1, β] span. The rank of Pinocchio's regressor, without any tool, is given beside them."
        if all(case.peer is not None for case in cases)
        else f"FIGAROH {cases[0].tool}. The rank of Pinocchio's regressor is given instead."
    )
    rows = [
        [
            case.robot,
            format_vector(case.gravity),
            str(case.count),
            str(case.rank),
            "not evaluated" if case.peer is None else str(case.peer),
            "not evaluated" if case.angle is None else format_number(case.angle, 1),
        ]
        for case in cases
    ]
    add_number_table(
        document,
        ["robot", "gravity [m/s²]", "bayesid", "Pinocchio's rank", "FIGAROH", "largest angle [rad]"],
        rows,
        "Numbers of base parameters on a fixed base, and the largest angle between the spaces of base parameters.",
        words=2,
    )


def _assumptions(seed: int) -> list[str]:
    return [
        "Bodies are rigid and joints ideal: there is no friction, and there are no rotors of the drives, whose "
        "parameters would be further columns.",
        "The structure depends on the kinematics alone: joint angles are anywhere on the circle, speeds and "
        "accelerations of unit size. How well a manoeuvre within its limits and with noisy sensors determines each "
        "parameter is another question, that of the posterior.",
        "A rank is accepted only if Gram-Schmidt in the preferred order, QR with column pivoting and the singular "
        "values agree, with a threshold of 10⁻¹⁰.",
        "For the scale, time is counted such that rates have the size of the mean motion, so that the gravity gradient "
        "is as large as other terms. Known parameters and actions weigh as much as one equation of motion.",
        f"Random states follow from the seed {seed}; those of the base parameters are always the same.",
    ]


@styled
def singular_figure(result: Result) -> Figure:
    """Draw the singular values of both robots' regressors, and the gap at the rank."""
    figure = wide_figure(2.2)
    for axes, one in zip(figure.subplots(1, 2), (result.planar, result.arm), strict=True):
        values = np.maximum(one.singular, 1e-18)
        place = np.arange(1, len(values) + 1)
        count = one.base.count
        axes.semilogy(place[:count], values[:count], ".", color=COLOURS[0], label=f"{count} kept")
        axes.semilogy(place[count:], values[count:], ".", color=COLOURS[1], label=f"{len(values) - count} dropped")
        axes.axhline(1e-10, color="#888888", linewidth=0.7)
        axes.set_title(f"{one.robot.name}, {len(one.robot.joints)} joints")
        axes.set_xlabel("number")
        axes.set_ylabel("relative singular value")
        axes.legend(loc="center left")
    return figure
