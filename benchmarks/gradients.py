"""Cost of gradients: of an equilibrium relative to its Newton iterations, and of a run relative to the run.

python benchmarks/gradients.py [--quick]
"""

from __future__ import annotations

import resource

import numpy as np
from reporting import Report, arguments, once

import withe

NODES = 100
TIME_STEP = 2e-3  # [s]
STEPS, QUICK_STEPS = 10_000, 200
FRAMES = 10
RATIO_GOAL, MEMORY_GOAL, ITERATIONS_GOAL = 2.5, 64.0, 2.0  # [-], [MB], [-]


def _scene(integrator: str) -> tuple[withe.Simulation, withe.Rod]:
    """A clamped arm in space, drawn along a helix."""
    turn = np.linspace(0.0, 3.0, NODES)
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0, viscosity=50.0)
    points = 0.1 * np.column_stack([np.cos(turn), np.sin(turn), 0.5 * turn])
    arm = scene.add_rod(points=points, radius=6e-3, material=rubber, name="arm")
    scene.clamp(arm.start)
    return scene.build(integrator=integrator, time_step=TIME_STEP, adaptive=False), arm


def _peak() -> float:
    """Most memory that this process has held so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _equilibria(report: Report, repeats: int) -> None:
    simulation, arm = _scene("static")
    weight = np.zeros((NODES, 3))
    weight[-1, 2] = 1.0
    wrt = [(arm, "youngs_modulus"), (arm, "natural_curvature")]
    found = simulation.equilibrium()
    iterations: list[int] = []

    def solve(modulus: float) -> None:
        simulation.set(arm, youngs_modulus=modulus)
        nonlocal found
        found = simulation.equilibrium()
        iterations.append(found.iterations)

    newton, gradient = [], []
    for k in range(repeats):
        modulus = 1e6 * (1.0 + 0.1 * (k % 2))
        newton.append(once(lambda m=modulus: solve(m)) / iterations[-1])
        gradient.append(once(lambda: found.gradient(weight, wrt)))
    ratio = float(np.median(gradient) / np.median(newton))
    rows = [
        ("a Newton iteration", f"{1e6 * np.median(newton):.0f}"),
        ("a gradient", f"{1e6 * np.median(gradient):.0f}"),
    ]
    report.table(f"Microseconds for an equilibrium of {NODES} nodes in space", ("what", "time"), rows)
    report.goal("gradient of an equilibrium over a Newton iteration", ratio, ITERATIONS_GOAL, at_least=False)


def _run(report: Report, integrator: str, steps: int, repeats: int) -> tuple[str, ...]:
    """The row of a table: medians of runs that take turns."""
    simulation, arm = _scene(integrator)
    start = simulation.snapshot()
    duration = steps * TIME_STEP
    weight = np.zeros((FRAMES + 1, NODES, 3))
    weight[-1, -1, 2] = 1.0
    records: list[withe.Record] = []

    def run(differentiable: bool) -> None:
        simulation.restore(start)
        records[:] = [
            simulation.run(duration, record_every=duration / FRAMES, progress=False, differentiable=differentiable)
        ]

    def differentiate() -> None:
        wrt = [(arm, "youngs_modulus"), (arm, "natural_curvature"), "initial_positions", "initial_velocities"]
        records[0].gradient({"positions": weight}, wrt)

    plain = [once(lambda: run(False))]
    before = _peak()
    kept, back = [once(lambda: run(True))], [once(differentiate)]
    memory = _peak() - before
    for _ in range(repeats - 1):
        plain.append(once(lambda: run(False)))
        kept.append(once(lambda: run(True)))
        back.append(once(differentiate))
    times = tuple(float(np.median(each)) for each in (plain, kept, back))
    ratio = (times[1] + times[2]) / times[0]
    report.goal(f"run and gradient over a run, {integrator}", ratio, RATIO_GOAL, at_least=False)
    report.goal(f"MB above a plain run, {integrator}", memory, MEMORY_GOAL, at_least=False)
    return (integrator, *(f"{time:.2f}" for time in times), f"{ratio:.2f}", f"{memory:.0f}")


def main() -> None:
    """Measure both, report."""
    options = arguments(__doc__)
    report = Report("gradients", quick=options.quick)
    _equilibria(report, 3 if options.quick else 200)
    steps = QUICK_STEPS if options.quick else STEPS
    integrators = ("backward_euler", "implicit_midpoint", "energy_momentum")
    columns = ("integrator", "run [s]", "kept for gradients [s]", "gradient [s]", "both over the run", "memory [MB]")
    rows = [_run(report, integrator, steps, 1 if options.quick else 5) for integrator in integrators]
    report.table(f"{steps} steps of {NODES} nodes in space, by every number at once", columns, rows)
    report.write()


if __name__ == "__main__":
    main()
