"""Random sequences of sensible calls on whole scenes, the same on several simulations that must agree to the bit.

`random_sequences.py COUNT SEED [SEQUENCE] [--jobs N]` runs COUNT sequences drawn from SEED, or one by its number.
`make asan-python` runs it with an engine built for the address sanitizer, `test_random_sequences.py` a few with the one
that is installed.

A sequence draws a scene and runs calls on it, lifts out of its plane among them, and interruptions, and steps that do
not converge. Then the same further calls must end alike, exceptions included,

- after `reset` as in a simulation just built;
- after a snapshot was taken as in a simulation of which none was taken;
- and then as in a copy, a pickle, a simulation just built and one that went elsewhere, to which
  the snapshot was restored from memory or from a file; read-outs between them change nothing.

A failure names sequence, lane and call. `random_calls.py` looks for bad input instead.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import faulthandler
import multiprocessing
import pickle
import random
import sys
import tempfile
import traceback
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

import withe
from random_scenes import Circle, Interrupting, Wave, draw_scene

ALLOWED = (ValueError, withe.ConvergenceError, KeyboardInterrupt)


def number(r, size):
    return r.uniform(-size, size)


def vector(r, size):
    """Mostly in the plane y = 0, which many scenes lie in."""
    return (number(r, size), number(r, size) if r.random() < 0.3 else 0.0, number(r, size))


# --- calls: each draws all of its arguments from `r` before it looks at the simulation -------------------------------


def step(simulation, r):
    simulation.step(r.randint(1, 4))


def run(simulation, r):
    steps, interrupted_at = r.uniform(0.5, 4.0), r.choice([None, None, 1, 2])
    interrupt = Interrupting(interrupted_at)
    record = simulation.run(
        steps * simulation.time_step,
        record_every=r.choice([None, 1.5, 0.4]) and 0.7 * simulation.time_step,
        progress=False,
        before_step=lambda s: interrupt(s.time),
        until=lambda s: not np.isfinite(s.positions()).all(),
        record={"kinetic": lambda s: s.energy().kinetic},
    )
    assert len(record["kinetic"]) == len(record.times)


def set_rod(simulation, r):
    rod = r.choice("ab")
    word, value = r.choice(
        [("youngs_modulus", r.uniform(3e5, 5e6)), ("density", r.uniform(300, 2000)), ("drag", r.uniform(0, 0.2)),
         ("viscosity", r.uniform(0, 500)), ("bend_stiffness", r.uniform(1e-5, 1e-3))]
    )  # fmt: skip
    simulation.set(rod, **{word: value})


def set_part(simulation, r):
    part, word, value = r.choice(
        [("mass", "mass", r.uniform(0, 0.01)), ("drag", "drag", r.uniform(0, 0.2)), ("force", "force", vector(r, 0.01)),
         ("fluid", "viscosity", r.uniform(0.1, 1)), ("force", "force", Wave(vector(r, 0.01), 40.0)),
         ("tendon", "tension", r.uniform(0, 0.3)), ("torsion", "stiffness", r.uniform(0, 0.02)),
         ("torsion", "rest_angle", number(r, 1.0)),
         ("joint", r.choice(["stiffness", "damping", "rest_angle", "moment"]), r.uniform(0, 0.01))]
    )  # fmt: skip
    over = r.choice([0.0, 0.0, 0.02]) if part in ("tendon", "torsion", "joint") else 0.0
    simulation.set(part, over=over, **{word: value})


def gravity(simulation, r):
    simulation.set(gravity=vector(r, 10.0))


def curvature(simulation, r):
    rod, out = r.choice("ab"), number(r, 5.0) if r.random() < 0.3 else 0.0
    simulation.set(
        rod, natural_curvature=r.choice([(number(r, 8.0), out), (out, number(r, 8.0))]), over=r.choice([0.0, 0.02])
    )


def twist(simulation, r):
    simulation.set(r.choice("ab"), natural_twist=number(r, 8.0), over=r.choice([0.0, 0.02]))


def velocities(simulation, r):
    simulation.set_velocities(r.choice(["a", "b", None]), vector(r, r.choice([0.1, 1.0, 1.0, 30.0])))


def body_motion(simulation, r):
    simulation.set_velocity(r.choice(["hub", "weight"]), vector(r, 1.0), angular=vector(r, 20.0))


def move(simulation, r):
    """Within the plane or out of it, at once or in some steps' time."""
    options = {"over": r.choice([0.0, 0.004, 0.03, 0.03])}
    if r.random() < 0.5:
        options["position"] = tuple(np.add((0, 0, 0.1), vector(r, 0.02)))
    if r.random() < 0.6:
        options["tangent"] = (1.0, r.choice([0.0, number(r, 0.3)]), number(r, 0.3))
        options["roll"] = r.choice([0.0, number(r, 1.0)])
    simulation.move("clamp", **options)


