"""A sheet in the rod engine that a robot folds. The module is independent of planners and their equilibria."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.folding.carrying import FRAMES, Watch, carried
from withe.folding.jaw import Jaw
from withe.folding.jaw_motion import JawMotion, Motion, lead
from withe.folding.noise import Noise
from withe.folding.paper import Paper
from withe.folding.paper_rods import add_paper, jaw_stiffness
from withe.folding.table_sheet import LONGEST, TableSheet, node_places
from withe.folding.views import strip_picture
from withe.parts.handles import Rod
from withe.recording.record import Record
from withe.simulation.simulation import Simulation
from withe.simulation.snapshots import Snapshot

__all__ = ["Fold", "Held", "SimulatedSheet"]

FloatArray = npt.NDArray[np.float64]
_STRIP = ((0.0, 1.0), (1.0, 1.0))


@dataclass(frozen=True)
class Fold:
    """Result of a fold.

    Attributes
    ----------
    error : float [m]
        Error of the length from the lifted edge to the crease: half the signed gap between the edge and its target on
        the sheet. Negative if the fold is too short.
    length : float [m]
        Length from the lifted edge to the crease.
    slide : float [m]
        Slide of the sheet's far edge over the table, in the direction of x.
    max_curvature : float [1/m]
        Greatest curvature at any time.
    max_speed : float [m/s]
        Greatest speed of any part of the sheet.
    failure : str or None
        Reason of a failed fold: the sheet snapped, its equations had no solution, or the motion took twice as long as
        expected. The other numbers are then those of this moment.
    record : Record
        Record of rod "sheet", from the lifted edge on, over obstacle "table".
    seen_slides : tuple of float [m]
        Slides that a camera saw during the fold; NaN where it did not see the far edge.
    slip : float [m]
        Slip of the sheet in the jaw, above its force limit.
    """

    error: float
    length: float
    slide: float
    max_curvature: float
    max_speed: float
    failure: str | None
    record: Record
    seen_slides: tuple[float, ...] = ()
    slip: float = 0.0


@dataclass(frozen=True)
class Held:
    """State of a sheet and its jaw during a motion, made by `SimulatedSheet.hold`, from which `carry_on` continues.

    Attributes
    ----------
    state : Snapshot
        State of the simulation.
    jaw : object
        Position of the jaw in its motion.
    """

    state: Snapshot
    jaw: JawMotion


@keyword_hints
class SimulatedSheet(TableSheet[Fold]):
    """Simulate a sheet on a table, and a jaw that holds one of its edges.

    The sheet is a planar rod with inertia, stretching, bending, weight and thickness, with anchored friction on the
    table and between its own sides. The simulation takes only the motion of the jaw from a plan.

    Parameters
    ----------
    paper : Paper
        Paper as the planner knows it.
    seed : int
        Seed of the noise. The same sheet always folds in the same way.
    noise : Noise, optional
        Deviations of the sheet, table and jaw. By default none.
    jaw : Jaw, optional
        Jaw that holds the sheet.
    edges : int
        Number of edges of the rod.
    time_step : float [s]
        Time step of backward Euler. It is shorter if the jaw would move by more than 2 mm in a step, and for 0.1 s
        after that.
    own_friction : float [-]
        Coefficient of the sheet on itself.
    record_every : float [s]
        Interval between frames of `Fold.record`, at which steps end; infinity records no frames in between.

    Attributes
    ----------
    paper : Paper
    truth : Paper
        True properties of the sheet for this seed, which a planner must not know.
    jaw : Jaw
    simulation : Simulation
    rod : Rod

    Raises
    ------
    ValueError
        Not a paper, or numbers out of range.

    Examples
    --------
    >>> import withe
    >>> sheet = withe.folding.SimulatedSheet(withe.folding.Paper.a4(), seed=3, noise=withe.folding.Noise())
    >>> print(f"{1e3 * sheet.truth.gravito_bending_length:.1f} mm, friction {sheet.truth.friction:.3f}")
    49.0 mm, friction 0.106
    """

    def __init__(
        self,
        paper: Paper,
        seed: int = 0,
        noise: Noise | None = None,
        *,
        jaw: Jaw | None = None,
        edges: int = 150,
        time_step: float = 0.01,
        own_friction: float = 0.3,
        record_every: float = FRAMES,
    ) -> None:
        super().__init__(paper, seed, noise, jaw)
        edges = validation.integer(edges, "edges", 20, 100_000)
        self._record_every = record_every
        places = node_places(paper.length, self.jaw.depth, edges)
        self._widths = paper.width_at(places)
        scene = self._tilted_scene()
        self.rod: Rod = add_paper(scene, self.truth, places, self._drawn.curl)
        # Surfaces press on each other from a twentieth of the thickness on; a jaw at the sheet's height does not.
        scene.add_floor(-0.55 * paper.thickness, friction=self._friction(), restitution=0.0, name="table")
        scene.enable_contact(friction=validation.non_negative(own_friction, "own_friction"), restitution=0.0)
        scene.grasp(
            self.rod,
            at=0.5 * self.jaw.depth,
            length=self.jaw.depth,
            stiffness=jaw_stiffness(self.jaw, paper),
            force_limit=self.jaw.force_limit,
            name="jaw",
        )
        self.simulation: Simulation = scene.build(integrator="backward_euler", time_step=time_step, planar=True)
        self._flat = self.simulation.hand("jaw").pose.rotation

    def _friction(self) -> float | Callable[[FloatArray], FloatArray]:
        """Return the friction of the table: one number if it is uniform, since a function costs time."""
        drawn, of_paper = self._drawn, self.paper.friction
        if not drawn.patches[:, 0].any():
            return self.truth.friction
        return lambda points: of_paper * drawn.friction_at(points[:, 0])

    def positions(self) -> FloatArray:
        """Return the present positions of the sheet, from the lifted edge on.

        Returns
        -------
        ndarray of shape (edges + 1, 3) [m]
        """
        return self.simulation.positions(self.rod)

    @property
    def slide(self) -> float:
        """Return the slide of the sheet's far edge over the table, in the direction of x [m]."""
        return float(self.positions()[-1, 0]) - self.paper.length

    def _outline(self) -> list[FloatArray]:
        across = np.multiply.outer(0.5 * self._widths, [0.0, 1.0, 0.0])
        return [self.positions() - across, self.positions() + across]

    def strip_picture(
        self, length: float | None = None, scale: float = 4000.0, *, turned: bool = False
    ) -> npt.NDArray[np.uint8]:
        """Take a picture from the side, for `measure`, of a strip of this paper that is clamped level and hangs.

        Parameters
        ----------
        length : float [m]
            Length of the strip. By default 2.2 times the Lgb that the planner knows.
        scale : float [px/m]
        turned : bool
            True if the lower side of the strip is up.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            Picture in which the strip enters from the left.

        Raises
        ------
        ValueError
            A length or scale that is not positive.
        ImportError
            OpenCV is not installed.
        """
        length = 2.2 * self.paper.gravito_bending_length if length is None else validation.positive(length, "length")
        scale = validation.positive(scale, "scale")
        strip = replace(self.truth, outline=_STRIP)
        curl = -self._drawn.curl if turned else self._drawn.curl
        return strip_picture(strip, curl, length, scale, self._grain)

    def carry_out(
        self, motions: Iterable[Motion], target: float, *, duration: float = LONGEST, progress: bool = True
    ) -> Fold:
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
        Fold

        Raises
        ------
        ValueError
            As `fold`, or an error that the generator raises.
        """
        self._begin()
        return self._carried(JawMotion(motions, self._drawn), target, duration, progress)

    def hold(self) -> Held:
        """Keep the state between two motions. A motion may call `hold`, and `carry_on` continues from that state.

        Returns
        -------
        Held
        """
        return Held(self.simulation.snapshot(), copy(self._motion))

    def carry_on(self, held: Held, motions: Iterable[Motion], target: float) -> Fold:
        """Carry out other motions from a kept state, as `carry_out` does from the flat sheet.

        Parameters
        ----------
        held : Held
            State, as `hold` returns it.
        motions : iterable of FoldPlan
            Motions from this state on.
        target : float [m]
            Place on the sheet where the lifted edge should lie in the end.

        Returns
        -------
        Fold

        Raises
        ------
        ValueError
            As `carry_out`.
        """
        self.simulation.restore(held.state)
        return self._carried(held.jaw.on_from_here(motions), target, LONGEST, False)

    def _carried(self, motion: JawMotion, target: float, duration: float, progress: bool) -> Fold:
        self._motion = motion
        lead(self.simulation.hand("jaw"), self._flat, motion, self.jaw.depth)
        return self._result(
            target, carried(self.simulation, motion, [self.rod], ["jaw"], duration, progress, self._record_every)
        )

    def _result(self, target: float, watch: Watch) -> Fold:
        slide = self.slide
        error = 0.5 * (float(self.positions()[0, 0]) - slide - target)
        return Fold(
            error=error,
            length=0.5 * target + error,
            slide=slide,
            max_curvature=watch.max_curvature,
            max_speed=watch.max_speed,
            failure=watch.failure,
            record=self.simulation.record,
            slip=watch.slip,
        )
