"""Impacts: what bodies keep, lose and give back when they meet, whatever the time step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import withe
from cases import measured

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
CONSERVING = ["implicit_midpoint", "energy_momentum"]
STEPS = [5e-3, 2e-3, 5e-4, 1e-4]  # [s]


def falling(radius: float, height: float, time_step: float, integrator: Any, **floor: Any) -> Any:
    """A rod a height above a floor, and when it gets there."""
    scene = withe.Scene()
    length = 25.0 * radius
    up = height + radius
    rod = scene.add_rod(
        start=(-0.5 * length, 0, up), end=(0.5 * length, 0, up), nodes=11, radius=radius, material=RUBBER
    )
    scene.add_floor(**floor)
    return scene.build(time_step=time_step, integrator=integrator), rod, np.sqrt(2.0 * height / 9.81)


def rebound(radius: float, height: float, time_step: float, integrator: Any, **floor: Any) -> float:
    """Height of the rebound relative to the height of the fall; fails if energy is created."""
    simulation, rod, fall = falling(radius, height, time_step, integrator, **floor)
    start = simulation.energy().total
    scale = simulation.energy().gravity - 9.81 * 1200.0 * np.pi * radius**2 * 25.0 * radius * radius
    top = 0.0
    while simulation.time < 1.15 * fall + 1.05 * floor.get("restitution", 1.0) * fall:
        simulation.step()
        energy = simulation.energy()
        assert energy.work == 0.0
        assert energy.total < start + 1e-6 * scale
        excess = energy.total + energy.dissipated - start
        if integrator == "energy_momentum":
            assert abs(excess) < 1e-6 * scale
        assert excess < 1e-3 * scale
        if simulation.time > 1.15 * fall:
            top = max(top, float(simulation.positions(rod)[:, 2].mean()) - radius)
    return top / height


@pytest.mark.parametrize("integrator", CONSERVING)
def test_a_rod_rises_as_high_as_it_fell_at_any_step_and_no_higher(integrator: Any) -> None:
    random = np.random.default_rng(20)
    for time_step in STEPS:
        radius, height = 4e-3 * 5.0 ** random.uniform(), 4e-3 * 5.0 ** random.uniform()
        assert 0.97 < rebound(radius, height, time_step, integrator) < 1.0 + 1e-6


def test_backward_euler_loses_what_its_steps_do_not_resolve_and_tends_to_the_elastic_answer() -> None:
    heights = [rebound(0.02, 0.01, step, "backward_euler") for step in (2e-3, 2e-4, 2e-5)]
    assert heights[0] < heights[1] < heights[2] < 1.0
    assert heights[2] > 0.75


@pytest.mark.case("contact", "Rebound height, restitution 0.3 and 0.7", source="e^2 h")
@pytest.mark.parametrize("integrator", CONSERVING)
@pytest.mark.parametrize("restitution", [0.3, 0.7])
def test_restitution_is_what_it_says_at_any_step(integrator: Any, restitution: float) -> None:
    for time_step in STEPS:
        # Weight works on the way through the tolerance and the depth of contact, about 2 % of this fall.
        reached = rebound(5e-3, 0.02, time_step, integrator, restitution=restitution)
        assert reached == pytest.approx(restitution**2, abs=0.02)


@pytest.mark.case("contact", "Rebound of thick rods from low heights", source="e^2 h")
def test_restitution_is_that_of_speeds_for_thick_rods_and_low_falls() -> None:
    """The weight would do much work over the depth of contact: 0.2 mm in a fall of 2 mm."""
    for radius, height, restitution in ((5e-3, 2e-3, 0.5), (0.02, 2e-3, 0.5), (0.02, 2e-3, 0.8)):
        reached = rebound(radius, height, 1e-4, "energy_momentum", restitution=restitution)
        measured(reached / restitution**2 - 1.0)
        assert reached == pytest.approx(restitution**2, rel=5e-3)


@pytest.mark.parametrize("friction_model", ["anchored", "lagged"])
@pytest.mark.parametrize("model", ["imcv2", "imcv1", "barrier", "spillmann_teschner"])
def test_every_contact_model_has_restitution(model: Any, friction_model: Any) -> None:
    scene = withe.Scene(gravity=(0, 0, 0))
    rod = scene.add_rod(start=(-0.05, 0, 0.01), end=(0.05, 0, 0.01), nodes=9, radius=5e-3, material=RUBBER)
    scene.add_floor(restitution=0.6, friction=0.2)
    scene.enable_contact(model=model, friction_model=friction_model)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocities(rod, (0, 0, -1.0))
    start = simulation.energy().total
    simulation.step(10)
    assert simulation.velocities(rod)[:, 2] == pytest.approx(0.6, rel=1e-6)
    energy = simulation.energy()
    assert energy.dissipated == pytest.approx(0.64 * start, rel=1e-6)
    assert energy.total + energy.dissipated == pytest.approx(start, rel=1e-6)


def test_steps_that_outlast_an_impact_that_gives_nothing_back_are_not_cut() -> None:
    # A sheet of paper that falls flat: edges swing on their contacts in microseconds, of which nobody wants to know.
    scene = withe.Scene()
    paper = withe.Stiffness(stretch=1e3, bend=(1e-6, 1e-6), twist=1e-6)
    sheet = scene.add_rod(
        start=(0, 0, 1e-3), end=(0.3, 0, 1e-3), nodes=76, radius=5e-5, stiffness=paper, line_density=0.017
    )
    scene.add_floor(restitution=0.0, friction=0.3)
    simulation = scene.build(integrator="backward_euler", time_step=1e-2, planar=True)
    simulation.step(10)
    assert simulation.statistics.steps == 10
    assert simulation.positions(sheet)[:, 2] == pytest.approx(5e-5, abs=2e-5)
    assert np.abs(simulation.velocities(sheet)).max() < 1e-4


@pytest.mark.parametrize("integrator", [*CONSERVING, "backward_euler"])
def test_what_gives_nothing_back_stays_where_it_falls(integrator: Any) -> None:
    """Stored energy of contact stays lost as the impact ends; if given back, it is 0.07 of the fall in short steps."""
    for time_step in (2e-3, 5e-4, 1e-4):
        simulation, rod, fall = falling(4e-3, 0.01, time_step, integrator, restitution=0.0)
        simulation.run(1.2 * fall, progress=False)
        heights = []
        while simulation.time < 2.5 * fall:
            simulation.step()
            heights.append(float(simulation.positions(rod)[:, 2].mean()))
        assert max(heights) < heights[-1] + 1e-3 * 0.01
        assert simulation.energy().kinetic < 1e-9


def head_on(time_step: float, restitution: float | None = None, **contact: Any) -> withe.Simulation:
    scene = withe.Scene(gravity=(0, 0, 0))
    rods = [
        scene.add_rod(start=(x, -0.05, 0), end=(x, 0.05, 0), nodes=11, radius=4e-3, material=RUBBER)
        for x in (-0.012, 0.0)
    ]
    scene.enable_contact(**contact)
    if restitution is not None:
        scene.set_restitution(*rods, restitution)
    simulation = scene.build(time_step=time_step)
    simulation.set_velocities(rods[0], (1.0, 0, 0))
    return simulation


def speeds(simulation: withe.Simulation) -> tuple[float, float]:
    """Velocities of the centres of mass of both rods [m/s]."""
    return tuple(  # type: ignore[return-value]
        float((0.5 * (v[1:] + v[:-1])).mean()) for v in (simulation.velocities(rod)[:, 0] for rod in simulation.rods)
    )


@pytest.mark.case("contact", "Rods that meet head-on", source="exchange of speeds")
@pytest.mark.parametrize("time_step", [5e-3, 5e-4, 5e-5])
def test_rods_that_meet_head_on_exchange_their_speeds(time_step: float) -> None:
    simulation = head_on(time_step)
    start = simulation.energy().total
    for _ in range(round(0.03 / time_step)):
        simulation.step()
        assert simulation.energy().total < start * (1.0 + 1e-4)
    first, second = speeds(simulation)
    assert first == pytest.approx(0.0, abs=5e-3)
    assert second == pytest.approx(1.0, abs=5e-3)


@pytest.mark.parametrize("time_step", [5e-3, 5e-4, 5e-5])
def test_a_pair_may_have_a_restitution_of_its_own(time_step: float) -> None:
    simulation = head_on(time_step, restitution=0.5)
    simulation.run(0.04, progress=False)
    first, second = speeds(simulation)
    assert first + second == pytest.approx(1.0, rel=1e-8)
    assert second - first == pytest.approx(0.5, rel=0.02)
    assert simulation.energy().dissipated == pytest.approx(0.75 * 0.5 * simulation.energy().kinetic / 0.625, rel=0.03)


def test_contact_that_grows_stiffer_under_load_puts_no_energy_in() -> None:
    """A load that grows a thousandfold on a rod that lies on a floor does all the work that is done."""
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 5e-3), end=(0.1, 0, 5e-3), nodes=11, radius=5e-3, material=RUBBER)
    scene.add_floor()
    scene.add_load(rod, lambda t: (0, 0, -0.1 * 1000.0 ** min(t, 1.0)))
    simulation = scene.build(time_step=2e-3)
    last = simulation.energy()
    for _ in range(600):
        simulation.step()
        energy = simulation.energy()
        assert energy.work == 0.0
        assert energy.dissipated > last.dissipated - 1e-9
        last = energy
    assert simulation.positions(rod)[:, 2].min() > 0.94 * 5e-3


@pytest.mark.parametrize("restitution", [-0.1, 1.1, float("nan")])
def test_restitution_is_from_0_to_1(restitution: float) -> None:
    scene = withe.Scene()
    with pytest.raises(ValueError, match="restitution"):
        scene.add_floor(restitution=restitution)
    with pytest.raises(ValueError, match="restitution"):
        scene.enable_contact(restitution=restitution)


def test_an_explicit_scheme_says_that_it_knows_elastic_impacts_only() -> None:
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.02), end=(0.1, 0, 0.02), nodes=5, radius=5e-3, material=RUBBER)
    scene.add_floor(restitution=0.5)
    with pytest.raises(ValueError, match="elastic impacts only"):
        scene.build(integrator="verlet", time_step=1e-6)


def test_error_control_gets_through_an_impact() -> None:
    """Contact once grew the stiffer the shorter a step was that met it, so that no step was short enough."""
    scene = withe.Scene()
    rod = scene.add_rod(start=(0, 0, 0.0105), end=(0.3, 0, 0.0105), nodes=21, radius=5e-3, material=RUBBER)
    scene.add_floor(friction=0.3)
    simulation = scene.build(integrator="backward_euler", time_step=1e-2, tolerance=1e-3)
    simulation.run(0.06, progress=False)
    assert simulation.positions(rod)[:, 2].min() > 0.98 * 5e-3


def test_nothing_that_rests_creeps_by_default() -> None:
    scene = withe.Scene(gravity=(1.0, 0, -9.81))  # a slope of a tenth
    rod = scene.add_rod(start=(0, 0, 5e-3), end=(0.2, 0, 5e-3), nodes=21, radius=5e-3, material=RUBBER)
    scene.add_floor(friction=0.5, restitution=0.0)
    simulation = scene.build(time_step=1e-2)
    simulation.step(200)
    start = simulation.positions(rod)
    simulation.step(1000)  # 10 s
    assert np.abs(simulation.positions(rod) - start)[:, :2].max() < 1e-8
