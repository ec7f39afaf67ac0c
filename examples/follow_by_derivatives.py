"""An arm follows a target by derivatives of its own simulation: no learning.

Before each control step the arm's motion is linearised where it is, x' = A x + B u, by `step_jacobian`. Five actions
ahead are then the bounded least squares of

    sum_k |tip_k + sum_i K_(k-i) u_i - target_k|^2 + w |u|^2,     -1 <= u <= 1,

tip_k where the arm would come to without an action, by a copy of it that goes ahead, K_j what an action does to the
tip j control steps later. The first of them is done. With one action ahead this is the resolved rate.

python examples/follow_by_derivatives.py [EPISODES [FILM.gif]]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from learn_follow import PUBLISHED, check_tools, discounted_return, film
from scipy.optimize import lsq_linear

import withe

EFFORT = 1e-3  # square root of w [m]
SEGMENTS, NODES, CONTROL_STEP = (3, 4, 4, 4, 4), 21, 0.1  # [s]
BEND_STEP = 0.05  # total discrete curvature that an action adds to a segment


class Controller:
    """Actions for an arm of `Follow`.

    Parameters
    ----------
    ahead : int
        Actions that are looked ahead.
    """

    def __init__(self, ahead: int) -> None:
        self.ahead = ahead
        self._tip: np.ndarray | None = None

    def __call__(self, seen: np.ndarray, robots: withe.Batch) -> np.ndarray:
        """Actions for all robots, shape (n, 10)."""
        return np.array([self.action(row, arm) for row, arm in zip(seen, robots, strict=True)])

    def action(self, seen: np.ndarray, arm: withe.Simulation) -> np.ndarray:
        """The first of the actions that look best; none where the arm whips so that no look ahead is possible."""
        try:
            return self.best(seen, arm)
        except withe.ConvergenceError:
            return np.zeros(10)

    def best(self, seen: np.ndarray, arm: withe.Simulation) -> np.ndarray:
        """The first of the actions that look best."""
        steps = round(CONTROL_STEP / arm.time_step)
        free, goals, tips = arm.copy(), [], []
        for k in range(1, self.ahead + 1):
            free.step(steps)
            tips.append(free.positions("arm")[-1])
            goals.append(seen[-6:-3] + k * CONTROL_STEP * seen[-3:])
        responses = self.responses(arm, steps)
        matrix = np.zeros((self.ahead, 3, self.ahead, 10))
        for k in range(self.ahead):
            for i in range(k + 1):
                matrix[k, :, i] = responses[k - i]
        flat = matrix.reshape(3 * self.ahead, -1)
        rows = np.vstack([flat, EFFORT * np.eye(flat.shape[1])])
        wanted = np.append(np.ravel(np.subtract(goals, tips)), np.zeros(flat.shape[1]))
        found = lsq_linear(rows, wanted, (-1.0, 1.0), method="bvls", max_iter=50).x[:10]
        return np.clip(found, -1.0, 1.0)  # rounding

    def responses(self, arm: withe.Simulation, steps: int) -> list[np.ndarray]:
        """Return K_1, K_2, ...: displacements of the tip per unit of each action, shape (3, 10) [m]."""
        now = arm.copy()
        now.set("arm", natural_curvature=arm.get("arm", "natural_curvature"))  # ends any ramp of the natural curvature
        A, B = now.step_jacobian([("arm", "natural_curvature")])
        if self._tip is None:
            self._tip = tip_of_state(arm, A.shape[0])
        by_action = B @ self.curvatures(arm)
        state, found = np.zeros((A.shape[0], 10)), []
        for step in range(self.ahead * steps):
            state = A @ state + min((step + 0.5) / steps, 1.0) * by_action  # led there in a control step
            if (step + 1) % steps == 0:
                found.append(self._tip @ state)
        return found

    @staticmethod
    def curvatures(arm: withe.Simulation) -> np.ndarray:
        """Natural curvature by actions, shape (2 stencils, 10) [1/m]: k V = 2 arctan(kappa / 2) of each component."""
        voronoi = 1.0 / (NODES - 1)
        half_turns = 0.5 * voronoi * arm.get("arm", "natural_curvature")
        slopes = np.cos(half_turns) ** 2 / voronoi
        out = np.zeros((NODES - 2, 2, 2, 5))
        segment = np.repeat(np.arange(5), SEGMENTS)
        share = BEND_STEP / np.repeat(SEGMENTS, SEGMENTS)
        for component in range(2):
            out[np.arange(NODES - 2), component, component, segment] = share * slopes[:, component]
        return out.reshape(2 * (NODES - 2), 10)


def tip_of_state(arm: withe.Simulation, size: int) -> np.ndarray:
    """Derivative of the tip by each component of the state, shape (3, size)."""
    start, small = arm.positions("arm")[-1], 1e-6
    out = np.zeros((3, size))
    for column in range(size):
        moved = arm.copy()
        moved.displace_state(small * np.eye(size)[column])
        out[:, column] = (moved.positions("arm")[-1] - start) / small
    return out.round(6)


def main() -> int:
    """Discounted returns of both, beside the published one; and a film."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("episodes", type=int, nargs="?", default=4, help="over which returns are means; 4")
    parser.add_argument("film", type=Path, nargs="?", help="file of a film, .gif or .mp4")
    arguments = parser.parse_args()
    print("Takes about 60 s.", flush=True)
    if arguments.film:
        check_tools()
    found = {ahead: discounted_return(Controller(ahead), arguments.episodes) for ahead in (1, 5)}
    for ahead, value in found.items():
        print(f"{ahead} action(s) ahead: discounted return {value:.1f}; published for a learned one {PUBLISHED:.0f}")
    if arguments.film:
        film(Controller(5), arguments.film, seconds=6.0)
    return 0 if found[5] > found[1] else 1


if __name__ == "__main__":
    sys.exit(main())
