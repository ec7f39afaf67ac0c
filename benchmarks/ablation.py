"""Saving of each heuristic of Newton's method: it is switched off alone, over groups of scenes.

    python benchmarks/ablation.py [--quick] [--groups impacts knots] [--heuristics reuse_across_steps]

The benchmark counts evaluations of the residual and factorisations, which do not depend on other processes. The cost of
a run is their weighted sum. One factorisation with its matrix counts as `FACTORISATION` evaluations with the following
solve. Ratios are geometric means over the scenes of a group that end both with and without the heuristic. A heuristic
is worth its code if the cost grows by 5 % without it, or if scenes are lost. A scene is lost if a step fails, or if its
cost exceeds `MOST` times the cost with all heuristics.
"""

from __future__ import annotations

import math
import signal
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import contact
import contact_cases
import friction_precision
import numpy as np
import rods_in_motion
import stress_cases
from reporting import Report, arguments, bar
from work_precision import Point

import withe
from withe import _core
from withe.parts.options import BuildOptions

HEURISTICS: tuple[str, ...] = _core.Options.heuristics
FACTORISATION = 3.0
MOST = 5.0
# Scenes whose cost times nodes is greater with everything on are left out: the rest shows the same in a tenth of the
# time.
LARGEST = {"knots": 2e7, "tightening, piles": 2e7, "violent motion": 3e5, "equilibria": 3e5}
WORTH = 1.05
GUARD = 4.0  # [s]


@dataclass
class Run:
    """Counts of one scene. `lost` is the reason if its run did not end."""

    iterations: int = 0
    evaluations: int = 0
    factorizations: int = 0
    seconds: float = 0.0
    lost: str = ""

    @property
    def cost(self) -> float:
        """In evaluations."""
        return self.evaluations + FACTORISATION * self.factorizations


# --- scenes ----------------------------------------------------------------------------------------------------

Scene = Callable[[], Iterator[withe.Simulation]]  # yields the simulation after each of its steps


def _impact(number: int, steps: int) -> Scene:
    def run() -> Iterator[withe.Simulation]:
        simulation = contact_cases.build(contact_cases.draw_case(number))
        for _ in range(steps):
            simulation.step()
            yield simulation

    return run


