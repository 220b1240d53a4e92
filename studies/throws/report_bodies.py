"""Section of the report on the bodies: principal moments against their geometry, and the wheel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayesid.report import Document
from studies.throws.figures import throws_figure

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["add_bodies"]

MOMENTS = ("smallest", "middle", "largest")


def add_bodies(document: Document, result: Result) -> None:
    """Add errors of single throws and of the joint fit, and the inertia of the wheel."""
    document.section("The bodies against their geometry")
    rows = []
    for body in result.extended.bodies.values():
        for k, name in enumerate(MOMENTS):
            truth = body.truth[k]
            single = 100.0 * np.sqrt((body.formal[:, k] ** 2).mean()) / truth
            rows.append(
                [
                    body.name,
                    name,
                    f"{1e6 * truth:.1f} ± {1e6 * body.truth_sd[k]:.1f}",
                    f"{body.errors[:, k].mean():+.2f} ± {body.errors[:, k].std(ddof=1):.2f}",
                    f"{single:.2f}",
                    f"{body.joint_errors[k]:+.2f}",
                    f"{100.0 * body.joint_formal[k] / truth:.2f}",
                    f"{100.0 * body.joint_jackknife[k] / truth:.2f}",
                ]
            )
    document.table(
        (
            "body",
            "moment",
            "stated [mg m²]",
            "single [%]",
            "formal sd [%]",
            "joint [%]",
            "formal sd [%]",
            "jackknife [%]",
        ),
        rows,
        "Errors of principal moments with the extended model: mean and scatter of single throws, and the joint fit of "
        "all throws.",
        ["left", "left", *["right"] * 6],
    )
    document.figure(
        throws_figure(result.plain, result.extended),
        "Errors of single throws with formal standard deviations. The grey band is the stated moments' own.",
    )
    extended = result.extended
    document.paragraph(
        f"Inertia of the wheel, from the box of known inertia: {1e6 * extended.wheel:.4f} mg m², "
        f"{1e6 * extended.wheel_formal:.4f} formal and {1e6 * extended.wheel_jackknife:.4f} jackknife sd. The joint "
        "fits " + ("converged." if extended.converged and result.plain.converged else "did not all converge.")
    )