def path(simulation, r):
    place = r.choice(["clamp", "pin", "new"])
    turns = r.random() < 0.6 and place != "pin"
    simulation.move(place, path=Circle(vector(r, 0.01), vector(r, 1.0) if turns else None, (0, 0, 0.1)))


def interrupted_path(simulation, r):
    """An exception in a callback ends the step; then remove the path again."""
    interrupt = Interrupting(r.randint(1, 3))
    simulation.move("clamp", path=lambda t: interrupt(t) or (0.0, 0.0, 0.1))
    try:
        simulation.step(3)
    finally:
        simulation.move("clamp", position=(0.0, 0.0, 0.1), over=0.01)


def move_obstacle(simulation, r):
    simulation.move(r.choice(["floor", "ball"]), position=vector(r, 0.01), over=r.choice([0.0, 0.02]))


def turn_obstacle(simulation, r):
    over = r.choice([0.0, 0.02])
    if r.random() < 0.5:
        simulation.move("floor", roll=number(r, 3.0), over=over)
    else:
        simulation.move("ball", roll=number(r, 3.0), tangent=(0, 1, 0), over=over)


def friction(simulation, r):
    mu = r.choice([0.0, 0.2, 0.4, (0.1, 0.3)])
    if r.random() < 0.7:
        simulation.set(r.choice(["floor", "ball"]), friction=mu)
    else:
        simulation.set(("a", r.choice(["b", "floor"])), friction=mu)


def load(simulation, r):
    """Put on, or taken off."""
    name = r.choice(["gust", "squall"])
    if r.random() < 0.5:
        simulation.add_force("b.end", Wave(vector(r, 0.01), 40.0) if r.random() < 0.3 else vector(r, 0.01), name=name)
    else:
        simulation.remove(name)


def hold(simulation, r):
    where, kind, edge = r.choice(["b.end", "a.node(1)", "a.start"]), r.random() < 0.5, r.random() < 0.5
    if kind:
        simulation.clamp(where, name="new", hold="edge" if edge else "frame")
    else:
        simulation.pin(where, name="new", free=(0, 0, 1) if edge else None)


def grasp(simulation, r):
    """Rigid, yielding, slipping; a ring, one that rubs, one that feeds the rod and may slip."""
    words = r.choice(
        [{}, {"stiffness": (50.0, 1e-3)}, {"stiffness": (50.0, 1e-3), "force_limit": 0.02}, {"slides": True},
         {"slides": True, "friction": 0.3}, {"slides": True, "feed_rate": 0.5},
         {"slides": True, "feed_rate": -0.5, "force_limit": 0.05}]
    )  # fmt: skip
    length = 0.0 if "slides" in words else r.choice([0.0, 0.01])
    simulation.grasp(r.choice("ab"), r.uniform(0.01, 0.08), length, name="hand", **words)


def move_hand(simulation, r):
    place = simulation.pose("hand").position + vector(r, 0.02)
    simulation.move("hand", position=place, over=r.choice([0.0, 0.004, 0.03]))


def ring(simulation, r):
    if r.random() < 0.5:
        simulation.set("hand", friction=r.choice([0.0, 0.2, 0.5]))
    else:
        simulation.feed("hand", number(r, 1.0))


def release(simulation, r):
    simulation.release(r.choice(["clamp", "pin", "new", "new", "hand"]))


def equilibrium(simulation, r):
    simulation.equilibrium()


CALLS = {
    step: 4, run: 2, set_rod: 2, set_part: 2, gravity: 1, curvature: 1, twist: 1, velocities: 1, body_motion: 1,
    move: 7, path: 1, interrupted_path: 1, move_obstacle: 1, hold: 2, release: 2, equilibrium: 1, turn_obstacle: 1,
    friction: 1, load: 1, grasp: 3, move_hand: 2, ring: 2,
}  # fmt: skip


def replaced(simulation, r):
    """The same simulation by another way."""
    way = r.randrange(4)
    if way == 0:
        return simulation.copy()
    if way == 1:
        return pickle.loads(pickle.dumps(simulation))
    if way == 2:
        simulation.restore(simulation.snapshot())
    return simulation


def go(simulation, seed, count, read=False):
    """Run calls drawn from a seed. Returns the simulation that is left, and what came of each."""
    r = random.Random(seed)
    outcomes = []
    for _ in range(count):
        if r.random() < 0.15:
            simulation = replaced(simulation, r)
        call = r.choices(list(CALLS), weights=list(CALLS.values()))[0]
        for act in (call, step):
            inner = random.Random(r.random())
            try:
                act(simulation, inner)
                outcomes.append((act.__name__, "done", state(simulation)))
            except ALLOWED as error:
                outcomes.append((act.__name__, f"{type(error).__name__}: {error}", state(simulation)))
        if read:
            read_all(simulation)
    return simulation, outcomes


