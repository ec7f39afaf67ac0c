"""Random sequences of calls, good and bad, on small scenes; run by test_random_calls.py in a process of its own.

Every call must end in a result or in an exception that the interface promises, and what can be read must be
finite. A crash of the interpreter is what this looks for.
"""

from __future__ import annotations

import copy
import faulthandler
import math
import pickle
import sys
import warnings

import numpy as np
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

import withe

ALLOWED = (ValueError, withe.ConvergenceError)
RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=10.0)
SPECIAL = [0.0, -1.0, 1e-300, 1e-40, 1e300, 1e40, 1e12, -1e9, math.nan, math.inf, -math.inf]
calls = {"sequences": 0, "results": 0, "refusals": 0}

sensible = st.floats(-2, 2, allow_nan=False)
number = st.one_of(sensible, sensible, st.sampled_from(SPECIAL), st.sampled_from([None, "x", True, 3]))
positive = st.one_of(st.floats(1e-3, 10), st.floats(1e-3, 10), number)
triple = st.one_of(
    st.tuples(sensible, sensible, sensible),
    st.tuples(sensible, sensible, sensible),
    st.tuples(number, number, number),
    st.sampled_from([(), (1, 2), None, "up", np.zeros((3, 3)), (0, 0, 0)]),
)
small_triple = triple.map(lambda v: tuple(0.01 * x for x in v) if _plain(v) else v)
index = st.integers(-6, 6)
node = st.tuples(st.sampled_from("abc"), st.sampled_from(["start", "end", "node(1)", "node(-1)", "node(9)"])).map(
    ".".join
)
rod = st.sampled_from(["a", "a", "b", "b", "c", "nobody"])
touched = st.sampled_from(["a", "b", "floor 1", "plane 1", "sphere 1", "capsule 1"])


def _plain(value):
    return isinstance(value, tuple) and all(isinstance(x, float) for x in value)


def add_rod(world, data):
    kind = data.draw(st.integers(0, 4))
    options = {"radius": 5e-3, "material": RUBBER, "name": data.draw(st.sampled_from([None, "c", "a"]))}
    if kind == 0:
        options |= {"start": data.draw(triple), "end": data.draw(triple), "nodes": data.draw(index)}
    elif kind == 1:
        count = data.draw(st.integers(0, 5))
        options |= {
            "points": [data.draw(triple) for _ in range(count)],
            "closed": data.draw(st.booleans()),
            "natural": data.draw(st.sampled_from(["straight", "as_built", "bent"])),
        }
    elif kind == 2:
        options |= {"start": (0, 0, 0), "end": (0, 0.3, 0), "nodes": 4, "radius": data.draw(positive)}
    elif kind == 3:
        options |= {"start": (0, 0, 0), "end": (0, 0.3, 0.1), "nodes": 4, "normal": data.draw(triple)}
    else:
        section = withe.Rectangle(width=data.draw(positive), height=data.draw(positive))
        options |= {"start": (0, 0, 0), "end": (0, 0.3, 0), "nodes": 4, "radius": None, "section": section}
    world.scene.add_rod(**options)


def function_of_time(data):
    """A function that never raises of itself, but may return anything."""
    a, b = data.draw(small_triple), data.draw(small_triple)
    if not (_plain(a) and _plain(b)):
        return lambda t: a

    def line(t):
        with np.errstate(all="ignore"):
            return np.add(a, np.multiply(t, b))

    return line


def custom(data):
    scale = data.draw(st.one_of(sensible, st.sampled_from(SPECIAL)))

    def wind(t, x, v):
        with np.errstate(all="ignore"):
            return np.multiply(scale, 0.001 * v)

    return wind


def stiffness(data):
    value = data.draw(st.one_of(sensible, st.sampled_from(SPECIAL)))

    def slope(t, x, v):
        with np.errstate(all="ignore"):
            return np.multiply(value, np.eye(x.size))

    return slope


def add_obstacle(world, data):
    friction = data.draw(st.one_of(st.just(0.3), number))
    kind = data.draw(st.integers(0, 3))
    if kind == 0:
        world.scene.add_floor(data.draw(number), friction=friction)
    elif kind == 1:
        world.scene.add_plane(data.draw(triple), data.draw(triple), friction=friction)
    elif kind == 2:
        world.scene.add_sphere(data.draw(triple), data.draw(positive), friction=friction)
    else:
        world.scene.add_capsule(data.draw(triple), data.draw(triple), data.draw(positive), friction=friction)


