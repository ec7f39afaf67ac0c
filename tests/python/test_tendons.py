"""Tendons as users meet them: what is refused, set, read, recorded and drawn."""

import pickle

import numpy as np
import pytest

import withe
from gradient_scenes import extrapolated

RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0)


def arm(guides=None, build=True, **options):
    """An upright arm of ten edges with a tendon."""
    scene = withe.Scene()
    rod = scene.add_rod(
        start=(0, 0, 0), end=(0, 0, 0.2), nodes=11, radius=8e-3, normal=(1, 0, 0), material=RUBBER, name="arm"
    )
    scene.clamp(rod.start)
    chosen = rod if guides is None else guides(rod)
    tendon = scene.add_tendon(chosen, **({"offset": (6e-3, 0), "tension": 0.5, "name": "cord"} | options))
    return (scene.build(time_step=2e-3), rod, tendon) if build else (scene, rod, tendon)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tension": -1.0}, "tension of tendon 'cord' must not be negative"),
        ({"tension": float("nan")}, "tension of tendon 'cord' must"),
        ({"offset": (1e-3, float("inf"))}, "offset of tendon 'cord' must"),
        ({"offset": 1e-3}, "offset of tendon 'cord' must"),
        ({"offset": np.zeros((5, 2))}, r"offset of tendon 'cord' must have shape \(2,\) or \(12, 2\)"),
        ({"name": "arm"}, "name of the tendon must be new"),
        ({"guides": lambda rod: [rod.edge(2)]}, "tendon 'cord' must have at least two guides, got 1"),
        ({"guides": lambda rod: []}, "tendon 'cord' must have at least two guides, got 0"),
        ({"guides": lambda rod: [rod.edge(2), rod.edge(2)]}, "guides 0 and 1 of tendon 'cord' must not coincide"),
        (
            {"guides": lambda rod: [rod.edge(2), rod.node(4)]},
            r"an edge, or an end of a rod, got 'arm.node\(4\)'",
        ),
        ({"guides": lambda rod: [rod.edge(2), "arm.edge(10)"]}, "edge of rod 'arm' must lie in -10..9, got 10"),
        ({"guides": lambda rod: [rod.edge(2), "leg.edge(1)"]}, "it has no rod 'leg'"),
        ({"guides": lambda rod: [rod.edge(2), 3]}, "guide of tendon 'cord' must be a handle or a name, got int"),
        ({"guides": lambda rod: [rod.edge(2), rod]}, "guide of tendon 'cord' must be an edge of a rod"),
        ({"guides": lambda rod: rod.edge(2)}, "must be a rod or several edges, got .* alone"),
        ({"guides": lambda rod: "arm.start"}, "must be a rod or several edges, got 'arm.start' alone"),
        ({"guides": lambda rod: "leg"}, "guides of tendon 'cord' 'leg' is not in the scene"),
        ({"guides": lambda rod: 7}, "guides of tendon 'cord' must be a rod or edges"),
    ],
)
def test_what_cannot_be_a_tendon_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        arm(**options)


def test_guides_of_another_scene_are_refused():
    _, rod, _ = arm()
    with pytest.raises(ValueError, match="is a handle of another scene"):
        arm(lambda own: [own.edge(1), rod.edge(2)])
    with pytest.raises(ValueError, match="is a handle of another scene"):
        arm(lambda own: rod)


def test_tension_is_set_and_read():
    simulation, _, tendon = arm()
    assert simulation.get(tendon, "tension") == 0.5
    simulation.set("cord", tension=0.2)
    assert simulation.get("cord", "tension") == 0.2
    for wrong in (-0.1, float("inf"), "much", None):
        with pytest.raises(ValueError, match="tension of tendon 'cord' must"):
            simulation.set("cord", tension=wrong)
    assert simulation.get("cord", "tension") == 0.2
    with pytest.raises(ValueError, match="tendon 'cord' has no 'length' to set; it has tension"):
        simulation.set("cord", length=1.0)
    with pytest.raises(ValueError, match="'cord' has no 'length'; it has tension"):
        simulation.get("cord", "length")
    for read in (simulation.tendon_length, simulation.tendon_points):
        with pytest.raises(ValueError, match="tendon must be a tendon, got the rod 'arm'"):
            read("arm")


def test_guides_are_where_they_are_said_to_be():
    ends = [(6e-3, 0, 0), *((6e-3, 0, 0.02 * (i + 0.5)) for i in range(10)), (6e-3, 0, 0.2)]
    simulation, rod, tendon = arm()
    simulation.set(tendon, tension=0.0)  # under which half an edge at the free end bends
    np.testing.assert_allclose(simulation.tendon_points(tendon), ends, atol=1e-15)
    assert simulation.tendon_length(tendon) == pytest.approx(0.2, rel=1e-12)
    names = ["arm.start", "arm.edge(3)", "arm.edge(-1)", "arm.end"]
    simulation, rod, tendon = arm(lambda _: names, offset=[(0, 1e-3), (0, 2e-3), (0, 3e-3), (0, 4e-3)])
    simulation.set(tendon, tension=0.0)
    expected = [(0, 1e-3, 0), (0, 2e-3, 0.07), (0, 3e-3, 0.19), (0, 4e-3, 0.2)]
    np.testing.assert_allclose(simulation.tendon_points(tendon), expected, atol=1e-15)
    length = np.linalg.norm(np.diff(expected, axis=0), axis=1).sum()
    assert simulation.tendon_length(tendon) == pytest.approx(length, rel=1e-12)
    assert rod.edge(3) == simulation.rods[0].edge(3)


