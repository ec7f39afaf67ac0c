"""A camera follows a swinging cable, while a board hides two fifths of it for two seconds.

The engine computes a cable that hangs between a pin and a hand. The hand moves, and a camera films the cable from the
side at 60 frames per second. A tracker that knows length, stiffness and weight of the cable predicts the hidden part by
an elastic rod. A tracker without this knowledge keeps the shape in which the part was last seen. Tracing of each frame
by itself finds neither the hidden part nor the order of the ends.

Writes out/track_cables.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np

import withe
from withe.perception import Camera, RodPrior, Tracker
from withe.view import style

LENGTH, RADIUS, DENSITY, STIFFNESS = 0.6, 4e-3, 0.02, 1.2e-4  # of the cable [m], [m], [kg/m], [N m^2]
SCALE, WIDTH, HEIGHT = 1000.0, 896, 560  # of the pictures [px/m], [px], [px]
RATE, DURATION = 60.0, 3.0  # of the film [1/s], [s]
HIDDEN = (0.5, 2.5)  # times between which the board is there [s]
BOARD = (316, 40, 572, 540)  # left, top, right and bottom [px]
NODES, FINE = 41, 4  # nodes of the trackers; edges of the cable per edge of a tracker


def camera() -> Camera:
    """A camera that looks level at the plane of the cable."""
    matrix = [[SCALE, 0.0, 447.5], [0.0, SCALE, 120.0], [0.0, 0.0, 1.0]]
    return Camera(matrix, rotation=np.diag([1.0, -1.0, -1.0]), translation=(0.0, 0.0, 1.0))


def motion(duration: float) -> np.ndarray:
    """Nodes of the cable in each frame, shape (frames, nodes, 2) [px]."""
    modulus = STIFFNESS / (0.25 * np.pi * RADIUS**4)
    rubber = withe.Material(youngs_modulus=modulus, density=DENSITY / (np.pi * RADIUS**2), viscosity=0.02 * modulus)
    scene = withe.Scene()
    turn = np.linspace(0.0, np.pi, FINE * (NODES - 1) + 1)
    line = np.column_stack([-0.2 * np.cos(turn), 0.0 * turn, -0.2 * np.sin(turn)])
    line *= LENGTH / np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    cable = scene.add_rod(points=line, nodes=len(line), natural="straight", radius=RADIUS, material=rubber)
    scene.pin(cable.start)
    hand = scene.pin(cable.end)
    simulation = scene.build(planar=True, time_step=0.5 / RATE)
    simulation.equilibrium()
    begin = simulation.positions(cable)[-1]

    def path(time: float) -> np.ndarray:
        return begin + np.array([0.05 * np.sin(4.5 * time), 0.0, 0.06 * np.sin(3.0 * time) ** 2])

    simulation.move(hand, path=path)
    record = simulation.run(duration, record_every=1.0 / RATE, progress=False)
    eye = camera()
    return np.array([eye.project(frame[:, [0, 2, 1]] * [1.0, 1.0, 0.0]) for frame in record.positions(cable)])


def picture(line: np.ndarray, board: bool) -> np.ndarray:
    """A frame of the film: red, green and blue."""
    image = np.full((HEIGHT, WIDTH, 3), (38, 42, 48), np.uint8)
    points = np.round(line * 16).astype(np.int32)[:, None]
    cv2.polylines(image, [points], False, (222, 120, 60), round(2.0 * RADIUS * SCALE), cv2.LINE_AA, 4)
    if board:
        cv2.rectangle(image, BOARD[:2], BOARD[2:], (92, 98, 106), -1)
    return image


def mask(image: np.ndarray) -> np.ndarray:
    """Pixels of the cable, by its colour."""
    return image[..., 0] > 120


def main() -> None:
    """Film, track, compare, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--duration", type=float, default=DURATION, help="of the film [s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 15 s.", flush=True)

    truth = motion(arguments.duration)
    times = np.arange(len(truth)) / RATE
    rod = RodPrior(length=LENGTH, bend_stiffness=STIFFNESS, line_density=DENSITY)
    trackers = {
        "with the rod": Tracker(camera(), rod, mask=mask, frame_rate=RATE),
        "without": Tracker(mask=mask, frame_rate=RATE),
    }
    board = np.zeros((HEIGHT, WIDTH), bool)
    board[BOARD[1] : BOARD[3], BOARD[0] : BOARD[2]] = True
    nodes: dict[str, list[np.ndarray]] = {name: [] for name in trackers}
    covered = []
    for time, line in zip(times, truth, strict=True):
        there = HIDDEN[0] <= time < HIDDEN[1]
        image = picture(line, there)
        column, row = np.round(line[::FINE]).astype(int).T
        covered.append(there & board[row, column])
        for name, tracker in trackers.items():
            (cable,) = tracker.update(image, hidden=board & there, time=time)
            nodes[name].append(cable.nodes)
    hidden = np.array(covered)
    errors = {}
    for name, found in nodes.items():
        turned = np.hypot(*(found[0][0] - truth[0, 0])) > np.hypot(*(found[0][-1] - truth[0, 0]))
        nodes[name] = [each[::-1] if turned else each for each in found]
        errors[name] = np.linalg.norm(np.array(nodes[name]) - truth[:, ::FINE], axis=2)
        print(f"{name}: hidden nodes are {errors[name][hidden].mean():.2f} px off on the mean")
    means = {}
    for name, error in errors.items():
        parts = [part if part.any() else np.ones_like(part) for part in hidden]
        means[name] = [each[part].mean() for each, part in zip(error, parts, strict=True)]

    colors = style.use()
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 4.2), width_ratios=(1.6, 1.0))
    frame = int(np.argmax(means["without"]))
    left.imshow(picture(truth[frame], True))
    left.plot(*truth[frame].T, color="white", lw=1.0, label="true centreline")
    for name, color, size in (("without", colors.sky, 5.0), ("with the rod", colors.yellow, 3.5)):
        left.plot(*nodes[name][frame].T, "o", color=color, ms=size, label=f"tracker {name}")
    left.set(title=f"Frame at {times[frame]:.2f} s", xticks=[], yticks=[])
    left.legend(loc="lower left", labelcolor="white", facecolor="#26292f", framealpha=0.9, fontsize=8)
    left.spines[:].set_visible(False)
    for name, color in (("without", colors.blue), ("with the rod", colors.red)):
        right.plot(times, means[name], color=color, label=name)
    right.axvspan(*HIDDEN, color=colors.pale, zorder=0)
    right.set(title="Error of the hidden nodes", ylim=(0.0, None), xlim=(0.0, times[-1]))
    style.label(right, x=("time", "s"), y=("mean error", "px"))
    style.legend(right, side="top", ncols=2)
    path = arguments.out / "track_cables.png"
    figure.savefig(path)
    print(f"Wrote {path}.")
    if errors["with the rod"][hidden].mean() > 3.0:
        sys.exit("The tracker must know the hidden part within 3 px.")


if __name__ == "__main__":
    main()
