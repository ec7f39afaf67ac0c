"""Equilibria of the literature: bent, pre-twisted and tapered cantilevers, follower forces, and frames.

What they are compared with is solved here without a mesh: `kirchhoff.py` by shooting, `stiffness_method.py` by
matrices of whole members, a tapered beam by quadrature.
"""

import numpy as np
import pytest
from scipy.integrate import quad

import rods
import withe
from cases import measured
from convergence import assert_order, assert_order_at_least
from kirchhoff import Cantilever, follower_tip
from stiffness_method import displacements

UP = np.array((0.0, 0.0, 1.0))


def missed(found, exact):
    return float(np.linalg.norm(np.subtract(found, exact)))


# [Bathe and Bolourchi 1979]: an eighth of a circle of radius 100 with a square section of 1 x 1, E = 1e7, nu = 0. The
# twisting stiffness is G (I1 + I2), as in the source. The load is perpendicular to the plane.
BEND_RADIUS, BEND_MODULUS, BEND_LOAD = 100.0, 1e7, 600.0
BEND_STIFFNESS = {"stretch": BEND_MODULUS, "twist": BEND_MODULUS / 12.0}


def bend_of_45_degrees(edges):
    turn = np.linspace(0.0, 0.25 * np.pi, 4001)
    curve = BEND_RADIUS * np.stack([1.0 - np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=1)
    scene = rods.weightless()
    arm = scene.add_rod(
        points=curve,
        nodes=edges + 1,
        normal=(1, 0, 0),
        radius=0.5,
        stiffness=withe.Stiffness(bend=BEND_MODULUS / 12.0, **BEND_STIFFNESS),
        line_density=1.0,
    )
    scene.clamp(arm.start)
    scene.add_force(arm.end, BEND_LOAD * UP)
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    return simulation.positions(arm)[-1]


@pytest.mark.case(
    "statics",
    "Tip of a bend of 45 degrees, loaded out of its plane",
    source="Kirchhoff's equations; scene of [Bathe and Bolourchi 1979]",
)
def test_bend_of_45_degrees_converges_at_second_order():
    bent = Cantilever(
        length=0.25 * np.pi * BEND_RADIUS,
        bend=(BEND_MODULUS / 12.0, BEND_MODULUS / 12.0),
        natural=(1.0 / BEND_RADIUS, 0.0, 0.0),
        frame=((1, 0, 0), (0, 0, -1), (0, 1, 0)),
        **BEND_STIFFNESS,
    )
    exact = bent.tip(BEND_LOAD * UP)
    # Their beam of eight elements, which shears.
    np.testing.assert_allclose(exact, (15.79, 47.23, 53.37), atol=0.15)
    errors = [missed(bend_of_45_degrees(n), exact) for n in (8, 64, 128, 256)]
    print("45-degree bend:", errors)
    measured(errors[-1] / BEND_RADIUS, "R")
    assert errors[0] < 3e-2
    assert_order(errors[1:])


# [Dowell, Traybar and Hodges 1977; Bauchau 2011]: a strip of aluminium, 20 x 0.5 x 0.126 inch, loads at its end aslant
# to its section; EA, EI about both axes and GJ.
PRINCETON_LENGTH, PRINCETON_WIDTH, PRINCETON_HEIGHT = 0.508, 12.377e-3, 3.2024e-3
PRINCETON_MODULUS, PRINCETON_POISSON = 71.7e9, 0.31


def princeton(edges, load):
    """Tip, and stiffnesses as the section gives them."""
    scene = rods.weightless()
    section = withe.Rectangle(width=PRINCETON_WIDTH, height=PRINCETON_HEIGHT)
    metal = withe.Material(youngs_modulus=PRINCETON_MODULUS, poisson_ratio=PRINCETON_POISSON, density=2700.0)
    strip = scene.add_rod(
        start=(0, 0, 0),
        end=(PRINCETON_LENGTH, 0, 0),
        nodes=edges + 1,
        section=section,
        material=metal,
        normal=(0, 1, 0),
    )
    scene.clamp(strip.start)
    scene.add_force(strip.end, load)
    simulation = rods.sharp(scene)
    assert simulation.equilibrium().stable
    return simulation.positions(strip)[-1], [
        np.asarray(simulation.get(strip, f"{word}_stiffness"))[0] for word in ("stretch", "bend", "twist")
    ]


@pytest.mark.case("statics", "Princeton beam, three loads, four angles", source="Kirchhoff's equations")
@pytest.mark.parametrize("size", [4.448, 8.896, 13.345])  # [N]
@pytest.mark.parametrize("degrees", [0, 30, 60, 90])
def test_princeton_beam_bends_over_both_sides_of_its_section_as_in_theory(size, degrees):
    angle = np.radians(degrees)
    load = size * np.array((0.0, np.cos(angle), np.sin(angle)))
    tips, stiffness = zip(*(princeton(n, load) for n in (10, 40, 80, 160)), strict=True)
    stretch, bend, twist = stiffness[0]
    area = PRINCETON_WIDTH * PRINCETON_HEIGHT
    np.testing.assert_allclose(stretch, PRINCETON_MODULUS * area)
    np.testing.assert_allclose(bend, PRINCETON_MODULUS * area * np.square((PRINCETON_WIDTH, PRINCETON_HEIGHT)) / 12.0)
    exact = Cantilever(PRINCETON_LENGTH, tuple(bend), twist, stretch).tip(load)
    errors = np.array([missed(tip, exact) for tip in tips]) / missed(exact, (PRINCETON_LENGTH, 0, 0))
    print(f"Princeton, {size} N at {degrees} degrees:", errors)
    measured(errors[-1])
    assert errors[0] < 1e-3
    # The error of the wall is of third order, and hides the second order of a load along the width.
    assert_order_at_least(errors[1:], 2.0, slack=0.3)


@pytest.mark.case(
    "statics", "Cantilever under a follower force", source="elastica; scene of [Argyris and Symeonidis 1981]"
)
@pytest.mark.parametrize("load", [2.0, *(pytest.param(load, marks=pytest.mark.slow) for load in (10.0, 20.0)), 40.0])
def test_a_force_that_follows_the_end_of_a_cantilever_converges_at_second_order(load):
    """[Argyris and Symeonidis 1981] follow such a beam as it coils; P L^2 / B up to 40."""
    inward, across, _ = follower_tip(load)
    errors = []
    for edges in (40, 80, 160):
        scene = rods.weightless()
        arm = rods.straight(scene, edges)
        scene.clamp(arm.start)
        push = scene.add_force(arm.end, (0.0, 0.0, 0.0), follower=True)
        simulation = rods.sharp(scene, planar=None)
        for share in np.arange(1, 11) / 10.0:
            simulation.set(push, force=share * load * UP)
            simulation.equilibrium()
        errors.append(missed(simulation.positions(arm)[-1], (1.0 - inward, 0.0, across)))
    print(f"follower, {load}:", errors)
    measured(errors[-1], "L")
    assert errors[1] < 7e-4
    assert_order(errors)


STRIP = {"bend": (1.0, 0.2), "twist": 0.3}


@pytest.mark.case("statics", "Strips with natural twist or curvature", source="Kirchhoff's equations")
@pytest.mark.parametrize(
    ("natural", "load"),
    [
        ((0.0, 0.0, np.pi), (0.0, 1.0, -2.0)),
        ((0.0, 0.0, np.pi), (0.5, -0.4, 0.3)),
        ((1.2, 0.0, 0.0), (0.0, 0.3, 0.5)),
        ((0.0, 1.5, 2.0), (-0.3, 0.5, 0.5)),
        ((1.0, -0.7, -3.0), (0.4, 0.5, -0.8)),
    ],
    ids=["pre-twisted", "pre-twisted, light", "curved", "curved and twisted", "curved both ways and twisted"],
)
def test_strips_that_are_twisted_or_curved_by_nature_converge_at_second_order(natural, load):
    """Stiff against bending one way, five times softer the other; the rod is straight when built."""
    exact = Cantilever(natural=natural, **STRIP).tip(load, steps=6)
    errors = []
    for edges in (40, 80, 160):
        scene = rods.weightless()
        strip = rods.straight(
            scene,
            edges,
            stiffness=rods.stiffness(**STRIP),
            normal=(0, 1, 0),
            natural_curvature=natural[:2],
            natural_twist=natural[2],
        )
        scene.clamp(strip.start)
        push = scene.add_force(strip.end, (0.0, 0.0, 0.0))
        simulation = rods.sharp(scene, planar=False)
        for share in np.arange(7) / 6.0:
            simulation.set(push, force=share * np.array(load))
            simulation.equilibrium()
        errors.append(missed(simulation.positions(strip)[-1], exact))
    print("strip", natural, load, errors)
    measured(errors[-1], "L")
    assert errors[-1] < 5e-5
    assert_order(errors)


@pytest.mark.case("statics", "Deflection of a tapered cantilever", source="quadrature of x^2 / EI(x)")
def test_a_tapered_cantilever_converges_at_second_order():
    """Round, its end a quarter as thick as its root; by quadrature of x^2 / EI, EI ~ h^4, each edge as thick as its
    middle."""

    def thickness(s):
        return 1.0 - 0.75 * s

    exact = quad(lambda s: (1.0 - s) ** 2 / thickness(s) ** 4, 0.0, 1.0, epsabs=1e-13)[0]
    errors = []
    for edges in (10, 20, 40, 80):
        middles = (np.arange(edges) + 0.5) / edges
        scene = rods.weightless()
        bend = thickness(middles) ** 4
        arm = rods.straight(scene, edges, stiffness=rods.stiffness(bend=np.stack([bend, bend], axis=1), twist=bend))
        scene.clamp(arm.start)
        scene.add_force(arm.end, 1e-5 * UP)
        simulation = rods.sharp(scene, planar=None)
        simulation.equilibrium()
        errors.append(simulation.positions(arm)[-1, 2] / 1e-5 / exact - 1.0)
    print("taper:", errors)
    measured(errors[-1])
    assert abs(errors[-1]) < 1e-3
    assert_order(errors)


# A tripod stands by its axial stiffness, which is therefore no greater than what rounding can follow.
FRAME = {"stretch": 300.0, "bend": 1.0, "twist": 0.7}
# Joints, members, clamped joints, forces at joints.
FRAMES = {
    "L": ([(0, 0, 0), (1, 0, 0), (1, 0.6, 0)], [(0, 1), (1, 2)], [0], {2: (0.3, -0.5, 0.8)}),
    "T": (
        [(0, 0, 0), (1, 0, 0), (1, 0.5, 0), (1, -0.7, 0)],
        [(0, 1), (1, 2), (1, 3)],
        [0],
        {2: (0.2, 0.1, 1.0), 3: (-0.4, 0.3, 0.2)},
    ),
    "portal": (
        [(0, 0, 0), (0, 0, 1), (1.5, 0, 1), (1.5, 0, 0)],
        [(0, 1), (1, 2), (2, 3)],
        [0, 3],
        {1: (1.0, 0.0, 0.0), 2: (0.2, 0.7, 0.0)},
    ),
    "tripod": (
        [(1, 0, 0), (-0.5, 0.8, 0), (-0.5, -0.8, 0), (0.1, 0, 1.1)],
        [(0, 3), (1, 3), (2, 3)],
        [0, 1, 2],
        {3: (1.0, 0.5, -0.4)},
    ),
    "ring of six": (
        [(np.cos(a), np.sin(a), 0.0) for a in np.arange(6) * np.pi / 3.0],
        [(i, (i + 1) % 6) for i in range(6)],
        [0],
        {3: (0.3, 0.2, 1.0), 2: (0.0, 0.0, -0.5)},
    ),
    "six rods in space": (
        [(0, 0, 0), (1, 0, 0), (0.5, 0.9, 0), (0.5, 0.3, 0.8)],
        [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
        [0, 1],
        {3: (0.3, 0.6, 1.0), 2: (0.0, 0.1, 1.0)},
    ),
    "a bar under torsion": (
        [(0, 0, 0), (1, 0, 0), (1, 0.5, 0), (1, -0.5, 0)],
        [(0, 1), (1, 2), (1, 3)],
        [0],
        {2: (0.0, 0.0, 1.0), 3: (0.0, 0.0, -1.0)},
    ),
}


@pytest.mark.case("statics", "Displacements of frames with rigid joints", source="matrix stiffness method")
@pytest.mark.parametrize("frame", FRAMES)
def test_frames_give_way_as_by_the_stiffness_method(frame):
    joints, members, clamped, forces = FRAMES[frame]
    points = np.array(joints, dtype=float)
    exact = displacements(points, members, clamped, forces, **FRAME)
    errors = []
    for edges in (8, 16, 32):
        answers = []
        # The even part in the load does not belong to the linear answer.
        for size in (1e-4, -1e-4):
            scene = rods.weightless()
            parts = [
                scene.add_rod(
                    start=points[a],
                    end=points[b],
                    nodes=edges + 1,
                    radius=1e-3,
                    line_density=1.0,
                    stiffness=withe.Stiffness(**FRAME),
                )
                for a, b in members
            ]
            at = {}
            for part, ends in zip(parts, members, strict=True):
                for node, joint in zip((part.start, part.end), ends, strict=True):
                    if joint in at:
                        scene.join(at[joint], node)
                    else:
                        at[joint] = node
            for joint in clamped:
                scene.clamp(at[joint])
            for joint, force in forces.items():
                scene.add_force(at[joint], size * np.array(force))
            simulation = rods.sharp(scene, planar=False)
            simulation.equilibrium()
            found = np.empty_like(points)
            for part, ends in zip(parts, members, strict=True):
                found[list(ends)] = simulation.positions(part)[[0, -1]]
            answers.append((found - points) / size)
        errors.append(missed(0.5 * (answers[0] + answers[1]), exact) / np.linalg.norm(exact))
    print(f"frame {frame}:", errors)
    measured(errors[-1])
    assert errors[-1] < 1e-4
    assert_order_at_least(errors, 2.0)
