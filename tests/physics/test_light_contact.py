"""A plank on a cylinder, a pile of logs and a cylinder that slides off another, by rigid-body theory.

Light loads must not move surfaces apart by more than a thousandth or so of their radius."""

from typing import Any

import numpy as np
import pytest

import withe
from cases import measured

GRAVITY = 9.81


@pytest.mark.case("contact", "Period of a plank that rocks on a cylinder", source="rigid body [Routh]")
@pytest.mark.parametrize("integrator", ["energy_momentum", pytest.param("implicit_midpoint", marks=pytest.mark.slow)])
@pytest.mark.parametrize("radius", [4e-3, 8e-3])
@pytest.mark.parametrize("tilt", [0.03, 0.05])
def test_a_plank_on_a_cylinder_rocks_about_its_middle(integrator: Any, radius: float, tilt: float) -> None:
    """Energy m g (R - r) a^2 / 2 against m L^2 w^2 / 24 [Routh]. On wide contact it came to rest tilted."""
    length, drum = 0.3, 0.1
    along = np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    middle = (drum + radius) * normal - drum * tilt * along
    scene = withe.Scene()
    plank = scene.add_rod(
        start=middle - 0.5 * length * along,
        end=middle + 0.5 * length * along,
        nodes=241,
        radius=radius,
        material=withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=7850.0),
    )
    scene.add_capsule((0, -0.3, 0), (0, 0.3, 0), drum, friction=2.0)
    simulation = scene.build(time_step=2e-3, planar=True, integrator=integrator)
    record = simulation.run(3.0, record_every=5e-3, progress=False)
    x = record.positions(plank)
    angle = np.arctan2(x[:, 0, 2] - x[:, -1, 2], x[:, -1, 0] - x[:, 0, 0])
    period = 2.0 * np.pi * np.sqrt(length**2 / (12.0 * GRAVITY * (drum - radius)))
    passes = np.flatnonzero((angle[:-1] > 0.0) & (angle[1:] <= 0.0))
    times = record.times[passes] + 5e-3 * angle[passes] / (angle[passes] - angle[passes + 1])
    print("plank:", integrator, radius, tilt, angle.min(), angle.max(), np.diff(times).mean() / period)
    late = angle[record.times > 1.5]
    assert abs(0.5 * (late.max() + late.min())) < 0.1 * tilt
    assert late.max() > 0.75 * tilt
    assert np.diff(times).mean() == pytest.approx(period, rel=0.03)


def settled_pile(radius: float, modulus: float, between: float) -> float:
    """Three logs, two on a floor side by side and one in the middle above: by how much that one has come down, over
    the radius."""
    scene = withe.Scene()
    wood = withe.Material(youngs_modulus=modulus, poisson_ratio=0.5, density=1200.0, viscosity=1e-5 * modulus)
    top = radius * (1.0 + np.sqrt(3.0))
    logs = [
        scene.add_rod(start=(x, -5 * radius, z), end=(x, 5 * radius, z), nodes=4, radius=radius, material=wood)
        for x, z in ((-radius, radius), (radius, radius), (0.0, top))
    ]
    scene.add_floor(friction=0.5)
    scene.enable_contact(friction=between)
    simulation = scene.build(time_step=1e-3)
    simulation.run(0.8, progress=False)
    return (top - simulation.positions(logs[2])[:, 2].mean()) / radius


@pytest.mark.case("contact", "Friction that holds a pile of three logs (bracket)", source="tan(15 degrees), statics")
@pytest.mark.parametrize(("radius", "modulus"), [(0.01, 1e9), (0.02, 1e8), (5e-3, 1e10)])
def test_a_pile_of_three_logs_stands_where_friction_holds_it(radius: float, modulus: float) -> None:
    """Each lower log is in balance under two forces, 15 degrees off the normals [statics]: mu = tan(15 deg)."""
    least = np.tan(np.radians(15.0))
    down = [settled_pile(radius, modulus, share * least) for share in (0.97, 1.03)]
    print("logs:", radius, modulus, down)
    measured(0.03)
    assert down[0] > 0.2
    assert abs(down[1]) < 0.01


@pytest.mark.case(
    "contact", "Angle at which a cylinder leaves another", source="cos a = 2/3 or 4/7 of its start [Routh]"
)
@pytest.mark.parametrize("time_step", [2e-3, 5e-4])
@pytest.mark.parametrize(("friction", "leaves"), [(0.0, 2.0 / 3.0), (3.0, 4.0 / 7.0)])
def test_a_cylinder_leaves_another_where_nothing_presses_it_any_more(
    time_step: float, friction: float, leaves: float
) -> None:
    """It slides off at cos = 2/3 of where it began, and rolls off at 4/7 [Routh]."""
    drum, radius, start = 0.1, 0.02, 0.05
    x, z = (drum + radius) * np.sin(start), (drum + radius) * np.cos(start)
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e8, poisson_ratio=0.5, density=1200.0)
    rod = scene.add_rod(start=(x, -0.03, z), end=(x, 0.03, z), nodes=4, radius=radius, material=rubber)
    scene.add_capsule((0, -0.3, 0), (0, 0.3, 0), drum, friction=friction)
    simulation = scene.build(time_step=time_step)
    weight = GRAVITY * 1200.0 * np.pi * radius**2 * 0.06
    angle = last = start
    while angle < 1.2:
        simulation.step()
        place = simulation.positions(rod).mean(axis=0)
        angle = np.arctan2(place[0], place[2])
        if simulation.contacts()["normal_force"].sum() > 0.02 * weight:
            last = angle
    print("cylinder:", time_step, friction, np.cos(last), leaves * np.cos(start))
    assert np.cos(last) == pytest.approx(leaves * np.cos(start), rel=0.02)
