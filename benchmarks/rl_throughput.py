"""Control steps a second of environments for reinforcement learning, Python included, beside PyElastica and MuJoCo.

The arm of [arXiv 2511.06667] under seeded actions: free in space and in a plane, among obstacles in a plane and in
space; 1, 16 and 500 environments on up to two threads. Accuracy: the tip against a converged run of the same model.

python benchmarks/rl_throughput.py [--quick]
"""

from __future__ import annotations

import warnings

import numpy as np
import rl_arms
from reporting import HAVE_ELASTICA, HAVE_MUJOCO, OUT, Report, Timing, arguments, bar

import withe
from withe.learning.arms import Arm, Obstacles2D, Obstacles3D

WORKERS = 2
KINDS: dict[str, tuple[type[Arm], float]] = {  # and control steps a second to reach
    "free": (rl_arms.FreeArm, 30_000),
    "planar, free": (rl_arms.PlanarArm, 60_000),
    "planar, obstacles": (Obstacles2D, 3_000),
    "obstacles": (Obstacles3D, 1_500),
}
COUNTS = (1, 16, 500)
PUBLISHED, LIMIT = 2e-4, 4e-4  # steps of PyElastica [s]
MUJOCO_STEP, MUJOCO_COUNT = 2.5e-3, 64  # the longest step of MuJoCo within 1 cm [s], its arms side by side


def accuracy(report: Report, quick: bool) -> None:
    """Errors of tips, where two runs in short steps agree, and how deep the arm sinks into obstacles."""
    seeds, count = (1, 3) if quick else (9, rl_arms.ACTIONS)
    rows = []
    for name, (kind, _) in KINDS.items():
        touches = name.endswith("obstacles")
        asked = [seed for seed in range(seeds) if not touches or rl_arms.references_agree(kind, seed, count)]
        errors = [rl_arms.tip_error(kind, seed, count) for seed in asked]
        error = float(np.median(errors)) if errors else np.nan
        radius = 0.03 if kind is Obstacles3D else 0.05
        sunk = max(rl_arms.penetration(kind, seed, radius, count) for seed in range(seeds)) if touches else None
        rows.append(
            (name, f"{1e3 * error:.1f}", f"{len(asked)} of {seeds}", "" if sunk is None else f"{100 * sunk:.1f} %")
        )
        report.figures[f"{name}: errors of the tip [m]"] = errors
        report.goal(f"{name}: error of the tip [mm], median over seeds", 1e3 * error, 10, at_least=False)
        if sunk is not None:
            report.goal(f"{name}: penetration over the smaller radius", sunk, 0.05, at_least=False)
    header = ("arm", "[mm]", "seeds", "penetration")
    report.table(f"Tip against a converged run, RMS over {count} actions", header, rows)