def _violent(number: int) -> Scene:
    def run() -> Iterator[withe.Simulation]:
        case = stress_cases.draw_case(number)
        simulation = stress_cases.build(case)
        for i in range(case.steps):
            if i in (0, case.steps // 2):
                stress_cases.events(case, simulation, int(i > 0))
            simulation.step()
            yield simulation

    return run


def _equilibrium(number: int) -> Scene:
    def run() -> Iterator[withe.Simulation]:
        case = stress_cases.draw_case(number, ("static",))
        simulation = stress_cases.build(case)
        for moment in (0, 1):
            stress_cases.events(case, simulation, moment)
            simulation.equilibrium()
            yield simulation

    return run


def _rod(name: str, method: str, edges: int, coarseness: float) -> Scene:
    def run() -> Iterator[withe.Simulation]:
        case = rods_in_motion.CASES[name]
        simulation = rods_in_motion.simulation(case, edges, integrator=method, time_step=coarseness * case.time_step)
        for _ in range(40):
            simulation.step(5)
            yield simulation

    return run


def _block(method: str, edges: int, step: float, force: float) -> Scene:
    def run() -> Iterator[withe.Simulation]:
        simulation, push = friction_precision.resting(Point("friction", method, edges, step))
        simulation.set(push, load=(force / friction_precision.LENGTH, 0.0, 0.0))
        for _ in range(rods_in_motion.steps_of(friction_precision.DURATION, step)):
            simulation.step()
            yield simulation

    return run


def _pushed_back() -> withe.Simulation:
    """A rod on a floor, its end pushed to one side: friction over a slip of 1e-8 m turns round within a step."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1000.0)
    rod = scene.add_rod(start=(0, 0, 5e-3), end=(1, 0, 5e-3), nodes=31, radius=5e-3, material=rubber)
    scene.add_floor(friction=0.4)
    scene.enable_contact(friction_model="lagged", slip_tolerance=1e-5)
    scene.add_force(rod.end, lambda t: (0.0, 0.3 if t < 0.02 else -0.3, 0.0))
    return scene.build(integrator="backward_euler", time_step=1e-3)


def _belt(law: withe.parts.FrictionModel) -> withe.Simulation:
    """A rod on a floor that has begun to move, and takes it along."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, poisson_ratio=0.5, density=1200.0)
    scene.add_rod(start=(0, 0, 5e-3), end=(0.3, 0, 5e-3), nodes=21, radius=5e-3, material=rubber)
    floor = scene.add_floor(friction=0.4)
    scene.enable_contact(friction_model=law)
    simulation = scene.build(integrator="backward_euler", time_step=1e-3)
    simulation.step(200)
    simulation.move(floor, path=lambda t: (0.5 * (t - 0.2), 0.0, 0.0))
    return simulation


def _stepped(build: Callable[[], withe.Simulation], steps: int) -> Scene:
    def run() -> Iterator[withe.Simulation]:
        simulation = build()
        for _ in range(steps):
            simulation.step()
            yield simulation

    return run


def groups(quick: bool) -> dict[str, list[Scene]]:
    """Scenes by group."""
    impacts = [n for n in range(100) if contact_cases.draw_case(n).kind != "knot"]
    dynamic = [n for n in range(100) if stress_cases.draw_case(n).method != "static"]
    loops = [
        _stepped(lambda f=f, law=law: contact.knot(f, law), 40)
        for f, law in ((0.0, "lagged"), (0.1, "lagged"), (0.1, "implicit"))
    ]
    found = {
        "impacts": [_impact(n, contact_cases.STEPS) for n in impacts],
        "knots": [_impact(n, 12) for n in (4, 9, 14, 19)],
        "tightening, piles": [*loops, _stepped(lambda: contact.pile(20), 40)],
        "violent motion": [_violent(n) for n in dynamic],
        "equilibria": [_equilibrium(n) for n in range(60)],
        "beams, helices": [
            _rod(name, method, edges, coarseness)
            for name, edges in (("beam a", 24), ("beam b", 24), ("helix a", 40), ("helix b", 40))
            for method in ("implicit_midpoint", "fourth_order", "energy_momentum", "backward_euler")
            for coarseness in (0.25, 1.0, 4.0)
        ],
        "friction": [
            _block(method, edges, step, force)
            for method in friction_precision.METHODS
            for edges in (3, 10)
            for step in (0.05, 0.015)
            for force in (3.0, 5.0)
        ]
        + [_stepped(_pushed_back, 100), *(_stepped(lambda law=law: _belt(law), 200) for law in contact_cases.LAWS)],
    }
    return {name: scenes[:1] for name, scenes in found.items()} if quick else found


# --- runs ------------------------------------------------------------------------------------------------------


@contextmanager
def without(heuristic: str) -> Iterator[None]:
    """Build simulations without a heuristic while the body runs. Without a name nothing changes."""
    made = BuildOptions.engine

    def engine(options: BuildOptions) -> _core.Options:
        result = made(options)
        if heuristic:
            result.switch_off(heuristic)
        return result

    BuildOptions.engine = engine
    try:
        yield
    finally:
        BuildOptions.engine = made


@contextmanager
def _guarded() -> Iterator[None]:
    """Stop a run that stays in one step for too long."""

    def ring(*_: object) -> None:
        raise TimeoutError(f"not done after {GUARD:g} s")

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, GUARD)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def measure(scene: Scene, heuristic: str = "", *, most: float = math.inf, work: float = math.inf) -> Run:
    """Counts of a scene without a heuristic, up to a cost, or a cost times nodes."""
    run, start = Run(), time.thread_time()
    now = None
    with without(heuristic), _guarded():
        try:
            for now in scene():
                run = replace(run, **_counts(now))
                if run.cost > min(most, work / len(now.positions())):
                    run.lost = "cost"
                    break
            if now is None or not np.isfinite(now.positions()).all():
                run.lost = "not finite"
        except (withe.ConvergenceError, TimeoutError) as error:
            run.lost = str(error)
    run.seconds = time.thread_time() - start
    return run


