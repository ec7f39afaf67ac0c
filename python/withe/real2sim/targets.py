"""Targets of fits: curvatures, tags, or centrelines, frame by frame."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.short_repr import ShortRepr
from withe.perception.camera import Camera
from withe.real2sim.places import Place, Places, turning_axis
from withe.simulation.simulation import Simulation

__all__ = [
    "Curvatures",
    "Residual",
    "Tags",
    "Target",
    "across_of_points",
    "bind",
    "checked_times",
    "frames_of",
    "pixel_derivative",
    "turns",
]

FloatArray = npt.NDArray[np.float64]


class Residual(ABC):
    """Distance of positions from a frame of a target, in units of `sigma`, or of 1; NaN for missing data."""

    @abstractmethod
    def value(self, positions: FloatArray, frame: int) -> FloatArray:
        """Return the residual of positions in a frame.

        Parameters
        ----------
        positions : ndarray of shape (nodes, 3) [m]
            Positions of the nodes of the simulation.
        frame : int
            Frame of the target.

        Returns
        -------
        ndarray of shape (residuals,)
        """

    @abstractmethod
    def derivative(self, positions: FloatArray, frame: int) -> FloatArray:
        """Return the derivatives of the residual by positions.

        Parameters
        ----------
        positions : ndarray of shape (nodes, 3) [m]
            Positions of the nodes of the simulation.
        frame : int
            Frame of the target.

        Returns
        -------
        ndarray of shape (residuals, nodes, 3)
        """


class Target(ABC):
    """Target of a fit, frame by frame, with `times` of the frames [s] and a standard deviation `sigma`, or None."""

    times: Any
    sigma: float | None

    @property
    @abstractmethod
    def frames(self) -> int:
        """Number of frames."""

    @abstractmethod
    def bind(self, simulation: Simulation) -> Residual:
        """Return the residual for the nodes of a simulation.

        Parameters
        ----------
        simulation : Simulation
            Simulation whose nodes are compared with the target.

        Returns
        -------
        Residual

        Raises
        ------
        ValueError
            The target does not fit the simulation.
        """

    @abstractmethod
    def told(self, frame: int) -> int:
        """Return the number of observations in a frame.

        Parameters
        ----------
        frame : int
            Frame of the target.

        Returns
        -------
        int
        """

    @abstractmethod
    def across(self, normal: FloatArray) -> FloatArray:
        """Return the directions of a frame's residual that no motion in a plane changes.

        Parameters
        ----------
        normal : ndarray of shape (3,)
            Normal of the plane.

        Returns
        -------
        ndarray of shape (residuals, n)
            Orthonormal columns.
        """


def turns(points: FloatArray) -> FloatArray:
    """Angles between the chords of points in a plane, counter-clockwise positive, (..., n, 2) -> (..., n - 2) [rad]."""
    return _turns_of(points[..., 1:, :] - points[..., :-1, :])


def _turns_of(chords: FloatArray) -> FloatArray:
    before, after = chords[..., :-1, :], chords[..., 1:, :]
    cross = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
    along = before[..., 0] * after[..., 0] + before[..., 1] * after[..., 1]
    return np.asarray(np.arctan2(cross, along))


@dataclass(eq=False, repr=False)
class Curvatures(ShortRepr, Target):
    """Discrete curvatures 2 tan(turn / 2) at tags, averaged over groups of them.

    The turn at a tag is the angle between the chords to the tags before and after it, in a plane
    [Bergou et al. 2008, section 4.2.1].

    Parameters
    ----------
    values : array_like of shape (frames, groups)
        Curvatures, NaN for missing data. The sign is that of natural curvature along the first material director in the
        plane; in space, positive curvature turns about `normal`.
    places : sequence
        Places of the tags on the rods: nodes, or pairs of a rod and a length along it [m].
    groups : sequence of sequences of int
        Indices of the tags over which each value is averaged, from 0. The first and the last tag have no curvature.
    normal : array_like of shape (3,), optional
        Axis of positive rotations; not needed in a planar simulation.
    sigma : float [-], optional
        Standard deviation of the values. By default estimated from the residuals.
    times : array_like of shape (frames,), optional [s]

    Raises
    ------
    ValueError
        Wrong shapes, or a group without tags or with the first or last tag.
    """

    values: npt.ArrayLike
    places: Sequence[Place]
    groups: Sequence[Sequence[int]]
    normal: npt.ArrayLike | None = None
    sigma: float | None = None
    times: Any = None

    def __post_init__(self) -> None:
        self.groups = _checked_groups(self.groups, len(self.places))
        self.values = _with_gaps(self.values, "values", (None, len(self.groups)))
        self.sigma = None if self.sigma is None else validation.positive(self.sigma, "sigma")
        self.normal = None if self.normal is None else validation.unit_vector(self.normal, "normal")
        self.times = checked_times(self.times, len(self.values))

    @classmethod
    def from_pixels(
        cls, pixels: npt.ArrayLike, places: Sequence[Place], groups: Sequence[Sequence[int]], **options: Any
    ) -> Curvatures:
        """Compute curvatures from a picture of tags, seen perpendicular to the plane in which they move.

        Parameters
        ----------
        pixels : array_like of shape (frames, tags, 2) [px]
            x to the right, y down; NaN for tags that were not seen. Counter-clockwise rotations in the picture are
            positive.
        places, groups, **options
            Arguments of `Curvatures`.

        Returns
        -------
        Curvatures

        Raises
        ------
        ValueError
            A wrong shape, or an argument that `Curvatures` refuses.
        """
        seen = _with_gaps(pixels, "pixels", (None, len(places), 2))
        curvature = 2.0 * np.tan(turns(seen * (1.0, -1.0)) / 2.0)
        checked = _checked_groups(groups, len(places))
        means = np.stack([curvature[:, np.array(group) - 1].mean(axis=1) for group in checked], axis=1)
        return cls(means, places, checked, **options)

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(np.asarray(self.values))

    def told(self, frame: int) -> int:
        """Number of observations in a frame."""
        return int(np.isfinite(np.asarray(self.values)[frame]).sum())

    def across(self, normal: FloatArray) -> FloatArray:
        """Return None, since rotations are about one axis."""
        return np.zeros((len(self.groups), 0))

    def bind(self, simulation: Simulation) -> Residual:
        """Return the residual for the nodes of a simulation.

        Raises
        ------
        ValueError
            A place that is not on a rod, or no `normal` for a simulation that is not planar.
        """
        places = Places(simulation, self.places)
        axis = self.normal
        if axis is None:
            plane = turning_axis(simulation, places.rods[0])
            if plane is None:
                raise ValueError("normal must be given, because the simulation is not planar and turns need an axis")
            axis = plane[1]
        return _CurvatureResidual(self, places, np.asarray(axis, np.float64))


class _CurvatureResidual(Residual):
    def __init__(self, target: Curvatures, places: Places, axis: FloatArray) -> None:
        self._values, self._sigma, self._axis = np.asarray(target.values, np.float64), target.sigma or 1.0, axis
        first = np.eye(3)[np.abs(axis).argmin()]
        first = np.cross(first, axis)
        self._plane = np.stack([first / np.linalg.norm(first), np.cross(axis, first) / np.linalg.norm(first)])
        self._chords = np.diff(places.weights()[0], axis=0)  # chords of tags, from nodes
        self._bends = np.diff(np.eye(len(target.places) - 1), axis=0)  # differences of neighbouring chords
        self._means = np.zeros((len(target.groups), len(target.places) - 2))
        for row, group in enumerate(target.groups):
            self._means[row, np.array(group) - 1] = 1.0 / len(group)
        self._measured = b"", np.zeros((0, 2)), np.zeros(0)

    def _measure(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return chords in the plane, and tangents of half of the turns between them.

        The results for the last positions are stored: a frame begins with the last positions of the previous frame, and
        values and derivatives use the same positions.
        """
        which = positions.tobytes()
        if which != self._measured[0]:
            chords = self._chords @ positions @ self._plane.T
            self._measured = which, chords, np.tan(0.5 * _turns_of(chords))
        return self._measured[1:]

    def value(self, positions: FloatArray, frame: int) -> FloatArray:
        _, tangents = self._measure(positions)
        return np.asarray((2.0 * (self._means @ tangents) - self._values[frame]) / self._sigma)

    def derivative(self, positions: FloatArray, frame: int) -> FloatArray:
        chords, tangents = self._measure(positions)
        # A chord e turns by (e x de) / |e|^2 about the axis: by (axis x e) . de.
        across = chords[:, ::-1] * (-1.0, 1.0) / (chords**2).sum(axis=1, keepdims=True)
        slope = self._means * (1.0 + tangents**2) / self._sigma
        by_chord = (slope @ self._bends)[:, :, None] * (across @ self._plane)
        return np.asarray(self._chords.T @ by_chord)


