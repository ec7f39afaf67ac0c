"""Run time of withe, PyElastica and MuJoCo for the same error, scene by scene, each at its own best settings.

    python benchmarks/peers.py [--quick] [--scene "heavy cantilever"]

Scenes:

- a heavy cantilever at rest,
- a beam that swings,
- Michell's ring beyond its critical twist,
- an overhand knot that is pulled tight,
- a cable that is dropped on a floor and rests there,
- the arm of the learning tasks.

Each simulator runs over a grid of meshes, time steps and, for scenes at rest, damping and duration. The reference of
the cantilever is the elastica. The references of the beam, the ring, the knot and the cable are fine meshes of withe.
The arm of each simulator is compared with its own run in short steps. The clamp of PyElastica and MuJoCo is in the
middle of the first element (see `peer_rods.py`).

All runs are made once for their errors. Runs that could be the fastest at some error are then timed in turns, and the
table has medians. Time is processor time of one thread without the build. withe finds scenes at rest as equilibria, and
the knot also in time. PyElastica and MuJoCo find them in time, which their durations allow for.
"""

from __future__ import annotations

import importlib.util
import math
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from peer_knots import ElasticaKnot, Knot, MujocoKnot, shortening, withe_knot
from peer_rods import (
    ElasticaRing,
    ElasticaRod,
    FloatArray,
    MujocoRod,
    Ring,
    Rod,
    elastica_tip,
    out_of_plane,
    slowest,
    withe_ring,
    withe_rod,
)
from reporting import HAVE_ELASTICA, HAVE_MUJOCO, OUT, Report, arguments, bar, interleaved
from work_precision import front, shown_time

import withe

HAVE_GYMNASIUM = importlib.util.find_spec("gymnasium") is not None
ROUNDS = 5
FRAMES = 100
PEERS = ("withe", "PyElastica", "MuJoCo")
Outcome = tuple[float, float]  # processor time [s], error


@dataclass
class Point:
    """One choice of settings of one simulator."""

    scene: str
    simulator: str
    settings: str
    run: Callable[[], Outcome] = field(repr=False)
    look: Callable[[], Outcome] | None = field(default=None, repr=False)  # quicker than `run`
    model: str = ""  # of the rod, if the simulator has several
    error: float = math.inf
    time: float = math.inf
    spread: float = 0.0

    @property
    def kind(self) -> tuple[str, str]:
        """Simulator, and its model of the rod if it has several."""
        return self.simulator, self.model

    def measure(self) -> None:
        """Run once, for the error and a first time."""
        seconds, error = (self.look or self.run)()
        if math.isfinite(error):
            self.time, self.error = seconds, error

    def as_json(self) -> dict[str, object]:
        """For the report; a run that diverged has no error."""
        found = {"scene": self.scene, "simulator": self.simulator, "settings": self.settings}
        measured = {"error": self.error, "time": self.time, "spread": self.spread}
        return found | {key: value if math.isfinite(value) else None for key, value in measured.items()}


@dataclass(frozen=True)
class Scene:
    """A scene, the errors at which run times are compared, and the runs of all simulators."""

    name: str
    unit: str
    marks: tuple[float, ...]
    runs: Callable[[bool], Iterator[Point]]
    differences: str  # of the models, which no mesh removes
    goal: tuple[float, float] | None = None  # the error and the ratio of run times of a goal, by default marks[1] and 1


# --- a heavy cantilever at rest ----------------------------------------------------------------------------------

CANTILEVER = Rod(weight=10.0)


def _tip_error(rod: Rod, tip: FloatArray) -> float:
    return float(np.hypot(*(tip[[0, 2]] / rod.length - elastica_tip(rod.weight))))


DURATIONS = (1.0, 1.5, 2.5, 4.0, 6.0, 9.0, 14.0)  # over the angular frequency of the first mode


