"""Pixels of tags from the shape of a robot, its view, and the places of the tags."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from withe.errors import ConvergenceError
from withe.real2sim.places import Places
from withe.real2sim.stills import Equilibria
from withe.real2sim.unknowns import Tilt, Unknown
from withe.simulation.simulation import Simulation

__all__ = ["CameraProblem", "View"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

_VIEW = 4  # numbers of a view before the places of tags: roll, logarithm of scale, offset


class View:
    """Orthographic view of a plane, from the coordinates that follow the coordinates of the robot.

    A point x appears at offset + scale R(roll) axes x [px], where R turns clockwise in the picture.
    """

    roll: float
    scale: float
    offset: FloatArray
    places: FloatArray
    axes: FloatArray

    def __init__(self, coordinates: FloatArray, axes: FloatArray) -> None:
        self.roll, self.scale, self.offset = coordinates[0], float(np.exp(coordinates[1])), coordinates[2:_VIEW]
        self.places = coordinates[_VIEW:]
        cosine, sine = np.cos(self.roll), np.sin(self.roll)
        self.axes = np.array([[cosine, -sine], [sine, cosine]]) @ axes  # right and down in the picture, (2, 3)

    def scaled(self, points: FloatArray) -> FloatArray:
        """Pixels of points, shape (n, 3) [m], relative to the pixel of the origin."""
        return np.asarray(self.scale * points @ self.axes.T)


class CameraProblem:
    """Residuals of tags in pixels.

    The coordinates are those of the unknowns, roll [rad], logarithm of scale [px/m], offset (2) [px], places of tags
    [m].

    Parameters
    ----------
    side : {1, -1}
        Side from which the camera sees the plane. With 1, the mean of the tags is on the same side of the first tag as
        drawn.

    Attributes
    ----------
    begin : ndarray of shape (coordinates,)
        Coordinates of a level camera whose scale follows from the distances of the tags in the picture.
    axes : ndarray of shape (2, 3)
        Directions right and down in a level picture, in the world.
    """

    equilibria: Equilibria
    places: Places
    seen: FloatArray
    count: int
    axes: FloatArray
    begin: FloatArray
    scales: FloatArray
    per_frame: npt.NDArray[np.bool_]
    names: list[str]

    def __init__(
        self, simulation: Simulation, unknowns: list[Unknown], places: Places, seen: FloatArray, side: int = 1
    ) -> None:
        self.equilibria = Equilibria(simulation, unknowns)
        self.places, self.seen = places, seen
        self.count = len(self.equilibria.names)
        middle = _means(seen)
        known = np.flatnonzero(np.isfinite(middle[:, 0]))
        drawn = places.weights()[0] @ simulation.positions()
        self.axes = _level_axes(simulation, places)
        across = drawn[known] @ self.axes[0]
        alike = (middle[known, 0] - middle[known, 0].mean()) @ across >= 0.0
        self.axes[0] *= side if alike else -side
        length = float(np.abs(places.arcs[known[-1]] - places.arcs[known[0]]))
        scale = float(np.linalg.norm(np.diff(middle[known], axis=0), axis=1).sum()) / length
        offset = middle[known[0]] - scale * self.axes @ drawn[known[0]]
        self.begin = np.concatenate([self.equilibria.begin(), [0.0, np.log(scale)], offset, places.arcs])
        spacings = np.full(len(places), length / len(places))
        self.scales = np.concatenate([self.equilibria.scales, [1.0, 1.0, *2 * [scale * length]], spacings])
        self.per_frame = np.concatenate([self.equilibria.per_frame, np.zeros(_VIEW + len(places), bool)])
        tags = [f"place of tag {i}" for i in range(len(places))]
        self.names = [*self.equilibria.names, "roll of the camera", "scale", "offset right", "offset down", *tags]

    def free(self, words: Sequence[str]) -> BoolArray:
        """Return True for the fitted coordinates."""
        free = np.ones(len(self.scales), bool)
        free[: self.count] = [name != Tilt.name or "tilt" in words for name in self.equilibria.names]
        free[self.count] = "roll" in words
        free[self.count + 1] = "scale" in words
        free[self.count + _VIEW :] = "arcs" in words
        free[self.count + _VIEW] = False  # the offset is found
        if self.places.arcs[-1] >= self.places.lines[-1].ends[-1] * (1.0 - 1e-9):
            free[-1] = False
        return free

    def view(self, coordinates: FloatArray) -> View:
        """Return the view of the plane."""
        return View(coordinates[self.count :], self.axes)

    def residual(self, coordinates: FloatArray, frame: int) -> tuple[FloatArray, FloatArray] | None:
        """Return simulated minus observed pixels, and positions of nodes; None if there is no equilibrium."""
        try:
            positions = self.equilibria.positions(coordinates[: self.count], frame)
        except (ConvergenceError, ValueError):
            return None
        view = self.view(coordinates)
        pixels = view.scaled(self.places.weights(view.places)[0] @ positions) + view.offset
        return np.asarray((pixels - self.seen[frame]).ravel()), positions

    def jacobian(self, coordinates: FloatArray, state: FloatArray, frame: int) -> FloatArray:
        """Derivatives of the residual."""
        view, count, tags = self.view(coordinates), self.count, np.arange(len(self.places))
        weights, slopes = self.places.weights(view.places)
        scaled = view.scaled(weights @ state)
        by_node = view.scale * view.axes[None, :, None] * weights[:, None, :, None]
        by_robot = self.equilibria.derivatives(by_node.reshape(2 * len(tags), *state.shape), coordinates[:count], frame)
        jacobian = np.zeros((len(tags), 2, len(coordinates)))
        jacobian[:, :, :count] = by_robot.reshape(len(tags), 2, count)
        jacobian[:, 0, count], jacobian[:, 1, count] = -scaled[:, 1], scaled[:, 0]
        jacobian[:, :, count + 1] = scaled
        jacobian[:, 0, count + 2] = jacobian[:, 1, count + 3] = 1.0
        jacobian[tags, :, count + _VIEW + tags] = view.scaled(slopes @ state)
        return jacobian.reshape(2 * len(tags), -1)


def _level_axes(simulation: Simulation, places: Places) -> FloatArray:
    """Return right and down in the world, from gravity, or from the first rod if gravity has no part in the plane."""
    normal = np.asarray(simulation.plan.plane_normal)
    weight = simulation.get("gravity")
    up = -(weight - normal * (normal @ weight))
    if np.linalg.norm(up) < 1e-12:
        up = np.cross(simulation.directors(places.rods[0].name)[0, 2], normal)
    up /= np.linalg.norm(up)
    return np.stack([np.cross(up, normal), -up])


def _means(seen: FloatArray) -> FloatArray:
    """Return the mean position of every tag, NaN for a tag that was never seen."""
    known = np.isfinite(seen)
    counts = known.sum(axis=0)
    sums = np.where(known, seen, 0.0).sum(axis=0)
    return np.asarray(np.divide(sums, counts, where=counts > 0, out=np.full(sums.shape, np.nan)))
