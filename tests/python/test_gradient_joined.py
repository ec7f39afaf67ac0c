"""Gradients by drawn nodes of rods that are joined, against scenes built anew."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from gradient_scenes import TIGHT, extrapolated

NODES, BRANCH = 9, 5
AT_TIP = ("corner", "smooth", "clamped")
KINDS = ("rigid", "pairs", "pinned", "revolute", *AT_TIP)
INTEGRATORS = ("backward_euler", "implicit_midpoint", "fourth_order", "energy_momentum")


def joint_of(kind):
    """The node of the arm that the branch is joined to."""
    return NODES - 1 if kind in AT_TIP else 4


def drawn(planar, kind):
    """Nodes of an arm and of its branch."""
    s = np.linspace(0.0, 1.0, NODES)
    arm = np.stack([0.3 * s, 0.0 * s if planar else 0.04 * np.sin(3.0 * s), 0.05 * np.sin(2.0 * s)], 1)
    if kind != "smooth":
        u = np.linspace(0.0, 1.0, BRANCH)[:, None]
        way = u * (0.02, 0.0 if planar else 0.1, 0.1) + 0.02 * np.sin(2.0 * u) * (1.0, 0.0, -0.3)
        return arm, arm[joint_of(kind)] + way
    before, last = arm[-2] - arm[-3], arm[-1] - arm[-2]
    axis = np.cross(before, last)
    turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * np.arctan2(np.linalg.norm(axis), before @ last))
    branch = [arm[-1]]
    for _ in range(BRANCH - 1):
        last = turn.apply(last)
        branch.append(branch[-1] + last)
    return arm, np.array(branch)


class Joined:
    """An arm with a branch, pushed and pulled by all that goes with how they are drawn."""

    def __init__(self, arm, branch, *, planar, kind, normal, integrator="static", natural="as_built", turned=None):
        world = np.eye(3) if turned is None else turned
        axial = (0, 0.01, 0) if planar else (0.01, 0.01, 0.004)
        scene = withe.Scene(gravity=world @ (0, 0, -9.81))
        rubber = withe.Material(
            youngs_modulus=1e6,
            poisson_ratio=0.4,
            density=1200.0,
            viscosity=0.0 if integrator in ("static", "fourth_order") else 300.0,
        )
        section = {"radius": 1.2e-2} if normal is None else {"section": withe.Rectangle(2.4e-2, 2e-2)}
        normals = (None, None) if normal is None else normal
        self.arm, self.branch = (
            scene.add_rod(
                points=points @ world.T, **section, material=rubber, natural=natural, name=name, normal=director
            )
            for points, name, director in ((arm, "arm", normals[0]), (branch, "branch", normals[1]))
        )
        node = self.arm.node(joint_of(kind))
        form = "pairs" if kind == "pairs" else "frame"
        of = kind if kind in ("pinned", "revolute") else "rigid"
        axis = None if kind != "revolute" else world @ ((1, 0, 0) if planar else (0.2, 0.9, -0.3))
        scene.join(node, self.branch.start, of, axis=axis, form=form)
        scene.clamp(node if kind == "clamped" else self.arm.start)
        if kind in ("pinned", "revolute"):
            for end in (self.arm.node(0), self.arm.end, self.arm.node(6)):
                scene.add_spring(end, self.branch.end, stiffness=30.0)
        # A length that was given stays, though it is that of the first drawing.
        ends = [points[2] for points in drawn(planar, kind)]
        given = float(np.linalg.norm(ends[1] - ends[0]))
        scene.add_spring(self.arm.node(2), self.branch.node(2), stiffness=10.0, rest_length=given)
        self.stay = scene.add_spring(self.arm.node(2), self.branch.node(3), stiffness=20.0)
        scene.add_force(self.branch.end, world @ (0.05, 0, 0.2))
        scene.add_force(self.arm.node(3), world @ (0.1, 0.0 if planar else 0.05, 0.2), follower=True)
        scene.add_moment(self.arm.node(6), world @ axial, follower=True)
        if kind != "pinned":  # which may spin
            scene.add_moment(self.branch.node(2), world @ axial)
        if kind not in ("pinned", "smooth", "pairs"):
            scene.add_moment(node, 2.0 * (world @ axial), follower=True)  # on the frame of the joint
        scene.add_load(self.arm, world @ (0.2, 0.0, 0.5))
        scene.add_load(self.branch, world @ (0.2, 0.0, 0.5), follower=True)
        scene.add_mass(self.arm.node(5), 0.02)
        scene.add_drag(0.2)
        options = {} if integrator == "static" else {"time_step": 2e-3, "adaptive": False}
        self.simulation = scene.build(integrator=integrator, planar=planar or None, **options, **TIGHT)


class Design:
    """A scene that is built anew with nodes displaced along random ways, of the rod that `of` names."""

    def __init__(self, seed, of, *, planar, kind, **options):
        random = np.random.default_rng(seed)
        arm, branch = drawn(planar, kind)
        self.of, at = of, joint_of(kind)
        self.ways = [random.normal(size=points.shape) * ((1, 0, 1) if planar else 1) for points in (arm, branch)]
        if of == "arm":
            self.ways[1][1:] = 0.0
        else:
            self.ways[0][np.arange(NODES) != at] = 0.0
        self.ways[1][0] = self.ways[0][at]
        normals = (0, 1, 0.1 * (not planar)), (0, 1, 0)
        if kind == "smooth":  # directors, too, go on in each other
            scene = withe.Scene()
            rod = scene.add_rod(
                points=arm, radius=1e-2, material=withe.Material(youngs_modulus=1e6, density=1e3), normal=normals[0]
            )
            normals = normals[0], scene.build(planar=False).directors(rod)[-1, 0]

        def make(h):
            points = (arm + h * self.ways[0], branch + h * self.ways[1])
            return Joined(*points, planar=planar, kind=kind, normal=normals, **options)

        self.make = make

    def along(self, gradient):
        return float(np.sum(gradient * self.ways[0 if self.of == "arm" else 1]))


@pytest.mark.parametrize("of", ["arm", "branch"])
@pytest.mark.parametrize("natural", ["as_built", "straight"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("planar", [True, False])
def test_gradient_by_drawn_nodes_of_joined_rods_is_that_of_scenes_built_anew(planar, kind, natural, of):
    design = Design(41, of, planar=planar, kind=kind, natural=natural)
    random, made = np.random.default_rng(42), design.make(0.0)
    found = made.simulation.equilibrium()
    read = {
        "positions": lambda made: made.simulation.positions(),
        "directors": lambda made: made.simulation.directors(made.arm),
        "curvatures": lambda made: made.simulation.curvatures(made.arm),
        "twists": lambda made: made.simulation.twists(made.arm),
    }
    for word, of_scene in read.items():
        weight = random.normal(size=of_scene(made).shape) * (0.01 if word in ("curvatures", "twists") else 1.0)
        if planar and word == "positions":
            weight[:, 1] = 0.0
        by = {word: weight if word == "positions" else {made.arm: weight}}
        (gradient,) = found.gradient(by, [(design.of, "points")])

        def scalar(h, of_scene=of_scene, weight=weight):
            other = design.make(h)
            other.simulation.equilibrium()
            return float((weight * of_scene(other)).sum())

        assert design.along(gradient) == pytest.approx(extrapolated(scalar, 1e-5), rel=1e-6, abs=2e-7), word


@pytest.mark.parametrize("of", ["arm", "branch"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("planar", [True, False])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_gradient_of_a_run_by_drawn_nodes_of_joined_rods_is_that_of_scenes_built_anew(integrator, planar, kind, of):
    natural = "straight" if kind in ("rigid", "clamped") else "as_built"
    design = Design(43, of, planar=planar, kind=kind, natural=natural, integrator=integrator)
    random, flat = np.random.default_rng(44), (1, 0, 1) if planar else (1, 1, 1)

    def run(h, **options):
        made, steps = design.make(h), iter(range(100))

        def before_step(simulation):
            step = next(steps)
            if step == 3:
                simulation.set(made.arm, natural_curvature=(0.0 if planar else 2.0, 3.0), over=6e-3)
            if step == 5:
                simulation.set(made.stay, rest_length=0.15)

        return made, made.simulation.run(16e-3, record_every=4e-3, progress=False, before_step=before_step, **options)

    made, record = run(0.0, differentiable=True)
    weights = {
        "positions": random.normal(size=record.positions().shape) * flat,
        "velocities": 0.01 * random.normal(size=record.velocities().shape) * flat,
        "curvatures": 1e-3 * random.normal(size=record.curvatures(made.arm).shape),
    }
    by = weights | {"curvatures": {made.arm: weights["curvatures"]}}
    (gradient,) = record.gradient(by, [(design.of, "points")])

    def scalar(h):
        made, other = run(h)
        shown = {
            "positions": other.positions(),
            "velocities": other.velocities(),
            "curvatures": other.curvatures(made.arm),
        }
        return float(sum((weights[word] * shown[word]).sum() for word in weights))

    assert design.along(gradient) == pytest.approx(extrapolated(scalar, 1e-5), rel=1e-6)


@pytest.mark.parametrize("natural", ["as_built", "straight"])
@pytest.mark.parametrize("word", ["positions", "directors", "curvatures"])
def test_directors_at_an_angle_to_the_plane_of_a_scene_turn_with_the_drawing(word, natural):
    random, world = np.random.default_rng(45), Rotation.from_rotvec((0.9, -0.9, 0.1)).as_matrix()
    arm, branch = drawn(True, "rigid")
    way = random.normal(size=arm.shape) * (1, 0, 1)

    def shown(h):
        bent = branch.copy()
        bent[0] += h * way[joint_of("rigid")]
        made = Joined(arm + h * way, bent, planar=True, kind="rigid", normal=None, natural=natural, turned=world)
        found = made.simulation.equilibrium()
        return made, found, getattr(made.simulation, word)(made.arm)

    made, found, value = shown(0.0)
    assert made.simulation.plan.planar
    assert 0.1 < abs(made.simulation.directors(made.arm)[0, 0] @ world[:, 1]) < 0.9
    weight = random.normal(size=value.shape) * (0.01 if word == "curvatures" else 1.0)
    if word == "positions":
        weight = weight * (1, 0, 1) @ world.T
    (gradient,) = found.gradient({word: {made.arm: weight}}, [(made.arm, "points")])
    expected = extrapolated(lambda h: float((weight * shown(h)[2]).sum()), 1e-5)
    assert np.sum(gradient * (way @ world.T)) == pytest.approx(expected, rel=1e-6)
