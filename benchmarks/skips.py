"""Saving of each skip of the plan: the same scene by the general path and by the path that the engine chooses.

    python benchmarks/skips.py [--quick]

Every row runs both in turns, checks that they find the same answer, and gives the time of a step by each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from reporting import Report, arguments, bar, interleaved, once

import withe

SAME = 1e-9  # relative to the length


@dataclass(frozen=True)
class Skip:
    """One row: two simulations that must agree.

    Attributes
    ----------
    what, without
        What the scene has not, and what the engine does without.
    general, skipped
        Make a simulation that takes the general path, and one that skips.
    """

    what: str
    without: str
    general: Callable[[], withe.Simulation]
    skipped: Callable[[], withe.Simulation]


def _arm(scene: withe.Scene, nodes: int, *, out_of_plane: float = 0.0, **options: object) -> withe.Rod:
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0, **options)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.4, out_of_plane, 0), nodes=nodes, radius=5e-3, material=rubber)
    scene.clamp(arm.start)
    return arm


def _simulation(
    nodes: int,
    prepare: Callable[[withe.Scene, withe.Rod], object] | None = None,
    *,
    in_space: bool = True,
    linear_solver: str = "automatic",
    **options: object,
) -> withe.Simulation:
    """Return an arm that falls under its weight. Unless it is planar, a transverse load moves it out of the plane."""
    scene = withe.Scene()
    arm = _arm(scene, nodes)
    if in_space:
        scene.add_force(arm.end, (0.0, 0.02, 0.0))
    if prepare is not None:
        prepare(scene, arm)
    solver = withe.Solver(step_tolerance=1e-12, linear_solver=linear_solver)
    return scene.build(time_step=2e-3, solver=solver, **options)


def _nothing_more(scene: withe.Scene, arm: withe.Rod) -> None:
    """Add terms without effect: a drag, loads and a custom force of zero."""
    scene.add_drag(1e-30)
    for node in range(1, 10):
        scene.add_force(arm.node(node), (0, 0, 0))
    scene.add_custom_force(lambda time, positions, velocities: np.zeros_like(positions))


def _follower(scene: withe.Scene, arm: withe.Rod) -> None:
    scene.add_force(arm.end, (0, 0, 0), follower=True)


def _nothing_to_touch(scene: withe.Scene, arm: withe.Rod) -> None:
    scene.enable_contact()


def _floor(scene: withe.Scene, arm: withe.Rod, friction: float = 0.0) -> None:
    """Reached by the arm within the run."""
    scene.add_floor(height=-0.01, friction=friction)


def _rough_floor(scene: withe.Scene, arm: withe.Rod) -> None:
    _floor(scene, arm, friction=1e-12)


def _uneven_floor(scene: withe.Scene, arm: withe.Rod) -> None:
    scene.add_floor(height=-0.01, friction=lambda points: np.full(len(points), 0.3))


def _even_floor(scene: withe.Scene, arm: withe.Rod) -> None:
    _floor(scene, arm, friction=0.3)


def _hand(scene: withe.Scene, arm: withe.Rod) -> None:
    """Add a hand that is so soft that it exerts no force."""
    scene.grasp(arm, 0.3, 0.02, stiffness=(1e-15, 1e-15))


def _ring(scene: withe.Scene, arm: withe.Rod) -> None:
    scene.grasp(arm, 0.3, slides=True, stiffness=1e-15)


def _thin_fluid(scene: withe.Scene, arm: withe.Rod) -> None:
    scene.add_fluid(1e-30, model="resistive")


def _moving(simulation: withe.Simulation) -> withe.Simulation:
    """A boundary that moves to where it is, for longer than the run."""
    simulation.move(simulation.rods[0].start, position=(0, 0, 0), over=1e3)
    return simulation


def _actuated(simulation: withe.Simulation) -> withe.Simulation:
    simulation.set(simulation.rods[0], natural_curvature=(0.0, 0.0), over=1e3)
    return simulation


def skips(nodes: int) -> list[Skip]:
    """Return the rows of the table "What is skipped", as far as this version has the general path."""
    return [
        Skip(
            "anything out of a plane",
            "third coordinate, theta",
            lambda: _simulation(nodes, in_space=False, planar=False),
            lambda: _simulation(nodes, in_space=False),
        ),
        Skip(
            "joints, loops",
            "sparse solver",
            lambda: _simulation(nodes, linear_solver="sparse"),
            lambda: _simulation(nodes),
        ),
        Skip(
            "follower loads",
            "unsymmetric solver",
            lambda: _simulation(nodes, _follower),
            lambda: _simulation(nodes),
        ),
        Skip(
            "unsymmetric terms but with a band",
            "sparse LU",
            lambda: _simulation(nodes, _follower, linear_solver="sparse"),
            lambda: _simulation(nodes, _follower),
        ),
        Skip(
            "drag, loads, custom forces",
            "their terms",
            lambda: _simulation(nodes, _nothing_more),
            lambda: _simulation(nodes),
        ),
        Skip(
            "contact",
            "broad phase, candidates",
            lambda: _simulation(nodes, _nothing_to_touch),
            lambda: _simulation(nodes),
        ),
        Skip(
            "contact but with a floor",
            "sparse solver",
            lambda: _simulation(nodes, _floor, linear_solver="sparse"),
            lambda: _simulation(nodes, _floor),
        ),
        Skip(
            # Midpoint steps without friction press along the direction at the end, which keeps them symmetric.
            "friction, on a floor, by backward Euler",
            "unsymmetric solver, slip",
            lambda: _simulation(nodes, _rough_floor, integrator="backward_euler"),
            lambda: _simulation(nodes, _floor, integrator="backward_euler"),
        ),
        Skip(
            "friction that varies over a floor",
            "a look at where nodes are",
            lambda: _simulation(nodes, _uneven_floor),
            lambda: _simulation(nodes, _even_floor),
        ),
        Skip("a fluid", "its terms", lambda: _simulation(nodes, _thin_fluid), lambda: _simulation(nodes)),
        Skip("hands", "their terms", lambda: _simulation(nodes, _hand), lambda: _simulation(nodes)),
        Skip("rings", "their terms", lambda: _simulation(nodes, _ring), lambda: _simulation(nodes)),
        Skip("moving boundaries", "their terms", lambda: _moving(_simulation(nodes)), lambda: _simulation(nodes)),
        Skip("actuation", "its terms", lambda: _actuated(_simulation(nodes)), lambda: _simulation(nodes)),
    ]


def _difference(skip: Skip, steps: int) -> float:
    shapes = []
    for make in (skip.general, skip.skipped):
        simulation = make()
        simulation.step(steps)
        shapes.append(simulation.positions())
    return float(np.linalg.norm(shapes[0] - shapes[1], axis=1).max()) / 0.4


def _recording(nodes: int, steps: int, rounds: int) -> tuple[float, float]:
    """Seconds of a step with a frame after each, and without frames."""

    def run(every: float) -> Callable[[], float]:
        def once_more() -> float:
            simulation = _simulation(nodes)
            duration = steps * simulation.time_step
            return once(lambda: simulation.run(duration, record_every=every or duration, progress=False))

        return once_more

    timings = interleaved({"all": run(2e-3), "none": run(0.0)}, rounds)
    return timings["all"].median / steps, timings["none"].median / steps


def main() -> None:
    """Run both paths of every row, and report."""
    quick = arguments(__doc__).quick
    steps, rounds, sizes = (10, 1, (31,)) if quick else (200, 7, (51, 201))
    report = Report("skips", quick=quick)
    with bar(len(sizes) * (len(skips(2)) + 1), "skips", "rows") as shown:
        for nodes in sizes:
            rows = []
            for skip in skips(nodes):
                apart = _difference(skip, steps)

                def timed(make: Callable[[], withe.Simulation]) -> Callable[[], float]:
                    def run() -> float:
                        simulation = make()
                        simulation.step(2)
                        return once(lambda: simulation.step(steps)) / steps

                    return run

                timings = interleaved({"general": timed(skip.general), "skipped": timed(skip.skipped)}, rounds)
                general, skipped = timings["general"], timings["skipped"]
                rows.append(
                    (
                        skip.what,
                        skip.without,
                        f"{1e6 * general.median:.0f}",
                        f"{1e6 * skipped.median:.0f}",
                        f"{100 * (1 - skipped.median / general.median):.0f} %",
                        f"{100 * max(general.spread, skipped.spread):.0f} %",
                        f"{apart:.0e}",
                    )
                )
                report.goal(f"{nodes} nodes, without {skip.what}: apart by", apart, SAME, at_least=False)
                shown.advance(1)
            with_frames, without = _recording(nodes, steps, rounds)
            saved = f"{100 * (1 - without / with_frames):.0f} %"
            rows.append(
                ("recording", "copies", f"{1e6 * with_frames:.0f}", f"{1e6 * without:.0f}", saved, "-", "0e+00")
            )
            shown.advance(1)
            header = ("a scene without", "does without", "general [us]", "skipped [us]", "saved", "spread", "apart")
            report.table(f"A step of an arm of {nodes} nodes", header, rows)
    report.write()


if __name__ == "__main__":
    main()