class Settling:
    """Runs of a peer to rest: one run, looked at after each of the durations, and runs of one duration alone."""

    def __init__(
        self,
        makes: list[Callable[[], ElasticaRod | ElasticaRing | ElasticaKnot | MujocoRod | MujocoKnot]],
        durations: list[float],
        error: Callable[[FloatArray, FloatArray], float],
    ) -> None:
        self._makes, self._durations, self._error = makes, durations, error
        self._looks: list[Outcome] = []

    def look(self, number: int) -> Outcome:
        """Return the outcome after a duration, of the first settings that do not diverge."""
        while not self._looks:
            one, seconds, before = self._makes[0](), 0.0, 0.0
            for duration in self._durations:
                spent, tips = one.run(duration - before)
                seconds, before = seconds + spent, duration
                # A run that diverges later is not trusted earlier.
                if not np.isfinite(tips).all():
                    self._looks = []
                    break
                self._looks.append((seconds, self._error(*one.nodes)))
            if not self._looks:
                if len(self._makes) == 1:
                    self._looks = [(math.inf, math.inf)] * len(self._durations)
                else:
                    del self._makes[0]
        return self._looks[number]

    def alone(self, number: int) -> Outcome:
        """Run for one duration only."""
        one = self._makes[0]()
        seconds, _ = one.run(self._durations[number])
        return seconds, self._error(*one.nodes)


def _settled(scene: str, rod: Rod, error: Callable[[FloatArray, FloatArray], float], quick: bool) -> Iterator[Point]:
    """Runs of both peers to rest."""
    pace = slowest(rod)
    durations = [value / pace for value in ((0.02,) if quick else DURATIONS)]
    for edges in (8,) if quick else (6, 8, 12, 20, 40):
        for damping in (2.0,) if quick else (1.0, 2.0, 3.0, 4.0):
            rate = damping * pace
            settings: list[tuple[str, str, list]] = []
            if HAVE_ELASTICA:
                makes = [lambda e=edges, r=rate, s=s: ElasticaRod(rod, e, s, r, _floor(rod)) for s in (0.85, 0.7, 0.5)]
                settings.append(("PyElastica", "largest stable step", makes))
            if HAVE_MUJOCO:
                for part in (0.05,) if quick else (0.02, 0.05, 0.1, 0.2, 0.5):
                    make = lambda e=edges, r=rate, s=part / pace: MujocoRod(rod, e, s, damping=r)  # noqa: E731
                    settings.append(("MuJoCo", f"step {1e3 * part / pace:.2g} ms", [make]))
            for simulator, text, makes in settings:
                settling = Settling(makes, durations, error)
                for i, duration in enumerate(durations):
                    words = f"{edges} elements, damping {rate:.3g} 1/s, {text}, {duration:.2g} s"
                    yield Point(
                        scene,
                        simulator,
                        words,
                        lambda settling=settling, i=i: settling.alone(i),
                        lambda settling=settling, i=i: settling.look(i),
                    )


def _floor(rod: Rod) -> float:
    """Stiffness of PyElastica's floor per length [Pa]: the rod's weight presses 2 % of its radius deep."""
    return rod.line_density * 9.81 / (0.02 * rod.radius)


def cantilever(quick: bool) -> Iterator[Point]:
    """Runs of the heavy cantilever."""
    rod = CANTILEVER

    def ours(edges: int) -> Callable[[], Outcome]:
        def run() -> Outcome:
            simulation = withe_rod(rod, edges, integrator="static")
            start = time.thread_time()
            simulation.equilibrium()
            return time.thread_time() - start, _tip_error(rod, simulation.positions()[-1])

        return run

    for edges in (8,) if quick else (4, 6, 8, 12, 16, 24, 32, 48, 64, 96):
        yield Point("heavy cantilever", "withe", f"{edges} edges, equilibrium", ours(edges))
    yield from _settled("heavy cantilever", rod, lambda _, nodes: _tip_error(rod, nodes[-1]), quick)


# --- a beam that swings ------------------------------------------------------------------------------------------

SWING = 1.0  # [s]


