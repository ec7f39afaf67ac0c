"""A gallery of short films in one style, mostly of the scenes of the other examples.

    python examples/gallery.py [NAME ...]

Writes out/gallery/NAME.mp4, each below 2 MB. `--pages FOLDER` also writes the small moving pictures of the
documentation. All films have the same size, light, floor and camera: it stands still, level with the horizon, and sees
the whole motion. All entries take about ten minutes on two cores.
"""

from __future__ import annotations

import argparse
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import withe
from withe.common.progress import progress

SIZE, FPS = (960, 540), 30.0  # [px], pictures per second
LARGEST = 2_000_000  # bytes of a film
BELOW = 0.06  # distance of the floor below hanging rods, over the extent of their motion
PAGE_SIZE, PAGE_FPS = (480, 270), 12.5


@dataclass(frozen=True)
class Shot:
    """A record, and how its film shows it.

    Attributes
    ----------
    record : Record or withe.common.frames.Frames
    speed : float
        Seconds of the simulation in a second of film.
    camera : tuple of float or withe.perception.Camera
        Direction of view, or a camera where less than the whole motion is to be seen.
    ground : float, optional [m]
        Height of the floor; by default that of the scene, or a little below the rods.
    """

    record: Any
    speed: float = 1.0
    camera: Any = (0.5, -1.0, 0.4)
    ground: float | None = None

    def floor(self) -> float | None:
        """Height of the floor that the film adds [m]; None where the scene has one."""
        if self.ground is not None or any(obstacle.kind == "plane" for obstacle in self.record.obstacles):
            return self.ground
        nodes = self.record.positions().reshape(-1, 3)
        return float(nodes[:, 2].min() - BELOW * np.linalg.norm(np.ptp(nodes, axis=0)))


class Sheet:
    """The record of a sheet that was simulated from its side, shown as wide as it is."""

    def __init__(self, record: withe.Record, width: float, thickness: float) -> None:
        self._record = record
        self.rods = tuple(replace(rod, widths=np.tile((width, thickness), (rod.edges, 1))) for rod in record.rods)

    def __len__(self) -> int:
        return len(self._record)

    def __getattr__(self, name: str) -> Any:
        if name == "_record":  # of a copy that is being made
            raise AttributeError(name)
        return getattr(self._record, name)


def camera_at(place: Sequence[float], target: Sequence[float], width: float) -> Any:
    """Return a camera at a place that sees `width` metres across at its target."""
    forward = np.subtract(target, place)
    distance = float(np.linalg.norm(forward))
    forward = forward / distance
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    focal = SIZE[0] * distance / width
    matrix = [[focal, 0, 0.5 * SIZE[0] - 0.5], [0, focal, 0.5 * SIZE[1] - 0.5], [0, 0, 1]]
    return withe.perception.Camera(matrix, rotation=rotation, translation=-rotation @ np.asarray(place, float))


# --- entries ---------------------------------------------------------------------------------------------------


def helix() -> Shot:
    """A helix of silicone sags under its weight and swings."""
    import helix

    return Shot(helix.build("energy_momentum").run(2.0, 0.01, progress=False), speed=0.3)


def plectoneme() -> Shot:
    """A rod under tension is twisted until it winds up about itself."""
    from plectoneme import BENDING, DENSITY, MODULUS, RADIUS, TWISTING

    length, nodes, force = 0.26, 261, 0.0012  # [m], [-], F h^2 / B
    x = np.linspace(0.0, 1.0, nodes)
    bump = 0.004 * length * np.exp(-(((x - 0.5) / 0.1) ** 2))
    points = np.stack([length * x, bump * np.cos(20.0 * x), bump * np.sin(20.0 * x)], axis=1)
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=DENSITY)
    rod = scene.add_rod(points=points, radius=RADIUS, material=rubber, natural="straight", name="rod")
    scene.clamp(rod.start, hold="edge")
    scene.clamp(rod.end, hold="edge", free=(1.0, 0.0, 0.0))
    pull = force * BENDING / RADIUS**2
    scene.add_force(rod.end, (pull, 0.0, 0.0))
    line_density = DENSITY * np.pi * RADIUS**2
    wave_time = length * np.sqrt(line_density / pull)
    scene.add_drag(6.0 * line_density / wave_time)
    scene.enable_contact()
    simulation = scene.build(integrator="backward_euler", time_step=wave_time / 125.0)
    # A straight rod buckles at the moment 2 sqrt(B F) [Greenhill 1883].
    critical = 2.0 * np.sqrt(BENDING * pull) / TWISTING
    simulation.set(rod, natural_twist=1.15 * critical, over=12.0 * wave_time)
    simulation.run(14.0 * wave_time, record_every=np.inf, progress=False)  # the straight rod is twisted unseen
    record = simulation.run(19.0 * wave_time, record_every=wave_time / 12.0, progress=False)
    return Shot(record, speed=19.0 * wave_time / 8.0, camera=(0.25, -1.0, 0.35))