@dataclass(eq=False, repr=False)
class Tags(ShortRepr, Target):
    """Positions of tags on rods, in pixels or in metres.

    Parameters
    ----------
    points : array_like of shape (frames, tags, 2) [px] or (frames, tags, 3) [m]
        Positions. Pixels need a camera, which `calibrate` finds. NaN for tags that were not seen.
    places : sequence
        Places of the tags on the rods: nodes, or pairs of a rod and a length along it [m].
    camera : perception.Camera, optional
    sigma : float, optional [px or m]
        Standard deviation of a coordinate. By default estimated from the residuals.
    times : array_like of shape (frames,), optional [s]

    Raises
    ------
    ValueError
        Wrong shapes.
    """

    points: npt.ArrayLike
    places: Sequence[Place]
    camera: Camera | None = None
    sigma: float | None = None
    times: Any = None

    def __post_init__(self) -> None:
        in_pixels = self.camera is not None or np.shape(self.points)[-1:] == (2,)
        what = "points in pixels" if in_pixels else "points in metres"
        self.points = _with_gaps(self.points, what, (None, len(self.places), 2 if in_pixels else 3))
        self.sigma = None if self.sigma is None else validation.positive(self.sigma, "sigma")
        self.times = checked_times(self.times, len(self.points))

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(np.asarray(self.points))

    def told(self, frame: int) -> int:
        """Number of observations in a frame."""
        return int(np.isfinite(np.asarray(self.points)[frame]).sum())

    def across(self, normal: FloatArray) -> FloatArray:
        """Return the normal at each tag, or None in pixels."""
        return across_of_points(len(self.places), normal, self.camera is None)

    def without(self, outliers: Sequence[tuple[int, int]]) -> Tags:
        """Return these tags without some tags in some frames.

        Parameters
        ----------
        outliers : sequence of (frame, tag)
            Frames and tags to leave out, such as `Fit.outliers`.

        Returns
        -------
        Tags
        """
        points = np.array(self.points)
        for frame, tag, *_ in outliers:
            points[frame, tag] = np.nan
        return Tags(points, self.places, self.camera, self.sigma, self.times)

    def bind(self, simulation: Simulation) -> Residual:
        """Return the residual for the nodes of a simulation.

        Raises
        ------
        ValueError
            A place that is not on a rod, or no camera for tags in pixels.
        """
        if self.camera is None and np.shape(self.points)[2] == 2:
            raise ValueError("camera must be given for tags in pixels; real2sim.calibrate finds one")
        return _TagResidual(self, Places(simulation, self.places))


