"""Scenes: names, handles, joints, and what reaches the engine. The engine itself does not run here."""

import copy
import pickle

import numpy as np
import pytest

import withe
from withe.parts.description import describe
from withe.parts.handles import Layout, RodPlace, UnionFind

RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0)


def add_rod(scene, start, end, nodes=5, **options):
    return scene.add_rod(start=start, end=end, nodes=nodes, radius=5e-3, material=RUBBER, **options)


def description(scene):
    return describe(scene._directory, scene.gravity)


def test_handles_are_named_values():
    scene = withe.Scene()
    arm = add_rod(scene, (0, 0, 0), (0, 0, -1), name="arm")
    assert arm.name == "arm"
    assert (arm.nodes, arm.edges, arm.stencils) == (5, 4, 3)
    assert arm.node(-1) == arm.end == arm.node(4)
    assert arm.node(0).name == "arm.start"
    assert arm.node(2).name == "arm.node(2)"
    assert arm.edge(-1).name == "arm.edge(3)"
    assert repr(arm.end) == "NodeHandle(name='arm.end')"
    assert len({arm.end, arm.node(-1), arm.start}) == 2


def test_parts_get_names_in_order_unless_they_are_given():
    scene = withe.Scene()
    first = add_rod(scene, (0, 0, 0), (0, 0, -1))
    second = add_rod(scene, (0, 0, -1), (0, 0, -2))
    parts = [
        first,
        second,
        scene.join(first.end, second.start),
        scene.clamp(first.start),
        scene.add_force(second.end, (0, 0, 1)),
        scene.add_mass(second.end, 0.1, name="gripper"),
    ]
    assert [part.name for part in parts] == ["rod 1", "rod 2", "joint 1", "clamp 1", "force 1", "gripper"]
    assert [scene[part.name] for part in parts] == parts
    assert scene["rod 1.end"] == first.end
    assert scene["rod 2.edge(1)"] == second.edge(1)
    assert scene.rods == (first, second)


def test_names_are_accepted_in_place_of_handles():
    scene = withe.Scene()
    add_rod(scene, (0, 0, 0), (0, 0, -1), name="left.arm")
    add_rod(scene, (0, 0, -1), (0, 0, -2), name="hand")
    scene.join("left.arm.end", "hand.start")
    scene.clamp("left.arm.node(0)")
    scene.add_load("hand", (0, 1, 0))
    scene.add_drag(0.5, rods=["hand"])
    with pytest.raises(ValueError, match=r"has no rod 'leg'"):
        scene.clamp("leg.end")


@pytest.mark.parametrize("travel", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_handles_survive_copy_and_pickle(travel):
    scene = withe.Scene()
    arm = add_rod(scene, (0, 0, 0), (0, 0, -1), name="arm")
    support = scene.clamp(arm.start)
    other = travel(scene)
    for handle in (arm, arm.end, arm.edge(1), support):
        assert travel(handle) == handle
    other.add_force(travel(arm).end, (0, 0, 0.1))
    assert np.array_equal(travel(arm).rows, arm.rows)
    simulation = other.build(integrator="static")
    simulation.equilibrium()
    assert simulation.reaction(travel(support)).force.shape == (3,)


def test_a_handle_of_another_scene_is_refused():
    one, two = withe.Scene(), withe.Scene()
    arm = add_rod(one, (0, 0, 0), (0, 0, -1), name="arm")
    add_rod(two, (0, 0, 0), (0, 0, -1), name="arm")
    with pytest.raises(ValueError, match=r"node to clamp 'arm.start' is a handle of another scene"):
        two.clamp(arm.start)
    simulation = two.build()
    with pytest.raises(ValueError, match="another scene"):
        simulation.positions(arm)
    assert simulation.positions("arm").shape == (5, 3)


def test_joined_nodes_share_a_row_whatever_the_order_of_joining():
    scene = withe.Scene()
    rods = [add_rod(scene, (0, 0, 0), end) for end in [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0)]]
    scene.join(rods[3].start, rods[2].start)
    scene.join(rods[0].start, rods[1].start)
    scene.join(rods[1].start, rods[3].start)
    assert [int(rod.rows[0]) for rod in rods] == [0, 0, 0, 0]
    assert rods[1].rows.tolist() == [0, 5, 6, 7, 8]
    rows = np.concatenate([rod.rows for rod in rods])
    assert sorted(set(rows.tolist())) == list(range(17))
    engine = description(scene)
    assert engine.positions.shape == (17, 3)
    for rod, end in zip(rods, [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0)], strict=True):
        assert np.allclose(engine.positions[rod.rows[-1]], end)


