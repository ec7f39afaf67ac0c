"""Small scenes that several tests share."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator

import numpy as np

import withe

RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0)


def cantilever(nodes: int = 11, **build):
    """A clamped rod of 0.2 m, level at the start: scene, rod, simulation."""
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start, name="wall")
    return scene, arm, scene.build(**build)


def weightless(nodes: int = 21, **build):
    """The same without gravity, and a finer mesh: scene, rod, simulation."""
    scene = withe.Scene(gravity=(0, 0, 0))
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=nodes, radius=5e-3, material=RUBBER, name="arm")
    scene.clamp(arm.start, name="wall")
    return scene, arm, scene.build(**build)


def tripod(**build):
    """Three rods at one joint, two of them clamped, out of any plane, with a tip load: scene, rods, simulation."""
    scene = withe.Scene()
    ends = [(0.1, 0, 0), (-0.05, 0.1, 0), (-0.05, -0.05, -0.08)]
    rods = [
        scene.add_rod(start=(0, 0, 0), end=end, nodes=8, radius=4e-3, material=RUBBER, name=f"limb {i}")
        for i, end in enumerate(ends)
    ]
    for rod in rods[1:]:
        scene.join(rods[0].start, rod.start)
    for rod in rods[:2]:
        scene.clamp(rod.end)
    scene.add_force(rods[2].end, (0.01, 0.02, 0.0), name="pull")
    return scene, rods, scene.build(**build)


def same_state(a: withe.Simulation, b: withe.Simulation) -> bool:
    """True if two simulations agree in every bit that can be read."""
    if a.time != b.time or a.snapshot() != b.snapshot():
        return False
    reads = [a.positions, b.positions], [a.velocities, b.velocities]
    return all(np.array_equal(x(), y()) for x, y in reads) and a.energy() == b.energy()


def steps_elsewhere(simulation: withe.Simulation) -> bool:
    """True if another thread steps the simulation, which is not to be read then."""
    try:
        simulation.positions()
    except RuntimeError:
        return True
    return False


@contextlib.contextmanager
def ctrl_c_once(ready: Callable[[], bool]) -> Iterator[None]:
    """Press Ctrl-C from another thread within the block, as soon as `ready()` is true."""

    def press() -> None:
        while not ready():
            left.wait(1e-3)
            if left.is_set():
                return
        os.kill(os.getpid(), signal.SIGINT)

    left = threading.Event()
    thread = threading.Thread(target=press)
    thread.start()
    try:
        yield
    finally:
        left.set()
        thread.join()