@lru_cache
def _swing(edges: int, step: float) -> FloatArray:
    """Tip of the beam in withe at equal times [m]."""
    simulation = withe_rod(CANTILEVER, edges, integrator="fourth_order", time_step=step, planar=True)
    return _recorded(simulation)[1]


def _recorded(simulation: withe.Simulation) -> tuple[float, FloatArray]:
    tips, count = [], round(SWING / FRAMES / simulation.time_step)
    start = time.thread_time()
    for _ in range(FRAMES):
        simulation.step(count)
        tips.append(simulation.positions()[-1])
    return time.thread_time() - start, np.array(tips)


def _motion_error(tips: FloatArray) -> float:
    """RMS over time of the distance from the reference, over the RMS of its motion."""
    exact = _swing(160, 5e-4)
    size = np.sqrt(np.mean(np.sum((exact - exact.mean(axis=0)) ** 2, axis=1)))
    return float(np.sqrt(np.mean(np.sum((tips - exact) ** 2, axis=1))) / size)


def beam(quick: bool) -> Iterator[Point]:
    """Runs of the swinging beam."""
    rod = CANTILEVER

    def ours(edges: int, integrator: str, step: float) -> Callable[[], Outcome]:
        def run() -> Outcome:
            seconds, tips = _recorded(withe_rod(rod, edges, integrator=integrator, time_step=step, planar=True))
            return seconds, _motion_error(tips)

        return run

    def theirs(make: Callable[[], ElasticaRod | MujocoRod]) -> Callable[[], Outcome]:
        def run() -> Outcome:
            seconds, tips = make().run(SWING, FRAMES)
            return seconds, _motion_error(tips)

        return run

    for edges in (8,) if quick else (8, 12, 16, 24, 32, 48):
        for integrator in ("energy_momentum", "fourth_order"):
            for parts in (1,) if quick else (1, 2, 4, 8):
                step = SWING / FRAMES / parts
                text = f"{edges} edges, {integrator}, step {1e3 * step:.3g} ms"
                yield Point("swinging beam", "withe", text, ours(edges, integrator, step))
    if HAVE_ELASTICA and not quick:
        for elements in (8, 12, 20, 40, 80):
            for share in (0.85, 0.7):
                text = f"{elements} elements, step {share:g}"
                make = lambda e=elements, s=share: ElasticaRod(rod, e, s)  # noqa: E731
                yield Point("swinging beam", "PyElastica", text, theirs(make))
    if HAVE_MUJOCO:
        for edges in (8,) if quick else (8, 12, 20, 40):
            for integrator in ("discrete", "Euler", "RK4"):
                for parts in (4,) if quick else (4, 10, 20, 40, 80, 160):
                    step = SWING / FRAMES / parts
                    text = f"{edges} edges, {integrator}, step {1e3 * step:.3g} ms"
                    make = lambda e=edges, i=integrator, s=step: MujocoRod(rod, e, s, i)  # noqa: E731
                    yield Point("swinging beam", "MuJoCo", text, theirs(make))


# --- Michell's ring beyond its critical twist --------------------------------------------------------------------

RING = Ring()


@lru_cache
def _flat(nodes: int) -> float:
    simulation = withe_ring(RING, nodes)
    simulation.equilibrium()
    return out_of_plane(simulation.positions())


def _ring_error(_: FloatArray | None, points: FloatArray) -> float:
    """Difference of how far the ring has left its plane."""
    return abs(out_of_plane(points) - _flat(256))


