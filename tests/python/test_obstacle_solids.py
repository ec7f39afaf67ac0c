"""Tubes and fields as obstacles: their geometry, wrong input, pictures and files."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import withe
from withe.parts.obstacle_shapes import shape_of
from withe.solids import Box, Field, Sphere, Tube

Array = npt.NDArray[np.float64]
SOFT = withe.Material(youngs_modulus=1e6, density=1000)


def quarter(radius: float = 0.05, points: int = 21) -> Array:
    """Points of a quarter of a circle."""
    angle = np.linspace(0.0, 0.5 * np.pi, points)
    return radius * np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])


def ring(p: Array) -> Array:
    """Distance from a torus."""
    return np.asarray(np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.03, p[:, 2]) - 0.01, np.float64)


RING = Field(ring, bounds=[(-0.05, -0.05, -0.02), (0.05, 0.05, 0.02)])


def test_distances_from_a_bent_tube_are_those_of_its_arc() -> None:
    """Inside, outside, and beyond an end."""
    draw = np.random.default_rng(0)
    angle, rho, turn = draw.uniform(0.05, 1.5, 500), draw.uniform(0.0, 0.01, 500), draw.uniform(0.0, 6.3, 500)
    away = 0.05 + rho * np.cos(turn)
    points = np.column_stack([away * np.cos(angle), away * np.sin(angle), rho * np.sin(turn)])
    shape = shape_of(Tube(quarter(), radius=0.004, wall=0.002))
    np.testing.assert_allclose(shape.distances(points), np.abs(rho - 0.005), atol=1e-7)
    before = np.array([[0.053, -0.002, 0.0], [0.05, -0.001, 0.008]])
    np.testing.assert_allclose(shape.distances(before), np.hypot([0.002, 0.003], [0.002, 0.001]), atol=1e-6)


@pytest.mark.parametrize("solid", [Tube(quarter(), radius=0.004), RING], ids=["tube", "field"])
def test_normals_are_gradients(solid: Tube | Field) -> None:
    """Central differences of distances give the normals beside the surface."""
    draw = np.random.default_rng(1)
    vertices, _ = solid.surface()
    points = vertices[draw.integers(0, len(vertices), 300)] + draw.normal(0.0, 1e-3, (300, 3))
    shape, small = shape_of(solid), 1e-6
    slopes = [
        (shape.distances(points + small * u) - shape.distances(points - small * u)) / (2 * small) for u in np.eye(3)
    ]
    normals = shape.normals(points)
    # The distance has a kink in the middle of a tube's wall.
    smooth = np.abs(shape.distances(points)) > 2e-6
    np.testing.assert_allclose(np.column_stack(slopes)[smooth], normals[smooth], atol=2e-5)


def test_the_surface_of_a_field_encloses_its_volume() -> None:
    """Triangles face outwards."""
    vertices, triangles = RING.surface()
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0 == pytest.approx(2 * np.pi**2 * 0.03 * 1e-4, rel=0.01)
    assert np.abs(ring(vertices)).max() < 1e-4


def test_a_grid_is_as_good_as_its_function() -> None:
    """The array holds the values of the function."""
    again = Field(RING.values, bounds=RING.bounds)
    points = RING.surface()[0][::50]
    np.testing.assert_allclose(shape_of(again).distances(points), shape_of(RING).distances(points), atol=1e-15)
    np.testing.assert_allclose(shape_of(RING).distances(points), ring(points), atol=3e-5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Tube([(0, 0, 0)], radius=0.01), "two and more"),
        (lambda: Tube([(0, 0, 0), (0, 0, 0), (1, 0, 0)], radius=0.01), "may be equal"),
        (lambda: Tube([(0, 0, 0), (1, 0, 0)], radius=0.0), "radius of the tube"),
        (lambda: Tube([(0, 0, 0), (1, 0, 0)], radius=0.1, wall=-1.0), "wall of the tube"),
        (lambda: Tube(quarter(0.005), radius=0.005), "bends with a radius of 0.00498 m"),
        (lambda: Tube(0.05 * coil(0.2), radius=0.01), "passes through itself"),
        (lambda: Field(ring, bounds=[(0, 0, 0), (-1, 1, 1)]), "lowest and a highest corner"),
        (lambda: Field(lambda p: p[:, :1], bounds=[(0, 0, 0), (1, 1, 1)]), "one number for each point"),
        (lambda: Field(lambda p: np.log(p[:, 0] - 0.5), bounds=[(0, 0, 0), (1, 1, 1)]), "not finite at"),
        (lambda: Field(lambda p: 2.0 * p[:, 0] - 1.0, bounds=[(0, 0, 0), (1, 1, 1)]), "the length is 2 in the median"),
        (lambda: Field(lambda p: p[:, 0] + 1.0, bounds=[(0, 0, 0), (1, 1, 1)]), "no surface within its bounds"),
        (lambda: Field(ring, bounds=RING.bounds, spacing=1e-5), "greater spacing"),
        (lambda: Field(RING.values, bounds=RING.bounds, spacing=1e-3), "must be None"),
        (lambda: Field(np.zeros((2, 5, 5)), bounds=RING.bounds), "four points"),
    ],
)
def test_wrong_solids_are_refused(make: object, message: str) -> None:
    """With what to do."""
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]


def coil(rise: float) -> Array:
    """Two turns of a helix of unit radius."""
    angle = np.linspace(0.0, 4.0 * np.pi, 81)
    return np.column_stack([np.cos(angle), np.sin(angle), rise * angle / (2.0 * np.pi)])


def test_wrong_scenes_are_refused() -> None:
    """Names tell what does not fit."""
    scene = withe.Scene()
    with pytest.raises(ValueError, match="add_sphere"):
        scene.add_obstacle(Sphere(0.1))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="add_body, and hold"):
        scene.add_obstacle(Box((1, 1, 1)))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="use add_obstacle"):
        scene.add_body(RING, density=1000)  # type: ignore[arg-type]
    scene.add_obstacle(Tube([(0, 0, 0), (0.1, 0, 0)], radius=0.001), name="vein")
    rod = scene.add_rod(start=(0.02, 0, 0), end=(0.08, 0, 0), nodes=13, radius=0.002, material=SOFT, name="wire")
    with pytest.raises(ValueError, match=r"'wire' with a contact radius of 0\.002 m is drawn inside of 'vein'"):
        scene.build()
    scene.ignore_contact(rod, "vein")
    scene.build()


def test_rods_drawn_in_the_wall_are_refused() -> None:
    """As in any obstacle."""
    scene = withe.Scene()
    scene.add_obstacle(Tube([(0, 0, 0), (0.1, 0, 0)], radius=0.004), name="vein")
    scene.add_rod(start=(0.02, 0, 0.0035), end=(0.08, 0, 0.0035), nodes=13, radius=0.001, material=SOFT, name="wire")
    with pytest.raises(ValueError, match="vein"):
        scene.build()


def scene_with(solid: Tube | Field) -> withe.Scene:
    """A rod that falls on a solid."""
    scene = withe.Scene()
    scene.add_obstacle(solid, position=(0.0, 0.0, -0.02), friction=0.2, name="thing")
    scene.add_rod(start=(0.0, 0.03, 0.0), end=(0.04, 0.03, 0.0), nodes=15, radius=0.001, material=SOFT, name="wire")
    return scene


@pytest.mark.parametrize("solid", [Tube(quarter(), radius=0.004), Field(RING.values, bounds=RING.bounds)])
def test_scene_files_snapshots_and_copies_repeat_to_the_bit(solid: Tube | Field, tmp_path: Path) -> None:
    """All of them go on alike."""
    scene = scene_with(solid)
    simulation = scene.build(time_step=2e-3)
    simulation.step(20)
    twins = [copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))]
    scene.save(tmp_path / "scene.toml")
    loaded = withe.Scene.load(tmp_path / "scene.toml").build(time_step=2e-3)
    loaded.step(20)
    simulation.step(20)
    for twin in (*twins, loaded):
        twin.step(20)
        np.testing.assert_array_equal(twin.positions(), simulation.positions())


def test_a_function_has_no_place_in_a_file(tmp_path: Path) -> None:
    """Fields by a function are refused with its name."""
    with pytest.raises(ValueError, match="Python function"):
        scene_with(RING).save(tmp_path / "scene.toml")


@pytest.mark.parametrize("solid", [Tube(quarter(), radius=0.004), RING], ids=["tube", "field"])
def test_records_keep_surfaces(solid: Tube | Field, tmp_path: Path) -> None:
    """Saved and loaded, and written for other programs."""
    simulation = scene_with(solid).build(time_step=5e-3)
    record = simulation.run(0.02, record_every=0.01)
    again = withe.Record.load(record.save(tmp_path / "run.npz"))
    np.testing.assert_array_equal(again.obstacles[0].vertices, solid.surface()[0])
    assert again.obstacles[0].kind == "shape"
    record.plot()
    record.export(tmp_path / "run.glb")
