"""Plots of results: one call each, into a new figure or into axes that are given, with no setting changed."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from conftest import PLANAR
from matplotlib.figure import Figure
from test_results import result

import bayesid
from bayesid.report.figures.figure_style import PageFigure
from bayesid.robot.link_shapes import link_shapes
from bayesid.robot.robot import Robot

assert result  # the fixture of made-up draws

URDF = """<robot name="shapes">
<link name="base"><inertial><mass value="12"/><inertia ixx="2" iyy="3" izz="4" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><geometry><box size="2 4 6"/></geometry></visual></link>
<link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="package://ship/part.stl" scale="2 2 2"/></geometry></visual></link>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><geometry><mesh filename="gone.stl"/></geometry></visual>
<collision><geometry><cylinder radius="0.5" length="3"/></geometry></collision></link>
<link name="c"><inertial><mass value="6"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="one" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 5"/><axis xyz="0 0 1"/></joint>
<joint name="two" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/></joint>
<joint name="three" type="fixed"><parent link="b"/><child link="c"/></joint></robot>"""

STL = "solid s\n" + "".join(
    f"facet normal 0 0 1\nouter loop\n{''.join(f'vertex {x} {y} {z}{chr(10)}' for x, y, z in face)}endloop\nendfacet\n"
    for face in ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (0, 1, 0), (0, 0, 1)])
)


@pytest.fixture
def shaped(tmp_path: Path) -> Robot:
    (tmp_path / "ship" / "urdf").mkdir(parents=True)
    (tmp_path / "ship" / "part.stl").write_text(STL + "endsolid s\n")
    (tmp_path / "ship" / "urdf" / "robot.urdf").write_text(URDF)
    return Robot.from_urdf(tmp_path / "ship" / "urdf" / "robot.urdf")


def test_links_have_meshes_primitives_or_the_box_of_their_inertia(shaped: Robot) -> None:
    shapes = {shape.link: shape for shape in link_shapes(shaped)}
    assert {name: shape.source for name, shape in shapes.items()} == {
        "base": "primitive",
        "a": "mesh",
        "b": "primitive",
        "c": "box",
    }
    corners = shapes["base"].triangles.reshape(-1, 3)  # a quarter turn exchanges x and y
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[-1.0, -1.0, -3.0], [3.0, 1.0, 3.0]])
    assert sorted(map(tuple, shapes["a"].triangles[0].tolist())) == [(0, 0, 0), (0, 2, 0), (2, 0, 0)]
    assert np.abs(shapes["b"].triangles[..., 2]).max() == pytest.approx(1.5)
    assert np.linalg.norm(shapes["b"].triangles[..., :2], axis=2).max() == pytest.approx(0.5)
    # the box has the inertia of the body
    sides = np.ptp(shapes["c"].triangles.reshape(-1, 3), axis=0)
    np.testing.assert_allclose(6.0 / 12.0 * (np.sum(sides**2) - sides**2), 1.0)


def test_a_robot_is_drawn_in_its_pose(shaped: Robot) -> None:
    (axes,) = bayesid.plot_robot(shaped, [0.0, 0.5 * np.pi]).axes
    # the base reaches from -1 to 3, the mesh to y = 2; the cylinder lies along x after a quarter turn about y
    limits = [axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]
    np.testing.assert_allclose(limits, [(-1.5, 3.0), (-1.0, 2.0), (-3.0, 7.0)], atol=0.3)
    flat = Figure().subplots()
    with pytest.raises(bayesid.InputError, match="the axes are flat"):
        bayesid.plot_robot(shaped, ax=flat)
    with pytest.raises(bayesid.InputError, match="3 positions for 2 joints"):
        bayesid.plot_robot(shaped, [0.0, 0.0, 0.0])
    given = Figure().add_subplot(projection="3d")
    assert bayesid.plot_robot(PLANAR, ax=given) is given.get_figure(root=True)


@pytest.mark.parametrize(
    ("plot", "rows", "columns"),
    [
        (bayesid.plot_residuals, 2, 3),
        (bayesid.plot_spectrum, 2, 3),
        (bayesid.plot_posterior, 10, 10),
        (bayesid.plot_manoeuvre, 1, 2),
    ],
)
def test_plots_of_an_identification_take_axes(plot, rows, columns, result) -> None:
    before = dict(mpl.rcParams)
    alone = plot(result)
    assert isinstance(alone, PageFigure)
    figure = Figure(figsize=(10, 8))
    panels = figure.subplots(rows, columns, squeeze=False)
    assert plot(result, axes=panels) is figure
    drawn = [axes for axes in figure.axes if axes.get_visible()]
    assert len(drawn) == len(alone.axes)
    for one, other in zip(drawn, alone.axes, strict=True):
        assert [line.get_xydata().tolist() for line in one.lines] == [
            line.get_xydata().tolist() for line in other.lines
        ]
        assert one.get_title() == other.get_title()
    assert len(figure.legends) == 0  # it is within a panel
    with pytest.raises(bayesid.InputError, match=f"{rows * columns} are needed"):
        plot(result, axes=figure.subplots(1, 1))
    assert dict(mpl.rcParams) == before


def test_a_figure_shows_itself_in_a_notebook(result) -> None:
    assert bayesid.plot_manoeuvre(result)._repr_png_().startswith(b"\x89PNG")


def test_a_body_that_was_not_identified_is_refused(result) -> None:
    with pytest.raises(bayesid.InputError, match="no body 'link9' was identified"):
        bayesid.plot_posterior(result, "link9")
