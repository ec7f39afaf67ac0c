"""Contact of rigid bodies: what users set, read and are told."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import withe
from withe.parts.body_surfaces import core_of

BALL = withe.solids.Sphere(0.02)


def ball_on_rods(**words: object) -> tuple[withe.Scene, withe.Body]:
    """Draw a ball that falls onto two clamped rods."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    scene.enable_contact(friction=0.2)
    rubber = withe.Material(youngs_modulus=2e6, density=1000.0)
    for y in (-0.015, 0.015):
        rod = scene.add_rod(start=(-0.1, y, 0), end=(0.1, y, 0), nodes=13, radius=0.004, material=rubber)
        scene.clamp(rod.start)
        scene.clamp(rod.end)
    return scene, scene.add_body(BALL, density=400, position=(0, 0, 0.03), **words)  # type: ignore[arg-type]


def test_contacts_name_bodies() -> None:
    """Read-outs, and the weight that contacts carry."""
    scene, _ = ball_on_rods(name="ball")
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    contacts = simulation.contacts()
    assert {tuple(pair) for pair in contacts["pair"]} == {("rod 1", "ball"), ("rod 2", "ball")}
    pressing = (contacts["normal_force"][:, None] * contacts["normal"]).sum(axis=0) + contacts["friction"].sum(axis=0)
    weight = 400 * BALL.volume * 9.81
    np.testing.assert_allclose(pressing, [0, 0, -weight], atol=1e-4 * weight)


