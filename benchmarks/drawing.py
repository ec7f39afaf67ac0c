"""Cost of pictures and films: a frame of a film, the first picture of a process, and the redraw after a slider moved.

python benchmarks/drawing.py [--quick]

The scene is the gripper of README.md above a floor. A frame costs processor time of rendering and of ffmpeg; the time
that a film takes before its first frame is left out. The first picture is timed on the wall, from the call in a new
process to the written file, imports and the test of the graphics library included; the fastest run counts. A redraw is
`move` of a view with sliders in memory: equilibrium, new surfaces and shadow, and a render of 640 x 480 pixels.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from reporting import OUT, Report, Timing, arguments, bar, interleaved

import withe

SIZES = ((640, 480), (1280, 720))  # [px]
FRAME_GOALS = {  # [s of processor a frame]
    ("draft", SIZES[0]): 0.06,
    ("high", SIZES[0]): 0.12,
    ("draft", SIZES[1]): 0.15,
    ("high", SIZES[1]): 0.28,
}
QUICK_FRAMES = (("draft", SIZES[0]),)
FIRST_GOAL = 2.0  # [s]
REDRAW_GOAL = 1.0 / 30.0  # [s]
MOVES, MOVES_QUICK = 20, 3  # of a slider, in a round
FPS, FPS_QUICK, DURATION = 30.0, 8.0, 0.5  # pictures per second of film; simulated time [s]
SHORT, LONG, LONG_QUICK = 1.0, 0.25, 0.7  # speeds of the two films whose difference is measured


def build() -> withe.Simulation:
    """The gripper of README.md above a floor, before it closes."""
    scene = withe.Scene()
    silicone = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1200.0, viscosity=2e3)
    arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.2), nodes=31, radius=8e-3, material=silicone, name="arm")
    scene.clamp(arm.start)
    for x, y in ((1, 0), (-0.5, 0.866), (-0.5, -0.866)):
        tip = (0.06 * x, 0.06 * y, -0.3)
        finger = scene.add_rod(start=(0, 0, -0.2), end=tip, nodes=21, radius=5e-3, material=silicone, normal=(x, y, 0))
        scene.join(arm.end, finger.start)
    scene.add_floor(-0.35)
    return scene.build(time_step=5e-3)


def gripper() -> withe.Record:
    """The gripper, which closes."""
    simulation = build()
    for finger in simulation.rods[1:]:
        simulation.set(finger, natural_curvature=(-8.0, 0.0), over=0.5)
    return simulation.run(duration=DURATION, record_every=0.02, progress=False)


def processor_time() -> float:
    """Processor time of this process and of the processes that it waited for [s]."""
    import resource

    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    )


def frame_cost(
    record: withe.Record, quality: str, size: tuple[int, int], folder: Path, slow: float = LONG, fps: float = FPS
) -> float:
    """Processor time of a frame [s]: the difference of a long and a short film, over that of their frames."""
    spent, frames = [], []
    for speed in (SHORT, slow):
        before = processor_time()
        film = folder / "film.mp4"
        record.animate(film, quality=quality, size=size, speed=speed, fps=fps, progress=False)
        spent.append(processor_time() - before)
        frames.append(int(np.floor(DURATION * fps / speed + 1e-9)) + 1)
    return (spent[1] - spent[0]) / (frames[1] - frames[0])


def first_picture(size: tuple[int, int] = SIZES[0]) -> tuple[float, float]:
    """Time of the first picture of a new process: on the wall and of processors [s]."""
    done = subprocess.run(
        [sys.executable, __file__, "--first-picture", *map(str, size)], capture_output=True, text=True, check=True
    )
    wall, processor = json.loads(done.stdout)
    return wall, processor


def draw_first(size: tuple[int, int]) -> None:
    """Draw one picture, and print how long it took, as JSON."""
    record = gripper()
    with tempfile.TemporaryDirectory() as folder:
        before, begun = processor_time(), time.perf_counter()
        record.picture(Path(folder) / "first.png", size=size)
        print(json.dumps([time.perf_counter() - begun, processor_time() - before]))


def films(report: Report, rounds: int) -> list[tuple[str, float, float]]:
    """Measure frames of films. Return name, cost and goal of each kind."""
    record = gripper()
    goals_of = FRAME_GOALS if rounds > 1 else {kind: FRAME_GOALS[kind] for kind in QUICK_FRAMES}
    with tempfile.TemporaryDirectory() as folder, bar(rounds * len(goals_of), "films", "films") as shown:
        frame_cost(record, "draft", (64, 48), Path(folder), LONG_QUICK, FPS_QUICK)  # imports

        def costs(quality: str, size: tuple[int, int]) -> Callable[[], float]:
            length = (LONG, FPS) if rounds > 1 else (LONG_QUICK, FPS_QUICK)
            return lambda: frame_cost(record, quality, size, Path(folder), *length)

        actions = {f"{quality}, {size[0]} x {size[1]}": costs(quality, size) for quality, size in goals_of}
        timings = interleaved(actions, rounds, lambda: shown.advance(1))
    goals = dict(zip(actions, goals_of.values(), strict=True))
    report.table(
        "Frame of a film [ms of processor]",
        ("quality, size [px]", "a frame"),
        [(name, f"{1e3 * one.median:.0f} +- {100 * one.spread:.0f} %") for name, one in timings.items()],
    )
    report.figures["frames"] = {name: one.as_json() for name, one in timings.items()}
    for name, one in timings.items():
        report.goal(f"frame, {name} [s of processor]", one.median, goals[name], at_least=False)
    return [(f"frame, {name}", one.median, goals[name]) for name, one in timings.items()]


def pictures(report: Report, rounds: int) -> list[tuple[str, float, float]]:
    """Measure the first picture of a process. Return its name, cost and goal."""
    with bar(rounds, "first picture", "processes") as shown:
        walls, processors = [], []
        for _ in range(rounds):
            wall, processor = first_picture()
            walls.append(wall)
            processors.append(processor)
            shown.advance(1)
    report.table(
        "First picture of a process, 640 x 480 [s]",
        ("time", "fastest", "median"),
        [
            (name, f"{min(values):.2f}", f"{np.median(values):.2f}")
            for name, values in (("on the wall", walls), ("of processors", processors))
        ],
    )
    report.figures["first picture"] = {
        "wall": Timing(tuple(walls)).as_json() | {"fastest": min(walls)},
        "processor": Timing(tuple(processors)).as_json() | {"fastest": min(processors)},
    }
    report.goal("first picture, fastest [s]", min(walls), FIRST_GOAL, at_least=False)
    return [("first picture", min(walls), FIRST_GOAL)]


def redraws(report: Report, rounds: int) -> list[tuple[str, float, float]]:
    """Measure the redraw after a slider moved, and the part of the equilibrium. Return its name, cost and goal."""
    import pyvista

    pyvista.OFF_SCREEN = True
    simulation = build()
    finger = simulation.rods[1]
    view = simulation.view(sliders=[(finger, "natural_curvature", (-10.0, 0.0))], size=SIZES[0])
    values = np.linspace(-9.0, -1.0, MOVES if rounds > 1 else MOVES_QUICK)

    def move(redraw: bool) -> float:
        before = processor_time()
        for value in values:
            if redraw:
                view.move(1, float(value))
            else:
                simulation.set(finger, natural_curvature=(0.0, float(value)))
                simulation.equilibrium()
        return (processor_time() - before) / len(values)

    try:
        view.image()
        move(True)  # compiles shaders, and finds out that smooth edges are too slow without a graphics card
        timings = interleaved({"redraw": lambda: move(True), "equilibrium alone": lambda: move(False)}, rounds)
    finally:
        view.close()
    report.table(
        "Redraw after a slider moved, 640 x 480 [ms of processor]",
        ("part", "a move"),
        [(name, f"{1e3 * one.median:.1f} +- {100 * one.spread:.0f} %") for name, one in timings.items()],
    )
    report.figures["redraws"] = {name: one.as_json() for name, one in timings.items()}
    report.goal("redraw of a slider [s of processor]", timings["redraw"].median, REDRAW_GOAL, at_least=False)
    return [("redraw of a slider", timings["redraw"].median, REDRAW_GOAL)]


# Kinds of drawing: each takes the report and the number of rounds, writes its table and goals, and returns rows of
# the plot.
PARTS: tuple[Callable[[Report, int], list[tuple[str, float, float]]], ...] = (films, pictures, redraws)


def draw(rows: list[tuple[str, float, float]], path: Path) -> None:
    """Bars of each cost over its goal."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names, costs, goals = zip(*rows, strict=True)
    shares = np.array(costs) / np.array(goals)
    figure, axes = plt.subplots(figsize=(7.0, 0.8 + 0.42 * len(rows)), layout="constrained")
    axes.barh(names, shares, color=["#00798c" if share <= 1.0 else "#d1495b" for share in shares], height=0.6)
    for row, (share, cost) in enumerate(zip(shares, costs, strict=True)):
        axes.text(share + 0.01, row, f"{cost:.3g} s", va="center", fontsize=9)
    axes.axvline(1.0, color="#33383d", linewidth=1.0)
    axes.set(xlabel="cost over goal", xlim=(0.0, 1.15 * max(1.0, shares.max())))
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def main() -> None:
    """Measure all parts, report, and draw."""
    options = arguments(__doc__, ("--first-picture", {"nargs": 2, "type": int, "help": "draw one picture, in pixels"}))
    if options.first_picture:
        draw_first(tuple(options.first_picture))
        return
    report = Report("drawing", quick=options.quick)
    rows = [row for part in PARTS for row in part(report, 1 if options.quick else 5)]
    path = report.write()
    draw(rows, OUT / "drawing.png")
    print(f"  drawn to {path.with_suffix('.png')}")


if __name__ == "__main__":
    main()