def ring(quick: bool) -> Iterator[Point]:
    """Runs of the ring."""

    def ours(nodes: int) -> Callable[[], Outcome]:
        def run() -> Outcome:
            simulation = withe_ring(RING, nodes)
            start = time.thread_time()
            simulation.equilibrium()
            return time.thread_time() - start, _ring_error(None, simulation.positions())

        return run

    for nodes in (16,) if quick else (12, 16, 24, 32, 48, 64, 96, 128):
        yield Point("Michell's ring", "withe", f"{nodes} nodes, equilibrium", ours(nodes))
    if not HAVE_ELASTICA or quick:
        return
    durations = [value / RING.pace for value in (2.0, 4.0, 6.0, 9.0, 14.0, 20.0)]
    for elements in (16, 24, 32, 48, 64, 96):
        for damping in (0.5, 1.0, 2.0):
            rate = damping * RING.pace
            makes = [lambda e=elements, r=rate, s=s: ElasticaRing(RING, e, s, r) for s in (0.85, 0.7, 0.5)]
            settling = Settling(makes, durations, _ring_error)
            for i, duration in enumerate(durations):
                words = f"{elements} elements, damping {rate:.3g} 1/s, largest stable step, {duration:.2g} s"
                run, look = (lambda s=settling, i=i: s.alone(i)), (lambda s=settling, i=i: s.look(i))
                yield Point("Michell's ring", "PyElastica", words, run, look)


# --- an overhand knot that is pulled tight -----------------------------------------------------------------------

KNOT = Knot()


@lru_cache
def _tight(quick: bool) -> float:
    """Median over fine meshes: contact between polygons makes the shortening depend on the mesh by 0.3 %."""
    found = []
    for edges in (80,) if quick else (240, 320, 480):
        simulation = withe_knot(KNOT, edges, integrator="static")
        simulation.equilibrium()
        found.append(shortening(simulation.positions()))
    return float(np.median(found))


def knot(quick: bool) -> Iterator[Point]:
    """Runs of the knot."""

    def error(_: FloatArray | None, points: FloatArray) -> float:
        return abs(shortening(points) / _tight(quick) - 1.0)

    def at_rest(edges: int) -> Callable[[], Outcome]:
        def run() -> Outcome:
            simulation = withe_knot(KNOT, edges, integrator="static")
            start = time.thread_time()
            simulation.equilibrium()
            return time.thread_time() - start, error(None, simulation.positions())

        return run

    def in_time(edges: int, rate: float, step: float, duration: float) -> Callable[[], Outcome]:
        def run() -> Outcome:
            simulation = withe_knot(KNOT, edges, rate, integrator="backward_euler", time_step=step)
            start = time.thread_time()
            simulation.step(round(duration / step))
            return time.thread_time() - start, error(None, simulation.positions())

        return run

    for edges in (60,) if quick else (50, 60, 80, 100, 120, 160):
        if not quick:
            yield Point("tightened knot", "withe", f"{edges} edges, equilibrium", at_rest(edges))
        for step in (0.02,) if quick else (0.01, 0.02, 0.05):
            for duration in (0.04,) if quick else (0.3, 0.4, 0.6, 1.0):
                text = f"{edges} edges, backward_euler, damping 14 1/s, step {1e3 * step:g} ms, {duration:g} s"
                yield Point("tightened knot", "withe", text, in_time(edges, 0.2 * KNOT.pace, step, duration))
    durations = [value / KNOT.pace for value in ((0.1,) if quick else (12.0, 20.0, 30.0, 45.0, 70.0))]
    settings: list[tuple[str, str, list]] = []
    for damping in (0.2,) if quick else (0.1, 0.2, 0.4):
        rate = damping * KNOT.pace
        if HAVE_ELASTICA and not quick:
            for elements, depth in ((60, 0.02), (90, 0.02), (90, 0.1), (120, 0.02), (120, 0.1), (160, 0.02)):
                makes = [
                    lambda e=elements, r=rate, s=s, d=depth: ElasticaKnot(KNOT, e, s, r, d) for s in (0.5, 0.35, 0.25)
                ]
                text = f"{elements} elements, damping {rate:.3g} 1/s, depth {depth:g}, largest stable step"
                settings.append(("PyElastica", text, makes))
        if HAVE_MUJOCO:
            for edges in (60,) if quick else (60, 75, 95):
                for step in (2e-3,) if quick else (2.5e-4, 5e-4, 1e-3, 2e-3, 4e-3):
                    make = lambda e=edges, r=rate, s=step: MujocoKnot(KNOT, e, s, r)  # noqa: E731
                    text = f"{edges} edges, damping {rate:.3g} 1/s, step {1e3 * step:.3g} ms"
                    settings.append(("MuJoCo", text, [make]))
    for simulator, text, makes in settings:
        settling = Settling(makes, durations, error)
        for i, duration in enumerate(durations):
            run, look = (lambda s=settling, i=i: s.alone(i)), (lambda s=settling, i=i: s.look(i))
            yield Point("tightened knot", simulator, f"{text}, {duration:.2g} s", run, look)


