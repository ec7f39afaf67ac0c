"""Values set while a simulation runs go with copies, snapshots, pickles and files, and `reset` takes them back."""

import copy
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import withe
from simple_scenes import RUBBER, same_state


@dataclass(frozen=True)
class Kind:
    """A kind of part: one of it in a scene of two rods, and numbers that are set; further reads by name."""

    add: Callable[[withe.Scene], Any]
    numbers: dict[str, Any]
    reads: tuple[str, ...] = ()


KINDS = {
    "rod": Kind(lambda scene: scene["b"], {"youngs_modulus": 2e6, "density": 1100.0, "natural_curvature": (0.0, 2.0)}),
    "spring": Kind(
        lambda scene: scene.add_spring("a.end", "b.end", stiffness=20.0, rest_length=0.05),
        {"stiffness": 35.0, "rest_length": 0.08, "damping": 0.1},
        ("spring_tension",),
    ),
    "revolute joint": Kind(
        lambda scene: scene.join("a.start", "b.start", "revolute", axis=(0, 1, 0), stiffness=0.02, rest_angle=0.4),
        {"stiffness": 0.05, "rest_angle": 0.8, "damping": 2e-4, "moment": -2e-3},
        ("joint_angle", "joint_rate", "joint_torque"),
    ),
    "tendon": Kind(
        lambda scene: scene.add_tendon(scene["a"], offset=(3e-3, 0), tension=0.5), {"tension": 0.9}, ("tendon_length",)
    ),
    "force": Kind(lambda scene: scene.add_force("b.end", (0.01, 0, 0)), {"force": (0.0, 0.02, 0.0)}),
    "moment": Kind(lambda scene: scene.add_moment("b.end", (0, 1e-4, 0)), {"moment": (0.0, -2e-4, 0.0)}),
    "floor": Kind(lambda scene: scene.add_floor(-0.012, friction=0.2), {"friction": 0.4}),
    "ring": Kind(lambda scene: scene.grasp("b", 0.1, slides=True, friction=0.1), {"friction": 0.3}),
    "mass": Kind(lambda scene: scene.add_mass("b.end", 2e-3), {"mass": 5e-3}),
    "drag": Kind(lambda scene: scene.add_drag(0.05), {"drag": 0.2}),
    "fluid": Kind(lambda scene: scene.add_fluid(1.0), {"viscosity": 3.0}),
}


def build(kind: Kind) -> tuple[withe.Simulation, str]:
    """The simulation, and the name of the part."""
    scene = withe.Scene()
    for name, end in (("a", (0.2, 0, 0)), ("b", (0.1, 0.15, 0.05))):
        scene.add_rod(start=(0, 0, 0), end=end, nodes=6, radius=5e-3, material=RUBBER, name=name)
    if kind is not KINDS["revolute joint"]:
        scene.join("a.start", "b.start")
    scene.clamp("a.end")
    part = kind.add(scene)
    return scene.build(time_step=2e-3), part.name


def state_of(simulation: withe.Simulation, part: str, kind: Kind) -> list[object]:
    return [simulation.get(part, word) for word in kind.numbers] + [
        getattr(simulation, word)(part) for word in kind.reads
    ]


@pytest.mark.parametrize("name", KINDS)
def test_copies_snapshots_pickles_and_reset_carry_what_was_set(name, tmp_path):
    kind = KINDS[name]
    simulation, part = build(kind)
    drawn, _ = build(kind)
    simulation.step(5)
    before = [simulation.get(part, word) for word in kind.numbers]
    simulation.set(part, **kind.numbers)
    for word, value, old in zip(kind.numbers, kind.numbers.values(), before, strict=True):
        assert not np.array_equal(np.broadcast_to(value, np.shape(old)), old), f"{word} has that value already"
        np.testing.assert_array_equal(np.broadcast_to(value, np.shape(old)), simulation.get(part, word))
    kept = simulation.snapshot()
    others = [simulation.copy(), copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))]
    for snapshot in (kept, withe.Snapshot.load(kept.save(tmp_path / "kept.npz"))):
        others.append(build(kind)[0])
        others[-1].restore(snapshot)
    simulation.step(10)
    for other in others:
        other.step(10)
        assert same_state(other, simulation)
        for mine, its in zip(state_of(simulation, part, kind), state_of(other, part, kind), strict=True):
            np.testing.assert_array_equal(its, mine)
    simulation.reset()
    for word, old in zip(kind.numbers, before, strict=True):
        np.testing.assert_array_equal(simulation.get(part, word), old)
    for each in (simulation, drawn):
        each.step(7)
    assert same_state(simulation, drawn)
