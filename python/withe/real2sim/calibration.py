"""Calibration of a camera that sees tags of a planar robot, together with the shapes of the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.progress import Progress
from withe.common.progress import progress as progress_bar
from withe.errors import ConvergenceError
from withe.perception.camera import Camera
from withe.real2sim.camera_problem import CameraProblem
from withe.real2sim.least_squares import FrameSolution, all_frames, lone_frame, reduced, spectra, weaknesses
from withe.real2sim.parsing import parse_unknowns
from withe.real2sim.places import Line, Places
from withe.real2sim.results import Unobservable
from withe.real2sim.shape_unknowns import NaturalCurvature
from withe.real2sim.targets import Tags
from withe.real2sim.unknowns import Tilt, Unknown
from withe.simulation.simulation import Simulation

__all__ = ["Calibration", "calibrate"]

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
Free = Literal["roll", "scale", "arcs", "tilt"]

_FREE = ("roll", "scale", "arcs", "tilt")
_PIXELS = 1e-6  # norm of residuals that counts as zero
_ITERATIONS = 50
_RESOLVED = 1e-3  # [px]; better than the resolution of any detector of tags
_SIDE = "side of the plane on which the camera is"


class Calibration(Camera):
    """A camera perpendicular to the plane in which a robot moves, and the places of its tags, made by `calibrate`.

    Attributes
    ----------
    roll : float [rad]
        Clockwise rotation of the picture against the vertical.
    scale : float [px/m]
    tilt : float [rad]
        Tilt of the base, towards positive curvature; 0 unless it was fitted.
    places : list of (str, float [m])
        Rod and length along it [m] of every tag, for `Tags`.
    gravity : ndarray of shape (3,) [m/s^2]
        Gravity for the simulation: turned back by the tilt.
    residuals : ndarray of shape (frames, tags, 2) [px]
        Simulated minus observed positions in the frames that were used.
    unobservable : tuple of Unobservable
        Combinations of unknowns that these frames do not determine. Print them.
    """

    roll: float
    scale: float
    tilt: float
    places: list[tuple[str, float]]
    gravity: FloatArray
    residuals: FloatArray
    unobservable: tuple[Unobservable, ...]

    def __repr__(self) -> str:
        turns = f"roll {self.roll:.4g} rad, tilt {self.tilt:.4g} rad"
        told = [f"\n  not observable: {each}" for each in self.unobservable]
        return f"Calibration({self.scale:.5g} px/m, {turns}, RMS of tags {self.rms:.3g} px)" + "".join(told)

    @property
    def rms(self) -> float:
        """Root mean square distance of tags from their observed positions [px]."""
        return float(np.sqrt(np.nanmean((self.residuals**2).sum(axis=2))))


@keyword_hints
def calibrate(
    simulation: Simulation,
    tags: Tags,
    frames: slice | Sequence[int] = slice(None),
    free: Sequence[Free] = ("roll", "scale", "arcs"),
    *,
    unknowns: Sequence[Any] | None = None,
    progress: bool = True,
) -> Calibration:
    """Calibrate the camera that saw tags of a planar robot, together with the robot's shapes.

    The camera looks straight at the plane and is nearly upright. A point (x, y) of the plane, right and up against
    gravity, is seen at offset + scale R(roll) (x, -y), with x right and y down in the picture. The offset is always
    fitted.

    Cameras on both sides of the plane are tried, and the one with the smaller residuals is kept. Both residuals are
    equally small, for example, for a robot that is drawn straight down. `Calibration.unobservable` then names the side,
    and the camera is on the side from which the robot appears, on the mean, as it is drawn.

    Parameters
    ----------
    simulation : Simulation
        Planar simulation of the robot. It is not changed.
    tags : Tags
        Tags in pixels, without a camera, with at least two places.
    frames : slice or sequence of int
        Frames to use. Leave some out to test the camera on them.
    free : sequence of {"roll", "scale", "arcs", "tilt"}
        Fitted quantities; the others are 0 or as given in `tags`.

        * "roll": roll of the camera
        * "scale": its scale; otherwise the scale follows from the distances of the tags
        * "arcs": places of the tags along the robot, except the first, and the last if it is at the tip
        * "tilt": tilt of the base
    unknowns : sequence of tuples, optional
        Unknowns of the robot, as in `fit`. By default a constant natural curvature of every rod.
    progress : bool
        True to show a progress bar on a terminal and in a notebook.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        A simulation that is not planar, tags that are not in pixels, or no visible tag.
    ConvergenceError
        The robot has no equilibrium for some frame.

    Notes
    -----
    The calibration has errors that all frames share, and that `Fit.covariance` of a fit with this camera does not
    include. They decrease with the root of the number of frames. With natural curvature constant along an arm,
    calibrated and fitted in the same frames:

    * nine tags in 12 frames: errors were 1.5 times the sigmas of the fit
    * six tags in 6 frames: 2.2 times
    """
    listed = _checked(simulation, tags, free)
    chosen = _chosen(frames, tags.frames)
    seen = np.asarray(tags.points, np.float64)
    good = [f for f in chosen if np.isfinite(seen[f]).any()]
    if not good:
        raise ValueError(f"tags must be seen in some of the {len(chosen)} frames that were asked for, got none")
    found: list[Calibration] = []
    failed: list[ConvergenceError] = []
    with progress_bar(2 * len(good), "calibrating", progress, unit="frames") as bar:
        for side in (1, -1):
            problem = _problem(simulation, tags, listed, unknowns, side)
            open_ = problem.free(listed)
            try:
                found.append(_calibration(problem, _solve(problem, good, open_, bar), open_))
            except ConvergenceError as error:
                failed.append(error)
    if not found:
        raise failed[0]
    return _better(found)


def _problem(
    simulation: Simulation, tags: Tags, free: Sequence[str], unknowns: Sequence[Any] | None, side: int
) -> CameraProblem:
    """Return the problem of a camera on one side of the plane."""
    copy = simulation.copy()
    own: list[Unknown] = (
        [NaturalCurvature(copy, rod) for rod in copy.rods] if unknowns is None else parse_unknowns(copy, unknowns)
    )
    if "roll" in free or "tilt" in free:
        own.append(Tilt(copy))
    return CameraProblem(copy, own, Places(copy, tags.places), np.asarray(tags.points, np.float64), side)


def _better(found: list[Calibration]) -> Calibration:
    """Return the camera with the smaller residuals among upright cameras, or the first one if they are equal.

    As with other unknowns, the side is unobservable if a change of side moves tags by less than the misfit.
    """
    upright = [camera for camera in found if np.cos(camera.roll) > 0.0] or found
    if len(upright) == 1:
        return upright[0]
    likely, other = upright
    best, rest = (other, likely) if other.rms < likely.rms - _RESOLVED else (likely, other)
    squares, more = (float(np.nanmean(camera.residuals**2)) for camera in (best, rest))
    effect, misfit = float(np.sqrt(max(more - squares, 0.0))), float(np.sqrt(squares))
    if effect < max(misfit, _RESOLVED):
        best.unobservable += (Unobservable({_SIDE: 1.0}, effect, misfit),)
    return best


class _Restricted:
    """The same problem, in which some coordinates keep their initial values."""

    def __init__(self, problem: CameraProblem, free: BoolArray, start: FloatArray) -> None:
        self._problem, self._free, self._start = problem, free, start
        self.scales, self.per_frame = problem.scales[free], problem.per_frame[free]

    def whole(self, coordinates: FloatArray) -> FloatArray:
        """All coordinates."""
        whole = self._start.copy()
        whole[self._free] = coordinates
        return whole

    def residual(self, coordinates: FloatArray, frame: int) -> tuple[FloatArray, FloatArray] | None:
        """As that of the problem."""
        return self._problem.residual(self.whole(coordinates), frame)

    def jacobian(self, coordinates: FloatArray, state: FloatArray, frame: int) -> FloatArray:
        """As that of the problem."""
        return self._problem.jacobian(self.whole(coordinates), state, frame)[:, self._free]


def _checked(simulation: Simulation, tags: Tags, free: Sequence[str]) -> list[str]:
    """Return the names of the free parameters of the camera, after checking all arguments."""
    if not isinstance(tags, Tags) or np.shape(tags.points)[2] != 2:
        raise ValueError("tags must be real2sim.Tags in pixels, shape (frames, tags, 2), without a camera")
    if len(tags.places) < 2:
        raise ValueError(f"tags must have two places at least, got {len(tags.places)}")
    if simulation.plan.plane_normal is None:
        raise ValueError("simulation must be planar: a camera in space is found by Camera.from_points")
    words = [free] if isinstance(free, str) else list(free)
    for word in words:
        validation.choice(word, "free", _FREE)
    return words


def _chosen(frames: slice | Sequence[int], count: int) -> list[int]:
    if isinstance(frames, slice):
        return list(range(count))[frames]
    return [validation.integer(frame, "frames", 0, count - 1) for frame in frames]


def _solve(problem: CameraProblem, frames: list[int], free: BoolArray, bar: Progress) -> dict[int, FloatArray]:
    """All coordinates of every frame: first its own for the camera as it begins, then all of them."""
    restricted = _Restricted(problem, free, problem.begin)
    own = restricted.per_frame
    start, guess = {}, problem.begin[free]
    for frame in frames:
        guess = lone_frame(restricted, frame, guess, own, _PIXELS, _ITERATIONS).coordinates
        start[frame] = guess
    found = all_frames(restricted, frames, start, _PIXELS, _ITERATIONS, lambda: bar.advance(1))
    failed = [frame for frame in frames if frame not in found]
    if failed:
        raise ConvergenceError(
            f"frame {failed[0]} has no equilibrium for the initial guess of the camera: leave the frame out of "
            "frames, or set natural curvatures that look more like the frame"
        )
    return {frame: restricted.whole(solution.coordinates) for frame, solution in found.items()}


def _calibration(problem: CameraProblem, found: dict[int, FloatArray], free: BoolArray) -> Calibration:
    """Return the camera, with the focal length for a distance of one metre, since pictures of planes do not show it."""
    last = next(reversed(found.values()))
    view = problem.view(last)
    forwards = np.cross(*view.axes)
    depth = float(forwards @ problem.places.rods[0].points[0])
    camera = Calibration(
        np.diag([view.scale, view.scale, 1.0]),
        rotation=np.stack([*view.axes, forwards]),
        translation=(*(view.offset / view.scale), 1.0 - depth),
    )
    camera.roll, camera.scale = float(view.roll), view.scale
    camera.places = [_on_rod(line, arc) for line, arc in zip(problem.places.lines, view.places, strict=True)]
    names = problem.equilibria.names
    tilt = next((u for u in problem.equilibria.unknowns if isinstance(u, Tilt)), None)
    camera.tilt = float(last[names.index(Tilt.name)]) if tilt is not None else 0.0
    camera.gravity = problem.equilibria.simulation.get("gravity") if tilt is None else tilt.gravity(camera.tilt)
    solutions = {}
    for frame, coordinates in found.items():
        evaluated = problem.residual(coordinates, frame)
        assert evaluated is not None
        residual, state = evaluated
        jacobian = problem.jacobian(coordinates, state, frame) * problem.scales
        jacobian[np.isnan(residual)] = 0.0
        solutions[frame] = FrameSolution(coordinates, residual, jacobian, 0, True)
    camera.residuals = np.stack([s.residual.reshape(-1, 2) for s in solutions.values()])
    camera.unobservable = _not_told(problem, solutions, free)
    return camera


def _not_told(problem: CameraProblem, solutions: dict[int, FrameSolution], free: BoolArray) -> tuple[Unobservable, ...]:
    """Return combinations that move the tags by less than the misfit. The tilt of the base is always among them."""
    asked = free | np.array([name == Tilt.name for name in problem.names])
    shared = asked & ~problem.per_frame
    kept = {f: FrameSolution(s.coordinates, s.residual, s.jacobian[:, asked], 0, True) for f, s in solutions.items()}
    matrix, _ = reduced(kept, problem.per_frame[asked])
    residuals = np.concatenate([s.residual for s in solutions.values()])
    rows = int(np.isfinite(residuals).sum())
    misfit = float(np.sqrt(np.nanmean(residuals**2)))
    names = [name for name, one in zip(problem.names, shared, strict=True) if one]
    return tuple(
        Unobservable(
            {n: float(w) for n, w in zip(names, weakness.direction, strict=True) if abs(w) > 0.1},
            weakness.effect,
            misfit,
        )
        for weakness in weaknesses(spectra([matrix])[0], rows, misfit)
    )


def _on_rod(line: Line, arc: float) -> tuple[str, float]:
    """A place along a line as one along a rod; beyond an end, at the end."""
    rod = int(np.searchsorted(line.offsets, arc, side="right")) - 1
    part, offset = line.rods[max(rod, 0)], line.offsets[max(rod, 0)]
    return part.name, float(np.clip(arc - offset, 0.0, part.lengths.sum()))
