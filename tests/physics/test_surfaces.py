"""Surfaces of rods: where they touch, apart from what their sections weigh and resist."""

import numpy as np
import pytest

import withe

PAPER = withe.Material(youngs_modulus=2e9, poisson_ratio=0.3, density=800.0)
THICKNESS = 1e-4


def lying_sheet(planar=None, height=2e-4, **rod):
    scene = withe.Scene()
    scene.add_rod(
        start=(0, 0, height),
        end=(0.297, 0, height),
        nodes=31,
        section=withe.Rectangle(0.21, THICKNESS),
        normal=(0, 1, 0),
        material=PAPER,
        name="sheet",
        **rod,
    )
    scene.add_floor(friction=0.3)
    return scene.build(integrator="backward_euler", time_step=1e-3, planar=planar)


@pytest.mark.parametrize(
    ("rod", "radius"), [({}, 0.5 * THICKNESS), ({"contact_radius": 1.5 * THICKNESS}, 1.5 * THICKNESS)]
)
@pytest.mark.parametrize("planar", [None, False])
def test_a_sheet_rests_at_its_contact_radius_above_the_floor(rod, radius, planar):
    simulation = lying_sheet(planar, **rod)
    simulation.run(duration=0.05, progress=False)
    # Within the distance tolerance above, and four hundredths of the radius below: what contact may give.
    heights = simulation.positions()[:, 2] / radius
    assert heights.min() > 0.96
    assert heights.max() < 1.1
    assert simulation.energy().kinetic < 1e-9


def test_the_contact_radius_changes_neither_weight_nor_stiffness_nor_the_picture():
    thin, thick = lying_sheet(), lying_sheet(height=2e-3, contact_radius=1e-3)
    for word in ("stretch_stiffness", "bend_stiffness", "twist_stiffness", "line_density"):
        np.testing.assert_array_equal(thin.get("sheet", word), thick.get("sheet", word))
    for simulation in (thin, thick):
        outline = simulation.run(duration=1e-3, progress=False).rods[0]
        np.testing.assert_array_equal(outline.widths, np.tile([0.21, THICKNESS], (30, 1)))


def test_edges_may_have_contact_radii_of_their_own():
    scene = withe.Scene()
    radii = np.where(np.arange(20) < 10, 2e-3, 1e-3)
    scene.add_rod(
        start=(0, 0, 2.3e-3), end=(0.2, 0, 2.3e-3), nodes=21, radius=2e-3, contact_radius=radii, material=PAPER
    )
    scene.add_floor()
    simulation = scene.build(integrator="static")
    contacts = simulation.contacts()
    assert len(contacts) == 0
    simulation.equilibrium()
    contacts = simulation.contacts()
    np.testing.assert_allclose(contacts["distance"] - contacts["gap"], radii[contacts["edge"][:, 0]], rtol=0.5)


@pytest.mark.parametrize("radius", [0.0, -1e-3, np.nan, np.inf, [1e-3, 1e-3]])
def test_a_contact_radius_that_is_none_is_refused(radius):
    with pytest.raises(ValueError, match="contact_radius of rod 'sheet'"):
        lying_sheet(contact_radius=radius)


def falling_sheet(scheme, step, floor, rods):
    """A sheet that is held at one end, far above all that it could touch."""
    scene = withe.Scene()
    sheet = scene.add_rod(
        start=(0, 0, 0),
        end=(0.297, 0, 0),
        nodes=61,
        section=withe.Rectangle(0.21, THICKNESS),
        normal=(0, 1, 0),
        material=PAPER,
    )
    scene.clamp(sheet.start)
    if floor:
        scene.add_floor(-1.0)
    if rods:
        scene.enable_contact()
    simulation = scene.build(integrator=scheme, time_step=step)
    simulation.step(40)
    return simulation


@pytest.mark.parametrize(("scheme", "step"), [("backward_euler", 1e-2), ("implicit_midpoint", 5e-3)])
@pytest.mark.parametrize(("floor", "rods"), [(True, False), (False, True), (True, True)])
def test_surfaces_that_nothing_touches_cost_no_iterations(scheme, step, floor, rods):
    alone, beside = (falling_sheet(scheme, step, *which) for which in ((False, False), (floor, rods)))
    assert beside.statistics.iterations <= 1.02 * alone.statistics.iterations
    np.testing.assert_allclose(beside.positions(), alone.positions(), atol=1e-9)