def test_copies_pickles_and_snapshots_continue_to_the_bit() -> None:
    """In the middle of an impact."""
    scene, ball = ball_on_rods()
    simulation = scene.build(time_step=1e-3)
    simulation.step(60)
    assert len(simulation.contacts()) > 0
    snapshot, others = simulation.snapshot(), [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    simulation.step(20)
    for other in others:
        other.step(20)
        np.testing.assert_array_equal(other.positions(), simulation.positions())
    expected = simulation.position(ball)
    simulation.restore(snapshot)
    simulation.step(20)
    np.testing.assert_array_equal(simulation.position(ball), expected)


def test_a_batch_steps_as_its_simulations() -> None:
    """To the bit."""
    scene, ball = ball_on_rods()
    batch = scene.build_batch(2, time_step=1e-3)
    batch.step(80)
    simulation = scene.build(time_step=1e-3)
    simulation.step(80)
    np.testing.assert_array_equal(batch.position(ball)[1], simulation.position(ball))


def test_a_scene_file_keeps_what_touches(tmp_path: Path) -> None:
    """Friction, restitution, and a ball that touches nothing."""
    scene, ball = ball_on_rods(friction=0.6, restitution=0.5, name="ball")
    ghost = scene.add_body(BALL, density=400, position=(0, 0, 0.03), touches=False, name="ghost")
    scene.save(tmp_path / "scene.toml")
    found = []
    for each in (scene, withe.Scene.load(tmp_path / "scene.toml")):
        simulation = each.build(time_step=1e-3)
        simulation.step(80)
        found.append([simulation.position("ball"), simulation.position("ghost")])
    np.testing.assert_array_equal(found[0], found[1])
    assert found[0][1][2] == pytest.approx(0.03 - 0.5 * 9.81 * 0.08**2, rel=1e-6)  # it falls through
    assert found[0][0][2] > 0.005
    assert (ball.name, ghost.name) == ("ball", "ghost")


@pytest.mark.parametrize(("own", "floor"), [(0.3, 0.0), (0.0, 0.3), (0.3, 0.1), (None, 0.3)])
def test_the_greater_friction_counts(own: float | None, floor: float) -> None:
    """Deceleration of a ball that slides, before it rolls."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    scene.add_floor(friction=floor)
    ball = scene.add_body(BALL, density=1000, position=(0, 0, 0.02), friction=own)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(ball, (2, 0, 0))
    simulation.step(50)
    assert simulation.velocity(ball)[0] == pytest.approx(2.0 - 0.3 * 9.81 * 0.05, rel=1e-3)


def test_friction_of_a_pair_has_precedence() -> None:
    """Set in the scene, then during the run."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    floor = scene.add_floor(friction=0.5)
    ball = scene.add_body(BALL, density=1000, position=(0, 0, 0.02), friction=0.4)
    scene.set_friction(ball, floor, 0.1)
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(ball, (2, 0, 0))
    simulation.step(50)
    speed = simulation.velocity(ball)[0]
    assert speed == pytest.approx(2.0 - 0.1 * 9.81 * 0.05, rel=1e-3)
    simulation.set((ball, floor), friction=0.2)
    simulation.step(50)
    assert simulation.velocity(ball)[0] == pytest.approx(speed - 0.2 * 9.81 * 0.05, rel=1e-3)


def test_a_rod_does_not_touch_the_body_that_it_is_joined_to() -> None:
    """Near the joint only: the far end of the rod does."""
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact()
    rubber = withe.Material(youngs_modulus=1e5, density=1000.0)
    ball = scene.add_body(BALL, density=1000)
    rod = scene.add_rod(start=(0, 0, 0.02), end=(0, 0, 0.22), nodes=21, radius=0.003, material=rubber)
    scene.join(rod.start, ball)
    hold = scene.clamp(rod.end)
    simulation = scene.build(integrator="static")
    assert len(simulation.contacts()) == 0
    rest = simulation.positions(rod).copy()
    simulation.equilibrium()
    np.testing.assert_allclose(simulation.positions(rod), rest, atol=1e-9)
    assert hold.name == "clamp 1"


def test_bodies_and_rods_that_pass_through_each_other_are_named() -> None:
    """A scene without contact warns once."""
    scene = withe.Scene(gravity=(0, 0, 0))
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    scene.clamp(scene.add_rod(start=(-0.1, 0, 0), end=(0.1, 0, 0), nodes=9, radius=0.004, material=rubber).start)
    ball = scene.add_body(BALL, density=1000, position=(0, 0, 0.03), name="ball")
    simulation = scene.build(time_step=1e-3)
    simulation.set_velocity(ball, (0, 0, -1))
    with pytest.warns(withe.RodCrossingWarning, match="rod 'rod 1' and body 'ball' pass through each other"):
        simulation.step(60)


def test_overlapping_bodies_are_named() -> None:
    """In the error of build."""
    scene = withe.Scene()
    scene.enable_contact()
    scene.add_body(BALL, density=1000, name="red")
    scene.add_body(BALL, density=1000, position=(0, 0, 0.03), name="green")
    with pytest.raises(ValueError, match=r"body 'red' and body 'green' overlap by 0\.01"):
        scene.build(time_step=1e-3)


@pytest.mark.parametrize(
    ("solid", "words", "message"),
    [
        (BALL, {"friction": -0.1}, "friction of body 'x' must not be negative"),
        (BALL, {"restitution": 1.5}, "restitution of body 'x' must"),
        (BALL, {"touches": "no"}, "touches of body 'x' must be True or False"),
        (BALL, {"touches": False, "friction": 0.3}, "friction of body 'x' has no effect"),
        (
            withe.solids.Cylinder(0.1, 0.1),
            {"friction": 0.3},
            "touches nothing: use a sphere, capsule, box, hull or mesh",
        ),
    ],
)
def test_what_cannot_be_is_refused(solid: object, words: dict[str, object], message: str) -> None:
    """With what to do."""
    with pytest.raises(ValueError, match=message):
        withe.Scene().add_body(solid, density=1000, name="x", **words)  # type: ignore[arg-type]


def test_a_solid_that_touches_nothing_has_no_pair() -> None:
    """In set_friction."""
    scene = withe.Scene()
    floor, box = scene.add_floor(), scene.add_body(withe.solids.Cylinder(0.1, 0.1), density=1000, name="box")
    with pytest.raises(ValueError, match="body 'box' touches nothing"):
        scene.set_friction(box, floor, 0.3)


def test_a_body_stands_for_its_support() -> None:
    """Its pose, its reaction, and its release; a free body has none."""
    scene, ball = ball_on_rods()
    wand = scene.add_body(withe.solids.Capsule(0.01, 0.1), mass=0.2, position=(0, 0, 0.3), name="wand")
    scene.clamp(wand)
    simulation = scene.build(time_step=1e-3)
    simulation.move(wand, position=(0, 0, 0.31), over=0.01)
    simulation.step(200)
    np.testing.assert_allclose(simulation.position(wand), (0, 0, 0.31), atol=1e-12)
    np.testing.assert_allclose(simulation.reaction(wand).force, (0, 0, 0.2 * 9.81), atol=1e-9)
    with pytest.raises(ValueError, match="body 'body 1' is not held: clamp or pin it first"):
        simulation.move(ball, position=(0, 0, 0))
    simulation.release(wand)
    simulation.step(10)
    assert simulation.position(wand)[2] < 0.31


def test_a_pendulum_that_touches_nothing_stays_planar() -> None:
    """Its ball could touch something only if there were another part."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    cable = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=11, radius=0.004, material=rubber)
    scene.pin(cable.start)
    scene.join(cable.end, scene.add_body(BALL, density=1000, position=(0.32, 0, 0)))
    assert scene.build(time_step=1e-3).plan.planar
    scene.add_body(BALL, density=1000, position=(0.1, 0, -0.2))
    assert not scene.build(time_step=1e-3).plan.planar


def test_a_mesh_file_touches_as_the_solid_that_it_shows(tmp_path: Path) -> None:
    """A box in millimetres, with repeated vertices as in STL files."""
    pyvista = pytest.importorskip("pyvista")
    vertices, triangles = withe.solids.Box((0.1, 0.08, 0.04)).surface()
    faces = np.column_stack([np.full(len(triangles), 3), triangles]).ravel()
    pyvista.PolyData(1e3 * vertices, faces).save(str(tmp_path / "box.stl"))
    mesh = withe.solids.Mesh.load(tmp_path / "box.stl", scale=1e-3)
    assert mesh.volume == pytest.approx(0.1 * 0.08 * 0.04)
    core = core_of(mesh)
    assert core is not None
    assert len(core.faces) == 6
    assert len(core.segments) == 12
    with pytest.raises(FileNotFoundError, match="no such file"):
        withe.solids.Mesh.load(tmp_path / "none.stl")


def test_concave_edges_touch_nothing() -> None:
    """A channel has one face for each of its twelve sides, and no edge in its corners."""
    outline = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]
    n = len(outline)
    vertices = np.array([(x, y, z) for z in (0.0, 4.0) for x, y in outline]) * 0.01
    caps = [(0, 1, 4), (1, 2, 3), (1, 3, 4), (0, 4, 5), (0, 5, 7), (5, 6, 7)]
    triangles = [caps_[::-1] for caps_ in caps] + [(a + n, b + n, c + n) for a, b, c in caps]
    for i in range(n):
        j = (i + 1) % n
        triangles += [(i, j, j + n), (i, j + n, i + n)]
    core = core_of(withe.solids.Mesh(vertices, np.array(triangles)))
    assert core is not None
    assert len(core.faces) == 10
    assert len(core.segments) == 24 - 2


@pytest.mark.parametrize(
    ("solid", "message"),
    [
        (lambda: withe.solids.Box((0.1, 0.1, 0.02), rounding=0.01), "rounding of the box must be less than half"),
        (lambda: withe.solids.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]), "not in one plane"),
        (lambda: withe.solids.Mesh(np.eye(3), [(0, 1, 2)]), r"must be closed.*Edges of triangles \[0\] do not"),
        (
            lambda: withe.solids.Mesh(np.diag([1.0, 1.0, 0.0]), [(0, 1, 1), (1, 1, 2)]),
            r"triangles \[0, 1\] of the mesh have no area",
        ),
        (lambda: flipped(), "counter-clockwise when seen from outside"),
    ],
)
def test_solids_that_cannot_touch_are_refused(solid: Callable[[], object], message: str) -> None:
    """With what is wrong with them."""
    with pytest.raises(ValueError, match=message):
        solid()


def flipped() -> withe.solids.Mesh:
    """Return a box that is inside out."""
    vertices, triangles = withe.solids.Box((0.1, 0.1, 0.1)).surface()
    return withe.solids.Mesh(vertices, triangles[:, ::-1])


def test_what_faces_cannot_touch_is_refused() -> None:
    """A sphere as an obstacle, and a rod inside of a box, unless the pair is left out."""
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    scene = withe.Scene()
    box = scene.add_body(withe.solids.Box((0.1, 0.1, 0.1)), density=1000, name="box")
    ball = scene.add_sphere(center=(0.3, 0, 0), radius=0.05, name="ball")
    with pytest.raises(ValueError, match=r"obstacle 'ball' does not touch the faces of body 'box'\. Add it"):
        scene.build()
    scene.ignore_contact(ball, box)
    scene.build()
    scene.enable_contact()
    rod = scene.add_rod(start=(0, 0, 0), end=(0, 0, 0.2), nodes=9, radius=0.004, material=rubber, name="rod")
    with pytest.raises(ValueError, match="rod 'rod' is drawn inside of body 'box'"):
        scene.build()
    scene.join(rod.start, box)
    assert len(scene.build(time_step=1e-3).contacts()) == 0


@pytest.mark.parametrize("nodes", [9, 40])
@pytest.mark.parametrize("start", [(0, 0, 0), (0, 0, 0.05), (0, 0, -0.02)])
def test_a_rod_comes_out_of_the_box_that_it_is_joined_to(start: tuple[float, float, float], nodes: int) -> None:
    """It does not touch the face that it passes, but others."""
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    scene = withe.Scene()
    scene.enable_contact()
    box = scene.add_body(withe.solids.Box((0.1, 0.1, 0.1)), density=1000)
    rod = scene.add_rod(start=start, end=np.add(start, (0, 0, 0.2)), nodes=nodes, radius=0.004, material=rubber)
    scene.join(rod.start, box)
    assert len(scene.build(time_step=1e-3).contacts()) == 0


def test_bodies_inside_of_each_other_are_refused() -> None:
    """A box in a box, a bar through a plate, a ball in a box, and a rod that crosses a box within an edge."""
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    for inner in (
        lambda scene: scene.add_body(withe.solids.Box((0.02, 0.02, 0.02)), density=1000, name="inner"),
        lambda scene: scene.add_body(withe.solids.Box((0.02, 0.02, 0.3)), density=1000, name="inner"),
        lambda scene: scene.add_body(withe.solids.Sphere(0.01), density=1000, name="inner"),
        lambda scene: scene.add_rod(
            start=(-0.3, 0.003, 0), end=(0.3, 0.003, 0), nodes=4, radius=0.004, material=rubber, name="inner"
        ),
    ):
        scene = withe.Scene()
        scene.enable_contact()
        scene.add_body(withe.solids.Box((0.1, 0.1, 0.04)), density=1000, name="outer")
        inner(scene)
        with pytest.raises(ValueError, match="'inner' is drawn inside of body 'outer'"):
            scene.build(time_step=1e-3)


def cup(side: float, wall: float) -> withe.solids.Mesh:
    """Return a square cup, open above."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    rings = [(0.5 * side, 0.0), (0.5 * side, side), (0.5 * side - wall, side), (0.5 * side - wall, wall)]
    vertices = np.array([(half * x, half * y, z) for half, z in rings for x, y in square])
    triangles = [(0, 2, 1), (0, 3, 2), (12, 13, 14), (12, 14, 15)]
    for k in range(4):
        after = (k + 1) % 4
        for low, high in ((0, 4), (4, 8), (8, 12)):
            triangles += [(low + k, low + after, high + after), (low + k, high + after, high + k)]
    return withe.solids.Mesh(vertices, np.array(triangles))


@pytest.mark.parametrize("wall", [0.001, 0.02])
def test_a_ball_rests_in_a_cup_with_thin_walls(wall: float) -> None:
    """It touches the bottom from inside, and nothing behind it."""
    scene = withe.Scene()
    scene.enable_contact(restitution=0.0)
    scene.clamp(scene.add_body(cup(0.1, wall), density=1000))
    ball = scene.add_body(withe.solids.Sphere(0.01), density=1000, position=(0.01, 0.005, wall + 0.0102))
    simulation = scene.build(time_step=2e-3)
    simulation.step(100)
    np.testing.assert_allclose(simulation.position(ball), (0.01, 0.005, wall + 0.01), atol=1e-4)


def test_a_ball_beside_an_acute_edge_touches_one_face() -> None:
    """And a ball beside a rounded edge touches the round."""
    rise = 0.04 * np.tan(np.radians(20.0))
    wedge = withe.solids.Hull(
        [(0, y, 0) for y in (-0.02, 0.02)] + [(0.04, y, z) for y in (-0.02, 0.02) for z in (0, -rise)]
    )
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact()
    scene.clamp(scene.add_body(wedge, density=1000))
    scene.add_body(withe.solids.Sphere(2e-3), density=1000, position=(0.003, 0, 0.00201))
    contacts = scene.build().contacts()
    assert len(contacts) == 1
    assert contacts["gap"][0] == pytest.approx(1e-5, abs=1e-9)
    side, rounding, radius = 0.06, 0.008, 0.002
    away = 0.5 * side - rounding + (rounding + radius + 1e-6) / np.sqrt(2.0)
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact()
    scene.clamp(scene.add_body(withe.solids.Box((side, 0.1, side), rounding=rounding), density=1000))
    scene.add_body(withe.solids.Sphere(radius), density=1000, position=(away, 0, away))
    assert scene.build().contacts()["gap"] == pytest.approx([1e-6], abs=1e-9)


def test_a_box_between_two_held_boxes_that_close_is_squeezed() -> None:
    """Both are rigid, so the error names them instead of a force that has no bound."""
    scene = withe.Scene(gravity=(0, 0, 0))
    scene.enable_contact()
    scene.add_body(withe.solids.Box((0.04, 0.04, 0.04)), density=1000, name="box")
    jaws = []
    for side, name in ((-1, "left"), (1, "right")):
        jaw = scene.add_body(
            withe.solids.Box((0.02, 0.06, 0.06)), density=1000, position=(0.03 * side, 0, 0), name=name
        )
        scene.clamp(jaw)
        jaws.append(jaw)
    simulation = scene.build(time_step=1e-3, integrator="backward_euler")
    for side, jaw in zip((-1, 1), jaws, strict=True):
        simulation.move(jaw, (side * (0.03 - 2e-5), 0, 0), over=0.02)
    with pytest.raises(withe.ConvergenceError, match="body 'box' is squeezed between body 'left' and body 'right'"):
        simulation.step(30)