# --- a cable that is dropped on a floor --------------------------------------------------------------------------

CABLE = Rod(weight=200.0, height=0.05)
_ALONG = np.linspace(0.1, 1.0, 10)


def _shape(s: FloatArray, points: FloatArray) -> FloatArray:
    """Points at ten equal arc lengths, over the length."""
    return np.stack([np.interp(_ALONG, s, x) for x in points.T], axis=1) / CABLE.length


@lru_cache
def _lying(edges: int) -> FloatArray:
    simulation = withe_rod(CABLE, edges, integrator="static")
    simulation.equilibrium()
    return _shape(np.linspace(0.0, 1.0, edges + 1), simulation.positions())


def _shape_error(s: FloatArray, points: FloatArray) -> float:
    """RMS distance along the cable from the reference, over its length."""
    return float(np.sqrt(np.mean(np.sum((_shape(s, points) - _lying(400)) ** 2, axis=1))))


def cable(quick: bool) -> Iterator[Point]:
    """Runs of the cable that is dropped."""

    def ours(edges: int) -> Callable[[], Outcome]:
        def run() -> Outcome:
            simulation = withe_rod(CABLE, edges, integrator="static")
            start = time.thread_time()
            simulation.equilibrium()
            seconds = time.thread_time() - start
            return seconds, _shape_error(np.linspace(0.0, 1.0, edges + 1), simulation.positions())

        return run

    for edges in (16,) if quick else (6, 8, 12, 16, 24, 32, 48, 64, 96, 128):
        yield Point("dropped cable", "withe", f"{edges} edges, equilibrium", ours(edges))
    yield from _settled("dropped cable", CABLE, _shape_error, quick)


# --- the arm of the learning tasks -------------------------------------------------------------------------------


def arm(quick: bool) -> Iterator[Point]:
    """Runs of the arm of the learning tasks: 60 control steps of 0.1 s, the error of the tip by its own short steps."""
    if not HAVE_GYMNASIUM:
        return
    import rl_arms
    import rl_peers

    count = 2 if quick else rl_arms.ACTIONS
    actions = rl_arms.actions_of(0, 10, count)

    def timed(make: Callable[[], FloatArray], exact: Callable[[], FloatArray]) -> Callable[[], Outcome]:
        def run() -> Outcome:
            start = time.thread_time()
            tips = make()
            seconds = time.thread_time() - start
            return seconds, float(np.sqrt(np.mean(np.sum((tips - exact()) ** 2, axis=1)))) / rl_peers.LENGTH

        return run

    def ours(step: float) -> FloatArray:
        task = rl_arms.FreeArm()
        task.time_step = step
        return rl_arms.tips(task, 0, count)

    def converged() -> FloatArray:
        return rl_arms.converged_tips(rl_arms.FreeArm, 0, count, 2 if quick else rl_arms.FINE)

    for parts in (4,) if quick else (2, 3, 4, 6, 8, 12, 16):
        yield Point("arm", "withe", f"step {100.0 / parts:.3g} ms", timed(lambda n=parts: ours(0.1 / n), converged))
    if HAVE_ELASTICA and not quick:
        fine = lru_cache(lambda: rl_peers.tips_of(rl_peers.ElasticaArm(2.5e-5), actions))
        for step in (4e-4, 3e-4, 2e-4, 1e-4):
            make = lambda s=step: rl_peers.tips_of(rl_peers.ElasticaArm(s), actions)  # noqa: E731
            yield Point("arm", "PyElastica", f"step {1e3 * step:.2g} ms", timed(make, fine))
    if HAVE_MUJOCO:
        import rl_mujoco

        bends = 2.0 * np.tan(0.5 * rl_peers.bends_of(actions))
        least = 2.5e-3 if quick else 2e-4
        fine = lru_cache(lambda: rl_mujoco.tips_of(least, bends, updates=4 if quick else 100))
        for step in (5e-3,) if quick else (12.5e-3, 5e-3, 2.5e-3, 1.25e-3, 0.625e-3):
            make = lambda s=step: rl_mujoco.tips_of(s, bends)  # noqa: E731
            yield Point("arm", "MuJoCo", f"step {1e3 * step:.3g} ms", timed(make, fine))