class _TagResidual(Residual):
    def __init__(self, target: Tags, places: Places) -> None:
        self._points, self._camera, self._sigma = np.asarray(target.points), target.camera, target.sigma or 1.0
        self._weights = places.weights()[0]

    def value(self, positions: FloatArray, frame: int) -> FloatArray:
        points = self._weights @ positions
        seen = points if self._camera is None else self._camera.project(points)
        return np.asarray((seen - self._points[frame]).ravel() / self._sigma)

    def derivative(self, positions: FloatArray, frame: int) -> FloatArray:
        tags = len(self._weights)
        by_point = np.broadcast_to(np.eye(3), (tags, 3, 3))
        if self._camera is not None:
            by_point = pixel_derivative(self._camera, self._weights @ positions)
        by_node = by_point[:, :, None] * self._weights[:, None, :, None] / self._sigma
        return np.asarray(by_node.reshape(-1, *positions.shape))


def across_of_points(count: int, normal: FloatArray, in_metres: bool) -> FloatArray:
    """Return `Target.across` of points, (3 count, count) in metres, (2 count, 0) in pixels."""
    return np.asarray(np.kron(np.eye(count), normal[:, None])) if in_metres else np.zeros((2 * count, 0))


def pixel_derivative(camera: Camera, points: FloatArray) -> FloatArray:
    """Return the derivative of pixels by points, shape (n, 2, 3) [px/m], by central differences of the projection."""
    step = 1e-5 * max(float(np.ptp(points, axis=0).max()), 1e-3)
    near = points[None, None] + step * np.array([1.0, -1.0])[:, None, None, None] * np.eye(3)[None, :, None]
    pixels = camera.project(near.reshape(-1, 3)).reshape(2, 3, len(points), 2)
    return np.asarray(((pixels[0] - pixels[1]) / (2.0 * step)).transpose(1, 2, 0))


