"""Paper that is folded: how exact and fast equilibria and plans are, and what friction every fold needs at least.

python benchmarks/folding.py [--quick]

Draws the manifold of sheets that are held without moment, the ridge that has to be crossed, and plans across it.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import folding_network
import numpy as np
from folding_network import processor_seconds
from reporting import OUT, Report, arguments, bar
from scipy import ndimage

from withe import folding
from withe.folding import free_moment, grid, moment_free
from withe.folding.free_moment import Holding
from withe.folding.sheets import Elastica, take

CASES = {  # paper, target, bound of curvature of a free moment [1/Lgb]
    "A4 half": (folding.Paper.a4(), "half", 2.5),
    "US half": (folding.Paper.us_letter(), "half", 2.5),
    "US .20": (folding.Paper.us_letter(), 0.20, 2.5),
    "cardboard half": (folding.Paper.cardboard(), "half", 4.0),
    "cardboard .20": (folding.Paper.cardboard(), 0.20, 6.5),
}
KNOWN = {  # from independent searches: without moment, with a free moment
    "A4 half": (0.220, 0.0),
    "US half": (0.306, 0.0),
    "US .20": (None, 0.275),
    "cardboard half": (1.2, 0.66),
    "cardboard .20": (None, 0.56),
}
FRICTION = 0.12
POINT = folding.Jaw(depth=0.0, finger=0.0)  # jaw of the known values without moment
COLOURS = {"ucs": "#ffffff", "slip, free moment": "#f4a261", "intuitive": "#e63946"}


def holding_of(paper: folding.Paper, curvature: float, jaw: folding.Jaw | None = None) -> Holding:
    """A sheet whose Lgb is known, and by default the jaw that plans have."""
    jaw, lgb = jaw or folding.Jaw(), paper.gravito_bending_length
    sizes = (jaw.depth / lgb, jaw.finger / lgb, paper.thickness / lgb)
    return Holding((paper.length - jaw.depth) / lgb, *sizes, curvature, 0.0)


def scattered(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions of which most are on the manifold."""
    random = np.random.default_rng(7)
    return random.uniform(0.0, grid.WIDE, count), random.uniform(0.0, grid.HIGH, count)


def equilibria(report: Report, quick: bool) -> None:
    """Solve at scattered points. Check time, and the first integral, which the solver does not use."""
    x, z = scattered(2_000 if quick else 100_000)
    folding.elastica(1.0, 1.0)  # makes the table
    found: list[Elastica] = []
    seconds = processor_seconds(lambda: found.append(folding.elastica(x, z)), 1 if quick else 3)
    pose = take(found[-1], found[-1].valid)
    left = (pose.suspended - pose.normal_force) * np.sin(pose.angle)
    off = left - pose.z + pose.tangential_force * (1.0 - np.cos(pose.angle))
    report.table(
        "Equilibria at scattered positions",
        ("positions", "on the manifold", "processor s", "us each", "first integral off, most"),
        [(len(x), len(pose.x), f"{seconds:.2f}", f"{1e6 * seconds / len(x):.0f}", f"{np.abs(off).max():.1e}")],
    )
    report.goal("first integral, most off [w Lgb^2]", float(np.abs(off).max()), 1e-8, at_least=False)
    if not quick:
        report.goal("100,000 positions on 2 cores [s]", seconds / 2, 3.0, at_least=False)


def speed(report: Report, quick: bool) -> None:
    """Plans of A4 in half."""
    paper, repeats = folding.Paper.a4(), 1 if quick else 7
    folding.plan(paper)  # makes the grid
    held = folding.plan(paper)
    free = folding.plan(paper, method="slip", grasp="free")

    def slip() -> None:
        free_moment.make_lattice.cache_clear()
        folding.plan(paper, method="slip", grasp="free")

    def slide() -> None:
        moment_free._needed_slides.cache_clear()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            folding.plan(paper, method="slip")

    calls = {
        "plan ucs": (lambda: folding.plan(paper), 0.05),
        "plan slip, free moment": (slip, 1.0),
        "plan slip, no moment": (slide, 1.0),
        "plan local": (lambda: folding.plan(paper, method="local"), None),
        "replan ucs": (lambda: folding.replan(held, held.poses[100], 0.004), 0.02),
        "replan slip, free moment": (lambda: folding.replan(free, free.poses[100], 0.001), 0.02),
    }
    rows = []
    for name, (call, target) in calls.items():
        if quick and name == "plan slip, no moment":
            continue
        took = processor_seconds(call, repeats if (target or 0) < 1 else min(repeats, 3))
        rows.append((name, f"{1e3 * took:.1f}"))
        if target is not None and not quick:
            report.goal(f"{name} [s]", took, target, at_least=False)
    report.table("Plans of A4 in half, processor time", ("", "ms"), rows)