def _counts(simulation: withe.Simulation) -> dict[str, int]:
    s = simulation.statistics
    return {"iterations": s.iterations, "evaluations": s.evaluations, "factorizations": s.factorizations}


def compare(whole: list[Run], lacking: list[Run]) -> dict[str, float]:
    """Geometric means of ratios, lacking over whole, and how many scenes are lost."""
    pairs = [(a, b) for a, b in zip(whole, lacking, strict=True) if not b.lost and a.cost > 0]

    def ratio(of: Callable[[Run], float]) -> float:
        return math.exp(np.mean([math.log(max(of(b), 1.0) / max(of(a), 1.0)) for a, b in pairs])) if pairs else 1.0

    return {
        "cost": ratio(lambda r: r.cost),
        "iterations": ratio(lambda r: r.iterations),
        "factorizations": ratio(lambda r: r.factorizations),
        "time": sum(b.seconds for _, b in pairs) / max(sum(a.seconds for a, _ in pairs), 1e-9),
        "lost": len(lacking) - sum(not b.lost for b in lacking),
    }


def main() -> None:
    """Measure, and report."""
    options = arguments(
        __doc__,
        ("--groups", {"nargs": "*", "help": "of these names only"}),
        ("--heuristics", {"nargs": "*", "choices": HEURISTICS, "help": "these only"}),
    )
    warnings.simplefilter("ignore", withe.CoarseStepWarning)
    report = Report("ablation", quick=options.quick)
    names = options.heuristics or (HEURISTICS[:1] if options.quick else HEURISTICS)
    chosen = {g: s for g, s in groups(options.quick).items() if not options.groups or g in options.groups}
    found: dict[str, dict[str, dict[str, float]]] = {name: {} for name in names}
    rows = []
    with bar(len(chosen) * (1 + len(names)), "ablation", "groups") as shown:
        for group, scenes in chosen.items():
            runs = [measure(scene, work=LARGEST.get(group, 1e6)) for scene in scenes]
            kept = [(scene, run) for scene, run in zip(scenes, runs, strict=True) if not run.lost]
            whole = [run for _, run in kept]
            rows.append((group, len(scenes), len(kept), *(sum(getattr(r, f) for r in whole) for f in _FIELDS)))
            shown.advance(1)
            for name in names:
                lacking = [measure(scene, name, most=MOST * run.cost) for scene, run in kept]
                found[name][group] = compare(whole, lacking)
                shown.advance(1)
    report.table(
        "Everything on", ("group", "scenes", "ended", *_FIELDS[:3], "s"), [(*r[:-1], f"{r[-1]:.2f}") for r in rows]
    )
    report.table(
        "Cost without, over with (iterations, factorisations; scenes lost)",
        ("without", *chosen),
        [(name, *(_cell(found[name][group]) for group in chosen)) for name in names],
    )
    report.figures["ratios"] = found
    for name in names:
        gain = max(max(ratios["cost"], 1.0 + 0.1 * ratios["lost"]) for ratios in found[name].values())
        report.goal(f"{name}: greatest cost without it", gain, WORTH)
    report.write()


_FIELDS = ("iterations", "evaluations", "factorizations", "seconds")


def _cell(ratios: dict[str, float]) -> str:
    lost = f"; {ratios['lost']:.0f} lost" if ratios["lost"] else ""
    return f"{ratios['cost']:.3f} ({ratios['iterations']:.2f}, {ratios['factorizations']:.2f}{lost})"


if __name__ == "__main__":
    main()
