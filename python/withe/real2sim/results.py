"""Results of fits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.parts.handles import Rod
from withe.real2sim.shape_unknowns import DrawnShape
from withe.real2sim.unknowns import Unknown, order_of_writing
from withe.simulation.simulation import Simulation

__all__ = ["Fit", "Outlier", "Unobservable"]

FloatArray = npt.NDArray[np.float64]
_ROWS_SHOWN = 8  # number of printed rows of each kind


@dataclass(frozen=True)
class Outlier:
    """A tag that jumped in one frame relative to its residuals in the neighbouring frames.

    A tag is an outlier if its error in a fit without the tag exceeds four times the usual error. Errors are relative to
    their expected standard deviation, so the limit is higher if few other tags or frames can check the tag. For normal
    errors the limit is 7 sigma in pixels and 9 sigma in metres. Smaller errors bias the frame without being reported.

    Attributes
    ----------
    frame, tag : int
        Indices, from 0.
    jump : float [px or m]
        Distance between the residual of the tag and its prediction from the neighbouring frames, for a fit without the
        tag, in the unit of the target [px or m].
    scatter : float [px or m]
        Usual error: 1.48 times the median over all tags, at least sigma, or a millionth of the extent of all tags
        without one.
    """

    frame: int
    tag: int
    jump: float
    scatter: float

    def __str__(self) -> str:
        return (
            f"frame {self.frame}: tag {self.tag} jumps by {self.jump:.3g}, usual is {self.scatter:.2g}; leave it out "
            "by targets.without(fit.outliers)"
        )


@dataclass(frozen=True, eq=False)
class Unobservable:
    """A combination of unknowns that the targets do not determine.

    Attributes
    ----------
    weights : dict of str to float [-]
        Share of each unknown in the combination: of the logarithm of a parameter, or of natural curvature times the
        length of the rod.
    effect : float [sigma, or unit of the target]
        Root mean square motion of the targets for a change by a factor e, or for a turn of one radian, while all other
        unknowns adapt. In units of sigma, or of the target without sigma.
    misfit : float [sigma, or unit of the target]
        Root mean square residual of the fit, in the same unit as `effect`. A systematic misfit of this size would hide
        the change.
    frames : tuple of int
        Frames with this combination; empty means all frames.
    """

    weights: dict[str, float]
    effect: float
    misfit: float
    frames: tuple[int, ...] = ()

    def __str__(self) -> str:
        main = sorted(self.weights.items(), key=lambda item: -abs(item[1]))[:4]
        text = main[0][0] if len(main) == 1 else " ".join(f"{weight:+.2f} {name}" for name, weight in main)
        where = f" in {len(self.frames)} frames" if self.frames else ""
        return f"{text}: moves the targets by {self.effect:.2g}, the misfit is {self.misfit:.2g}{where}"


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """Result of a fit, frame by frame.

    Attributes
    ----------
    names : tuple of str
        Names of the unknowns.
    values : ndarray of shape (frames, unknowns)
        Values in SI units. Shared values stand in every row. NaN in skipped frames.
    residuals : ndarray of shape (frames, residuals)
        Simulated minus observed values, in units of sigma, or of the target without sigma. NaN without observation.
    covariance : ndarray of shape (frames, unknowns, unknowns)
        Covariance of the values, for independent errors of the targets. The variance of the errors is sigma^2, or the
        mean square of the residuals per degree of freedom. NaN without either, infinite for unobservable values. For a
        motion the covariance includes errors of the time step, and the correlation of residuals from frame to frame. In
        a planar scene residuals across the plane do not count. The camera counts as exact; with a camera of `calibrate`
        the true errors are greater, see there.
    solves : ndarray of int of shape (frames,)
        Number of equilibria for each frame.
    iterations : ndarray of int of shape (frames,)
        Number of outer iterations.
    converged : ndarray of bool of shape (frames,)
        True if no small change of the unknowns reduces the residuals. This includes local minima, and targets out of
        reach.
    reasons : dict of int to str
        Reasons why frames did not converge, were skipped, or have residuals beyond sigma. Residuals are beyond sigma if
        the sum of squares exceeds 9 sigma^2 per degree of freedom, and a bound that noise exceeds once in a million
        frames. For motions also too coarse a mesh, or too long a time step.
    unobservable : tuple of Unobservable
        Combinations of unknowns that the targets do not determine.
    outliers : tuple of Outlier
        Tags that jump in one frame. Only fits of frames to `Tags` detect outliers.
    unchecked : tuple of (int, int)
        Frames and tags in which an outlier cannot be detected: the tag was seen in fewer than four neighbouring frames,
        or too few other tags of the frame predict its position.
    """

    names: tuple[str, ...]
    values: FloatArray
    residuals: FloatArray
    covariance: FloatArray
    solves: npt.NDArray[np.int64]
    iterations: npt.NDArray[np.int64]
    converged: npt.NDArray[np.bool_]
    reasons: dict[int, str]
    unobservable: tuple[Unobservable, ...]
    outliers: tuple[Outlier, ...]
    unchecked: tuple[tuple[int, int], ...]
    _unknowns: tuple[Unknown, ...]
    _coordinates: FloatArray

    def __repr__(self) -> str:
        seen = np.isfinite(self.rms)
        left = np.sqrt(np.mean(self.rms[seen] ** 2)) if seen.any() else np.nan
        return "\n  ".join(
            [
                f"Fit({self.converged.sum()} of {len(self.values)} frames converged, RMS of the residuals {left:.3g})",
                *_some(self._ranges()),
                *_some(f"not observable: {each}" for each in self.unobservable),
                *_some(f"outlier: {each}" for each in self.outliers),
                *self._not_looked_for(),
                *_some(f"frame {frame}: {reason}" for frame, reason in self.reasons.items()),
            ]
        )

    def _ranges(self) -> Iterable[str]:
        sigmas = np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))
        for name, values, deviations in zip(self.names, self.values.T, sigmas.T, strict=True):
            lowest, highest = np.nanmin(values), np.nanmax(values)
            span = f"{lowest:.6g}" if lowest == highest else f"{lowest:.6g} to {highest:.6g}"
            known = deviations[np.isfinite(deviations)]
            yield f"{name}: {span}" + (f", sigma {np.median(known):.2g}" if len(known) else "")

    def _not_looked_for(self) -> Iterable[str]:
        if self.unchecked:
            frames = len({frame for frame, _ in self.unchecked})
            yield (
                f"outliers were not checked at {len(self.unchecked)} tags in {frames} frames: too few neighbouring "
                "frames or tags predict their positions"
            )

    @property
    def skipped(self) -> tuple[int, ...]:
        """Frames without observations."""
        return tuple(int(i) for i in np.flatnonzero(np.isnan(self.residuals).all(axis=1)))

    @property
    def rms(self) -> FloatArray:
        """Root mean square of every frame's residuals, shape (frames,); NaN without observations."""
        known = np.isfinite(self.residuals)
        sums = np.where(known, self.residuals, 0.0) ** 2
        counts = known.sum(axis=1)
        return np.asarray(
            np.sqrt(np.divide(sums.sum(axis=1), counts, where=counts > 0, out=np.full(len(counts), np.nan)))
        )

    def value(self, rod: Rod | str, word: str = "natural_curvature") -> FloatArray:
        """Return the values of one unknown: of a rod, or `value("delay")`.

        Parameters
        ----------
        rod : Rod or str
            Rod of the unknown, or "delay".
        word : str
            Parameter of the rod.

        Returns
        -------
        ndarray of shape (frames, n)
            Values in SI units.

        Raises
        ------
        ValueError
            It was not an unknown of the fit.
        """
        return self.values[:, self._place(rod, word)]

    def sigma(self, rod: Rod | str, word: str = "natural_curvature") -> FloatArray:
        """Return the standard deviations of one unknown.

        Parameters
        ----------
        rod : Rod or str
            Rod of the unknown, or "delay".
        word : str
            Parameter of the rod.

        Returns
        -------
        ndarray of shape (frames, n)
            Standard deviations in SI units.

        Raises
        ------
        ValueError
            It was not an unknown of the fit.
        """
        deviations = np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))
        return np.asarray(deviations[:, self._place(rod, word)])

    def apply(self, simulation: Simulation, frame: int = -1) -> None:
        """Set the values of a frame in a simulation.

        Parameters
        ----------
        simulation : Simulation
            The fitted simulation, or another one of the same scene.
        frame : int

        Raises
        ------
        ValueError
            A skipped frame, or another scene.
        """
        coordinates = self._coordinates[frame]
        if not np.isfinite(coordinates).all():
            raise ValueError(f"frame {frame} was skipped, because nothing was seen in it: give a frame with values")
        ends = np.cumsum([len(unknown) for unknown in self._unknowns])
        for index in order_of_writing(simulation, self._unknowns):
            unknown, end = self._unknowns[index], ends[index]
            unknown.write(simulation, coordinates[end - len(unknown) : end])

    def points(self, rod: Rod | str, frame: int = -1) -> FloatArray:
        """Return the drawn nodes of a rod from its fitted ``points``.

        Parameters
        ----------
        rod : Rod or str
            Rod to read.
        frame : int
            Frame of the fit. By default the last one.

        Returns
        -------
        ndarray of shape (nodes, 3) [m]

        Raises
        ------
        ValueError
            The ``points`` of the rod were not fitted.
        """
        place = self._place(rod, "points")
        name = rod if isinstance(rod, str) else rod.name
        found = next(u for u in self._unknowns if isinstance(u, DrawnShape) and name in u.rods)
        return found.points(self._coordinates[frame, place])

    def _place(self, rod: Rod | str, word: str) -> slice:
        name = rod if isinstance(rod, str) else rod.name
        word = name if name == "delay" else word
        start = 0
        for unknown in self._unknowns:
            if unknown.word == word and (name in unknown.rods or name == word):
                return slice(start, start + len(unknown))
            start += len(unknown)
        raise ValueError(f"{word} of rod {name!r} was not fitted; these were: {', '.join(self.names)}")


def _some(lines: Iterable[str]) -> list[str]:
    """The first of some lines, and how many more there are."""
    first = list(lines)
    more = len(first) - _ROWS_SHOWN
    return [*first[:_ROWS_SHOWN], f"and {more} more"] if more > 1 else first