def enable_contact(world, data):
    options = {
        "friction": data.draw(st.one_of(st.floats(0, 1), number)),
        "model": data.draw(st.sampled_from(["imcv2", "imcv2", "barrier", "springs"])),
        "friction_model": data.draw(st.sampled_from(["implicit", "lagged", "anchored", "dry"])),
        "distance_tolerance": data.draw(st.one_of(st.none(), st.none(), st.floats(1e-5, 1e-2), number)),
        "slip_tolerance": data.draw(st.one_of(st.just(1e-3), positive)),
        "centreline_friction": data.draw(st.booleans()),
    }
    if data.draw(st.integers(0, 3)) == 0:
        options["stiffness"] = data.draw(positive)
    world.scene.enable_contact(**options)


def add_fluid(world, data):
    world.scene.add_fluid(
        data.draw(positive),
        model=data.draw(st.sampled_from(["stokeslets", "resistive", "honey"])),
        regularization=data.draw(st.one_of(st.none(), st.just(0.02), positive)),
        wavelength=data.draw(st.one_of(st.none(), positive)),
    )


def grasp(where, d):
    """Anywhere along a rod, rigid or not."""
    where.grasp(
        d.draw(rod),
        d.draw(number),
        d.draw(number),
        stiffness=d.draw(st.one_of(st.none(), st.tuples(positive, positive))),
        force_limit=d.draw(st.one_of(st.none(), positive)),
    )


def ring(where, d):
    """One that a rod slides through, by itself or fed."""
    words = {}
    for word, strategy in [
        ("stiffness", positive), ("friction", positive), ("feed_rate", number), ("force_limit", positive),
    ]:  # fmt: skip
        if d.draw(st.integers(0, 2)) == 0:
            words[word] = d.draw(strategy)
    where.grasp(d.draw(rod), d.draw(st.one_of(st.floats(0, 0.2), number)), slides=True, **words)


ON_SCENE = {
    "add_rod": add_rod,
    "add_obstacle": add_obstacle,
    "enable_contact": enable_contact,
    "add_fluid": add_fluid,
    "set_friction": lambda w, d: w.scene.set_friction(d.draw(rod), d.draw(touched), d.draw(number)),
    "ignore_contact": lambda w, d: w.scene.ignore_contact(d.draw(rod), d.draw(touched)),
    "join": lambda w, d: w.scene.join(
        d.draw(node),
        d.draw(node),
        kind=d.draw(st.sampled_from(["rigid", "rigid", "pinned", "revolute", "glued"])),
        axis=d.draw(st.one_of(st.none(), triple)),
        form=d.draw(st.sampled_from(["frame", "frame", "pairs"])),
        stiffness=d.draw(st.sampled_from([0.0, 0.0, 1e-2, -1.0, float("nan")])),
        rest_angle=d.draw(st.sampled_from([0.0, 0.0, -7.0, float("inf")])),
    ),
    "clamp": lambda w, d: w.scene.clamp(
        d.draw(node), hold=d.draw(st.sampled_from(["frame", "edge"])), free=d.draw(st.one_of(st.none(), triple))
    ),
    "pin": lambda w, d: w.scene.pin(d.draw(node), free=d.draw(st.one_of(st.none(), triple))),
    "grasp": lambda w, d: grasp(w.scene, d),
    "ring": lambda w, d: ring(w.scene, d),
    "add_force": lambda w, d: w.scene.add_force(d.draw(node), d.draw(small_triple), follower=d.draw(st.booleans())),
    "add_moment": lambda w, d: w.scene.add_moment(d.draw(node), d.draw(small_triple)),
    "add_load": lambda w, d: w.scene.add_load(d.draw(rod), d.draw(small_triple), follower=d.draw(st.booleans())),
    "add_varying": lambda w, d: w.scene.add_force(d.draw(node), function_of_time(d), name="varying"),
    "add_mass": lambda w, d: w.scene.add_mass(d.draw(node), d.draw(positive)),
    "add_drag": lambda w, d: w.scene.add_drag(d.draw(positive)),
    "add_custom_force": lambda w, d: w.scene.add_custom_force(custom(d)),
    "add_solved_force": lambda w, d: w.scene.add_custom_force(custom(d), jacobian=stiffness(d)),
    "gravity": lambda w, d: setattr(w.scene, "gravity", d.draw(triple)),
    "pickle": lambda w, d: setattr(w, "scene", copy.deepcopy(w.scene)),
}