# --- the report --------------------------------------------------------------------------------------------------

SCENES = {
    scene.name: scene
    for scene in (
        Scene(
            "heavy cantilever",
            "length",
            (1e-2, 3e-3, 1e-3),
            cantilever,
            "PyElastica's rod shears and stretches, withe's stretches, MuJoCo's does neither.",
        ),
        Scene(
            "swinging beam",
            "motion",
            (1e-1, 3e-2, 1e-2),
            beam,
            "PyElastica's rod shears and has rotary inertia. MuJoCo's discrete integrator damps at first order.",
        ),
        Scene(
            "Michell's ring",
            "extent",
            (1e-2, 3e-3, 1e-3),
            ring,
            "Not simulated by MuJoCo: its closed rods have no twist, and its rods have no natural twist. PyElastica's "
            "rod shears. Both other simulators have GJ = 2.5 EI.",
        ),
        Scene(
            "tightened knot",
            "shortening",
            (3e-2, 2e-2, 1e-2),
            knot,
            "Contact of PyElastica and MuJoCo is a penalty. Edges of MuJoCo are longer than a diameter, and keep their "
            "length. PyElastica's rod shears.",
        ),
        Scene(
            "dropped cable",
            "length",
            (1e-2, 3e-3, 1e-3),
            cable,
            "Floors of PyElastica and MuJoCo are penalties; they are set to yield by a few per cent of the radius.",
        ),
        Scene(
            "arm",
            "length",
            (3e-2, 1e-2, 3e-3),
            arm,
            "Each simulator is compared with its own limit. The times of withe include its environment.",
        ),
    )
}


def _promising(points: list[Point]) -> list[Point]:
    """Return points of each simulator that are no more than a quarter slower than one that is better."""
    return [
        p
        for p in points
        if p.time < math.inf
        and not any(q.kind == p.kind and q.error < p.error and 1.25 * q.time < p.time for q in points)
    ]


def best_run(points: list[Point], simulator: str, mark: float) -> Point | None:
    """Return the fastest run of a simulator with at most this error."""
    found = [p for p in points if p.simulator == simulator and p.error <= mark and p.time < math.inf]
    return min(found, key=lambda p: p.time, default=None)


def _report_scene(report: Report, scene: Scene, points: list[Point]) -> tuple[list[tuple], list[tuple]]:
    absent = [name for name in PEERS if f"Not simulated by {name}" in scene.differences]
    rows, settings = [], []
    for mark in scene.marks:
        best = {name: best_run(points, name, mark) for name in PEERS}
        ours = best["withe"]
        cells = [shown_time(ours.time if ours else None)]
        for name in PEERS[1:]:
            found = best[name]
            cells.append("not simulated" if name in absent else shown_time(found.time if found else None))
            ratio = found.time / ours.time if found and ours else None
            cells.append("-" if ratio is None else f"{ratio:.3g}")
            goal_mark, target = scene.goal or (scene.marks[1], 1.0)
            if mark == goal_mark and name not in absent:
                text = f"{scene.name}: run time of {name} over withe at {mark:g} of the {scene.unit}"
                report.goal(text, ratio, target)
        rows.append((scene.name, f"{mark:g} of the {scene.unit}", *cells))
        for name, point in best.items():
            if point is not None:
                spread = f"{100 * point.spread:.0f} %"
                error, run_time = f"{point.error:.1e}", shown_time(point.time)
                settings.append((scene.name, f"{mark:g}", name, point.settings, error, run_time, spread))
    return rows, settings


