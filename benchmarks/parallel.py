"""Simulations side by side, one scene on two threads, the time to build, and an explicit step beside PyElastica's.

python benchmarks/parallel.py [--quick]
"""

from __future__ import annotations

import time

import numpy as np
from contact import pile
from reporting import HAVE_ELASTICA, Report, Timing, arguments, bar, interleaved
from rods_in_motion import CASES, simulation

import withe


def _many(workers: int, count: int, duration: float) -> tuple[float, list[np.ndarray]]:
    """Seconds on the wall for equal simulations, and where they end."""
    case = CASES["helix a"]
    all_of_them = [simulation(case, case.edges, time_step=5e-3) for _ in range(count)]
    start = time.perf_counter()
    records = withe.run_many(all_of_them, duration, workers=workers, progress=False)
    return time.perf_counter() - start, [record.positions() for record in records]


def run_many(report: Report, quick: bool) -> None:
    """Eight equal simulations of 5 s on one thread and on two."""
    count, duration, rounds = (4, 0.1, 1) if quick else (8, 5.0, 5)
    alone, ends = _many(1, count, duration)
    _, ends_of_two = _many(2, count, duration)
    same = all(np.array_equal(a, b) for a, b in zip(ends, ends_of_two, strict=True))
    timings = interleaved({str(n): lambda n=n: _many(n, count, duration)[0] for n in (1, 2)}, rounds)
    one, two = timings["1"], timings["2"]
    report.table(
        f"{count} simulations of {duration:g} s (helix, 100 nodes, 3D)",
        ("threads", "wall [s]", "spread"),
        [(n, f"{t.median:.3f}", f"{100 * t.spread:.0f} %") for n, t in (("1", one), ("2", two))],
    )
    report.figures["run_many"] = {"first": alone, "one": one.as_json(), "two": two.as_json(), "equal to the bit": same}
    report.goal("run_many, times faster on 2 threads", one.median / two.median, 1.8)
    report.goal("run_many, results that differ from one thread's", 0.0 if same else 1.0, 0, at_least=False)


