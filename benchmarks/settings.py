"""Cost of setting a parameter of a rod of 1,000 nodes that touches a floor and itself, with the Python call.

python benchmarks/settings.py [--quick]
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from reporting import Report, arguments, interleaved, once

import withe

NODES = 1000
CALLS = 100
GOAL = 20.0  # [us]


def _simulation() -> withe.Simulation:
    """Return a helix that stands on the floor, clamped at one end."""
    turn = np.linspace(0.0, 3.0, NODES)
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    points = np.column_stack([np.cos(turn), np.sin(turn), 0.006 + turn / 15.0])
    rod = scene.add_rod(points=points, radius=5e-3, material=rubber, name="arm")
    scene.clamp(rod.start)
    scene.add_floor(friction=0.3, name="floor")
    scene.enable_contact(friction=0.2)
    simulation = scene.build(time_step=1e-3)
    simulation.step(3)
    return simulation


def _settings(simulation: withe.Simulation) -> dict[str, Callable[[int], object]]:
    """Return functions that set another value each time, by their names."""
    random = np.random.default_rng(1)
    curvatures, moduli = random.normal(size=(7, NODES - 2, 2)), 1e6 * (1.0 + random.random((7, NODES - 1)))
    arm = "arm"
    return {
        "youngs_modulus": lambda i: simulation.set(arm, youngs_modulus=1e6 + i % 7),
        "natural_curvature": lambda i: simulation.set(arm, natural_curvature=curvatures[i % 7]),
        "youngs_modulus, one an edge": lambda i: simulation.set(arm, youngs_modulus=moduli[i % 7]),
        "natural_curvature, one for all": lambda i: simulation.set(arm, natural_curvature=(0.0, 1.0 + i % 7)),
        "gravity": lambda i: simulation.set(gravity=(0.0, 0.0, -9.0 - i % 7)),
        "friction of the floor": lambda i: simulation.set("floor", friction=0.3 + 0.01 * (i % 7)),
        "youngs_modulus, as it is": lambda _: simulation.set(arm, youngs_modulus=1e6),
    }


def main() -> None:
    """Set each of them in turns, report."""
    options = arguments(__doc__)
    simulation = _simulation()
    before = simulation.statistics.factorizations

    def calls(act: Callable[[int], object]) -> Callable[[], float]:
        def several() -> None:
            for i in range(CALLS):
                act(i)

        return lambda: once(several)

    actions = {name: calls(act) for name, act in _settings(simulation).items()}
    timings = interleaved(actions, 5 if options.quick else 50)
    report = Report("settings", quick=options.quick)
    taken = {name: 1e6 * timing.median / CALLS for name, timing in timings.items()}
    rows = [(name, f"{taken[name]:.1f} +- {100 * timings[name].spread:.0f} %") for name in taken]
    report.table(f"Microseconds to set it, {NODES} nodes", ("what", "a call"), rows)
    report.figures["seconds"] = {name: timing.as_json() for name, timing in timings.items()}
    for name in ("youngs_modulus", "natural_curvature"):
        report.goal(f"us to set {name}", taken[name], GOAL, at_least=False)
    report.goal("factorisations", simulation.statistics.factorizations - before, 0, at_least=False)
    report.write()


if __name__ == "__main__":
    main()
