"""Films of cables with known nodes, for tests and benchmarks of the tracker. The engine computes hanging cables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import withe
from withe.perception import Camera, RodPrior

SHAPE = (672, 896)  # height and width of a picture [px]
SCALE = 1000.0  # [px/m]
LENGTH = 0.6  # of a hanging cable [m]
RADIUS = 4e-3  # [m]
WIDTH = 9  # of a cable in a picture [px]
RATE = 60.0  # frames per second
NODES = 41
TRUE_NODES = 4 * (NODES - 1) + 1  # each fourth one is a node of the tracker
HIDDEN_SHARE, HIDDEN_TIME = 0.4, 2.0  # share of the length, and duration [s]
BEFORE, AFTER = 0.5, 0.5  # durations in which all is visible [s]


def camera() -> Camera:
    """A camera that looks level at the plane z = 0, y upwards."""
    matrix = [[SCALE, 0.0, 447.5], [0.0, SCALE, 150.0], [0.0, 0.0, 1.0]]
    return Camera(matrix, rotation=np.diag([1.0, -1.0, -1.0]), translation=(0.0, 0.0, 1.0))


@dataclass
class Film:
    """Nodes [px] of every cable in every frame, shape (frames, cables, TRUE_NODES, 2), and what is hidden.

    `hidden`: first and last row of the true nodes that are hidden, in which frames.
    """

    lines: np.ndarray
    rods: list[RodPrior]
    hidden: tuple[int, int] = (0, 0)
    hidden_frames: tuple[int, int] = (0, 0)

    def masks(self) -> Iterator[np.ndarray]:
        """Masks of the frames, drawn one at a time."""
        first, last = self.hidden
        for frame, lines in enumerate(self.lines):
            if self.hidden_frames[0] <= frame < self.hidden_frames[1]:
                yield mask_of([part for line in lines for part in (line[: first + 1], line[last:])])
            else:
                yield mask_of(lines)


def mask_of(lines, shape=SHAPE, width=WIDTH) -> np.ndarray:
    """Mask of polylines with straight ends, as booleans."""
    import cv2

    mask = np.zeros(shape, np.uint8)
    for line in lines:
        if len(line) < 2:
            continue
        way = np.gradient(line, axis=0)
        across = 0.5 * width * np.column_stack([-way[:, 1], way[:, 0]]) / np.linalg.norm(way, axis=1)[:, None]
        for i in range(len(line) - 1):
            quad = np.array(
                [line[i] - across[i], line[i + 1] - across[i + 1], line[i + 1] + across[i + 1], line[i] + across[i]]
            )
            cv2.fillConvexPoly(mask, np.round(quad * 64).astype(np.int32), 1, cv2.LINE_8, 6)
    return mask > 0


def hanging_film(seed: int) -> Film:
    """A cable that hangs from a fixed pin, and from a hand that moves; for two seconds 40 % of it are hidden."""
    random = np.random.default_rng([seed, 1])
    weight_length = random.uniform(0.05, 0.12)  # (EI / w)^(1/3) [m]
    density = 0.02
    stiffness = density * 9.81 * weight_length**3
    area, inertia = np.pi * RADIUS**2, 0.25 * np.pi * RADIUS**4
    modulus = stiffness / inertia
    rubber = withe.Material(youngs_modulus=modulus, density=density / area, viscosity=0.02 * modulus)
    scene = withe.Scene()
    span = random.uniform(0.6, 0.85) * LENGTH
    turn = np.linspace(0.0, np.pi, TRUE_NODES)
    line = np.column_stack([0.5 * span * (1.0 - np.cos(turn)), 0.0 * turn, -0.25 * np.sin(turn)])
    size = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    line = line * LENGTH / size
    cable = scene.add_rod(
        points=line, nodes=TRUE_NODES, natural="straight", radius=RADIUS, material=rubber, name="cable"
    )
    scene.pin(cable.start)
    hand = scene.pin(cable.end)
    simulation = scene.build(planar=True, time_step=0.5 / RATE)
    simulation.equilibrium()
    begin = simulation.positions(cable)[-1]
    periods, phases = random.uniform(1.0, 2.5, (2, 2)), random.uniform(0.0, 2 * np.pi, (2, 2))
    sizes = random.uniform(0.02, 0.05, (2, 2))

    def offset(time: float) -> np.ndarray:
        waves = sizes * (np.sin(2 * np.pi * time / periods + phases) - np.sin(phases))
        move = waves.sum(axis=1) * min(1.0, time / 0.3)
        return np.array([move[0], 0.0, move[1]])

    simulation.move(hand, path=lambda time: begin + offset(time))
    duration = BEFORE + HIDDEN_TIME + AFTER
    record = simulation.run(duration, record_every=1.0 / RATE, progress=False)
    positions = record.positions(cable)
    shift = np.array([-0.5 * span, 0.0])
    plane = positions[:, :, [0, 2]] + shift
    view = camera()
    lines = np.stack([view.project(np.column_stack([x, np.zeros(len(x))])) for x in plane])[:, None]
    first = int(random.uniform(0.0, 1.0 - HIDDEN_SHARE) * (TRUE_NODES - 1))
    frames = round(BEFORE * RATE), round((BEFORE + HIDDEN_TIME) * RATE)
    rod = RodPrior(length=LENGTH, bend_stiffness=stiffness, line_density=density)
    return Film(lines, [rod], (first, first + round(HIDDEN_SHARE * (TRUE_NODES - 1))), frames)


def crossing_film(seed: int, frames: int = 90) -> Film:
    """Two cables of one width that are apart at first; then they cross, bend, and turn."""
    for attempt in range(100):
        film = _crossing(np.random.default_rng([seed, 2, attempt]), frames)
        first, last = film.lines[0][:, ::4]
        if np.sqrt(((first[:, None] - last[None]) ** 2).sum(axis=2)).min() > 3.0 * WIDTH:
            return film
    raise RuntimeError("no film in which the cables are apart at first")


def _crossing(random: np.random.Generator, frames: int) -> Film:
    """A film in which the cables may touch at first."""
    share = np.linspace(-0.5, 0.5, TRUE_NODES)
    angle = random.uniform(0.0, 2.0 * np.pi)
    between = np.radians(random.uniform(15.0, 165.0))
    lines = []
    for cable in range(2):
        heading = angle + cable * between
        length = random.uniform(260.0, 420.0)
        bend = random.uniform(-1.2, 1.2, 2)
        waves, phases = random.uniform(-0.5, 0.5, 2), random.uniform(0.0, 2.0 * np.pi, 2)
        spin = random.uniform(-0.6, 0.6)
        side = np.array([-np.sin(heading), np.cos(heading)]) * random.choice([-1.0, 1.0])
        start = random.uniform(60.0, 110.0) * side + random.uniform(-60.0, 60.0) * np.array(
            [np.cos(heading), np.sin(heading)]
        )
        path = -2.0 * start * (0.3 if cable else 1.0)
        motion = []
        for time in np.linspace(0.0, 1.0, frames):
            wave = waves * np.sin(2.0 * np.pi * time + phases)
            turned = heading + spin * time + (bend[0] + wave[0]) * share + (bend[1] + wave[1]) * 4.0 * share**2
            way = np.column_stack([np.cos(turned), np.sin(turned)]) * length / (TRUE_NODES - 1)
            line = np.vstack([[0.0, 0.0], np.cumsum(0.5 * (way[1:] + way[:-1]), axis=0)])
            eased = 0.5 - 0.5 * np.cos(np.pi * time)
            motion.append(line - line.mean(axis=0) + start + eased * path)
        lines.append(motion)
    middle = np.array([SHAPE[1], SHAPE[0]]) / 2.0
    return Film(np.array(lines).transpose(1, 0, 2, 3) + middle, [])