def test_union_find_keeps_the_smallest_member_as_root():
    groups = UnionFind(6)
    for pair in [(5, 4), (4, 2), (1, 0), (5, 1)]:
        groups.unite(*pair)
    assert [groups.find(i) for i in range(6)] == [0, 0, 0, 3, 0, 0]


def test_a_layout_copy_does_not_change_with_the_scene():
    layout = Layout()
    for name in "ab":
        layout.add(RodPlace(name, 3, False, np.ones(2), None))
    frozen = layout.copy()
    layout.merge((0, 2), (1, 0))
    assert frozen.node_count == 6
    assert layout.node_count == 5


def clusters(joint):
    return [[(place.rod, place.node) for place in cluster] for cluster in joint.clusters]


def test_rigid_joins_make_one_cluster():
    scene = withe.Scene()
    a, b, c = (add_rod(scene, (0, 0, 0), end) for end in [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    scene.join(a.start, b.start)
    scene.join(b.start, c.start)
    (joint,) = description(scene).joints
    assert clusters(joint) == [[(0, 0), (1, 0), (2, 0)]]
    assert joint.links == []
    assert joint.form == "frame"


def test_pinned_joins_make_clusters_that_only_share_the_node():
    scene = withe.Scene()
    a, b, c = (add_rod(scene, (0, 0, 0), end) for end in [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    scene.join(a.start, b.start)
    scene.join(b.start, c.start, kind="pinned")
    (joint,) = description(scene).joints
    assert clusters(joint) == [[(0, 0), (1, 0)], [(2, 0)]]
    assert joint.links == []


def test_revolute_joins_link_clusters_about_a_unit_axis():
    scene = withe.Scene()
    a, b = (add_rod(scene, (0, 0, 0), end) for end in [(1, 0, 0), (0, 1, 0)])
    scene.join(b.start, a.start, kind="revolute", axis=(0, 0, 3))
    (joint,) = description(scene).joints
    (link,) = joint.links
    assert clusters(joint) == [[(0, 0)], [(1, 0)]]
    assert (link.parent, link.child) == (1, 0)
    assert np.array_equal(link.axis, (0, 0, 1))


def test_joints_at_different_nodes_stay_apart_and_loops_close():
    scene = withe.Scene()
    a = add_rod(scene, (0, 0, 0), (1, 0, 0))
    b = add_rod(scene, (1, 0, 0), (0, 1, 0))
    c = add_rod(scene, (0, 1, 0), (0, 0, 0))
    scene.join(a.end, b.start)
    scene.join(b.end, c.start, form="pairs")
    scene.join(c.end, a.start)
    joints = description(scene).joints
    assert [clusters(joint) for joint in joints] == [[[(0, 4), (1, 0)]], [[(1, 4), (2, 0)]], [[(0, 0), (2, 4)]]]
    assert [joint.form for joint in joints] == ["frame", "pairs", "frame"]
    assert len(description(scene).positions) == 12


def test_the_ends_of_one_rod_can_be_joined():
    scene = withe.Scene()
    angle = np.linspace(0, 2 * np.pi, 13)
    ring = scene.add_rod(points=np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), radius=0.01, material=RUBBER)
    scene.join(ring.start, ring.end)
    assert ring.rows[0] == ring.rows[-1] == 0


def test_joins_that_contradict_each_other_are_refused_and_change_nothing():
    scene = withe.Scene()
    a, b, c = (add_rod(scene, (0, 0, 0), end) for end in [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
    scene.join(a.start, b.start, kind="pinned")
    scene.join(b.start, c.start)
    for kind, axis in [("rigid", None), ("revolute", (0, 0, 1))]:
        if kind == "revolute":
            scene.join(a.start, c.start, kind=kind, axis=axis)
            with pytest.raises(ValueError, match="already have a revolute joint"):
                scene.join(b.start, a.start, kind=kind, axis=(1, 0, 0))
        else:
            with pytest.raises(ValueError, match="cannot be both rigidly joined and pinned"):
                scene.join(a.start, c.start, kind=kind)
    with pytest.raises(ValueError, match="form must be the same"):
        scene.join(b.node(0), c.node(0), form="pairs")
    assert [name for name in scene._directory.parts if name.startswith("joint")] == ["joint 1", "joint 2", "joint 3"]


def test_loads_masses_and_drag_reach_the_engine():
    scene = withe.Scene(gravity=(1, 0, -9))
    a = add_rod(scene, (0, 0, 0), (1, 0, 0))
    b = add_rod(scene, (0, 0, 0), (0, 1, 0))
    scene.join(a.start, b.start)
    scene.add_force(a.end, (0, 0, -1), follower=True)
    scene.add_moment(b.end, lambda t: (t + 1, 0, 0))
    scene.add_load(b, (0, 2, 0))
    scene.add_mass(b.start, 0.5)
    scene.add_mass(a.start, 0.25)
    scene.add_drag(0.5)
    scene.add_drag(0.25, rods=[b])
    scene.add_custom_force(lambda t, x, v: 0 * x)
    engine = description(scene)
    assert np.array_equal(engine.gravity, (1, 0, -9))
    assert [(load.kind, load.pass_.rod, load.pass_.node, load.follower, load.varies) for load in engine.loads] == [
        ("force", 0, 4, True, False),
        ("moment", 1, 4, False, True),
        ("distributed", 1, 0, False, False),
    ]
    assert np.array_equal(engine.loads[1].values, [(1, 0, 0)])
    assert engine.added_mass[0] == 0.75
    assert engine.added_mass.sum() == 0.75
    assert [float(rod.drag[0]) for rod in engine.rods] == [0.5, 0.75]
    assert engine.has_custom_force


def test_supports_reach_the_engine_with_their_free_directions():
    scene = withe.Scene()
    a = add_rod(scene, (0, 0, 0), (1, 0, 0))
    b = add_rod(scene, (0, 1, 0), (1, 1, 0))
    scene.clamp(a.start, free=(0, 0, 2))
    scene.clamp(b.start, hold="edge")
    scene.pin(a.end, free=[(1, 0, 0), (1, 1, 0)])
    clamp, edge, pin = description(scene).supports
    assert [clamp.kind, edge.kind, pin.kind] == ["clamp", "hold_edge", "pin"]
    assert np.allclose(clamp.free, np.diag([0, 0, 1]))
    assert np.allclose(edge.free, 0)
    assert np.allclose(pin.free, np.diag([1, 1, 0]))


def test_a_node_is_held_once_also_when_it_was_joined_later():
    scene = withe.Scene()
    a = add_rod(scene, (0, 0, 0), (1, 0, 0))
    b = add_rod(scene, (1, 0, 0), (2, 0, 0))
    scene.clamp(a.end)
    scene.pin(b.start)
    with pytest.raises(ValueError, match=r"node 'rod 1.end' is already held by 'clamp 1'"):
        scene.pin(a.end)
    scene.join(a.end, b.start)
    with pytest.raises(ValueError, match=r"'rod 1.end' and 'rod 2.start' must have one support, got both"):
        scene.build()


def test_a_held_edge_takes_both_its_nodes():
    scene = withe.Scene()
    a = add_rod(scene, (0, 0, 0), (1, 0, 0))
    scene.clamp(a.start, hold="edge")
    with pytest.raises(
        ValueError, match=r"'pin 1' at .* would hold a node that 'clamp 1' at 'rod 1.start' already holds"
    ):
        scene.pin(a.node(1))
    scene.pin(a.node(-2))
    with pytest.raises(ValueError, match=r"'clamp 2' at 'rod 1.end' would hold a node that 'pin 1'"):
        scene.clamp(a.end, hold="edge")
    scene.pin(a.node(2))
    assert scene.build(integrator="static").equilibrium().stable


@pytest.mark.parametrize("hold", ["frame", "edge"])
def test_a_held_edge_whose_other_node_is_joined_to_a_held_one_names_both_supports(hold):
    scene = withe.Scene()
    a = add_rod(scene, (0, 0, 0), (1, 0, 0))
    b = add_rod(scene, (0.25, 0, 0), (0.25, 1, 0))
    scene.clamp(a.start, hold="edge")
    scene.clamp(b.start, hold=hold)
    scene.join(a.node(1), b.start)
    with pytest.raises(ValueError, match=r"'clamp 1' at .*start' and 'clamp 2' at .* hold the same node"):
        scene.build()


def test_a_scene_pickles_with_all_its_parts():
    scene = withe.Scene()
    a = add_rod(scene, (0, 0, 0), (1, 0, 0), name="arm")
    scene.clamp(a.start)
    scene.add_force(a.end, (0, 0, 1))
    again = pickle.loads(pickle.dumps(scene))
    x, y = (s.build(integrator="static") for s in (scene, again))
    x.equilibrium()
    y.equilibrium()
    assert np.array_equal(x.positions(a), y.positions(a))


def test_a_simulation_does_not_change_with_its_scene():
    scene = withe.Scene()
    add_rod(scene, (0, 0, 0), (1, 0, 0), name="arm")
    simulation = scene.build()
    add_rod(scene, (0, 1, 0), (1, 1, 0), name="late")
    scene.gravity = (0, 0, 0)
    assert len(simulation.rods) == 1
    assert len(simulation.positions()) == 5
    assert np.array_equal(simulation.get("gravity"), (0, 0, -9.81))
    with pytest.raises(ValueError, match="'late' is not in the scene"):
        simulation.positions("late")


def test_importing_withe_imports_neither_scipy_nor_matplotlib():
    import subprocess
    import sys

    code = "import withe, sys; print([m for m in ('scipy', 'matplotlib', 'pyvista', 'torch') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def star(count, one_call, kind="rigid", **options):
    """Rods from one place into drawn directions, two of them clamped: scene, rods."""
    generator = np.random.default_rng(count)
    scene = withe.Scene()
    ways = generator.normal(size=(count, 3))
    rods = [
        scene.add_rod(start=(0, 0, 0), end=0.1 * way / np.linalg.norm(way), nodes=6, radius=3e-3, material=RUBBER)
        for way in ways
    ]
    nodes = [rod.start for rod in rods]
    joints = scene.join(*nodes, kind=kind, **options) if one_call else None
    if not one_call:
        for node in nodes[1:]:
            scene.join(nodes[0], node, kind, **options)
    for rod in rods[:2]:
        scene.clamp(rod.end)
    return scene, rods, joints


@pytest.mark.parametrize("count", [3, 4, 6])
@pytest.mark.parametrize("kind", ["rigid", "pinned", "revolute"])
def test_any_number_of_nodes_is_joined_in_one_call_as_in_several(count, kind):
    options = {"axis": (0, 1, 0), "stiffness": 1e-3} if kind == "revolute" else {}
    together, in_turn = star(count, True, kind, **options), star(count, False, kind, **options)
    assert [joint.name for joint in together[2]] == [f"joint {i + 1}" for i in range(count - 1)]
    assert {int(rod.rows[0]) for rod in together[1]} == {0}
    a, b = together[0].build(time_step=1e-3), in_turn[0].build(time_step=1e-3)
    a.step(10)
    b.step(10)
    assert np.array_equal(a.positions(), b.positions())


def test_two_nodes_give_a_joint_and_a_kind_may_follow_the_nodes():
    scene, rods, _ = star(4, True)
    other = withe.Scene()
    ends = [other.add_rod(start=(0, 0, 0), end=end, nodes=3, radius=3e-3, material=RUBBER).start for end in np.eye(3)]
    joints = other.join(*ends, "revolute", axis=(1, 1, 1), name="hub")
    assert [joint.name for joint in joints] == ["hub 1", "hub 2"]
    assert isinstance(joints, tuple)
    assert scene.rods == tuple(rods)
    pair = withe.Scene()
    two = [pair.add_rod(start=(0, 0, 0), end=end, nodes=3, radius=3e-3, material=RUBBER).start for end in np.eye(3)[:2]]
    assert pair.join(*two) == pair["joint 1"]


def test_nodes_that_cannot_all_be_joined_are_not_joined_at_all():
    def nodes(scene):
        ends = [(0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)]
        return [scene.add_rod(start=(0, 0, 0), end=end, nodes=3, radius=3e-3, material=RUBBER) for end in ends]

    for wrong, message in (
        (lambda s, r: s.join(r[0].start, r[1].start, r[2].end), "must coincide to be joined"),
        (lambda s, r: s.join(r[0].start, r[1].start, r[0].start), "must be two, got 'rod 1.start' twice"),
        (lambda s, r: s.join(r[0].start, r[1].start, r[2].start, "revolut", axis=(1, 0, 0)), "did you mean 'revolute'"),
        (lambda s, r: s.join(r[0].start, r[1].start, r[2].start, "pinned", kind="revolute"), "must be given once"),
        (lambda s, r: s.join(r[0].start, r[1].start, 3.0), "third node to join must be a handle or a name"),
        (
            lambda s, r: s.join(r[0].start, r[1].start, r[1].start, "revolute", axis=(1, 0, 0)),
            "already have a revolute joint",
        ),
    ):
        scene = withe.Scene()
        rods = nodes(scene)
        with pytest.raises(ValueError, match=message):
            wrong(scene, rods)
        assert rods[0].rows[0] != rods[1].rows[0]
        scene.join(*(rod.start for rod in rods))
        assert rods[0].rows[0] == rods[1].rows[0] == rods[2].rows[0]
