"""Fits to camera data: the soft limbs of the dissertation's section 6.4.2, and synthetic data with known truth.

python benchmarks/real2sim.py [--quick]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from reporting import Report, arguments, bar, once

import withe
from withe.real2sim import Tags, calibrate, fit, fit_motion, rest_shape

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "python"))
import dropped_cable as cable
from ringing_rod import UNKNOWNS, let_go, ringing
from soft_limb import CONSTANT, LIMB, log, published, robot, seen_curvatures

LINEAR = [(rod, "natural_curvature", "linear") for rod in ("upper", "lower")]
PUBLISHED_TIP = 2.9  # figure 6.7, whose camera is not published [mm]
TRUTH = np.array([1e6, 3000.0])  # of the vibrating rod: Young's modulus [Pa], viscosity [Pa s]
SCALE, NOISE = 3600.0, 0.5  # scale of the camera [px/m], noise of its tags [px]


def _curvatures(report: Report, quick: bool) -> None:
    """The published targets, and tips for the curvatures that reach them, with a level camera and a fitted one."""
    simulation, places = robot()
    targets = seen_curvatures(places)
    found = fit(simulation, targets, CONSTANT, progress=False)
    seconds = [once(lambda: fit(simulation, targets, CONSTANT, progress=False)) for _ in range(1 if quick else 5)]
    by_descent = fit(simulation, targets, CONSTANT, method="source", progress=False)
    apart = np.degrees(np.abs(found.values * LIMB - published()[1]).max())
    report.goal("targets: largest sum of residuals", np.abs(found.residuals).sum(axis=1).max(), 1e-9, at_least=False)
    report.goal("targets: most iterations a frame", found.iterations.max(), 3, at_least=False)
    report.goal("targets: degrees from published turns", apart, 0.6, at_least=False)
    report.goal("targets: seconds for all frames", np.median(seconds), 0.1, at_least=False)
    report.goal("targets: equilibria by the published descent", by_descent.solves.sum(), 2000, at_least=False)
    still = Tags(np.zeros((1, len(places), 3)), places).bind(simulation)
    tips = []
    for frame in range(len(found.values)):
        found.apply(simulation, frame)
        simulation.equilibrium()
        tips.append(still.value(simulation.positions(), 0)[[-3, -1]] @ (1.0, 1.0j))
    pixels = log().pixels @ (1.0, -1.0j)
    level = pixels[:, -1] - pixels[:, 0]
    spacing = np.nanmean(np.abs(np.diff(pixels, axis=1))) / (LIMB / 4.0)  # [px/m]
    similarity = np.vdot(level, tips) / np.vdot(level, level)  # roll and scale of least squares
    offs = [1e3 * np.abs(level * factor - tips).mean() for factor in (1.0 / spacing, similarity)]
    for name, value, target in (("level camera", offs[0], 15.05), ("roll and scale fitted", offs[1], 3.55)):
        report.goal(f"targets: mm of the tip on the mean, {name}", value, target, at_least=False)
    report.figures["tip in figure 6.7 [mm]"] = PUBLISHED_TIP


def _tags(report: Report, step: int) -> None:
    """Curvatures that explain all tags, in frames that the camera was not calibrated with."""
    simulation, places = robot()
    pixels, rows = log().pixels, []
    for name, unknowns in (("constant", CONSTANT), ("linear", LINEAR)):
        camera = calibrate(simulation, Tags(pixels, places), slice(0, 85, step), unknowns=unknowns, progress=False)
        found = fit(simulation, Tags(pixels[85:], camera.places, camera), unknowns, progress=False)
        off = 1e3 * np.linalg.norm(found.residuals.reshape(-1, len(places), 2), axis=2) / camera.scale
        mean, greatest, rms = off[:, -1].mean(), off[:, -1].max(), np.sqrt((off**2).mean())
        rows.append((name, f"{mean:.2f}", f"{greatest:.2f}", f"{rms:.2f}"))
        report.goal(f"tags: RMS of all [mm], {name}", rms, 0.8 if name == "constant" else 0.4, at_least=False)
        if name == "constant":
            report.goal("tags: tip on the mean [mm]", mean, 0.6, at_least=False)
            report.goal("tags: tip at most [mm]", greatest, 1.0, at_least=False)
    report.table("Tags off in frames 85 to 168 [mm]", ("curvature", "tip, mean", "tip, most", "all, RMS"), rows)


def _stiffness(report: Report, step: int, factors: tuple[float, ...]) -> None:
    """Stills of limbs whose curvatures are unknown do not determine their modulus, and the fit reports it."""
    pixels, limbs, rows = log().pixels, ("upper", "lower"), []
    for factor in factors:
        simulation, places = robot()
        for limb in limbs:
            simulation.set(limb, youngs_modulus=factor * simulation.get(limb, "youngs_modulus"))
        camera = calibrate(simulation, Tags(pixels, places), slice(0, 85, step), progress=False)
        found = fit(simulation, Tags(pixels[85 :: step // 4], camera.places, camera), CONSTANT, progress=False)
        off = 1e3 * found.residuals / camera.scale
        rows.append((f"{factor:g}", f"{np.sqrt(2.0 * (off**2).mean()):.2f}"))
        if factor == 1.0:
            seen = Tags(pixels[: 85 : 2 * step], camera.places, camera)
            asked = fit(simulation, seen, [*CONSTANT, (limbs, "youngs_modulus")], progress=False)
    report.table("Moduli other than the given one", ("times the modulus", "RMS of all tags [mm]"), rows)
    said = any("youngs_modulus" in name for each in asked.unobservable for name in each.weights)
    report.goal("stills: the modulus is said to be unobservable", float(said), 1.0)


def _arm(nodes: int) -> withe.Simulation:
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=nodes, radius=5e-3, material=rubber, name="arm")
    scene.clamp(arm.start)
    return scene.build(integrator="static", planar=True)


def _errors(report: Report, seeds: int) -> None:
    """Compare covariances with true errors: a curvature of each of two frames, and a modulus that both share."""
    truth, camera = np.array([0.0, 4.0, 1e6]), _camera()
    fine, exact = _arm(121), []
    for curvature in truth[:2]:
        fine.set("arm", natural_curvature=(0.0, curvature))
        fine.equilibrium()
        exact.append(camera.project(fine.positions("arm")[20::20]))
    places, unknowns = [f"arm.node({n})" for n in range(5, 31, 5)], [("arm", "natural_curvature", "constant")]
    unknowns.append(("arm", "youngs_modulus"))
    simulation, scaled = _arm(31), []
    with bar(seeds, "made stills", "fits") as shown:
        for seed in range(seeds):
            noisy = np.array(exact) + np.random.default_rng(seed).normal(0.0, NOISE, np.shape(exact))
            found = fit(simulation, Tags(noisy, places, camera, sigma=NOISE), unknowns, progress=False)
            values = [*found.value("arm")[:, 0], found.value("arm", "youngs_modulus").flat[0]]
            sigmas = [*found.sigma("arm")[:, 0], found.sigma("arm", "youngs_modulus").flat[0]]
            scaled.append((np.array(values) - truth) / sigmas)
            shown.advance(1)
    names, sizes = ("curvature 0", "curvature 1", "modulus"), np.sqrt(np.mean(np.square(scaled), axis=0))
    for name, value in zip(names, sizes, strict=True):
        report.goal(f"made stills: error over sigma of {name}, RMS - 1", abs(value - 1.0), 0.1, at_least=False)


def _drawn(nodes: int, turn: float, curvature: float) -> withe.Simulation:
    """Return an arm drawn as an arc of 0.3 m. It begins along x, turned upwards by an angle."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=5e6, density=1000.0)
    edge = 0.3 / (nodes - 1)
    angles = turn + curvature * edge * (np.arange(nodes - 1) + 0.5)
    ways = np.cumsum(edge * np.stack([np.cos(angles), 0.0 * angles, np.sin(angles)], axis=1), axis=0)
    arm = scene.add_rod(points=np.concatenate([np.zeros((1, 3)), ways]), radius=4e-3, material=rubber, name="arm")
    scene.clamp(arm.start)
    return scene.build(integrator="static", planar=True)


