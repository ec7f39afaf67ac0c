"""A plug at the end of a hanging cable swings: its frequencies are those of Bessel functions.

The cable has no bending stiffness to speak of. Its tension grows with the height z above a point that lies M / rho
below its lower end, for a plug of mass M and a cable of mass rho per length. A shape that swings at the frequency w is
then u = a J0(2 w (z / g)^(1/2)) + b Y0(2 w (z / g)^(1/2)) [Bernoulli 1732]. The plug of inertia J turns by an angle p,
and its centre of mass is the distance c below the end of the cable. With the tension T = M g there, the balance of
forces and moments of the plug is

    T u' + w^2 M (u - c p) = 0,    c T u' - c T p + w^2 J p = 0.

The example compares the first three frequencies of `linearise()` with the roots of these equations. It also kicks the
plug, and compares the peaks of the spectrum of its motion. It fails if a frequency is wrong by more than 0.1 %, or if
a peak is not where it should be.

Writes out/hanging_plug.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq
from scipy.special import j0, j1, y0, y1

import withe
from withe.view import style

GRAVITY = 9.81  # [m/s^2]
LENGTH, DENSITY, RADIUS, NODES = 1.0, 0.1, 4e-3, 41  # of the cable [m], [kg/m], [m]
MASS, SIZE = 0.15, (0.05, 0.05, 0.14)  # of the plug [kg], [m]
KICK, SPIN = 0.01, 0.3  # small [m/s], [rad/s]
TIME_STEP, DURATION = 5e-3, 20.0  # [s]
FREQUENCY_ERROR = 1e-3  # allowed, relative


def hanging() -> tuple[withe.Simulation, withe.Body]:
    """Return the cable with its plug, at rest."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    limp = withe.Stiffness(stretch=1e6, bend=1e-8, twist=1.0)
    cable = scene.add_rod(
        start=(0, 0, 0),
        end=(0, 0, -LENGTH),
        nodes=NODES,
        radius=RADIUS,
        stiffness=limp,
        line_density=DENSITY,
        name="cable",
    )
    scene.pin(cable.start)
    position = (0, 0, -LENGTH - 0.5 * SIZE[2])
    plug = scene.add_body(withe.solids.Box(SIZE), mass=MASS, position=position, name="plug")
    scene.join(cable.end, plug)
    return scene.build(planar=True, time_step=TIME_STEP), plug


def theory(count: int) -> np.ndarray:
    """Return the frequencies of a limp cable with a plug [Hz]."""
    below, arm = MASS / DENSITY, 0.5 * SIZE[2]
    inertia = MASS * (SIZE[0] ** 2 + SIZE[2] ** 2) / 12.0

    def determinant(w: float) -> float:
        top, end = (np.array([f(2.0 * w * np.sqrt(z / GRAVITY)) for f in (j0, y0)]) for z in (below + LENGTH, below))
        slope = -w / np.sqrt(below * GRAVITY) * np.array([f(2.0 * w * np.sqrt(below / GRAVITY)) for f in (j1, y1)])
        pull = MASS * GRAVITY
        force = [*(pull * slope + w**2 * MASS * end), -(w**2) * MASS * arm]
        moment = [*(arm * pull * slope), -arm * pull + w**2 * inertia]
        return float(np.linalg.det([[*top, 0.0], force, moment]))

    grid = np.linspace(0.5, 60.0, 3000)
    values = [determinant(w) for w in grid]
    roots = [brentq(determinant, grid[i], grid[i + 1]) for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0.0]
    return np.array(roots[:count]) / (2.0 * np.pi)


def spectrum(record: withe.Record) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies [Hz] and the amplitude of the plug's angle at each [rad]."""
    turn = record.body_rotation("plug")
    angle = np.arctan2(turn[:, 0, 2], turn[:, 2, 2])[:-1]
    window = np.hanning(len(angle))
    padded = np.fft.rfft(angle * window, 8 * len(angle))
    return np.fft.rfftfreq(8 * len(angle), record.times[1]), 2.0 * np.abs(padded) / window.sum()