def _net(cords: int, threads: int) -> withe.Simulation:
    """A square net of cords, pinned at each crossing, that hangs from its border."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e7, poisson_ratio=0.5, density=1000.0)
    length, nodes = 0.05 * (cords + 1), 4 * (cords + 1) + 1
    lines = 0.05 * np.arange(1, cords + 1)
    along = [
        scene.add_rod(start=(0, y, 0), end=(length, y, 0), nodes=nodes, radius=1e-3, material=rubber) for y in lines
    ]
    across = [
        scene.add_rod(start=(x, 0, 0), end=(x, length, 0), nodes=nodes, radius=1e-3, material=rubber) for x in lines
    ]
    for i, a in enumerate(along):
        for j, b in enumerate(across):
            scene.join(a.node(4 * (j + 1)), b.node(4 * (i + 1)), kind="pinned")
    for cord in (*along, *across):
        scene.pin(cord.start)
        scene.pin(cord.end)
    return scene.build(integrator="backward_euler", threads=threads)


def one_scene(report: Report, quick: bool) -> None:
    """Steps of large scenes on one thread and on two."""
    cords, rods, steps, rounds = (6, 20, 1, 1) if quick else (40, 1000, 4, 5)
    makers = {
        f"net of {cords} cords a side": lambda threads: _net(cords, threads),
        f"pile of {rods:,} rods": lambda threads: pile(rods, threads),
    }
    rows = []
    for name, make in makers.items():
        simulations = {str(threads): make(threads) for threads in (1, 2)}

        def stepped(threads: str, simulations: dict[str, withe.Simulation] = simulations) -> float:
            start = time.perf_counter()
            simulations[threads].step(steps)
            return (time.perf_counter() - start) / steps

        for threads in simulations:
            stepped(threads)
        timings = interleaved({threads: lambda threads=threads: stepped(threads) for threads in simulations}, rounds)
        one, two = timings["1"], timings["2"]
        same = np.array_equal(simulations["1"].positions(), simulations["2"].positions())
        ratio = one.median / two.median
        unknowns = simulations["1"].plan.unknowns
        rows.append((name, f"{unknowns:,}", f"{1e3 * one.median:.1f}", f"{1e3 * two.median:.1f}", f"{ratio:.2f}"))
        report.figures[name] = {"one": one.as_json(), "two": two.as_json(), "equal to the bit": same}
        report.goal(f"{name}, times faster on 2 threads", None if quick else ratio, 1.6)
        report.goal(f"{name}, results that differ from one thread's", 0.0 if same else 1.0, 0, at_least=False)
    report.table(
        "A step of one scene, on one thread and on two (time on the wall)",
        ("scene", "unknowns", "one thread [ms]", "two threads [ms]", "times faster"),
        rows,
    )


def _hundred_rods() -> withe.Scene:
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    for i in range(100):
        x, y = 0.1 * (i % 10), 0.1 * (i // 10)
        rod = scene.add_rod(start=(x, y, 0), end=(x + 0.03, y, -0.3), nodes=21, radius=3e-3, material=rubber)
        scene.clamp(rod.start)
    return scene


def start_up(report: Report, quick: bool) -> None:
    """From a scene to a simulation."""
    scene = _hundred_rods()
    seconds = []
    for _ in range(2 if quick else 21):
        start = time.perf_counter()
        scene.build()
        seconds.append(time.perf_counter() - start)
    timing = Timing(tuple(seconds))
    report.table(
        "Build of 100 clamped rods of 21 nodes",
        ("milliseconds", "spread"),
        [(f"{1e3 * timing.median:.1f}", f"{100 * timing.spread:.0f} %")],
    )
    report.figures["build"] = timing.as_json()
    report.goal("build of 100 rods [ms]", 1e3 * timing.median, 50, at_least=False)


def _our_step(case_name: str, planar: bool, steps: int) -> float:
    case = CASES[case_name]
    options = {"planar": planar} if case.kind == "beam" else {}
    stable = simulation(case, 200, integrator="verlet", time_step=1e-9, **options).plan.stable_step
    ours = simulation(case, 200, integrator="verlet", time_step=0.8 * stable, **options)
    ours.step(20)
    start = time.thread_time()
    ours.step(steps)
    return (time.thread_time() - start) / steps


def explicit_step(report: Report, quick: bool) -> None:
    """A Verlet step at 201 nodes, in space and in the plane, beside PyElastica's of the same rod."""
    steps = 20 if quick else 2000
    actions = {
        "ours, 3D beam": lambda: _our_step("beam a", False, steps),
        "ours, 3D helix": lambda: _our_step("helix a", False, steps),
        "ours, planar beam": lambda: _our_step("beam a", True, steps),
    }
    if HAVE_ELASTICA and not quick:
        from elastica_rods import ElasticaRun

        for name in ("beam a", "helix a"):
            step = 0.2 * CASES[name].elastica_step
            run = ElasticaRun(CASES[name], 200, 1e6 * step, step, moved_wall=False)
            run.step(100)
            actions[f"PyElastica, {name[:-2]}"] = lambda run=run: run.time_per_step(0.15)
    timings = interleaved(actions, 1 if quick else 9)
    report.table(
        "An explicit step at 201 nodes",
        ("", "us", "spread"),
        [(name, f"{1e6 * t.median:.1f}", f"{100 * t.spread:.0f} %") for name, t in timings.items()],
    )
    report.figures["explicit step"] = {name: timing.as_json() for name, timing in timings.items()}
    for ours, theirs in (("3D beam", "beam"), ("3D helix", "helix"), ("planar beam", "beam")):
        other = timings.get(f"PyElastica, {theirs}")
        ratio = other.median / timings[f"ours, {ours}"].median if other else None
        report.goal(f"Verlet step, {ours}: times faster than PyElastica's", ratio, 4)


def main() -> None:
    """All four."""
    quick = arguments(__doc__).quick
    report = Report("parallel", quick=quick)
    with bar(4, "parallel", "parts") as shown:
        for part in (run_many, one_scene, start_up, explicit_step):
            part(report, quick)
            shown.advance(1)
    report.write()


if __name__ == "__main__":
    main()