class _Together(Residual):
    """Several targets of the same frames."""

    def __init__(self, residuals: list[Residual]) -> None:
        self._residuals = residuals

    def value(self, positions: FloatArray, frame: int) -> FloatArray:
        return np.concatenate([residual.value(positions, frame) for residual in self._residuals])

    def derivative(self, positions: FloatArray, frame: int) -> FloatArray:
        return np.concatenate([residual.derivative(positions, frame) for residual in self._residuals])


def frames_of(targets: Target | Sequence[Target]) -> list[Target]:
    """Return targets as a list; all must have the same number of frames.

    Raises
    ------
    ValueError
        No target, another type, or different numbers of frames.
    """
    listed = [targets] if isinstance(targets, Target) else list(targets)
    for target in listed:
        if not isinstance(target, Target):
            raise ValueError(f"targets must be Curvatures, Tags or Centrelines, got {type(target).__name__}")
    if not listed or listed[0].frames == 0:
        raise ValueError("targets must have at least one frame")
    if len({target.frames for target in listed}) > 1:
        counts = ", ".join(str(target.frames) for target in listed)
        raise ValueError(f"targets must have the same number of frames, got {counts}")
    if len(listed) > 1 and any(target.sigma is None for target in listed):
        raise ValueError(
            "sigma of every target must be given when there are several, because the sigmas weight the targets"
        )
    return listed


def bind(targets: list[Target], simulation: Simulation) -> Residual:
    """Return the residual of all targets for the nodes of a simulation."""
    bound = [target.bind(simulation) for target in targets]
    return bound[0] if len(bound) == 1 else _Together(bound)


def _checked_groups(groups: Sequence[Sequence[int]], tags: int) -> list[tuple[int, ...]]:
    if tags < 3:
        raise ValueError(f"places must be three at least, got {tags}: a turn needs a tag on either side")
    if len(groups) == 0:
        raise ValueError("groups must be at least one, got none")
    checked = []
    for group in groups:
        if len(group) == 0:
            raise ValueError("groups must have at least one tag each, got an empty one")
        checked.append(tuple(validation.integer(tag, "tags of groups", 1, tags - 2) for tag in group))
    return checked


def _with_gaps(values: npt.ArrayLike, what: str, shape: tuple[int | None, ...]) -> FloatArray:
    """A copy as numbers, of which some may be NaN."""
    try:
        array = np.array(np.ma.filled(np.ma.asarray(values, dtype=float), np.nan), np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what} must be numbers: {error}") from None
    fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = ", ".join("frames" if n is None else str(n) for n in shape)
        raise ValueError(f"{what} must have shape ({wanted}), got {array.shape}")
    if np.isinf(array).any():
        raise ValueError(f"{what} must be finite, or NaN where nothing was seen, got infinity")
    return array


def checked_times(times: Any, frames: int) -> FloatArray | None:
    """Check times of frames, if given: they must increase."""
    if times is None:
        return None
    array = validation.number_array(times, "times", (frames,))
    if (np.diff(array) <= 0.0).any():
        raise ValueError("times must increase from frame to frame")
    return array