def _plot(name: str, points: list[Point], scenes: list[Scene]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(scenes), figsize=(1.5 + 3.2 * len(scenes), 3.8), squeeze=False)
    for axis, scene in zip(axes[0], scenes, strict=True):
        for i, simulator in enumerate(PEERS):
            mine = [p for p in points if p.scene == scene.name and p.simulator == simulator and p.time < math.inf]
            if not mine:
                continue
            line = front(p for p in mine if p.error < 10.0 * scene.marks[0])
            axis.loglog(
                [p.time for p in line], [p.error for p in line], "os^"[i] + "-", ms=4, color=f"C{i}", label=simulator
            )
        for mark in scene.marks:
            axis.axhline(mark, color="0.85", lw=0.8, zorder=0)
        axis.set(title=scene.name, xlabel="run time [s]", ylabel=f"error / {scene.unit}")
        axis.grid(alpha=0.3)
    axes[0][0].legend(fontsize=8)
    figure.tight_layout()
    OUT.mkdir(parents=True, exist_ok=True)
    figure.savefig(OUT / f"{name}.png", dpi=130)
    plt.close(figure)


def compare(report: Report, scenes: list[Scene], quick: bool) -> list[Point]:
    """Measure errors, then times in turns, and add the tables and goals of some scenes to a report."""
    warnings.simplefilter("ignore", withe.CoarseStepWarning)  # long steps are part of the grid
    points = [point for scene in scenes for point in scene.runs(quick)]
    with bar(len(points), "errors") as shown:
        for point in points:
            point.measure()
            shown.advance(1)
    kept = [p for scene in scenes for p in _promising([p for p in points if p.scene == scene.name])]
    rounds = 1 if quick else ROUNDS
    with bar(rounds * len(kept), "times") as shown:
        timings = interleaved(
            {str(i): lambda p=p: p.run()[0] for i, p in enumerate(kept)}, rounds, lambda: shown.advance(1)
        )
    for i, point in enumerate(kept):
        point.time, point.spread = timings[str(i)].median, timings[str(i)].spread
    for point in points:
        if point not in kept:
            point.time = math.inf
    rows, settings = [], []
    for scene in scenes:
        found = _report_scene(report, scene, [p for p in points if p.scene == scene.name])
        rows += found[0]
        settings += found[1]
    header = ("scene", "error", "withe", "PyElastica", "over withe", "MuJoCo", "over withe")
    report.table("Run time at the same error", header, rows)
    header = ("scene", "error", "simulator", "settings", "its error", "time", "spread")
    report.table("Fastest settings", header, settings)
    report.table("Differences of the models", ("scene", "difference"), [(s.name, s.differences) for s in scenes])
    report.keep_points(points)
    _plot(report.name, points, scenes)
    return points


def main() -> None:
    """Compare the simulators in the scenes, and write the report."""
    options = arguments(
        __doc__, ("--scene", {"choices": list(SCENES), "action": "append", "help": "only this one (may be repeated)"})
    )
    if HAVE_ELASTICA and not options.quick:
        ElasticaRod(CANTILEVER, 8, 0.5, 1.0).run(1e-3)  # compiles
        ElasticaRod(CABLE, 8, 0.5, 1.0, _floor(CABLE)).run(1e-3)
        ElasticaRing(RING, 8, 0.5, 1.0).run(1e-3)
        ElasticaKnot(KNOT, 60, 0.5, 1.0, 0.1).run(1e-3)
    report = Report("peers", quick=options.quick)
    compare(report, [SCENES[name] for name in options.scene or SCENES], options.quick)
    report.write()


if __name__ == "__main__":
    main()