def _knot(name: str) -> Shot:
    import granny_reef

    step = 5e-3
    start = granny_reef.at_rest(name, granny_reef.MODULUS)
    simulation, _ = granny_reef.begin_pull(name, start, 0.3, granny_reef.MODULUS, 13.0, step)
    return Shot(simulation.run(13.0, 0.1, progress=False), speed=1.8, camera=(0.25, -1.0, 0.3))


def reef() -> Shot:
    """The ends of a reef knot are pulled."""
    return _knot("reef")


def granny() -> Shot:
    """The ends of a granny knot are pulled: one crossing differs from the reef knot."""
    return _knot("granny")


def flagella() -> Shot:
    """Turning flagella find each other through the fluid and bundle."""
    import flagella

    simulation = flagella.build(3, "stokeslets", 4e-3)
    return Shot(simulation.run(8.0, 0.03, progress=False), camera=(0.5, -1.0, 0.3))


def spider() -> Shot:
    """A spider of nine soft limbs falls on a floor with friction, and slides."""
    import spider

    return Shot(spider.fall(1.0, 2.5e-4), speed=0.18, camera=(0.35, -1.0, 0.35))


def gripper() -> Shot:
    """Five limbs that hang side by side curl up and entangle."""
    import gripper

    return Shot(gripper.grip(0.5, 5, 14.0, False)[1], speed=1.8, camera=(0.4, -1.0, 0.2))


def tendons() -> Shot:
    """Three tendons lead the tip of a soft arm around."""
    length, radius, offset = 0.25, 9e-3, 14e-3  # [m]
    scene = withe.Scene()
    silicone = withe.Material(youngs_modulus=1.5e6, poisson_ratio=0.5, density=1100.0, viscosity=8e3)
    arm = scene.add_rod(
        start=(0, 0, 0.3), end=(0, 0, 0.3 - length), nodes=31, radius=radius, material=silicone, normal=(1, 0, 0)
    )
    scene.clamp(arm.start)
    angles = 2.0 * np.pi * np.arange(3) / 3.0
    strings = [scene.add_tendon(arm, offset=(offset * np.cos(a), offset * np.sin(a))) for a in angles]
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)

    def pull(now: withe.Simulation) -> None:
        grown = min(now.time / 1.5, 1.0)
        for string, angle in zip(strings, angles, strict=True):
            wave = np.cos(2.0 * np.pi * now.time / 2.5 - angle)
            now.set(string, tension=4.0 * grown * (3.0 - 2.0 * grown) * grown * max(wave, 0.0))

    record = simulation.run(7.0, 0.03, before_step=pull, progress=False)
    return Shot(record, camera=(0.6, -1.0, 0.35), ground=0.0)


def servo_arm() -> Shot:
    """Two flexible arms turn by a right angle; the shaped command of the second one leaves no vibration."""
    import servo_arm

    period = 1.0 / servo_arm.arm()[0].linearise().frequencies(1)[0]
    commands = ([(1.0, 0.0)], [(0.25, 0.0), (0.5, 0.5 * period), (0.25, period)])
    scene = withe.Scene(gravity=(0.0, 0.0, 0.0))
    servos = [servo_arm.add_arm(scene, 0.75 * number, number + 1) for number in range(2)]
    simulation = scene.build(planar=True, integrator="energy_momentum", time_step=1e-3)

    def lead(now: withe.Simulation) -> None:
        time = now.time + 0.5 * now.time_step
        for servo, parts in zip(servos, commands, strict=True):
            share = sum(part * servo_arm.rise(time - delay) for part, delay in parts)
            now.set(servo, rest_angle=servo_arm.ANGLE * share)

    record = simulation.run(1.8, 5e-3, before_step=lead, progress=False)
    view = camera_at((0.46, -1.5, 1.8), (0.5, 0.2, 0.0), 2.15)
    return Shot(record, speed=0.28, camera=view, ground=-0.03)


