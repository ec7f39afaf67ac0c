"""An arm that is too slender to stand is kept upright by its muscles: LQR from the Jacobian of a step.

An upright column of bending stiffness B and weight w per length buckles under its weight beyond l^3 = 7.837 B / w
(Greenhill 1881). This column is 1.37 times as long. Its lower half has a muscle. A linear-quadratic regulator changes
only the natural curvature of this muscle, once per time step. `step_jacobian` gives x' = A x + B u of a step, and
`state_difference` gives the state x. A force pushes at the tip. The example fails if the arm falls with the regulator
or stands without it, or if the growing mode of the step is not that of the linearised equations.

Writes out/upright_arm.png.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import solve_discrete_are

import withe
from withe.view import style

RADIUS, MODULUS, DENSITY, GRAVITY = 6e-3, 1e6, 1100.0, 9.81  # [m], [Pa], [kg/m^3], [m/s^2]
BENDING = MODULUS * np.pi * RADIUS**4 / 4.0  # [N m^2]
WEIGHT = DENSITY * GRAVITY * np.pi * RADIUS**2  # [N/m]
LONGEST = (7.837 * BENDING / WEIGHT) ** (1.0 / 3.0)  # greatest length that stands by itself [m]
LENGTH = 1.37 * LONGEST
NODES, TIME_STEP = 21, 5e-3  # [s]
PUSH, PUSHED = 3e-2, (1.0, 1.2)  # [N], from when to when [s]
STEADY = 0.02  # relative to the length: allowed distance of the tip at the end


class Balanced(NamedTuple):
    """An arm that was pushed."""

    record: withe.Record
    curvature: np.ndarray  # natural, of the lower half, at every step [1/m]

    @property
    def tip(self) -> np.ndarray:
        """Sideways [m]."""
        return self.record.positions()[:, -1, 0]


def upright() -> withe.Simulation:
    """The arm, clamped at its foot, straight under its weight: an equilibrium that is not stable."""
    scene = withe.Scene(gravity=(0.0, 0.0, -GRAVITY))
    rubber = withe.Material(youngs_modulus=MODULUS, poisson_ratio=0.5, density=DENSITY, viscosity=500.0)
    arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, LENGTH), nodes=NODES, radius=RADIUS, material=rubber, name="arm")
    scene.clamp(arm.start)
    push = scene.add_force(arm.end, (PUSH, 0.0, 0.0), name="push")  # along the plane that the arm may move in
    simulation = scene.build(integrator="backward_euler", planar=True, time_step=TIME_STEP)
    simulation.set(push, force=(0.0, 0.0, 0.0))
    guide = simulation.pin(arm.end, free=(0.0, 0.0, 1.0))
    simulation.equilibrium()
    simulation.release(guide)
    return simulation


def muscle(simulation: withe.Simulation) -> np.ndarray:
    """Natural curvature of every stencil for a unit of the lower half's, about the normal of the plane [1/m]."""
    arm = simulation["arm"]
    directors = simulation.directors(arm)[0]
    towards = directors[:2] @ np.array([1.0, 0.0, 0.0])  # curvature that leans towards x
    stencils = len(simulation.get(arm, "natural_curvature"))
    return np.outer(np.arange(stencils) < stencils // 2, towards)


def regulator(simulation: withe.Simulation, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A, B and the gain of u = -K x about the present state."""
    A, by_stencil = (m.toarray() for m in simulation.step_jacobian([(simulation["arm"], "natural_curvature")]))
    B = by_stencil @ shape.reshape(-1, 1)
    # The cost weighs displacements of nodes (1 for a tenth of the length) and curvature (1 for a quarter turn).
    C = simulation.linearise().displacement / (0.1 * LENGTH)
    unknowns = len(A) // 2
    Q = np.zeros_like(A)
    Q[:unknowns, :unknowns] = C.T @ C / NODES + 1e-6 * np.eye(unknowns)
    R = np.array([[(LENGTH / np.pi) ** 2]])
    P = solve_discrete_are(A, B, Q, R)
    return A, B, np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)


def pushed(duration: float, controlled: bool) -> Balanced:
    """The arm, pushed, with or without the regulator."""
    simulation = upright()
    reference, shape, commands = simulation.copy(), muscle(simulation), []
    gain = regulator(simulation, shape)[2] if controlled else None

    def steer(now: withe.Simulation) -> None:
        u = 0.0 if gain is None else -float((gain @ now.state_difference(reference))[0])
        commands.append(u)
        now.set("arm", natural_curvature=u * shape)
        now.set("push", force=(PUSH if PUSHED[0] <= now.time < PUSHED[1] else 0.0, 0.0, 0.0))

    record = simulation.run(duration, record_every=0.02, progress=False, before_step=steer)
    return Balanced(record, np.array(commands))


def draw(held: Balanced, fallen: Balanced, path: Path) -> None:
    """Draw both arms side by side, and the control of the muscle."""
    colors = style.use()
    figure = plt.figure(figsize=(10.4, 4.4))
    grid = figure.add_gridspec(2, 3, width_ratios=(1.2, 1.2, 1.5))
    tip, muscle = (figure.add_subplot(grid[row, 2]) for row in range(2))
    for column, way, color, title in (
        (0, fallen, colors.red, "without regulator"),
        (1, held, colors.blue, "with regulator"),
    ):
        axis = figure.add_subplot(grid[:, column])
        times, x = way.record.times, way.record.positions()
        shown = np.linspace(0, len(times) - 1, 12).astype(int)
        if way is held:
            shown = np.arange(np.searchsorted(times, PUSHED[0]), np.searchsorted(times, PUSHED[1] + 1.5), 3)
        for k in shown:
            axis.plot(100.0 * x[k, :, 0], 100.0 * x[k, :, 2], color=color, alpha=0.25, linewidth=3)
        axis.plot(100.0 * x[-1, :, 0], 100.0 * x[-1, :, 2], color=color, linewidth=5, solid_capstyle="round")
        axis.plot((-2.0, 2.0), (0.0, 0.0), color=colors.grey, linewidth=4)  # the foot is clamped; there is no floor
        axis.set(title=title, aspect="equal", xlim=(-16, 24), ylim=(-20, 28))
        style.label(axis, x=("x", "cm"), y=("z", "cm"))
    times = held.record.times
    tip.plot(times, 1e3 * held.tip)
    muscle.plot(TIME_STEP * np.arange(len(held.curvature)), held.curvature, color=colors.orange)
    for axis, title, quantity in (
        (tip, "tip", ("displacement", "mm")),
        (muscle, "muscle", ("natural curvature", "1/m")),
    ):
        axis.axvspan(*PUSHED, color=colors.pale, label="push")
        axis.set_title(title)
        style.label(axis, x=("time", "s"), y=quantity)
    style.legend(tip, side="top")
    figure.savefig(path)
    plt.close(figure)


def main() -> None:
    """Linearise, hold, let fall, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=6.0, help="[s]")
    parser.add_argument("--out", type=Path, default=Path("out"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("Takes about 2 s.", flush=True)

    simulation = upright()
    A, B, gain = regulator(simulation, muscle(simulation))
    growing = np.linalg.eigvals(A)
    growing = growing[np.abs(growing) > 1.0 + 1e-9]
    expected = -2.0 * np.pi * float(simulation.linearise().frequencies(1)[0])  # rate of exp(rate t), undamped
    print(f"{LENGTH / LONGEST:.2f} times as long as what stands; {len(growing)} growing mode(s)")
    rate = (1.0 - 1.0 / np.abs(growing).max()) / TIME_STEP  # rate for which backward Euler has this factor
    print(f"it grows with {rate:.3f} 1/s; by the linearised equations, without damping, {expected:.3f} 1/s")
    closed = np.abs(np.linalg.eigvals(A - B @ gain)).max()
    print(f"with the regulator the slowest mode decays with {-np.log(closed) / TIME_STEP:.2f} 1/s")

    held, fallen = pushed(arguments.duration, True), pushed(arguments.duration, False)
    print(
        f"held: tip at most {1e3 * np.abs(held.tip).max():.1f} mm aside, {1e3 * abs(held.tip[-1]):.2f} mm in the end; "
        f"muscle at most {np.abs(held.curvature).max():.2f} 1/m; without: {1e3 * abs(fallen.tip[-1]):.0f} mm"
    )
    draw(held, fallen, arguments.out / "upright_arm.png")
    print(f"Wrote {arguments.out / 'upright_arm.png'}.")
    if len(growing) != 1 or not 0.98 < rate / expected < 1.0 or closed >= 1.0:
        sys.exit("The step does not have the one growing mode of the equations, or the regulator does not hold it.")
    if abs(held.tip[-1]) > STEADY * LENGTH or abs(fallen.tip[-1]) < 0.3 * LENGTH:
        sys.exit("The arm falls with the regulator, or stands without.")


if __name__ == "__main__":
    main()
