"""Critical loads of the literature: snap-through, a strip that tips over sideways, and how fast Beck's column grows."""

import numpy as np
import pytest

import rods
import snap_through
import theory
import withe
from cases import measured
from convergence import assert_order, assert_order_at_least, zero_crossing


def lee(edges):
    scene = rods.weightless()
    parts = {
        "stiffness": rods.stiffness(stretch=snap_through.LEE.stretch),
        "line_density": 1.0,
        "radius": 1e-3,
        "nodes": edges + 1,
    }
    column = scene.add_rod(start=(0, 0, 0), end=(0, 0, 1), **parts)
    beam = scene.add_rod(start=(0, 0, 1), end=(1, 0, 1), **parts)
    scene.join(column.end, beam.start)
    scene.pin(column.start)
    scene.pin(beam.end)
    return scene, scene.pin(beam.node(edges // 5), free=(1, 0, 0))


def arch(edges):
    angle = np.radians(np.linspace(-107.5, 107.5, 8601))
    curve = np.stack([np.sin(angle), 0.0 * angle, np.cos(angle)], axis=1)
    scene = rods.weightless()
    ring = scene.add_rod(
        points=curve,
        nodes=edges + 1,
        normal=(0, 1, 0),
        stiffness=rods.stiffness(stretch=snap_through.ARCH.stretch),
        line_density=1.0,
        radius=1e-3,
    )
    scene.clamp(ring.start)
    scene.pin(ring.end)
    return scene, scene.pin(ring.node(edges // 2), free=(1, 0, 0))


# Displacements of the load: few steps up to the limit, many around it.
LEE_DROPS = np.concatenate([np.arange(0.05, 0.38, 0.05), np.arange(0.39, 0.435, 0.01)])
ARCH_DROPS = np.concatenate([np.arange(0.1, 1.05, 0.1), np.arange(1.08, 1.21, 0.02)])


@pytest.mark.case("stability", "Limit loads of Lee's frame and of a deep arch", source="elastica, solved by shooting")
@pytest.mark.parametrize(
    ("make", "curve", "drops", "known", "meshes", "bound"),
    [
        # [Lee, Manuel and Rossow 1968]
        (lee, snap_through.LEE, LEE_DROPS, 18.55, (10, 20, 40), 1e-3),
        # [DaDeppo and Schmidt 1975], 897 in their numbers
        (arch, snap_through.ARCH, ARCH_DROPS, 8.97, (16, 32, 64), 5e-4),
    ],
    ids=["Lee's frame", "deep arch"],
)
def test_limit_loads_converge_at_second_order_or_better_to_those_of_the_elastica(
    make, curve, drops, known, meshes, bound
):
    exact = curve.limit_load(drops)
    assert exact == pytest.approx(known, rel=1e-3)
    errors = []
    for edges in meshes:
        scene, grip = make(edges)
        simulation = rods.sharp(scene, planar=True)
        forces = []
        for drop in drops:
            simulation.move(grip, position=(0.2 if make is lee else 0.0, 0.0, 1.0 - drop))
            simulation.equilibrium()
            forces.append(-simulation.reaction(grip).force[2])
        errors.append(snap_through.peak(drops, forces) / exact - 1.0)
    print("limit load", exact, errors)
    measured(errors[-1])
    assert abs(errors[-1]) < bound
    assert_order_at_least(errors, 2.0)


@pytest.mark.case(
    "stability",
    "Lateral buckling of a narrow cantilever",
    source="4.0126 sqrt(EI GJ) / L^2 [Prandtl 1899, Michell 1899]",
)
def test_a_narrow_cantilever_tips_over_sideways_at_prandtls_load_at_second_order():
    """It hardly bends under the load; a small side load measures the stiffness that is left."""
    assert pytest.approx(4.0126, abs=1e-4) == theory.TIPPING_LOAD
    loads = theory.TIPPING_LOAD * np.array((0.93, 0.95, 0.97, 0.98, 0.99))
    errors = []
    for edges in (10, 40, 80, 160):
        sways = []
        for load in loads:
            scene = rods.weightless()
            strip = rods.straight(scene, edges, stiffness=rods.stiffness(bend=(1.0, 1e5)), normal=(0, 1, 0))
            scene.clamp(strip.start)
            scene.add_force(strip.end, (0.0, 1e-5, -load))
            simulation = rods.sharp(scene, planar=False)
            simulation.equilibrium()
            sways.append(simulation.positions(strip)[-1, 1] / 1e-5)
        errors.append(zero_crossing(loads, sways) / theory.TIPPING_LOAD - 1.0)
    print("lateral buckling:", errors)
    measured(errors[2])
    assert abs(errors[0]) < 3e-3
    assert abs(errors[2]) < 1e-4
    # Order of differences: bending under the load contributes a constant 1.1e-5.
    assert_order_at_least(np.diff(errors[1:]), 2.0, slack=0.2)


@pytest.mark.case(
    "stability", "Growth rate of Beck's column beyond flutter", source="characteristic equation [Beck 1952]"
)
def test_flutter_of_becks_column_grows_in_time_as_fast_as_in_theory():
    """Beyond 20.05 its lowest frequencies are a complex pair, found in motion from a small disturbance."""
    frequency, growth = theory.flutter(25.0)
    errors = []
    for edges in (10, 20, 40):
        scene = rods.weightless()
        column = rods.straight(scene, edges, stiffness=rods.stiffness(stretch=1e5), normal=(0, 0, 1))
        scene.clamp(column.start)
        scene.add_force(column.end, (-25.0, 0.0, 0.0), follower=True)
        step = 2.0 * np.pi / frequency / 800
        simulation = scene.build(
            time_step=step, planar=True, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
        )
        simulation.equilibrium()
        push = np.zeros((edges + 1, 3))
        push[:, 2] = 1e-9 * np.linspace(0.0, 1.0, edges + 1) ** 2
        simulation.set_velocities(column, push)
        tip = []
        for _ in range(3200):
            simulation.step()
            tip.append(simulation.positions(column)[-1, 2])
        # x[n+1] = 2 exp(s dt) cos(w dt) x[n] - exp(2 s dt) x[n-1], each as it has grown; a span apart, so that
        # differences have digits.
        x = np.array(tip[1200::25])
        weights = np.exp(-growth * 25.0 * step * np.arange(len(x) - 2))
        _, last = np.linalg.lstsq(np.stack([x[1:-1], x[:-2]], axis=1) * weights[:, None], x[2:] * weights, rcond=None)[
            0
        ]
        errors.append(0.5 * np.log(-last) / (25.0 * step) / growth - 1.0)
    print("Beck, growth", growth, "error", errors)
    measured(errors[-1])
    assert abs(errors[-1]) < 4e-3
    assert_order(errors, slack=0.3)