def fold() -> Shot:
    """A jaw folds a sheet of A4 in half, as planned: the sheet does not slide."""
    from withe import folding

    paper = folding.Paper.a4()
    sheet = folding.SimulatedSheet(paper, edges=100, time_step=0.01)
    record = sheet.fold(folding.plan(paper, method="slip", grasp="free"), progress=False).record
    shown = Sheet(record, paper.width, 6e-4)  # thicker than paper, which would be thinner than a pixel
    return Shot(shown, speed=float(record.times[-1]) / 7.0, camera=(0.55, -1.0, 0.5))


def word() -> Shot:
    """A gripper writes a word with a thread, which hangs from above, without lifting it."""
    from write_word import FRICTION, GRAVITO_BENDING_LENGTH, RADIUS, as_large_as_can_be

    from withe.deployment import Cable, deploy, plan

    pattern = as_large_as_can_be("eel")
    thread = Cable(pattern.length + 4.0 * GRAVITO_BENDING_LENGTH + 0.01, RADIUS, GRAVITO_BENDING_LENGTH)
    motion = plan(thread, pattern, "exact", crossings="over")
    record = deploy(motion, friction=FRICTION, nodes=200, quasi_static=True, progress=False).record
    low, high = pattern.raw.min(axis=0), pattern.raw.max(axis=0)
    (x, y), width = 0.5 * (low + high), float(high[0] - low[0])
    x += 0.05 * width  # of the tail behind the word
    view = camera_at((x, y - 1.3 * width, 1.5 * width), (x, y + 0.05 * width, 0.0), 1.45 * width)
    return Shot(record, speed=float(record.times[-1]) / 8.0, camera=view)


def trefoil() -> Shot:
    """A cable is laid down, and two grippers tie it into a trefoil knot."""
    from tie_knot import FRICTION
    from tie_knot import trefoil as steps_of_trefoil

    from withe.deployment import tie

    record = tie(*steps_of_trefoil(), friction=FRICTION, nodes=110).record
    view = camera_at((0.05, -0.45, 0.5), (0.02, 0.05, 0.01), 0.46)
    return Shot(record, speed=float(record.times[-1]) / 9.0, camera=view)


def pile() -> Shot:
    """Forty rods fall into a pile."""
    count, length, radius = 40, 0.16, 7e-3  # [m]
    random = np.random.default_rng(4)
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=2e6, poisson_ratio=0.5, density=1000.0, viscosity=2e3)
    for number in range(count):
        heading, tilt = random.uniform(0.0, np.pi), random.uniform(-0.15, 0.15)
        way = 0.5 * length * np.array([np.cos(heading) * np.cos(tilt), np.sin(heading) * np.cos(tilt), np.sin(tilt)])
        middle = np.array([*random.uniform(-0.05, 0.05, 2), 0.05 + 0.04 * number])
        scene.add_rod(start=middle - way, end=middle + way, nodes=11, radius=radius, material=rubber)
    scene.add_floor(friction=0.5)
    scene.enable_contact(friction=0.5, friction_model="lagged")
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    view = camera_at((0.5, -0.9, 0.6), (0.0, 0.02, 0.07), 0.85)
    return Shot(simulation.run(1.2, 5e-3, progress=False), speed=0.17, camera=view)


def robot() -> Shot:
    """A six-legged robot of soft rods walks."""
    import robot

    return Shot(robot.walk(10, progress=False), speed=0.9, camera=(0.35, -1.0, 0.5), ground=-robot.LEG_RADIUS)


def soft_legs() -> Shot:
    """A quadruped with a rigid trunk and soft legs trots."""
    import soft_legs

    return Shot(soft_legs.walk(4.5), speed=0.6, camera=(0.45, -1.0, 0.45))


def ball() -> Shot:
    """Three soft fingers lift a ball by friction."""
    import lift_ball

    return Shot(lift_ball.lift(*lift_ball.build(), hold=0.4), speed=0.25, camera=(1.0, -0.8, 0.35))


def guidewire() -> Shot:
    """A guidewire is pushed through a bent vessel."""
    import guidewire

    scene, _, hand = guidewire.scene()
    record, _, _ = guidewire.push(scene, hand, guidewire.INSERTION)
    view = camera_at((0.01, -0.17, 0.19), (0.03, 0.036, 0.01), 0.2)
    return Shot(record, speed=0.45, camera=view, ground=-0.02)


ENTRIES: dict[str, Callable[[], Shot]] = {
    entry.__name__: entry
    for entry in (
        robot, soft_legs, gripper, ball, spider, tendons, servo_arm, guidewire, helix, plectoneme, reef, granny,
        flagella, pile, fold, word, trefoil,
    )
}  # fmt: skip


# --- traced cables: a film of a picture, not of a record -----------------------------------------------------------


