"""A sheet that widens from where it is held and narrows again: rods of tapered rectangles against the elastica."""

import numpy as np
import pytest

import withe
from cases import measured
from withe.folding import elastica
from withe.folding.grid import lift
from withe.folding.sheets import poses_of
from withe.folding.widths import Width

LGB, LENGTH, THICKNESS, WIDEST = 0.05, 0.3, 1e-4, 0.2
PLACES, WIDTHS = np.array([0.0, 0.14, LENGTH]), np.array([0.02, WIDEST, 0.04])  # straight between
DENSITY, GRAVITY = 500.0, 9.81


def way_to(x: float, z: float, width: Width) -> np.ndarray:
    """Poses x, z, angle of sheets without moment: raised without tangential force, and on to a position [Lgb]."""
    raised = poses_of(lift(width))[:40]
    share = np.linspace(0.0, 1.0, 41)[1:]
    on = elastica(*(raised[-1, :2, None] + share * (np.array([x, z]) - raised[-1, :2])[:, None]), width=rows_of(width))
    return np.concatenate([np.zeros((1, 3)), raised, poses_of(on)])


def rows_of(width: Width) -> np.ndarray:
    return np.stack([width.places, width.widths], axis=1)


def lifted(edges: int, way: np.ndarray) -> np.ndarray:
    """Force of the jaw on a rod that is led to a pose, x and z [N], and its moment [N m]."""
    weight = DENSITY * GRAVITY * THICKNESS * WIDEST
    modulus = 2.0 * weight * LGB**3 / (WIDEST * THICKNESS**3 / 12.0)
    scene = withe.Scene()
    nodes = np.linspace(0.0, LENGTH, edges + 1)
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    sheet = scene.add_rod(
        points=np.stack([nodes, np.zeros_like(nodes), np.zeros_like(nodes)], axis=1),
        normal=(0.0, 1.0, 0.0),  # the width
        section=withe.Rectangle(width=np.interp(middles, PLACES, WIDTHS), height=THICKNESS),
        contact_radius=0.5 * THICKNESS,
        material=withe.Material(youngs_modulus=modulus, density=DENSITY),
        name="sheet",
    )
    jaw = scene.clamp(sheet.start)
    scene.add_floor(-0.55 * THICKNESS, friction=10.0)
    scene.enable_contact(friction=0.0, friction_model="anchored", distance_tolerance=0.05 * THICKNESS)
    simulation = scene.build(integrator="backward_euler", time_step=0.02, planar=True)

    def path(time):
        place = np.interp(time, [0.0, 4.0], [0.0, len(way) - 1.0])
        x, z, angle = (np.interp(place, np.arange(len(way)), column) for column in (way * [LGB, LGB, 1.0]).T)
        cosine, sine = np.cos(angle), np.sin(angle)
        return np.array([x, 0.0, z]), np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])

    simulation.move(jaw, path=path)
    simulation.run(6.0, progress=False)
    reaction = simulation.reaction(jaw)
    return np.array([reaction.force[0], reaction.force[2], reaction.moment[1]])


@pytest.mark.case("statics", "Forces of a tapered hanging sheet", source="elastica of varying width")
@pytest.mark.slow
@pytest.mark.parametrize(("x", "z"), [(0.5, 1.5), (1.5, 2.0)])
def test_a_tapered_rod_is_held_by_the_forces_of_the_continuum(x, z):
    weight = DENSITY * GRAVITY * THICKNESS * WIDEST
    width = Width(tuple(PLACES / LGB), tuple(WIDTHS / WIDEST))
    pose = elastica(x, z, width=rows_of(width))
    lifts = float(width.weight(pose.suspended))
    exact = weight * LGB * np.array([pose.tangential_force, lifts - pose.normal_force])  # it leaves towards -x
    size = np.linalg.norm(exact)
    way = way_to(x, z, width)
    for edges, most in ((144, 4e-3), (288, 1.5e-3)):  # Lgb / 24, / 48
        found = lifted(edges, way)
        measured(np.linalg.norm(found[:2] - exact) / size)
        assert np.linalg.norm(found[:2] - exact) < most * size
        assert abs(found[2]) < 2.0 * most * size * LGB  # it is held without moment
