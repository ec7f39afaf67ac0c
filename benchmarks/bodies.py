"""Run time of withe and MuJoCo for the same error: rods with a rigid body at their ends.

    python benchmarks/bodies.py [--quick]

Scenes:

- a clamped beam that vibrates with a body at its end, by the first mode in closed form,
- a plug on a cable that is let go level and swings, by a fine mesh of withe.

MuJoCo has the rod as a chain of rigid links on hinges, and the cable also as a flex with a constraint (see
`peer_bodies.py`). Frequencies of the meshes of both simulators are compared with closed forms, and a fine chain with
the fine mesh of withe. Times are measured as in `peers.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np
from peer_bodies import (
    BodyRod,
    FloatArray,
    MujocoChain,
    MujocoFlex,
    WitheBody,
    beam_mode,
    beam_shape,
    chain_frequencies,
    hanging_frequencies,
    withe_frequencies,
)
from peers import Outcome, Point, Scene, best_run, compare
from reporting import HAVE_MUJOCO, Report, arguments
from work_precision import shown_time

# --- a beam with a rigid body at its end -------------------------------------------------------------------------

TIPPED = BodyRod(
    length=1.0,
    line_density=1.0,
    bending=1.0,
    stretching=1e5,
    mass=1.0,
    inertia=0.01,
    offset=0.2,
    is_clamped=True,
)
_PERIODS, _SMALL = 1, 1e-3  # of the vibration, and its amplitude over the length


@lru_cache
def _vibration(cells: int) -> tuple[FloatArray, float, float, float]:
    """Velocities at equal distances and of the body [m/s], its spin and the angular frequency [rad/s]."""
    omega, _, _ = beam_mode(TIPPED)
    size = _SMALL * TIPPED.length * omega
    displacements, slope = beam_shape(TIPPED, np.linspace(0.0, 1.0, cells + 1))
    return size * displacements, size * (1.0 + TIPPED.offset * slope), size * slope, omega


def _vibrating(one: WitheBody | MujocoChain, cells: int) -> Outcome:
    """RMS over time of the distance of the body from the first mode in closed form, over the RMS of its motion."""
    velocities, of_body, spin, omega = _vibration(cells)
    one.swing(velocities, of_body, spin)
    frames = 20 * _PERIODS
    seconds, places = one.run(_PERIODS * 2.0 * np.pi / omega, frames)
    exact = of_body / omega * np.sin(2.0 * np.pi * np.arange(1, frames + 1) / 20.0)
    return seconds, float(np.sqrt(np.mean((places[:, 2] - exact) ** 2) / np.mean(exact**2)))


def tipped(quick: bool) -> Iterator[Point]:
    """Runs of the beam with a body."""
    frame = 2.0 * np.pi / beam_mode(TIPPED)[0] / 20.0

    def ours(edges: int, integrator: str, parts: int) -> Callable[[], Outcome]:
        return lambda: _vibrating(WitheBody(TIPPED, edges, integrator=integrator, time_step=frame / parts), edges)

    def theirs(links: int, integrator: str, parts: int) -> Callable[[], Outcome]:
        return lambda: _vibrating(MujocoChain(TIPPED, links, frame / parts, integrator), links)

    for edges in (4,) if quick else (3, 4, 6, 8, 12):
        for integrator in ("energy_momentum", "fourth_order"):
            for parts in (1,) if quick else (1, 2, 4, 8, 16):
                text = f"{edges} edges, {integrator}, step {1e3 * frame / parts:.3g} ms"
                yield Point("beam with a body", "withe", text, ours(edges, integrator, parts))
    if not HAVE_MUJOCO:
        return
    for links in (4,) if quick else (4, 8, 16, 24, 32):
        fastest = MujocoChain(TIPPED, links).frequencies[-1]
        # RK4 and Euler need stable time steps. The discrete integrator is implicit.
        for integrator, least, factors in (
            ("RK4", math.ceil(frame * fastest / 2.7), (1, 2)),
            ("Euler", math.ceil(frame * fastest / 1.9), (1, 2, 4, 8)),
            ("discrete", 8, (1, 4, 16, 64)),
        ):
            for parts in [least * factor for factor in factors][: 1 if quick else None]:
                text = f"chain of {links} links, {integrator}, step {1e3 * frame / parts:.3g} ms"
                yield Point("beam with a body", "MuJoCo", text, theirs(links, integrator, parts))


# --- a plug on a cable that swings -------------------------------------------------------------------------------

PLUG = BodyRod(
    length=1.0,
    line_density=0.1,
    bending=1e-4,
    stretching=1e5,
    mass=0.2,
    inertia=2e-4,
    offset=0.05,
    is_clamped=False,
    gravity=9.81,
    tilt=math.radians(90.0),
)
_SWUNG, _PLUG_FRAMES = 2.0, 100  # [s]


@lru_cache
def _swung(edges: int, step: float) -> FloatArray:
    """Centre of the plug in withe at equal times [m]."""
    return WitheBody(PLUG, edges, integrator="fourth_order", time_step=step).run(_SWUNG, _PLUG_FRAMES)[1]


def _plug_error(places: FloatArray, quick: bool) -> float:
    """RMS over time of the distance from the reference, over the RMS of its motion."""
    exact = _swung(20, 2e-3) if quick else _swung(160, 5e-4)
    size = np.sqrt(np.mean(np.sum((exact - exact.mean(axis=0)) ** 2, axis=1)))
    return float(np.sqrt(np.mean(np.sum((places - exact) ** 2, axis=1))) / size)


def plug(quick: bool) -> Iterator[Point]:
    """Runs of the plug."""
    frame = _SWUNG / _PLUG_FRAMES

    def timed(make: Callable[[], WitheBody | MujocoChain | MujocoFlex]) -> Callable[[], Outcome]:
        def run() -> Outcome:
            seconds, places = make().run(_SWUNG, _PLUG_FRAMES)
            return seconds, _plug_error(places, quick)

        return run

    for edges in (6,) if quick else (4, 6, 8, 12, 16, 24, 32):
        for integrator in ("energy_momentum", "fourth_order"):
            for parts in (1,) if quick else (1, 2, 4, 8):
                make = lambda e=edges, i=integrator, s=frame / parts: WitheBody(  # noqa: E731
                    PLUG, e, integrator=i, time_step=s
                )
                text = f"{edges} edges, {integrator}, step {1e3 * frame / parts:.3g} ms"
                yield Point("swung plug", "withe", text, timed(make))
    if not HAVE_MUJOCO:
        return
    for links in (6,) if quick else (4, 6, 8, 12, 16, 24):
        for integrator in ("RK4", "Euler", "discrete"):
            for parts in (4,) if quick else (1, 2, 4, 8, 16, 32):
                make = lambda e=links, i=integrator, s=frame / parts: MujocoChain(PLUG, e, s, i)  # noqa: E731
                text = f"chain of {links} links, {integrator}, step {1e3 * frame / parts:.3g} ms"
                yield Point("swung plug", "MuJoCo", text, timed(make))
    for edges in (6,) if quick else (6, 8, 12, 16):
        for parts in (8,) if quick else (4, 10, 20, 40, 80):
            make = lambda e=edges, s=frame / parts: MujocoFlex(PLUG, e, s)  # noqa: E731
            text = f"flex of {edges} edges, discrete, step {1e3 * frame / parts:.3g} ms"
            yield Point("swung plug", "MuJoCo", text, timed(make), model="flex")


def report_frequencies(report: Report, quick: bool) -> None:
    """Add the errors of the frequencies of meshes by closed forms."""
    hanging = replace(PLUG, tilt=0.0, bending=1e-7)  # the closed form has no bending
    omega, exact = beam_mode(TIPPED)[0], hanging_frequencies(hanging, 3)
    rows = []
    for cells in (5,) if quick else (5, 10, 20, 40):
        found = [withe_frequencies(TIPPED, cells, 1) / omega, withe_frequencies(hanging, cells, 3) / exact]
        if HAVE_MUJOCO:
            found += [chain_frequencies(TIPPED, cells, 1) / omega, chain_frequencies(hanging, cells, 3) / exact]
        rows.append((cells, *(f"{np.abs(ratios - 1.0).max():.1e}" for ratios in found)))
    header = ("edges or links", "beam, withe", "plug, withe", "beam, chain of MuJoCo", "plug, chain of MuJoCo")
    report.table("Largest error of frequencies by closed forms", header[: len(rows[0])], rows)


def report_gaps(report: Report, quick: bool) -> None:
    """Add the gaps between the cable and the plug, and the difference of the finest motions of both simulators."""
    one = WitheBody(PLUG, 12, integrator="energy_momentum", time_step=_SWUNG / _PLUG_FRAMES)
    one.run(_SWUNG, _PLUG_FRAMES)
    report.goal("swung plug: gap between cable and plug in withe [m]", one.gap, 1e-12, at_least=False)
    gaps = [("withe, 12 edges, step 20 ms", f"{one.gap:.1e} m")]
    if HAVE_MUJOCO:
        gaps.append(("MuJoCo, chain", "0 by its coordinates"))
        for step, stiff in ((2e-3, 0.02), (2e-3, None), (5e-4, None)):  # 0.02 s is the default of MuJoCo
            flex = MujocoFlex(PLUG, 12, step, stiff)
            flex.run(_SWUNG, _PLUG_FRAMES)
            text = "constraints by default" if stiff else "stiffest constraints"
            gaps.append((f"MuJoCo, flex of 12 edges, {text}, step {1e3 * step:g} ms", f"{flex.gap:.1e} m"))
        links, step = (12, 2e-3) if quick else (80, 2.5e-4)
        apart = _plug_error(MujocoChain(PLUG, links, step).run(_SWUNG, _PLUG_FRAMES)[1], quick)
        text = f"MuJoCo, chain of {links} links, RK4, step {1e3 * step:g} ms"
        report.table("Swung plug, difference from the reference", ("run", "over the motion"), [(text, f"{apart:.1e}")])
    report.table("Gap between cable and plug", ("simulator", "mean gap"), gaps)


def report_flex(report: Report, points: list[Point]) -> None:
    """Add the run times of MuJoCo's own rods, which its chain is faster than."""
    own = [p for p in points if p.scene == "swung plug" and (p.simulator == "withe" or p.model == "flex")]
    if not any(p.model for p in own):
        return
    rows = []
    for mark in SCENES[1].marks:
        ours, theirs = (best_run(own, name, mark) for name in ("withe", "MuJoCo"))
        ratio = theirs.time / ours.time if ours and theirs else None
        times = [shown_time(one.time if one else None) for one in (ours, theirs)]
        settings = theirs.settings if theirs else "-"
        rows.append((f"{mark:g}", *times, "-" if ratio is None else f"{ratio:.3g}", settings))
        if mark == 1e-2:
            report.goal("swung plug: run time of MuJoCo's flex over withe at 0.01 of the motion", ratio, 10.0)
    header = ("error", "withe", "flex of MuJoCo", "over withe", "settings of the flex")
    report.table("Swung plug with the rods of MuJoCo", header, rows)


# --- the report --------------------------------------------------------------------------------------------------

SCENES = (
    Scene(
        "beam with a body",
        "motion",
        (1e-2, 3e-3, 1e-3),
        tipped,
        "Not simulated by PyElastica here: its joints of rods and bodies are springs. MuJoCo has a chain of links.",
        (1e-3, 20.0),
    ),
    Scene(
        "swung plug",
        "motion",
        (3e-2, 1e-2, 5e-3),
        plug,
        "Not simulated by PyElastica here: its joints of rods and bodies are springs. MuJoCo has a chain of links, "
        "or a flex with a constraint.",
        (1e-2, 10.0),
    ),
)


def main() -> None:
    """Compare both simulators, and write the report."""
    options = arguments(__doc__)
    report = Report("bodies", quick=options.quick)
    points = compare(report, list(SCENES), options.quick)
    report_frequencies(report, options.quick)
    report_gaps(report, options.quick)
    report_flex(report, points)
    report.write()


if __name__ == "__main__":
    main()
