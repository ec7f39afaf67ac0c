"""Contact in scripts: what a scene accepts and refuses, what a simulation answers, and that it repeats to the bit."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)


def crossing(**contact: Any) -> tuple[withe.Scene, withe.Rod, withe.Rod]:
    """A rod that falls on a clamped one."""
    scene = withe.Scene()
    top = scene.add_rod(
        start=(-0.1, 0.01, 0.012), end=(0.1, 0, 0.012), nodes=15, radius=5e-3, material=RUBBER, name="top"
    )
    bar = scene.add_rod(start=(0, -0.1, 0), end=(0.01, 0.1, 0), nodes=15, radius=5e-3, material=RUBBER, name="bar")
    scene.clamp(bar.start)
    scene.clamp(bar.end)
    scene.enable_contact(**contact)
    return scene, top, bar


def test_contacts_name_the_pair_and_balance_the_weight_of_a_block() -> None:
    scene = withe.Scene()
    scene.add_rod(start=(0, 0, 0.005), end=(0.1, 0, 0.005), nodes=5, radius=5e-3, material=RUBBER, name="block")
    scene.add_floor(name="table")
    simulation = scene.build(integrator="backward_euler")
    simulation.step(200)
    contacts = simulation.contacts()
    assert {tuple(pair) for pair in contacts["pair"]} == {("block", "table")}
    weight = 1200.0 * np.pi * 5e-3**2 * 0.1 * 9.81
    assert contacts["normal_force"].sum() == pytest.approx(weight, rel=1e-3)
    np.testing.assert_allclose(contacts["normal"], np.tile([0.0, 0.0, 1.0], (len(contacts), 1)), atol=1e-12)
    assert np.abs(contacts["point"][:, 2]).max() < 5e-4
    assert (contacts["edge"][:, 1] == -1).all()


@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "anchored"])
def test_a_restored_a_copied_and_a_pickled_simulation_go_on_with_the_same_bits(friction_model: Any) -> None:
    scene, _, _ = crossing(friction=0.3, friction_model=friction_model)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    simulation.step(30)
    assert len(simulation.contacts()) > 0
    snapshot = simulation.snapshot()
    copies = [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    simulation.step(10)
    expected = simulation.positions()
    simulation.restore(snapshot)
    for one in [simulation, *copies]:
        if one is not simulation:
            one.restore(snapshot)
        one.step(10)
        np.testing.assert_array_equal(one.positions(), expected)


@pytest.mark.parametrize("friction_model", ["implicit", "lagged", "anchored"])
@pytest.mark.parametrize("integrator", ["backward_euler", "implicit_midpoint", "energy_momentum"])
def test_energies_and_contacts_read_out_between_any_two_calls_change_no_bit(
    integrator: Any, friction_model: Any
) -> None:
    scene, _, _ = crossing(friction=0.3, friction_model=friction_model, restitution=0.5)
    simulation, asked = (scene.build(integrator=integrator, time_step=2e-3) for _ in range(2))
    for k in range(30):
        asked.energy()
        if k == 15:
            for one in (simulation, asked):
                one.set(gravity=(1.0, 0.0, -9.81))
        asked.contacts()
        simulation.step()
        asked.step()
        np.testing.assert_array_equal(asked.positions(), simulation.positions())
        np.testing.assert_array_equal(asked.velocities(), simulation.velocities())
    assert len(simulation.contacts()) > 0
    assert asked.statistics.iterations == simulation.statistics.iterations


def parallel_pair() -> withe.Scene:
    scene = withe.Scene(gravity=(0, 0, 0))
    for name, height in (("a", 0.0), ("b", 0.007)):
        scene.add_rod(start=(0, 0, height), end=(0.3, 0, height), nodes=31, radius=5e-3, material=RUBBER, name=name)
    return scene


def clamped_cross() -> withe.Scene:
    """Centrelines that meet, between walls: both rods must bend."""
    scene = withe.Scene(gravity=(0, 0, 0))
    for name, end in (("a", (0.15, 0.0, 0.0)), ("b", (0.0, 0.15, 1e-9))):
        start = -np.array(end)
        rod = scene.add_rod(start=start, end=end, nodes=31, radius=5e-3, material=RUBBER, name=name)
        scene.clamp(rod.start)
        scene.clamp(rod.end)
    return scene


def loop() -> withe.Scene:
    """A rod that meets itself after a turn."""
    scene = withe.Scene(gravity=(0, 0, 0))
    t = np.linspace(0.0, 1.15, 80)
    angle = 2.0 * np.pi * t
    points = np.column_stack([0.05 * np.cos(angle), 0.05 * np.sin(angle), 4e-3 * t])
    scene.add_rod(points=points, nodes=80, radius=5e-3, material=RUBBER, name="a")
    return scene


@pytest.mark.parametrize("drawn", [parallel_pair, clamped_cross, loop])
def test_rods_that_overlap_are_moved_apart_on_request(drawn: Callable[[], withe.Scene]) -> None:
    scene = drawn()
    as_drawn = scene.build(planar=False).positions()
    scene.enable_contact()
    with pytest.raises(ValueError, match=r"overlap by .* m at the start"):
        scene.build(planar=False)
    scene.enable_contact(overlap="separate")
    simulation = scene.build(integrator="backward_euler", planar=False)
    start = simulation.positions()
    assert any("moved apart" in note for note in simulation.plan.notes)
    contacts = simulation.contacts()
    assert len(contacts) > 0
    assert contacts["gap"].min() > -1e-12
    np.testing.assert_array_equal(simulation.velocities(), 0.0)
    assert np.linalg.norm(start - as_drawn, axis=1).max() < 0.01
    for rod in simulation.rods:
        strain = simulation.tensions(rod) / (1e6 * np.pi * 5e-3**2)
        assert np.abs(strain).max() < 0.01
    simulation.step(20)
    simulation.reset()
    np.testing.assert_array_equal(simulation.positions(), start)


def test_ignored_pairs_and_groups_pass_through_each_other() -> None:
    for leave_out in (
        lambda scene: scene.ignore_contact("top", "bar"),
        lambda scene: [scene.set_contact_group(rod, "ghosts") for rod in ("top", "bar")],
    ):
        scene, top, bar = crossing()
        leave_out(scene)
        simulation = scene.build(integrator="backward_euler", time_step=2e-3)
        simulation.step(60)
        assert len(simulation.contacts()) == 0
        assert simulation.positions(top)[:, 2].max() < simulation.positions(bar)[7, 2]


def test_a_pair_may_have_a_stiffness_of_its_own() -> None:
    depths = []
    for stiffness in (50.0, 500.0):
        scene = withe.Scene()
        scene.add_rod(start=(0, 0, 0.005), end=(0.1, 0, 0.005), nodes=5, radius=5e-3, material=RUBBER, name="block")
        scene.add_floor(name="table")
        scene.set_contact_stiffness("block", "table", stiffness)
        scene.set_friction("block", "table", 0.3)
        simulation = scene.build(integrator="backward_euler")
        simulation.step(200)
        contacts = simulation.contacts()
        # Each edge has a share of the stiffness at its nodes; 2 k depth is the force, where the penalty is not bent.
        totals = contacts["normal_force"].sum()
        assert totals == pytest.approx(1200.0 * np.pi * 5e-3**2 * 0.1 * 9.81, rel=1e-3)
        depths.append(-contacts["gap"].min())
    assert depths[0] > depths[1] + 1e-5


def test_the_plan_warns_of_edges_that_are_too_long_for_contact() -> None:
    def warnings(nodes: int) -> list[str]:
        scene = withe.Scene()
        scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=5e-3, material=RUBBER, name="rope")
        scene.enable_contact()
        return [note for note in scene.build().plan.notes if "warning" in note]

    assert warnings(21) == []
    (warning,) = warnings(11)
    assert "edges of rod 'rope' are 2 times as long as the rod is thick" in warning


def test_the_plan_says_what_contact_adds_and_what_is_skipped() -> None:
    scene, _, _ = crossing()
    assert any("rods touch each other" in note for note in scene.build().plan.notes)
    floor_only = withe.Scene()
    floor_only.add_rod(start=(0, 0, 0.1), end=(0.1, 0, 0.1), nodes=5, radius=5e-3, material=RUBBER)
    floor_only.add_floor()
    assert any("no broad phase" in note for note in floor_only.build().plan.notes)


@pytest.mark.parametrize(
    ("friction", "friction_model", "unsymmetric"),
    [(0.0, "implicit", False), (0.3, "lagged", False), (0.3, "implicit", True)],
)
def test_the_plan_says_that_implicit_friction_makes_the_jacobian_unsymmetric(
    friction: float, friction_model: Any, unsymmetric: bool
) -> None:
    scene = withe.Scene()
    scene.add_rod(start=(-0.1, 0, 0.01), end=(0.1, 0, 0.01), nodes=5, radius=5e-3, material=RUBBER)
    scene.enable_contact(friction=friction, friction_model=friction_model)
    assert ("unsymmetric Jacobian: implicit friction" in scene.build(planar=False).plan.notes) == unsymmetric


def overlapping(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 0.007), end=(0.1, 0, 0.007), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.add_rod(start=(0, -0.1, 0), end=(0, 0.1, 0), nodes=5, radius=5e-3, material=RUBBER, name="b")
    scene.enable_contact()
    scene.build()


def not_joined(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 0), end=(0, 0, 0), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=RUBBER, name="b")
    scene.enable_contact()
    scene.build()


def buried(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 0), end=(0.1, 0, 0), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.add_floor(name="table")
    scene.build()


def floor_through_a_clamp(scene: withe.Scene) -> None:
    rod = scene.add_rod(start=(0, 0, 0), end=(0, 0, 0.2), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.clamp(rod.start)
    scene.add_floor(name="table")
    scene.enable_contact(overlap="separate")
    scene.build()


def crossing_in_a_plane(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 0), end=(0.1, 0, 0), nodes=6, radius=5e-3, material=RUBBER, name="a")
    scene.add_rod(start=(0, 0, -0.1), end=(0, 0, 0.1), nodes=6, radius=5e-3, material=RUBBER, name="b")
    scene.enable_contact(overlap="separate")
    scene.build(planar=True)


def touching_barrier(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 5e-3), end=(0.1, 0, 5e-3), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.add_floor(name="table")
    scene.enable_contact(model="barrier")
    scene.build()


def unknown_group(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 1), end=(0.1, 0, 1), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.set_contact_group("a", None)  # type: ignore[arg-type]


def coarse_tolerance(scene: withe.Scene) -> None:
    scene.add_rod(start=(-0.1, 0, 1), end=(0.1, 0, 1), nodes=5, radius=5e-3, material=RUBBER, name="a")
    scene.enable_contact(distance_tolerance=0.1)
    scene.build()


REFUSED: list[tuple[Callable[[withe.Scene], Any], str]] = [
    (lambda scene: scene.add_floor(friction=-0.1), "friction of 'floor 1'"),
    (lambda scene: scene.add_floor(friction=float("nan")), "friction of 'floor 1'"),
    (lambda scene: scene.add_plane((0, 0, 0), (0, 0, 0)), "normal of 'plane 1'"),
    (lambda scene: scene.add_sphere((0, 0, 0), -1.0), "radius of 'sphere 1'"),
    (lambda scene: scene.add_capsule((0, 0, 0), (0, 0), 1.0), "end of 'capsule 1'"),
    (lambda scene: scene.enable_contact(friction=-1), "friction"),
    (lambda scene: scene.enable_contact(slip_tolerance=0), "slip_tolerance"),
    (lambda scene: scene.enable_contact(friction_model="sticky"), "friction_model"),
    (lambda scene: scene.set_friction("nobody", "noone", 0.1), "what touches 'nobody' is not in the scene"),
    (overlapping, "edge . of rod 'a' and edge . of rod 'b' overlap by 0.003"),
    (overlapping, "at the start: draw them apart, leave the pair out"),
    (not_joined, "at the start: join the nodes that meet there, draw them apart, leave the pair out"),
    (buried, "edge . of rod 'a' and 'table' overlap by 0.005"),
    (floor_through_a_clamp, "edge 0 of rod 'a' and 'table' overlap by 0.005 m at the start and cannot be moved apart"),
    (crossing_in_a_plane, "cannot be moved apart within their plane"),
    (lambda scene: scene.enable_contact(friction=float("nan")), "friction"),
    (lambda scene: scene.enable_contact(overlap="push"), "overlap"),
    (lambda scene: scene.enable_contact(stiffness="hard"), "stiffness of contact"),
    (lambda scene: scene.enable_contact(stiffness=0.0), "stiffness of contact"),
    (lambda scene: scene.set_contact_stiffness("a", "b", -1.0), "stiffness of contact"),
    (touching_barrier, "edge . of rod 'a' and 'table' overlap by 0 m"),
    (lambda scene: scene.set_contact_group("nobody", "inner"), "'nobody'"),
    (lambda scene: scene.ignore_contact("inner", "inner"), "what touches 'inner' is not in the scene"),
    (unknown_group, "group of rod 'a' must be text, got None"),
    (coarse_tolerance, "distance_tolerance must not exceed the contact radius of rod 'a'"),
]


@pytest.mark.parametrize(("call", "message"), REFUSED)
def test_what_cannot_be_is_refused_by_name(call: Callable[[withe.Scene], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call(withe.Scene())


def test_fourth_order_steps_refuse_contact() -> None:
    scene, _, _ = crossing()
    with pytest.raises(ValueError, match="fourth_order"):
        scene.build(integrator="fourth_order")


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler"])
def test_a_copy_in_another_thread_takes_the_same_steps_to_the_bit(integrator: Any) -> None:
    simulation = crossing(friction=0.3)[0].build(integrator=integrator)
    simulation.step(30)
    copy = simulation.copy()
    thread = threading.Thread(target=copy.step, args=(40,))
    thread.start()
    simulation.step(40)
    thread.join()
    assert copy.positions().tobytes() == simulation.positions().tobytes()
    assert copy.velocities().tobytes() == simulation.velocities().tobytes()
    assert copy.energy() == simulation.energy()