def _photograph(report: Report, seeds: int) -> None:
    """The shape of a rod without its weight, and how it was clamped, from a photograph of it as it sags."""
    fine, camera, simulation = _drawn(121, 0.15, -2.0), _camera(), _drawn(31, 0.0, 1.5)
    fine.equilibrium()
    exact, truth, scaled = camera.project(fine.positions("arm")[::2]), np.array([0.15, 0.15 - 3.5 * 0.3]), []
    with bar(seeds, "made photographs", "fits") as shown:
        for seed in range(seeds):
            seen = exact + np.random.default_rng(seed).normal(0.0, NOISE, exact.shape)
            found = rest_shape(simulation, "arm", seen, camera, unknown="points", sigma=NOISE)
            scaled.append((found.values[0] - truth) / np.sqrt(np.diag(found.covariance[0])))
            shown.advance(1)
    for name, value in zip(("start", "end"), np.sqrt(np.mean(np.square(scaled), axis=0)), strict=True):
        goal = f"photograph of a sagging rod: error over sigma of its turn at the {name}, RMS - 1"
        report.goal(goal, abs(value - 1.0), 0.1, at_least=False)


def _camera() -> withe.perception.Camera:
    return withe.perception.Camera(
        [[1500.0, 0, 640], [0, 1500, 360], [0, 0, 1]],
        rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        translation=(0, 0, 1),
    )


