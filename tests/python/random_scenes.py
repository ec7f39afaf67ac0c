"""Scenes that random sequences run on, drawn from a number; and functions of time that pickle."""

from __future__ import annotations

import random

import numpy as np
from scipy.spatial.transform import Rotation

import withe

SOFT = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=100.0)
ELASTIC = withe.Material(youngs_modulus=2e6, poisson_ratio=0.3, density=800.0)
# Statics seldom: where there is no equilibrium, finding this takes long.
INTEGRATORS = (
    *("implicit_midpoint",) * 3,
    *("backward_euler", "energy_momentum", "fourth_order") * 2,
    "static",
    "verlet",
)
JOINTS = ("rigid", "rigid", "pinned", "revolute", "none")


class Wave:
    """A force that swings."""

    def __init__(self, amplitude, rate):
        self.amplitude, self.rate = amplitude, rate

    def __call__(self, t):
        return np.multiply(self.amplitude, np.sin(self.rate * t))


class Circle:
    """A support that leaves its place along a line and comes back, and turns about an axis on the way."""

    def __init__(self, way, axis, place):
        self.way, self.axis, self.place = way, axis, place

    def __call__(self, t):
        position = np.add(self.place, np.multiply(self.way, np.sin(30.0 * t)))
        if self.axis is None:
            return position
        return position, Rotation.from_rotvec(np.multiply(self.axis, 0.3 * np.sin(20.0 * t))).as_matrix()


class Wind:
    """A custom force."""

    def __call__(self, t, x, v):
        return -1e-3 * v + 1e-4 * np.cos(20.0 * t)


class Springs:
    """A custom force that is solved for, between nodes that are not neighbours, and moments with it."""

    def __call__(self, t, x, v):
        return 0.1 * (x[::-1] - x) - 1e-3 * v, 1e-5 * np.cos(20.0 * t) * np.array([(0.0, 1.0, 0.0)] * len(x))


class SpringsJacobian:
    """That of the forces; moments have none."""

    def __call__(self, t, x, v):
        between = 0.1 * (np.eye(len(x))[::-1] - np.eye(len(x)))
        return np.kron(between, np.eye(3)), -1e-3 * np.eye(x.size)


class Interrupting:
    """Callback that raises, at its call of a given number, the exception of a user's Ctrl-C."""

    def __init__(self, at):
        self.left = at

    def __call__(self, t):
        if self.left is not None:
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt


def add_rods(scene, r, flat, material, joints):
    """An arm along x and a limb at its end, that goes up or hangs; sometimes a ring above them."""
    kind = r.choice(joints)
    up = r.random() < 0.5
    tip = 0.22 if kind == "none" else 0.2
    a = scene.add_rod(
        start=(0, 0, 0.1), end=(0.2, 0, 0.1), nodes=r.choice([3, 8, 13]), radius=4e-3, material=material, name="a",
        normal=(0, 0, 1) if r.random() < 0.5 else None,
    )  # fmt: skip
    s = np.linspace(0.0, 1.0, r.choice([4, 7]))
    if up:
        points = np.stack([tip + 0 * s, 0.0 * s if flat else 0.1 * s, 0.1 + 0.1 * s], axis=1)
    else:
        points = np.stack([tip + 0.1 * s, 0 * s if flat else 0.05 * s**2, 0.1 - 0.06 * s**2], axis=1)
    b = scene.add_rod(points=points, radius=3e-3, material=material, name="b")
    if kind != "none":
        turns = {"axis": (0, 1, 0)} if kind == "revolute" else {}
        if turns and r.random() < 0.7:
            turns |= {
                "stiffness": r.uniform(0.0, 0.02),
                "rest_angle": r.uniform(-1, 1),
                "moment": r.uniform(-1e-3, 1e-3),
            }
        form = {"form": "pairs"} if kind == "rigid" and r.random() < 0.2 else {}
        scene.join(a.end, b.start, kind, **turns, **form, name="joint")
    if r.random() < 0.2:
        angle = np.linspace(0.0, 2.0 * np.pi, 9)[:-1]
        ring = np.stack([0.1 + 0.03 * np.cos(angle), 0 * angle, 0.16 + 0.03 * np.sin(angle)], axis=1)
        scene.add_rod(points=ring, closed=True, radius=3e-3, material=material, name="ring")
    return a, b, points[-1], 0.09 if up else 0.03


