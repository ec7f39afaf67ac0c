"""A sheet on a table that a jaw folds, for any model of rods."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import replace
from typing import Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.folding.jaw import Jaw
from withe.folding.jaw_motion import Motion
from withe.folding.noise import Drawn, Noise
from withe.folding.paper import Paper, require_length
from withe.folding.views import table_picture
from withe.perception.camera import Camera
from withe.scene.scene import Scene
from withe.simulation.simulation import Simulation

__all__ = ["LONGEST", "FoldingMotion", "TableSheet", "node_places"]

FloatArray = npt.NDArray[np.float64]
LONGEST = 600.0  # [s] that a progress bar expects of motions whose duration is not known

F = TypeVar("F")


class FoldingMotion(Motion, Protocol):
    """A motion with the target of the edge."""

    @property
    def target(self) -> float:
        """Return the place on the sheet where the lifted edge should lie in the end [m]."""


@keyword_hints
class TableSheet(ABC, Generic[F]):
    """A paper with the deviations of a seed, a jaw, and the simulation of both. `F` is the result of a fold."""

    paper: Paper
    jaw: Jaw
    truth: Paper
    simulation: Simulation

    def __init__(self, paper: Paper, seed: int, noise: Noise | None, jaw: Jaw | None) -> None:
        if not isinstance(paper, Paper):
            raise ValueError(f"paper must be a Paper, got {paper!r}")
        if noise is not None and not isinstance(noise, Noise):
            raise ValueError(f"noise must be a Noise, got {noise!r}")
        self.paper, self.jaw = paper, Jaw() if jaw is None else jaw
        self._seed = validation.integer(seed, "seed", 0, 2**63 - 1)
        self._grain = np.random.default_rng(self._seed)
        self._drawn = Drawn.of(Noise.none() if noise is None else noise, self._seed)
        self.truth = replace(
            paper,
            gravito_bending_length=paper.gravito_bending_length * self._drawn.gravito_bending_length,
            friction=paper.friction * self._drawn.friction,
        )

    def _tilted_scene(self) -> Scene:
        """Return an empty scene in the frame of the table."""
        return Scene(gravity=9.81 * np.array([np.sin(self._drawn.tilt), 0.0, -np.cos(self._drawn.tilt)]))

    def _begin(self) -> None:
        """Return to the flat sheet and to the first picture."""
        self.simulation.reset()
        self._grain = np.random.default_rng(self._seed)

    def fold(self, plan: FoldingMotion, *, progress: bool = True) -> F:
        """Carry out a plan, from the flat sheet.

        Parameters
        ----------
        plan : FoldPlan
            Plan, or another object with `times`, `poses` and `target` like those of a plan.
        progress : bool
            True to show a progress bar.

        Returns
        -------
        Fold or WideFold
            Result of the sheet.

        Raises
        ------
        ValueError
            Not a plan, or a plan for paper of another size. Poses that are not finite or do not begin at the flat
            sheet, or times that do not increase.

        Examples
        --------
        >>> import withe
        >>> paper = withe.folding.Paper.a4()
        >>> folded = withe.folding.SimulatedSheet(paper).fold(withe.folding.plan(paper))  # doctest: +SKIP
        >>> print(f"slides {1e3 * folded.slide:.1f} mm")  # doctest: +SKIP
        slides 7.7 mm
        """
        if not all(hasattr(plan, name) for name in ("times", "poses", "target")):
            raise ValueError(f"plan must be a FoldPlan, or have times, poses and target, got {plan!r:.80}")
        require_length(self.paper, getattr(plan, "paper", self.paper))
        return self.carry_out([plan], plan.target, duration=float(plan.times[-1] - plan.times[0]), progress=progress)

    @abstractmethod
    def carry_out(
        self, motions: Iterable[Motion], target: float, *, duration: float = LONGEST, progress: bool = True
    ) -> F:
        """Carry out motions in a row, from the flat sheet.

        Parameters
        ----------
        motions : iterable of FoldPlan
            Each motion is requested when the previous one has ended, so a generator may look at the sheet in between.
            The first pose of a motion is the last pose of the previous one.
        target : float [m]
            Place on the sheet where the lifted edge should lie in the end.
        duration : float [s]
            Duration that a progress bar expects.
        progress : bool
            True to show a progress bar.

        Returns
        -------
        Fold or WideFold
            Result of the sheet.

        Raises
        ------
        ValueError
            As `fold`, or an error that the generator raises.
        """

    @abstractmethod
    def _outline(self) -> list[FloatArray]:
        """Return both long sides of the sheet as it lies now, each of shape (n, 3) [m]."""

    def picture(self, camera: Camera, size: tuple[int, int] = (640, 480)) -> npt.NDArray[np.uint8]:
        """Take a picture of the sheet in its present state, on a dark table. The sheet is straight across.

        Parameters
        ----------
        camera : withe.perception.Camera
        size : (int, int) [px]
            Width and height.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Red, green, blue, with sensor noise.

        Raises
        ------
        ImportError
            OpenCV is not installed.
        """
        return table_picture(self._outline(), camera, size, self._grain)


def node_places(length: float, depth: float, edges: int) -> FloatArray:
    """Nodes along a sheet, such that the inner edge of the jaw is in the middle of an edge.

    The direction of an edge is the direction of the sheet in its middle, to second order in its length.
    """
    held = max(0, round(edges * depth / length - 0.5))
    last = depth * (held + 1.0) / (held + 0.5) if depth > 0.0 else length / edges
    return np.concatenate([np.linspace(0.0, last, held + 2), np.linspace(last, length, edges - held)[1:]])