def throughput(report: Report, quick: bool, shown: object) -> dict[tuple[str, int], Timing]:
    """Control steps a second; three times each, turn and turn about."""
    found: dict[tuple[str, int], list[float]] = {}
    for _ in range(1 if quick else 3):
        for name, (kind, _goal) in KINDS.items():
            for count in (1, 2) if quick else COUNTS:
                steps = 2 if quick else max(10, 400 // count if name.startswith("free") else 100 // count)
                rate = rl_arms.control_steps(kind, count, min(count, WORKERS), steps)
                found.setdefault((name, count), []).append(rate)
            shown.advance(1)  # type: ignore[attr-defined]
    timings = {key: Timing(tuple(rates)) for key, rates in found.items()}
    report.table(
        f"Control steps a second, {WORKERS} threads",
        ("arm", "environments", "a second", "spread"),
        [(name, str(n), f"{t.median:,.0f}", f"{100 * t.spread:.0f} %") for (name, n), t in timings.items()],
    )
    report.figures["control steps a second"] = {f"{name}, {n}": t.as_json() for (name, n), t in timings.items()}
    most = max(count for _, count in timings)
    if not quick:
        pairs = [[rl_arms.control_steps(rl_arms.FreeArm, most, n, 4) for n in (1, WORKERS)] for _ in range(3)]
        gain = float(np.median([many / one for one, many in pairs]))
        report.figures[f"free arm, {most}: control steps a second, one thread and {WORKERS}"] = pairs
        report.goal(f"free: {WORKERS} threads over one, {most} environments", gain, 0.9 * WORKERS)
    for name, (_, goal) in KINDS.items():
        report.goal(f"{name}: control steps a second, {most} environments", timings[name, most].median, goal)
    return timings


def share_of_solving(report: Report, quick: bool) -> None:
    """Measure the parts of a single environment's step apart from assembly and solve."""
    import time

    env = withe.learning.Environment(rl_arms.FreeArm())
    env.reset(seed=0)
    actions = rl_arms.actions_of(0, 10, 5 if quick else 400)
    before, start = env.simulation.statistics, time.perf_counter()
    for action in actions:
        env.step(action)
    whole, after = time.perf_counter() - start, env.simulation.statistics
    solving = after.assembly_time - before.assembly_time + after.solve_time - before.solve_time
    engine = after.total_time - before.total_time
    report.table(
        "A control step of one environment [us]",
        ("assembly and solve", "rest of the engine", "Python"),
        [tuple(f"{1e6 * t / len(actions):.0f}" for t in (solving, engine - solving, whole - engine))],
    )
    report.figures["one environment [s]"] = {"assembly and solve": solving, "engine": engine, "all": whole}
    report.goal("share of a step that is neither assembly nor solve", 1.0 - solving / whole, 0.15, at_least=False)


def peers(report: Report, quick: bool, ours: dict[tuple[str, int], Timing]) -> None:
    """PyElastica: one process, and as many as threads."""
    if not HAVE_ELASTICA or quick:
        for steps in (PUBLISHED, LIMIT):
            report.goal(f"times PyElastica's at {steps:g} s, one environment", None, 120 if steps == PUBLISHED else 60)
        return
    import rl_peers

    actions = rl_arms.actions_of(0, 10, 12)
    rows = []
    for step in (PUBLISHED, LIMIT):
        error = rl_peers.converged_error(step, 0.25 * PUBLISHED, rl_arms.actions_of(0, 10))
        alone = Timing(tuple(rl_peers.steps_a_second(step, actions) for _ in range(3)))
        many = Timing(tuple(rl_peers.many_steps_a_second(step, actions, WORKERS) for _ in range(3)))
        rows.append((f"{step:g}", f"{alone.median:.1f}", f"{many.median:.1f}", f"{1e3 * error:.2f}"))
        report.figures[f"PyElastica, {step:g} s"] = {"one": alone.as_json(), "processes": many.as_json()}
        single, most = ours["free", 1].median / alone.median, ours["free", max(COUNTS)].median / many.median
        times = 1.0 if step == PUBLISHED else 0.5
        report.goal(f"times PyElastica's at {step:g} s, one environment", single, 120 * times)
        report.goal(f"times PyElastica's at {step:g} s, {max(COUNTS)} environments", most, 200 * times)
    report.table(
        "PyElastica's free arm, control steps a second",
        ("step [s]", "one process", f"{WORKERS} processes", "error of the tip [mm]"),
        rows,
    )


def mujoco(report: Report, quick: bool) -> None:
    """MuJoCo: one arm, and a batch on as many threads; turn and turn about with ours."""
    goals = {1: None, MUJOCO_COUNT: 20.0}
    names = {count: f"times MuJoCo's at {MUJOCO_STEP:g} s, {count} environments" for count in goals}
    if not HAVE_MUJOCO or quick:
        report.goal(names[MUJOCO_COUNT], None, goals[MUJOCO_COUNT])
        return
    import rl_mujoco
    import rl_peers

    bends = 2.0 * np.tan(0.5 * rl_peers.bends_of(rl_arms.actions_of(0, 10)))
    error = rl_mujoco.converged_error(MUJOCO_STEP, 2e-4, bends)
    apart = rl_mujoco.tips_of(2e-4, bends, updates=100) - rl_arms.converged_tips(rl_arms.FreeArm, 0)
    rows = []
    for count in goals:
        threads = min(count, WORKERS)
        pairs = [
            (
                rl_mujoco.steps_a_second(MUJOCO_STEP, bends[:12], count, threads),
                rl_arms.control_steps(rl_arms.FreeArm, count, threads, 400 // count + 10),
            )
            for _ in range(3)
        ]
        theirs, ours = (Timing(tuple(rates)) for rates in zip(*pairs, strict=True))
        rows.append((str(count), f"{theirs.median:,.0f}", f"{ours.median:,.0f}"))
        report.figures[f"MuJoCo, {count}"] = {"theirs": theirs.as_json(), "ours": ours.as_json()}
        times = float(np.median([b / a for a, b in pairs]))
        report.figures[names[count]] = times
        if goals[count] is not None:
            report.goal(names[count], times, goals[count])
    distance = float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))
    report.table(
        f"MuJoCo's free arm in steps of {MUJOCO_STEP:g} s: error of its tip {1e3 * error:.1f} mm; in short steps "
        f"{1e3 * distance:.1f} mm from ours",
        ("environments", "MuJoCo, control steps a second", "withe"),
        rows,
    )