def build(world, data):
    integrator = data.draw(
        st.sampled_from(["implicit_midpoint", "backward_euler", "energy_momentum", "fourth_order", "verlet", "static"])
    )
    options = {
        "integrator": integrator,
        "time_step": data.draw(st.sampled_from([1e-3, 1e-2, 1e-3])) * (1e-3 if integrator == "verlet" else 1.0),
        "planar": data.draw(st.sampled_from([None, None, True, False])),
        "adaptive": data.draw(st.booleans()),
        "solver": withe.Solver(max_halvings=4),
    }
    if data.draw(st.integers(0, 4)) == 0:
        options |= {"time_step": data.draw(positive), "tolerance": data.draw(positive)}
    world.simulation = world.scene.build(**options)


def snapshot(world, data):
    world.snapshot = world.simulation.snapshot()


def set_rod(world, data):
    word = data.draw(
        st.sampled_from(
            ["youngs_modulus", "density", "viscosity", "drag", "stretch_stiffness", "bend_stiffness",
             "twist_stiffness", "line_density", "viscous_time", "poisson_ratio", "colour"]
        )
    )  # fmt: skip
    value = data.draw(positive)
    if word == "youngs_modulus" and isinstance(value, float) and 0 < value < 100:
        value *= 1e6
    world.simulation.set(data.draw(rod), **{word: value})


def move(world, data):
    options = {}
    for word, strategy in [("position", triple), ("tangent", triple), ("roll", number), ("over", positive)]:
        if data.draw(st.integers(0, 2)) == 0:
            options[word] = data.draw(strategy)
    world.simulation.move(data.draw(node), **options)


def read(world, data):
    simulation = world.simulation
    name = data.draw(st.sampled_from(["directors", "curvatures", "twists", "tensions", "spins", "positions"]))
    values = getattr(simulation, name)(data.draw(rod))
    assert np.isfinite(values).all(), f"{name} holds {values}"
    assert np.isfinite(list(vars(simulation.energy()).values())).all()
    contacts = simulation.contacts()
    for field in ("distance", "gap", "point", "normal", "normal_force", "friction"):
        assert np.isfinite(contacts[field]).all(), f"{field} holds {contacts[field]}"
    assert str(simulation.plan)


ON_SIMULATION = {
    "step": lambda w, d: w.simulation.step(d.draw(st.integers(-1, 3))),
    "run": lambda w, d: w.simulation.run(
        d.draw(st.sampled_from([1e-3, 2.5e-3, 0.0, math.nan])), record_every=d.draw(st.sampled_from([None, 1e-3])),
        progress=False,
    ),
    "equilibrium": lambda w, d: w.simulation.equilibrium(),
    "read": read,
    "set_rod": set_rod,
    "set_force": lambda w, d: w.simulation.set("force 1", force=d.draw(small_triple)),
    "set_moment": lambda w, d: w.simulation.set("moment 1", moment=d.draw(small_triple)),
    "set_function": lambda w, d: w.simulation.set("force 1", force=function_of_time(d)),
    "set_gravity": lambda w, d: w.simulation.set(gravity=d.draw(triple)),
    "put_on": lambda w, d: w.simulation.add_force(d.draw(node), d.draw(small_triple)),
    "take_off": lambda w, d: w.simulation.remove(d.draw(st.sampled_from(["force 1", "force 2", "moment 1"]))),
    "friction": lambda w, d: w.simulation.set(
        d.draw(st.sampled_from(["floor 1", "plane 1", "sphere 1", None])),
        friction=d.draw(st.one_of(st.floats(0, 1), number, st.tuples(number, number))),
    ),
    "friction_of_two": lambda w, d: w.simulation.set((d.draw(rod), d.draw(touched)), friction=d.draw(number)),
    "roll": lambda w, d: w.simulation.move(
        d.draw(st.sampled_from(["floor 1", "sphere 1", "capsule 1"])), roll=d.draw(number),
        tangent=d.draw(st.one_of(st.none(), triple)), over=d.draw(st.sampled_from([0.0, 0.01])),
    ),
    "natural_curvature": lambda w, d: w.simulation.set(
        d.draw(rod), natural_curvature=d.draw(st.tuples(number, number)),
        over=d.draw(st.sampled_from([0.0, 0.01, -1, math.nan])),
    ),
    "natural_twist": lambda w, d: w.simulation.set(d.draw(rod), natural_twist=d.draw(number)),
    "natural_stretch": lambda w, d: w.simulation.set(d.draw(rod), natural_stretch=d.draw(number), over=0.01),
    "velocities": lambda w, d: w.simulation.set_velocities(d.draw(rod), d.draw(triple)),
    "clamp": lambda w, d: w.simulation.clamp(d.draw(node), hold=d.draw(st.sampled_from(["frame", "edge"]))),
    "pin": lambda w, d: w.simulation.pin(d.draw(node)),
    "grasp": lambda w, d: grasp(w.simulation, d),
    "ring": lambda w, d: ring(w.simulation, d),
    "feed": lambda w, d: w.simulation.hand("hand 1").feed(d.draw(number)),
    "passage": lambda w, d: w.simulation.passage("hand 1"),
    "friction_of_ring": lambda w, d: w.simulation.set("hand 1", friction=d.draw(positive)),
    "move_hand": lambda w, d: w.simulation.hand("hand 1").move(position=d.draw(small_triple), over=d.draw(positive)),
    "wrench": lambda w, d: w.simulation.wrench("hand 1", about=d.draw(triple)),
    "let_go": lambda w, d: w.simulation.hand("hand 1").release(),
    "release": lambda w, d: w.simulation.release(d.draw(node)),
    "move": move,
    "path": lambda w, d: w.simulation.move(d.draw(node), path=function_of_time(d)),
    "reaction": lambda w, d: w.simulation.reaction(d.draw(node)),
    "snapshot": snapshot,
    "restore": lambda w, d: w.simulation.restore(w.snapshot),
    "reset": lambda w, d: w.simulation.reset(),
    "copy": lambda w, d: setattr(w, "simulation", w.simulation.copy()),
    "pickle": lambda w, d: pickle.loads(pickle.dumps(w.simulation.snapshot())),
}  # fmt: skip