def _ringing(report: Report, seeds: int, end: float = 2.0) -> None:
    """Modulus and viscosity from 2 s of ringing of the same mesh, 100 pictures a second, clocks apart by 13 ms."""
    times, delay, places = np.arange(0.04, end, 0.01), 0.013, range(3, 13, 3)
    simulation, exact = ringing(time_step=1e-3, viscosity=TRUTH[1]), []
    for time in times + delay:
        simulation.run(time - simulation.time, progress=False)
        exact.append(simulation.positions("arm")[places])
    names, rows, errors = [f"arm.node({n})" for n in places], [], []
    with bar(seeds, "made ringing", "fits") as shown:
        for seed in range(seeds):
            noise = np.random.default_rng(seed).normal(0.0, NOISE / SCALE, np.shape(exact)) * (1, 0, 1)
            start = ringing(modulus=1.2e6, viscosity=2000.0)
            target = Tags(np.array(exact) + noise, names, times=times)
            found = fit_motion(start, target, UNKNOWNS, begin=let_go, progress=False)
            errors.append(100.0 * (found.values[0, :2] / TRUTH - 1.0))
            sigma = 100.0 * np.sqrt(np.diag(found.covariance[0]))[:2] / TRUTH
            rows.append((seed, *(f"{value:.3f}" for value in (*errors[-1], *sigma))))
            shown.advance(1)
    header = ("seed", "modulus off", "viscosity off", "sigma of modulus", "sigma of viscosity")
    report.table("Two seconds of ringing [%]", header, rows)
    for name, value in zip(("modulus", "viscosity"), np.sqrt(np.mean(np.square(errors), axis=0)), strict=True):
        report.goal(f"made ringing: {name} off, RMS [%]", value, 1.0, at_least=False)


def _cable(report: Report, seeds: int, unseen: int, nodes: int, time_step: float) -> None:
    """A cable that swings after one of two grippers let go, seen for 1.5 s; pose in these and in a second unseen."""
    names = ("pose [mm]", "EI [%]", "damping [%]")
    later = cable.TIMES[-1] + np.arange(1, unseen + 1) / 30.0
    times = np.concatenate([cable.TIMES, later]) + cable.DELAY
    exact, rows, errors = cable.true_shapes(times), [], []
    count, true = len(cable.TIMES), np.array(list(cable.TRUTH.values()))
    with bar(seeds, "made cable", "fits") as shown:
        for seed in range(seeds):
            start = cable.held(nodes, time_step, **cable.GUESS)
            target = cable.lines_seen(exact[:count], cable.NOISE, seed)
            found = fit_motion(start, target, cable.UNKNOWNS, begin=cable.lift, progress=False)
            found.apply(start)
            cable.lift(start)
            off = 1e3 * cable.distances(cable.shapes_at(start, times), exact)
            errors.append([off[:count].mean(), *(100.0 * np.abs(found.values[0, :2] / true - 1.0))])
            figures = (*errors[-1], off[:count].max(), off[count:].mean())
            rows.append((seed, *(f"{value:.3f}" for value in figures), found.solves[0]))
            shown.advance(1)
    rows.append(("others report", *(f"{cable.PUBLISHED[name]:g}" for name in names), "", "", ""))
    header = ("seed", "mean pose off [mm]", "EI off [%]", "damping off [%]", "most [mm]", "next second [mm]", "runs")
    report.table("A dropped cable, seen by a camera of 0.5 px noise", header, rows)
    for name, value, target in zip(names, np.sqrt(np.mean(np.square(errors), axis=0)), (3.0, 1.0, 5.0), strict=True):
        report.goal(f"dropped cable: {name}, RMS", value, target, at_least=False)


def main() -> None:
    """Measure all, report."""
    quick = arguments(__doc__).quick
    report = Report("real2sim", quick=quick)
    _curvatures(report, quick)
    _tags(report, 20 if quick else 4)
    _stiffness(report, *(20, (1.0,)) if quick else (4, (0.25, 1.0, 100.0)))
    _errors(report, 2 if quick else 100)
    _photograph(report, 2 if quick else 300)
    _ringing(report, 1 if quick else 4, 0.5 if quick else 2.0)
    _cable(report, *(1, 3, 11, 1e-2) if quick else (8, 30, 31, 2.5e-3))
    report.write()


if __name__ == "__main__":
    main()