def state(simulation):
    """Return all values that must agree to the bit, as (name, bytes)."""
    parts = [("time", np.float64(simulation.time)), ("positions", simulation.positions())]
    parts += [("velocities", simulation.velocities())]
    for rod in simulation.rods:
        parts += [
            (f"directors of {rod.name}", simulation.directors(rod)),
            (f"spins of {rod.name}", simulation.spins(rod)),
        ]
    parts += [("energy", np.array(list(vars(simulation.energy()).values())))]
    return [(name, np.asarray(values).tobytes()) for name, values in parts]


def read_all(simulation):
    for rod in simulation.rods:
        for readout in (simulation.curvatures, simulation.twists, simulation.tensions, simulation.link):
            assert np.isfinite(readout(rod)).all()
        simulation.get(rod, "natural_curvature")
    assert np.isfinite(simulation.momentum().angular).all()
    assert np.isfinite(simulation.linearise().stiffness).all()
    simulation.contacts(), str(simulation.plan), simulation.statistics
    for support in simulation._session.settings.supports:
        assert np.isfinite(simulation.reaction(support).force).all()


class DisagreementError(AssertionError):
    """Two simulations that must go the same way do not."""


def compare(lane, found, expected):
    for index, ((call, outcome, now), (_, should, then)) in enumerate(zip(found, expected, strict=True)):
        if outcome != should:
            raise DisagreementError(f"{lane}: call {index}, {call}: {outcome!r}, expected {should!r}")
        for (name, value), (_, other) in zip(now, then, strict=True):
            if value != other:
                apart = (
                    np.abs(np.frombuffer(value) - np.frombuffer(other)).max() if len(value) == len(other) else "shape"
                )
                raise DisagreementError(f"{lane}: after call {index}, {call} ({outcome}): {name} apart by {apart}")


def sequence(number, counted, folder):
    scene, options = draw_scene(number)
    counted[options["integrator"]] += 1
    try:
        simulation = scene.build(**options)
    except ALLOWED as error:
        counted[f"not built: {type(error).__name__}"] += 1
        return
    was_planar = simulation.plan.planar
    simulation, outcomes = go(simulation, number, 4)
    counted["lifted out of the plane"] += was_planar and not simulation.plan.planar
    for _, outcome, _ in outcomes:
        counted[outcome.partition(":")[0]] += 1

    simulation.reset()
    simulation, found = go(simulation, number + 1, 3)
    _, expected = go(scene.build(**options), number + 1, 3)
    compare("reset", found, expected)

    snapshot = simulation.snapshot()
    file = snapshot.save(folder / "sequence.npz")
    lanes = {"copy": simulation.copy(), "copy, read between calls": simulation.copy()}
    lanes["pickle"] = pickle.loads(pickle.dumps(simulation))
    lanes["built and restored"] = scene.build(**options)
    lanes["built and restored"].restore(snapshot)
    lanes["gone elsewhere and restored"], _ = go(simulation.copy(), number + 2, 2)
    lanes["gone elsewhere and restored"].restore(snapshot)
    lanes["restored from a file"] = simulation.copy()
    lanes["restored from a file"].step(0)
    lanes["restored from a file"].restore(withe.Snapshot.load(file))
    _, expected = go(simulation, number + 3, 3)
    untouched, _ = go(scene.build(**options), number + 1, 3)
    compare("no snapshot taken", go(untouched, number + 3, 3)[1], expected)
    for lane, other in lanes.items():
        _, found = go(other, number + 3, 3, read="read" in lane)
        compare(lane, found, expected)
    counted["sequences that agree"] += 1


def attempt(number):
    """Run a sequence, and return its counts and its failure."""
    faulthandler.enable()
    warnings.simplefilter("ignore")
    print(f"sequence {number}", file=sys.stderr, flush=True)  # after a crash, its sequence is among the last lines
    counted: collections.Counter[str] = collections.Counter()
    try:
        with tempfile.TemporaryDirectory() as folder:
            sequence(number, counted, Path(folder))
    except (Exception, KeyboardInterrupt) as error:
        return counted, f"{type(error).__name__}: {error}\n{traceback.format_exc()}"
    return counted, None


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("count", type=int)
    options.add_argument("seed", type=int)
    options.add_argument("sequence", type=int, nargs="?", help="only this one")
    options.add_argument("--jobs", type=int, default=1, help="processes")
    given = options.parse_args()
    drawn = [random.Random(f"{given.seed} {i}").randrange(10**9) for i in range(given.count)]
    numbers = drawn if given.sequence is None else [given.sequence]
    counted: collections.Counter[str] = collections.Counter()
    failed = 0
    with contextlib.ExitStack() as stack:
        apply = map
        if given.jobs > 1:
            workers = ProcessPoolExecutor(given.jobs, multiprocessing.get_context("spawn"))
            apply = stack.enter_context(workers).map
        for number, (found, failure) in zip(numbers, apply(attempt, numbers), strict=True):
            counted += found
            if failure is not None:
                failed += 1
                print(f"sequence {number} of seed {given.seed}: {failure}", flush=True)
    print(f"{len(numbers)} sequences, {failed} failed: " + ", ".join(f"{n} {w}" for w, n in counted.most_common()))
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