def traced(path: Path, size: tuple[int, int], count: int | None) -> None:
    """Cables in a picture are traced one after the other; at crossings the upper one covers the lower one."""
    import cv2
    import imageio_ffmpeg

    from withe.perception import border_filter, trace
    from withe.perception.synthetic import make_case, render
    from withe.view.colors import rod_color
    from withe.view.films import Film

    scale = max(size[1] / 360.0, 1.0)  # narrower cables cannot be traced
    case = make_case("six cables", 8, scale, (360, 640))
    dull = [(176, 92, 70), (62, 98, 140), (196, 160, 84), (84, 132, 100), (120, 92, 140), (90, 98, 106)]
    photo = render(case, np.random.default_rng(1), dull, background=(226, 232, 237), grain=3.0)
    tracing = trace(photo, border_filter)
    lengths = [len(line) for line in tracing.centrelines]
    frames = count or 210
    rest, total = frames // 7, sum(lengths)

    def drawn(done: int) -> np.ndarray:
        """The picture with the first rows of all cables, taken in a row."""
        image = photo.copy()
        shown, before = [], 0
        for length in lengths:
            shown.append(int(np.clip(done - before, 0, length)))
            before += length

        def stroke(cable: int, first: int, last: int) -> None:
            points = np.round(16.0 * tracing.centrelines[cable][first:last]).astype(np.int32)[:, None]
            width = float(np.median(tracing.widths[cable]))
            color = [int(255 * part) for part in rod_color(cable)]
            if len(points) > 1:
                cv2.polylines(image, [points], False, color, max(1, round(0.8 * width)), cv2.LINE_AA, 4)

        for cable, rows in enumerate(shown):
            stroke(cable, 0, rows)
        for crossing in tracing.crossings:
            (over, row), (under, other) = crossing.over, crossing.under
            if row < shown[over] and other < shown[under]:
                reach = round(1.2 * float(np.median(tracing.widths[under])))
                stroke(over, max(0, row - reach), min(row + reach, shown[over]))
        return image

    with Film(imageio_ffmpeg.get_ffmpeg_exe(), path, size, FPS) as film:
        for frame in range(frames):
            share = np.clip((frame - rest) / max(1, frames - 3 * rest), 0.0, 1.0)
            film.write(cv2.resize(drawn(round(share * total)), size, interpolation=cv2.INTER_AREA))


# --- films ---------------------------------------------------------------------------------------------------------


def make(name: str, folder: Path, size: tuple[int, int] = SIZE, *, quality: Any = "high") -> Path:
    """Simulate one entry, and write its film."""
    path = folder / f"{name}.mp4"
    if name == "traced":
        traced(path, size, None)
        return path
    shot = ENTRIES[name]()
    look = {"camera": shot.camera, "ground": shot.floor(), "quality": quality}
    return withe.view.animate(shot.record, path, size=size, fps=FPS, speed=shot.speed, progress=False, **look)


def shrink(film: Path, target: Path) -> None:
    """Write the small moving picture of a film for the documentation, as WebP."""
    import imageio_ffmpeg

    width, height = PAGE_SIZE
    filters = f"fps={PAGE_FPS:g},scale={width}:{height}:flags=lanczos"
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-y", "-loglevel", "error", "-i", film, "-vf", filters]
    command += ["-c:v", "libwebp_anim", "-quality", "55", "-compression_level", "4", "-loop", "0", "-an", target]
    subprocess.run(command, check=True)


def main() -> None:
    """Make the films, one after the other."""
    names = [*ENTRIES, "traced"]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"by default all: {', '.join(names)}")
    parser.add_argument("--out", type=Path, default=Path("out/gallery"))
    parser.add_argument("--pages", type=Path, help="folder for the small moving pictures of the documentation")
    arguments = parser.parse_args()
    chosen = arguments.names or names
    unknown = set(chosen) - set(names)
    if unknown:
        parser.error(f"NAME must be one of {', '.join(names)}, got {', '.join(sorted(unknown))}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    with progress(len(chosen), "gallery", unit="films") as bar:
        for name in chosen:
            film = make(name, arguments.out)
            print(f"{film}: {film.stat().st_size / 1e6:.2f} MB", flush=True)
            if film.stat().st_size > LARGEST:
                raise SystemExit(f"{film} must be below {LARGEST / 1e6:g} MB")
            if arguments.pages:
                arguments.pages.mkdir(parents=True, exist_ok=True)
                shrink(film, arguments.pages / f"{name}.webp")
            bar.advance(1)


if __name__ == "__main__":
    main()