def peaks(frequencies: np.ndarray, amplitudes: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the greatest peak within 5 % of each frequency [Hz]."""
    found = []
    for each in near:
        inside = np.flatnonzero(np.abs(frequencies / each - 1.0) < 0.05)
        found.append(frequencies[inside[np.argmax(amplitudes[inside])]])
    return np.array(found)


def corners(record: withe.Record, frame: int) -> np.ndarray:
    """Return the outline of the plug in the plane of its motion, shape (5, 2) [m]."""
    half = 0.5 * np.array(SIZE)
    box = np.array([(a, 0.0, b) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]) * half
    place, turn = record.body_position("plug")[frame], record.body_rotation("plug")[frame]
    return (place + box @ turn.T)[:, [0, 2]]


def draw(swing: withe.Record, spectra: tuple[np.ndarray, np.ndarray], expected: np.ndarray, path: Path) -> None:
    """Draw a wide swing, and the spectrum of a small one with the frequencies of theory."""
    colors = style.use()
    figure, (seen, peak) = plt.subplots(1, 2, figsize=(10.4, 5.0), width_ratios=(1.0, 1.5), layout="constrained")
    moments = np.linspace(0, len(swing) - 1, 7).round().astype(int)
    for frame, shade in zip(moments, style.ramp()(np.linspace(0.0, 1.0, len(moments))), strict=True):
        seen.plot(*swing.positions("cable")[frame][:, [0, 2]].T, color=shade, linewidth=2.5)
        seen.fill(*corners(swing, frame).T, facecolor=colors.pale, edgecolor=shade, linewidth=1.6, zorder=3)
    seen.set(aspect="equal", title=f"a kick: 0 to {swing.times[-1]:.1f} s, light to dark")
    style.label(seen, x=("x", "m"), y=("z", "m"))
    for k, each in enumerate(expected):
        peak.axvline(each, color=colors.red, linestyle=":", label="Bessel functions" if k == 0 else None)
    peak.semilogy(spectra[0], 1e3 * spectra[1], color=colors.blue, label="simulation")
    peak.set(xlim=(0.0, 1.25 * expected[-1]), title="angle of the plug", ylim=(1e-4, None))
    style.label(peak, x=("frequency", "Hz"), y=("amplitude", "mrad"))
    style.legend(peak)
    figure.savefig(path)
    plt.close(figure)


def main() -> Any:
    """Compare frequencies and peaks, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=DURATION, help="of the small swing [s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 3 s.", flush=True)

    simulation, plug = hanging()
    simulation.equilibrium()
    rest = simulation.snapshot()
    found, expected = simulation.linearise().frequencies(3), theory(3)
    off = float(np.abs(found / expected - 1.0).max())
    print("frequencies " + ", ".join(f"{f:.3f}" for f in found) + f" Hz, theory within {100 * off:.3f} %")
    simulation.set_velocity(plug, (KICK, 0, 0), angular=(0, SPIN, 0))
    spectra = spectrum(simulation.run(arguments.duration, TIME_STEP, progress=False))
    apart = np.abs(peaks(*spectra, expected) - expected)
    print(f"peaks of the spectrum at most {apart.max():.3f} Hz from theory")
    simulation.restore(rest)
    simulation.set_velocity(plug, (2.0, 0, 0), angular=(0, -8.0, 0))
    swing = simulation.run(0.3, progress=False)
    draw(swing, spectra, expected, arguments.out / "hanging_plug.png")
    print(f"Wrote {arguments.out / 'hanging_plug.png'}.")
    if off > FREQUENCY_ERROR:
        sys.exit("The frequencies are not those of theory.")
    if apart.max() > 1.0 / arguments.duration:
        sys.exit("The plug does not swing at the frequencies of theory.")


if __name__ == "__main__":
    main()