def needed(pose: Elastica, length: float) -> np.ndarray:
    """Friction that a sheet of some length needs at poses, not to slide."""
    return np.abs(pose.tangential_force) / (pose.normal_force + length - pose.suspended)


def bottleneck(
    paper: folding.Paper, target: float | str, spacing: float, jaw: folding.Jaw | None = None
) -> tuple[float, Elastica] | None:
    """Least greatest ratio from flat to a goal without moment, and the pose where it is; None where no path is.

    Over lifted length and angle, the latter from that of sheets without tangential force on: poses are smooth in these.
    """
    hold, lgb = holding_of(paper, 1.0, jaw), paper.gravito_bending_length
    x = (paper.length if target == "half" else target) / lgb
    goal = moment_free.goal_pose(folding.elastica, x, hold.thickness, hold.depth, hold.finger)
    if goal is None or goal.suspended[0] >= hold.length:
        return None
    raised = grid.lift()
    lengths = np.linspace(0.3, hold.length - 1e-6, int(hold.length / spacing))
    angles = np.arange(-40, int(4.5 / spacing)) * spacing
    length, angle = np.meshgrid(lengths, angles, indexing="ij")
    pose = folding.elastica(length=length, angle=np.interp(length, raised.suspended, raised.angle) + angle)
    ratio = np.where(pose.valid, np.where(angle == 0, 0.0, needed(pose, hold.length)), np.inf)
    flat = np.where(lengths < raised.suspended[-1])[0]  # their ratio is 0
    away = np.abs(pose.suspended - goal.suspended) + np.abs(pose.angle - goal.angle)
    near = np.unravel_index(np.nanargmin(np.where(np.isfinite(ratio), away, np.nan)), ratio.shape)

    def passable(bound: float) -> bool:
        parts, _ = ndimage.label(ratio <= bound, structure=np.ones((3, 3)))
        return bool(parts[near] and parts[near] in parts[flat, 40])

    low, high = float(needed(goal, hold.length)[0]), 100.0
    if not passable(high):
        return None
    low = max(low, float(ratio[near]))
    if passable(low):
        return low, goal
    while high - low > 1e-5 * high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if passable(middle) else (middle, high)
    parts, _ = ndimage.label(ratio <= low, structure=np.ones((3, 3)))
    sides = [ndimage.binary_dilation(parts == part, np.ones((3, 3))) for part in (parts[flat[-1], 40], parts[near])]
    top = np.unravel_index(np.argmin(np.where(sides[0] & sides[1], ratio, np.inf)), ratio.shape)
    return high, Elastica(**{name: np.array([value[top]]) for name, value in vars(pose).items()})


def free_ratio(paper: folding.Paper, target: float | str, curvature: float, fine: int) -> float | None:
    """The same of a jaw that turns the edge as it likes."""
    hold, lgb = holding_of(paper, curvature), paper.gravito_bending_length
    x = (paper.length if target == "half" else target) / lgb
    best = None
    for pulls in (False, True):
        lattice = free_moment.make_lattice(hold, pulls, np.inf, fine)
        goals = free_moment.goals(lattice, hold, x)
        goals = take(goals, hold.bearable(goals))
        way = free_moment.way_to(lattice, hold, goals, hold.ratio(goals), 0.0) if len(goals.x) else None
        if way is not None and (best is None or way.ratio < best):
            best = way.ratio
        if best == 0.0:
            break
    return best


