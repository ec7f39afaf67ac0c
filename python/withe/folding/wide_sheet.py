"""A wide sheet: two strips side by side, joined at their ends, that may slide by different amounts.

The module is independent of planners and their equilibria.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.folding.carrying import Watch, carried
from withe.folding.jaw import Jaw
from withe.folding.jaw_motion import JawMotion, Motion, lead
from withe.folding.noise import Noise
from withe.folding.paper import Paper
from withe.folding.paper_rods import jaw_stiffness, strip_numbers
from withe.folding.table_sheet import LONGEST, TableSheet, node_places
from withe.parts.handles import Rod
from withe.parts.materials import Stiffness
from withe.recording.record import Record
from withe.scene.scene import Scene
from withe.simulation.simulation import Simulation

__all__ = ["WideFold", "WideSheet"]

FloatArray = npt.NDArray[np.float64]
_IN_PLANE = 1e3  # in-plane stiffness of a strip, relative to its bending; more changes no spin by 0.01 degrees
_TWIST = 1.5  # G J / EI of a flat strip, Poisson's ratio 1/3
_CROSS_WEIGHT = 0.05  # weight of the link of the far ends per length, relative to a strip
_RIB_WEIGHT = 1e-4  # the same for ribs
_RIB_WIDTH = 0.96  # relative to the width of a strip
_RIB_SPACING = 0.02  # [m]: between ribs a layer sinks by micrometres


@dataclass(frozen=True)
class WideFold:
    """Result of a fold of a wide sheet.

    Attributes
    ----------
    error : float [m]
        Error of the length from the lifted edge to the crease, as in `Fold`, mean of both sides.
    length : float [m]
        Length from the lifted edge to the crease, mean of both sides.
    slides : ndarray of shape (2,) [m]
        Slide of the far end of either strip along x; the strip with the smaller y comes first.
    spin : float [rad]
        Error of the angle of the crease, from the lengths of both sides: positive if the side with the smaller y is
        longer [dissertation, 7.8.4].
    failure : str or None
        Reason of a failed fold.
    record : Record
        Record of rods "strip 0" and "strip 1".
    seen_slides : tuple of float [m]
        Slides of the middle of the far edge that a camera saw on the way; NaN where it did not see the edge.
    slip : float [m]
        Greatest slip of the sheet in the jaw, above its force limit.
    """

    error: float
    length: float
    slides: FloatArray
    spin: float
    failure: str | None
    record: Record
    seen_slides: tuple[float, ...] = ()
    slip: float = 0.0


@keyword_hints
class WideSheet(TableSheet[WideFold]):
    """Two strips of a sheet on a table, joined at their far ends and held by one jaw. Uneven sliding turns the sheet.

    This is the spatial counterpart of `SimulatedSheet`. Each strip is a rod with half of the width of the sheet, at the
    middle of its half, and has its own coefficient of friction on the table. The link between the far ends has
    negligible weight. Stiff ribs lie across the folded half of each strip and are as wide as the strip. The ribs
    support layers that lie on each other: two lines would slide off sideways. They carry no other pressing load.

    Parameters
    ----------
    paper : Paper
        Paper as the planner knows it.
    seed : int
        Seed of the noise.
    noise : Noise, optional
        Deviations of the sheet, table and jaw. `friction_variation` is ignored.
    unevenness : float [-]
        Relative standard deviation of half the difference between the coefficients of the strips. The deviation is at
        most twice this value.
    jaw : Jaw, optional
        Jaw that holds the sheet.
    edges : int
        Number of edges of each strip.
    time_step : float [s]
        Time step of backward Euler; shorter in plunges, as in `SimulatedSheet`.
    own_friction : float [-]
        Coefficient of a strip on itself.

    Attributes
    ----------
    paper, truth : Paper
        Paper as the planner knows it, and as it is.
    frictions : ndarray of shape (2,)
        Coefficient of either strip on the table.
    simulation : Simulation
    strips : tuple of two Rod

    Raises
    ------
    ValueError
        Not a paper, or numbers out of range.

    Examples
    --------
    >>> import withe
    >>> sheet = withe.folding.WideSheet(withe.folding.Paper.a4(), seed=1)
    >>> folded = sheet.fold(withe.folding.plan(sheet.paper))  # doctest: +SKIP
    >>> print(f"{np.degrees(folded.spin):.2f} degrees")  # doctest: +SKIP
    """

    strips: tuple[Rod, Rod]

    def __init__(
        self,
        paper: Paper,
        seed: int = 0,
        noise: Noise | None = None,
        *,
        unevenness: float = 0.1,
        jaw: Jaw | None = None,
        edges: int = 75,
        time_step: float = 0.01,
        own_friction: float = 0.3,
    ) -> None:
        super().__init__(paper, seed, noise, jaw)
        if not paper.is_strip:
            raise ValueError("paper must have uniform width for two strips of one width, but has an outline")
        edges = validation.integer(edges, "edges", 20, 100_000)
        uneven = validation.non_negative(unevenness, "unevenness")
        if uneven > 0.5:
            raise ValueError(f"unevenness must be at most 0.5, got {uneven:g}: friction would be negative")
        more = uneven * np.clip(np.random.default_rng((self._seed, 2)).normal(), -2.0, 2.0)
        self.frictions: FloatArray = self.truth.friction * np.array([1.0 - more, 1.0 + more])
        self._places = node_places(paper.length, self.jaw.depth, edges)
        self._sides = np.array([-0.25, 0.25]) * paper.width
        scene, self.strips = self._scene(validation.non_negative(own_friction, "own_friction"))
        self.simulation: Simulation = scene.build(integrator="backward_euler", time_step=time_step)

    def _scene(self, own_friction: float) -> tuple[Scene, tuple[Rod, Rod]]:
        paper, scene = self.paper, self._tilted_scene()
        line_density, bend, stretch = strip_numbers(replace(self.truth, width=0.5 * paper.width))
        stiffness = Stiffness(stretch=stretch, bend=(_IN_PLANE * bend, bend), twist=_TWIST * bend)
        zero, radius = np.zeros_like(self._places), 0.5 * paper.thickness
        strips = tuple(
            scene.add_rod(
                points=np.stack([self._places, zero + y, zero], axis=1),
                normal=(0.0, 1.0, 0.0),
                radius=radius,
                stiffness=stiffness,
                line_density=line_density,
                natural_curvature=(0.0, self._drawn.curl),
                name=f"strip {i}",
            )
            for i, y in enumerate(self._sides)
        )
        rigid = Stiffness(stretch=stretch, bend=_IN_PLANE * bend, twist=_IN_PLANE * bend)
        cross = scene.add_rod(
            points=[(paper.length, y, 0.0) for y in np.linspace(self._sides[0], self._sides[1], 3)],
            normal=(1.0, 0.0, 0.0),
            radius=radius,
            stiffness=rigid,
            line_density=_CROSS_WEIGHT * line_density,
            name="cross",
        )
        scene.join(strips[0].end, cross.start)
        scene.join(strips[1].end, cross.end)
        table = scene.add_floor(-0.55 * paper.thickness, friction=self.truth.friction, restitution=0.0, name="table")
        scene.enable_contact(friction=own_friction, restitution=0.0)
        along, about = jaw_stiffness(self.jaw, paper)
        for strip, friction in zip(strips, self.frictions, strict=True):
            scene.set_friction(strip, table, float(friction))
            scene.ignore_contact(strip, cross)
            scene.grasp(
                strip,
                at=0.5 * self.jaw.depth,
                length=self.jaw.depth,
                stiffness=(0.5 * along, 0.5 * about),
                force_limit=0.5 * self.jaw.force_limit,
                name=f"jaw on {strip.name}",
            )
        scene.ignore_contact(*strips)
        scene.ignore_contact(cross, table)
        scene.set_contact_group(cross, "across")
        for strip, y in zip(strips, self._sides, strict=True):
            for node in self._ribbed():
                self._add_rib(scene, strip, node, float(y), rigid, _RIB_WEIGHT * line_density)
        return scene, (strips[0], strips[1])

    def _ribbed(self) -> list[int]:
        """Nodes of a strip that have a rib: under the jaw, and on to the crease of the longest fold.

        None is beside the last edge that the jaw holds: a joint there would cost accuracy.
        """
        held = int(np.searchsorted(self._places, self.jaw.depth)) - 1
        spacing = max(1, round(_RIB_SPACING / float(self._places[-1] - self._places[-2])))
        crease = int(np.searchsorted(self._places, 0.5 * self.paper.length))
        return [*range(held), *range(held + 3, crease + spacing, spacing)]

    def _add_rib(
        self, scene: Scene, strip: Rod, node: int, y: float, stiffness: Stiffness, line_density: float
    ) -> None:
        reach = 0.25 * _RIB_WIDTH * self.paper.width
        rib = scene.add_rod(
            points=[(self._places[node], y + side, 0.0) for side in (-reach, 0.0, reach)],
            normal=(1.0, 0.0, 0.0),
            radius=0.5 * self.paper.thickness,
            stiffness=stiffness,
            line_density=line_density,
            name=f"rib {node} of {strip.name}",
        )
        scene.join(rib.node(1), strip.node(node))
        scene.set_contact_group(rib, "across")
        scene.ignore_contact(rib, "table")

    def carry_out(
        self, motions: Iterable[Motion], target: float, *, duration: float = LONGEST, progress: bool = True
    ) -> WideFold:
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
        WideFold

        Raises
        ------
        ValueError
            As `fold`, or an error that the generator raises.
        """
        simulation = self.simulation
        self._begin()
        jaw = JawMotion(motions, self._drawn)
        for strip, y in zip(self.strips, self._sides, strict=True):
            hand = simulation.hand(f"jaw on {strip.name}")
            lead(hand, hand.pose.rotation, jaw, self.jaw.depth, float(y))
        hands = [f"jaw on {strip.name}" for strip in self.strips]
        return self._result(target, carried(simulation, jaw, self.strips, hands, duration, progress))

    def _outline(self) -> list[FloatArray]:
        first, second = (self.simulation.positions(strip) for strip in self.strips)
        middle, across = 0.5 * (first + second), second - first  # strips are in the middles of their halves
        return [middle - across, middle + across]

    def _result(self, target: float, watch: Watch) -> WideFold:
        ends = [self.simulation.positions(strip)[[0, -1], 0] for strip in self.strips]
        slides = np.array([far - self.paper.length for _, far in ends])
        errors = 0.5 * (np.array([edge for edge, _ in ends]) - slides - target)
        spin = np.arctan2(errors[0] - errors[1], self._sides[1] - self._sides[0])
        error = float(errors.mean())
        record = self.simulation.record
        return WideFold(error, 0.5 * target + error, slides, float(spin), watch.failure, record, slip=watch.slip)