class World:
    """A scene of two joined rods, and the simulation built from it last."""

    def __init__(self):
        self.scene = withe.Scene()
        self.scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=4, radius=5e-3, material=RUBBER, name="a")
        self.scene.add_rod(start=(0.2, 0, 0), end=(0.2, 0.1, 0.1), nodes=3, radius=5e-3, material=RUBBER, name="b")
        self.scene.join("a.end", "b.start")
        self.simulation = None
        self.snapshot = None

    def call(self, what, data):
        try:
            what(self, data)
            calls["results"] += 1
        except ALLOWED:
            calls["refusals"] += 1
        if self.simulation is not None:
            assert np.isfinite(self.simulation.positions()).all()
            assert np.isfinite(self.simulation.velocities()).all()


@st.composite
def names(draw):
    before = draw(st.lists(st.sampled_from(sorted(ON_SCENE)), max_size=4))
    after = draw(st.lists(st.sampled_from(sorted(ON_SIMULATION)), min_size=1, max_size=5))
    return before, after


def make_test(examples: int, number: int):
    @seed(number)
    @settings(
        max_examples=examples,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=_phases(),
    )
    @given(names(), st.data())
    def sequence(plan, data):
        calls["sequences"] += 1
        world = World()
        for name in plan[0]:
            world.call(ON_SCENE[name], data)
        if data.draw(st.integers(0, 3)):
            world.call(lambda w, d: w.scene.clamp("a.start"), data)
        world.call(build, data)
        if world.simulation is not None:
            for name in plan[1]:
                world.call(ON_SIMULATION[name], data)

    return sequence


def _phases():
    from hypothesis import Phase

    return [Phase.generate, Phase.shrink] if "--shrink" in sys.argv else [Phase.generate]


def main() -> None:
    """`random_calls.py COUNT SEED`: run so many sequences, and print what came of them."""
    faulthandler.enable()
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", category=DeprecationWarning)
    # Four nodes under forces of any size are coarse, and the warnings are right.
    warnings.simplefilter("ignore", category=withe.CoarseMeshWarning)
    warnings.simplefilter("ignore", category=withe.RingLeftWarning)
    # A time step of any length may be far from plausible.
    warnings.simplefilter("ignore", category=withe.PlausibilityWarning)
    warnings.filterwarnings("ignore", "the ramp of .* has not begun")
    count, number = int(sys.argv[1]), int(sys.argv[2])
    make_test(count, number)()
    print(f"{calls['sequences']} sequences, {calls['results']} results, {calls['refusals']} refusals")


if __name__ == "__main__":
    main()