def agreement(report: Report, quick: bool) -> None:
    """The free arm in PyElastica and in withe: how far tips are apart, at rest and in motion."""
    if not HAVE_ELASTICA or quick:
        report.goal("tips of PyElastica and withe apart in motion [mm]", None, 10, at_least=False)
        return
    import rl_peers

    turns = rl_peers.bends_of(np.repeat(rl_arms.actions_of(0, 10, 1), 8, axis=0))[-1]
    chain = rl_peers.chain_tip(turns)
    rows = []
    for words, gravity, shear in (("no weight", 0.0, 1.0), ("weight", 9.81, 1.0), ("weight", 9.81, 10.0)):
        theirs = rl_peers.settled_tip(turns, gravity, shear, 1e-4 if shear == 1.0 else 5e-5)
        ours = rl_arms.settled_tip(turns, gravity)
        closed = "" if gravity else f"{1e3 * max(np.linalg.norm(tip - chain) for tip in (theirs, ours)):.1g}"
        rows.append((f"at rest, {words}", f"{shear:g}", f"{1e3 * np.linalg.norm(theirs - ours):.2g}", closed))
    actions, ours = rl_arms.actions_of(0, 10), rl_arms.converged_tips(rl_arms.FreeArm, 0)
    for shear in (1.0, 10.0):
        theirs = rl_peers.tips_of(rl_peers.ElasticaArm(1e-4 if shear == 1.0 else 5e-5, shear=shear), actions)
        apart = float(np.sqrt(np.mean(np.sum((theirs - ours) ** 2, axis=1))))
        rows.append((f"{len(actions)} actions", f"{shear:g}", f"{1e3 * apart:.2g}", ""))
        if shear == 1.0:
            report.goal("tips of PyElastica and withe apart in motion [mm]", 1e3 * apart, 10, at_least=False)
    report.table(
        "Tips of PyElastica and withe, both in short steps",
        ("arm", "its stiffness in shear", "apart [mm]", "from a chain's closed form [mm]"),
        rows,
    )


def draw(timings: dict[tuple[str, int], Timing]) -> None:
    """Control steps a second over the number of environments, out/benchmarks/rl_throughput.png."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
    for (name, (_, goal)), color in zip(KINDS.items(), ("#00798c", "#66a182", "#edae49", "#d1495b"), strict=True):
        counts = [count for other, count in timings if other == name]
        axes.loglog(counts, [timings[name, count].median for count in counts], "o-", color=color, label=name)
        axes.axhline(goal, color=color, linewidth=0.8, linestyle=":")
    axes.set(xlabel="environments", ylabel="control steps a second", title=f"{WORKERS} threads; dotted: goals")
    axes.set_xticks(sorted({count for _, count in timings}), [f"{n}" for n in sorted({n for _, n in timings})])
    axes.minorticks_off()
    axes.legend(frameon=False)
    axes.grid(color="#dddddd", linewidth=0.5)
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "rl_throughput.png", dpi=150)
    plt.close(figure)


def main() -> None:
    """All of it."""
    quick = arguments(__doc__).quick
    warnings.simplefilter("ignore", withe.CoarseStepWarning)
    report = Report("rl_throughput", quick=quick)
    with bar(7 if quick else 15, "rl_throughput", "parts") as shown:
        accuracy(report, quick)
        shown.advance(1)
        timings = throughput(report, quick, shown)
        share_of_solving(report, quick)
        shown.advance(1)
        agreement(report, quick)
        peers(report, quick, timings)
        mujoco(report, quick)
        shown.advance(1)
    draw(timings)
    report.write()


if __name__ == "__main__":
    main()