def ridge(report: Report, quick: bool) -> dict[str, Elastica]:
    """Every case at two resolutions. Returns where the ridge is lowest."""
    cases = dict(list(CASES.items())[:1]) if quick else CASES
    rows, tops = [], {}
    with bar(len(cases), "ridge", "cases") as shown:
        for name, (paper, target, curvature) in cases.items():
            resolutions = (0.04, 0.02)[: 2 - quick]
            edge = [bottleneck(paper, target, spacing, POINT) for spacing in resolutions]
            held = [bottleneck(paper, target, spacing) for spacing in resolutions]
            free = [free_ratio(paper, target, curvature, fine) for fine in (1, 2)[: 2 - quick]]
            known_held, known_free = KNOWN[name]
            rows.append(
                (
                    name,
                    " ".join("none" if found is None else f"{found[0]:.4f}" for found in edge),
                    known_held or "",
                    " ".join("none" if found is None else f"{found[0]:.4f}" for found in held),
                    f"{curvature:g}",
                    " ".join("none" if found is None else f"{found:.4f}" for found in free),
                    known_free,
                )
            )
            if held[-1] is not None:
                tops[name] = held[-1][1]
            if not quick:
                if known_held is not None:
                    off = np.nan if edge[-1] is None else edge[-1][0] - known_held
                    report.goal(f"{name}: ridge without moment, off", abs(off), 0.01 * known_held, at_least=False)
                value = np.inf if free[-1] is None else free[-1]
                bound = FRICTION / 2 if known_free == 0.0 else known_free
                report.goal(f"{name}: least ratio with a free moment", value, bound, at_least=False)
            shown.advance(1)
    header = (
        "case",
        "no moment, held at its edge",
        "known",
        "held by the jaw",
        "curvature [1/Lgb]",
        "free moment",
        "known",
    )
    report.table("Friction that a fold needs at least, at two resolutions", header, rows)
    return tops


def draw(top: Elastica | None) -> None:
    """The manifold of A4 by the friction that it needs, and plans over it."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    paper = folding.Paper.a4()
    hold, lgb = holding_of(paper, 2.5), paper.gravito_bending_length
    x, z = np.meshgrid(np.linspace(0.02, 6.6, 330), np.linspace(0.02, 3.6, 180))
    pose = folding.elastica(x, z)
    there = pose.valid & (pose.suspended < hold.length)
    ratio = np.where(there, np.maximum(needed(replace_invalid(pose, there), hold.length), 0.011), np.nan)
    figure, axes = plt.subplots(figsize=(8.4, 4.3), layout="constrained")
    shown = axes.pcolormesh(x, z, ratio, norm=LogNorm(0.01, 2.0), cmap="viridis", rasterized=True)
    levels = axes.contour(x, z, ratio, levels=[FRICTION, 0.22], colors="#1b263b", linewidths=[1.4, 0.8])
    axes.clabel(levels, fmt={FRICTION: "0.12", 0.22: "0.22"}, fontsize=8)
    plans = {
        "ucs": folding.plan(paper),
        "slip, free moment": folding.plan(paper, method="slip", grasp="free"),
        "intuitive": folding.plan(paper, method="intuitive"),
    }
    for name, plan in plans.items():
        inner = poses_of_jaw(plan) / lgb
        style = ":" if name == "slip, free moment" else "-"
        axes.plot(inner[:, 0], inner[:, 1], style, color=COLOURS[name], linewidth=2.2, label=name)
    if top is not None:
        axes.plot(top.x, top.z, "^", color="#e9c46a", markeredgecolor="#1b263b", markersize=10, label="lowest pass")
    axes.set(
        xlabel="jaw's inner edge: x [Lgb]",
        ylabel="z [Lgb]",
        xlim=(0, 6.6),
        ylim=(0, 3.6),
        title="A4 held without moment: the friction that keeps it from sliding",
    )
    axes.set_aspect("equal")
    figure.colorbar(shown, ax=axes, label="slip ratio", shrink=0.85)
    axes.legend(loc="upper right", fontsize=8, facecolor="#415a77", labelcolor="white", framealpha=0.9)
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / "folding.png", dpi=150)
    plt.close(figure)


def replace_invalid(pose: Elastica, there: np.ndarray) -> Elastica:
    """Return the same with harmless numbers for invalid sheets."""
    return replace(
        pose,
        tangential_force=np.where(there, pose.tangential_force, 0.0),
        normal_force=np.where(there, pose.normal_force, 1.0),
        suspended=np.where(there, pose.suspended, 0.0),
    )


def poses_of_jaw(plan: folding.FoldPlan) -> np.ndarray:
    """Path of the jaw's inner edge in a plan [m]: x from its position in the flat sheet, z."""
    depth, angle = plan.jaw.depth, plan.angles
    x = plan.poses[:, 0] + depth * np.cos(angle) - depth
    return np.stack([x, plan.poses[:, 2] - depth * np.sin(angle)], axis=1)


def main() -> None:
    """Measure, list, draw."""
    options = arguments(__doc__)
    report = Report("folding", quick=options.quick)
    equilibria(report, options.quick)
    speed(report, options.quick)
    folding_network.compare(report, options.quick)
    tops = ridge(report, options.quick)
    if not options.quick:
        draw(tops.get("A4 half"))
    report.write()


if __name__ == "__main__":
    main()