def test_a_closed_rod_has_a_tendon_all_round_that_draws_it_together():
    scene = withe.Scene(gravity=(0, 0, 0))
    angles = 2.0 * np.pi * np.arange(24) / 24
    points = 0.1 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    ring = scene.add_rod(points=points, closed=True, radius=5e-3, material=RUBBER)
    tendon = scene.add_tendon(ring, offset=(0, 0), tension=0.5)
    simulation = scene.build(integrator="static")
    start = simulation.tendon_length(tendon)
    assert len(simulation.tendon_points(tendon)) == 25
    simulation.equilibrium()
    area = np.pi * 25e-6
    assert simulation.tendon_length(tendon) == pytest.approx(start * (1.0 - 0.5 / (1e6 * area)), rel=1e-4)


def test_plans_say_what_tendons_cost_and_which_plane_they_leave():
    simulation, _, _ = arm()
    assert simulation.plan.planar
    assert "11 pieces of tendons" in str(simulation.plan)
    scene, rod, _ = arm(build=False)
    scene.add_tendon(rod, offset=(0, 6e-3))
    simulation = scene.build()
    assert not simulation.plan.planar
    with pytest.raises(ValueError, match="tendons do not share a plane"):
        scene.build(planar=True)


def test_a_snapshot_of_another_tendon_is_refused():
    kept = arm()[0].snapshot()
    other, _, _ = arm(offset=(5e-3, 0))
    with pytest.raises(ValueError, match="snapshot"):
        other.restore(kept)


def test_batches_pull_each_of_their_arms():
    scene, _, tendon = arm(build=False)
    batch = scene.build_batch(3, time_step=2e-3, workers=2)
    batch.set(tendon, tension=[0.1, 0.4, 0.7])
    batch.step(20)
    for lane, tension in enumerate((0.1, 0.4, 0.7)):
        single = scene.build(time_step=2e-3)
        single.set(tendon, tension=tension)
        single.step(20)
        np.testing.assert_array_equal(batch.positions()[lane], single.positions())
        assert batch.tendon_length(tendon)[lane] == single.tendon_length(tendon)
        np.testing.assert_array_equal(batch.tendon_points(tendon)[lane], single.tendon_points(tendon))


def test_records_keep_tendons_and_draw_them(tmp_path):
    simulation, _, tendon = arm()
    record = simulation.run(0.02, record_every=0.01, progress=False)
    loaded = withe.Record.load(record.save(tmp_path / "arm.npz"))
    for each in (record, loaded, pickle.loads(pickle.dumps(record))):
        (outline,) = each.tendons
        assert outline.name == "cord"
        points = outline.points({0: each.positions("arm")}, {0: each.directors("arm")})
        assert points.shape == (3, 12, 3)
        # At the wall by the first edge's directors, which it turns from by less than the bend of half an edge.
        np.testing.assert_allclose(points[-1], simulation.tendon_points(tendon), atol=1e-4)
        np.testing.assert_allclose(points[-1, 1:], simulation.tendon_points(tendon)[1:], atol=1e-14)
    pytest.importorskip("matplotlib")
    lines = sum(len(axes.lines) for axes in record.plot().axes)
    bare = withe.Record.load(record.save(tmp_path / "bare.npz"))
    bare._tendons = ()
    assert lines == sum(len(axes.lines) for axes in bare.plot().axes) + 3


@pytest.mark.parametrize("integrator", ["implicit_midpoint", "energy_momentum", "backward_euler"])
def test_gradients_by_tensions_that_are_set_while_it_runs(integrator):
    scene, _, tendon = arm(build=False)
    simulation = scene.build(
        time_step=2e-3, integrator=integrator, solver=withe.Solver(step_tolerance=1e-13, force_tolerance=1e-12)
    )

    def run(pull, **options):
        simulation.reset()
        tensions = iter((0.5, 0.3 + pull, 0.6, 0.2, 0.8))
        return simulation.run(
            0.01, before_step=lambda s: s.set(tendon, tension=next(tensions)), progress=False, **options
        )

    def tip(record):
        return record.positions("arm")[-1, -1, 0]

    record = run(0.0, differentiable=True)
    weight = np.zeros(record.positions().shape)
    weight[-1, -1, 0] = 1.0
    by_calls = record.gradient({"positions": weight}, []).calls
    found = [call.gradients["tension"] for call in by_calls]
    assert len(found) == 5
    assert found[1] == pytest.approx(extrapolated(lambda h: tip(run(h)), 1e-3), rel=1e-6)


def test_gradients_that_are_not_known_are_refused():
    scene = withe.Scene(gravity=(0, 0, 0))
    rods = [
        scene.add_rod(start=(0, 0, 0), end=end, nodes=5, radius=5e-3, material=RUBBER)
        for end in ((0, 0, 0.1), (0.1, 0, 0))
    ]
    scene.join(rods[0].start, rods[1].start)
    guides = [rods[0].end, rods[0].start, rods[1].start, rods[1].end]
    tendon = scene.add_tendon(guides, offset=(4e-3, 0), tension=0.1)
    scene.clamp(rods[0].end)
    simulation = scene.build(integrator="static", planar=False)
    found = simulation.equilibrium()
    with pytest.raises(ValueError, match="two consecutive guides on one joint"):
        found.gradient(np.ones((9, 3)), [(tendon, "tension")])