def add_tree_of_bodies(scene, number):
    """A tree of one to four rigid bodies on the limb of a drawn scene or beside it, with joints and loads of all kinds.

    The bodies have a generator of their own, so that the scenes without them stay the same.
    """
    r = random.Random(f"bodies {number}")

    def some(size):
        return [r.uniform(-size, size) for _ in range(3)]

    def turned():
        turn = Rotation.from_rotvec(some(2.0))
        w, x, y, z = turn.as_quat(scalar_first=True)
        return r.choice([None, turn, turn.as_matrix(), [w, x, y, z]])

    solids = (
        withe.solids.Sphere(0.02),
        withe.solids.Box((0.02, 0.03, 0.05)),
        withe.solids.Cylinder(0.01, 0.04),
        withe.solids.Capsule(0.01, 0.03),
        withe.solids.Mesh(
            [[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0], [0, 0, 0.04]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
        ),
    )
    held = scene["hub"] if "hub" in scene._directory.parts else None
    for i in range(r.randint(1, 4)):
        place = np.add((0.3, 0.0, 0.2 + 0.1 * i), some(0.02))
        kind = r.choice(["solid", "mass", "inertia"])
        if kind == "solid":
            body = scene.add_body(r.choice(solids), density=r.uniform(300.0, 900.0), position=place, rotation=turned())
        elif kind == "mass":
            body = scene.add_body(r.choice(solids), mass=0.01, position=place, rotation=turned(), name=f"body {i} b")
        else:
            inertia = r.choice([1e-5, (1e-5, 1.2e-5, 1.5e-5), np.diag([1e-5, 1e-5, 1.8e-5])])
            body = scene.add_body(mass=0.02, inertia=inertia, center=some(0.01), position=place, rotation=turned())
        if r.random() < 0.3:
            scene.add_force(body, some(0.01), at=np.add(place, some(0.02)))
        if r.random() < 0.2:
            scene.add_moment(body, some(1e-4))
        kind = r.choice(["rigid", "pinned", "revolute"])
        turns = {"axis": some(1.0), "stiffness": 1e-3, "damping": 1e-5} if kind == "revolute" else {}
        if held is None and r.random() < 0.7:
            scene.join(body, scene["b"].end, kind, **turns)
        elif held is not None:
            if kind == "rigid":
                scene.join(held, body, kind="pinned", at=place)
            else:
                scene.join(held, body, kind, at=place, **turns)
        elif r.random() < 0.5:
            scene.clamp(body, at=np.add(place, some(0.02)), spin=r.choice([False, (0.0, 0.6, 0.8)]))
        else:
            scene.pin(body, at=place)
        held = body


def add_supports_and_loads(scene, r, flat, a, b, varying, clamped):
    if r.random() < 0.9 or clamped:
        scene.clamp(a.start, name="clamp", hold=r.choice(["frame", "frame", "edge"]))
    if r.random() < 0.3:
        scene.pin(b.end, name="pin", free=r.choice([None, None, (1, 0, 0)]))
    size = (0.002, 0.0 if flat else 0.001, 0.003)
    if r.random() < 0.5:
        value = Wave(size, 60.0) if varying and r.random() < 0.4 else size
        scene.add_force(a.node(1), value, follower=r.random() < 0.3, name="force")
    if r.random() < 0.2:
        scene.add_moment(b.end, (0, 1e-4, 0) if flat else (1e-4, 0, 1e-4))
    if r.random() < 0.2:
        scene.add_load(
            a, Wave((0, 0, 0.02), 50.0) if varying and r.random() < 0.5 else (0, 0, 0.02), follower=r.random() < 0.3
        )
    if r.random() < 0.3:
        scene.add_mass(a.node(1), 1e-3, name="mass")
    if r.random() < 0.3:
        scene.add_drag(0.05, name="drag")
    if r.random() < 0.3:
        guides = r.choice([a, b, [a.start, a.edge(0), b.edge(-1), b.end]])
        scene.add_tendon(guides, offset=(2e-3, 0.0 if flat else 1e-3), tension=r.uniform(0.0, 0.2), name="tendon")
    if r.random() < 0.3:
        axis = (0, 1, 0) if flat else r.choice([(0, 1, 0), (0.3, 1, -0.2)])
        angle = r.uniform(-0.5, 0.5)
        scene.add_torsion_spring(a.edge(-1), b.edge(0), stiffness=0.01, rest_angle=angle, axis=axis, name="torsion")
    if varying and r.random() < 0.15:
        scene.add_custom_force(Wind())
    if varying and r.random() < 0.15:
        scene.add_custom_force(Springs(), jacobian=SpringsJacobian(), moments=True)


def add_surroundings(scene, r, flat, floor):
    if r.random() < 0.3:
        scene.add_floor(floor, friction=r.choice([0.0, 0.3]), name="floor")
    if r.random() < 0.2:
        scene.add_sphere((0.15, 0.0 if flat else 0.02, 0.05), 0.025, friction=0.3, name="ball")
    if r.random() < 0.1:
        scene.add_capsule((0.05, -0.1, 0.08), (0.05, 0.1, 0.08), 0.01, friction=0.2)
    if r.random() < 0.4:
        scene.enable_contact(
            friction=r.choice([0.0, 0.3]),
            friction_model=r.choice(["implicit", "anchored", "lagged"]),
            model=r.choice(["imcv2", "imcv2", "barrier"]),
        )
    if r.random() < 0.2:
        scene.add_fluid(0.5, model=r.choice(["resistive", "stokeslets"]), regularization=5e-3, name="fluid")


def add_bodies(scene, r, flat, b, end, static):
    """A hub at the end of the limb, and sometimes a weight on a joint of the hub."""
    out = 0.0 if flat else 0.01
    hub = scene.add_body(
        mass=r.uniform(1e-3, 0.05),
        inertia=np.array([1.0, 1.4, 1.9]) * r.uniform(1e-7, 1e-5),
        center=r.choice([(0, 0, 0), (0.01, out, -0.005)]),
        position=end,
        name="hub",
    )
    axes = {"revolute": (0, 1, 0), "sliding": (1, 0, 0.5)}
    kind = "rigid" if static else r.choice(["rigid", "rigid", "pinned", "revolute", "sliding"])
    scene.join(hub, b.end, kind, axis=axes.get(kind), stiffness=5.0 if kind in axes else 0.0)
    if r.random() < 0.4:
        place = np.add(end, (0.02, out, 0.01))
        weight = scene.add_body(withe.solids.Sphere(0.01), mass=r.uniform(1e-3, 0.02), position=place, name="weight")
        kind = r.choice(["pinned", "revolute", "sliding"])
        stiffness = 5.0 if kind in axes else 0.0
        scene.join(hub, weight, kind, at=np.add(end, (0.01, 0, 0)), axis=axes.get(kind), stiffness=stiffness)
    if r.random() < 0.3:
        scene.add_spring(hub.at(np.add(end, (0, 0, 0.01))), scene.rods[0].node(1), stiffness=r.uniform(0.0, 20.0))


def draw_scene(number: int, varying: bool = True):
    """A scene, and what it is to be built with; with functions of time only if `varying`."""
    r = random.Random(number)
    flat = r.random() < 0.6
    integrator = r.choice(INTEGRATORS)
    scene = withe.Scene(gravity=(0, 0, -9.81) if r.random() < 0.7 else (0, 0, 0))
    planar = r.choice([None, None, None, False, True]) if flat else None  # True takes no functions of time
    static = integrator == "static"  # mechanisms have no equilibrium, and finding this takes long
    fourth = integrator == "fourth_order"  # goes back in time: no viscosity, no contact, no fluid
    material = ELASTIC if fourth else r.choice([SOFT, ELASTIC])
    a, b, end, floor = add_rods(scene, r, flat, material, ["rigid"] if static else JOINTS)
    add_supports_and_loads(scene, r, flat, a, b, varying=varying and not planar, clamped=static)
    if not fourth:
        add_surroundings(scene, r, flat, floor)
    options = {
        "integrator": integrator,
        "time_step": 2e-5 if integrator == "verlet" else r.choice([1e-3, 2e-3, 5e-3]),
        "planar": planar,
    }
    if integrator not in ("static", "verlet"):
        options["adaptive"] = r.random() < 0.85
        options["solver"] = withe.Solver(max_halvings=r.choice([6, 2]))  # or a step without solution takes long to fail
        if r.random() < 0.15:
            options["tolerance"] = r.choice([1e-3, 1e-4])
    if integrator != "verlet" and r.random() < 0.35:  # last, so that all else is drawn as without bodies
        add_bodies(scene, r, flat, b, end, static)
    return scene, options
