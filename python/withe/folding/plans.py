"""A plan: the poses of the jaw over time, and the predicted state of the sheet."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.extras import require
from withe.folding.figures import draw_fold, side_view
from withe.folding.jaw import Jaw, inner_edge
from withe.folding.paper import Paper
from withe.folding.plan_files import KIND, VERSION, parts_of, sheet_listed
from withe.folding.sheets import Elastica, at_forces, drag, forces_of, join, of_other, take
from withe.folding.widths import Width, free_width
from withe.io import PlanFile, listed
from withe.view import style

__all__ = ["SHORT", "FoldPlan", "flat_forces"]

FloatArray = npt.NDArray[np.float64]
SHORT = 0.5  # the same for the sheet of a plan [Lgb]: poses hardly determine so short a part
_GRAVITY = 9.81  # [m/s^2]
_COAST = 5e-3  # [m]
_LOW = 1e-5  # an edge less high than this lies on the table [Lgb]
_LEAST = 0.1  # lifted, of a sheet that is flat [Lgb]


def flat_forces(width: Width) -> tuple[float, float, float]:
    """Forces of a nearly flat sheet [w Lgb], [Lgb]: half of the weight of the lifted part lies on the table."""
    return 0.5 * float(width.weight(_LEAST)), 0.0, _LEAST


@dataclass(frozen=True, eq=False)
class FoldPlan(PlanFile):
    """Poses and times of a jaw that folds a sheet.

    The origin of the world is the middle of the lifted edge in the flat sheet. The x axis points along the sheet to its
    far edge, z up, and y across. The table and the flat sheet are at z = 0. A pose is the position and rotation of the
    *outer edge*, which is lifted. In the flat sheet the frame of the edge is that of the world. The frame turns about y
    with the edge. Its x axis points from the outer edge into the sheet, along the straight part in the jaw. The inner
    edge of the jaw, where the sheet begins to hang freely, is at `jaw.depth` along this x axis.

    Attributes
    ----------
    paper : Paper
        Paper of the plan.
    target : float [m]
        Target of the outer edge: x of the last pose. The crease is in the middle.
    method, grasp : str
        Arguments of `plan`.
    jaw : Jaw
        Jaw that holds the sheet.
    limits : tuple of float [m/s], [rad/s], [m/s^2]
        Speed, rate of rotation, acceleration.
    offset : float [m]
        Slide of the sheet when the plan was made: 0, except after a `replan`.
    rise : float [m]
        Height over the target at which the slow motion of the edge ends: 0, except before a plunge.
    side : str
        Direction of the jaw's fingers: "edge", from beyond the edge in line with the sheet; or "side", across the
        sheet, if there is no room beyond the edge.
    clearance : float [m]
        Least height of the fingers over the table while the edge looks back (angle > pi / 2). At the start the lower
        finger needs the edge to overhang the table, or to be bent up.
    uncertainty : tuple of float [-]
        Relative errors of Lgb and friction.
    curvature : float [1/Lgb]
        Bound on the curvature with a free moment.
    manifold : str
        Source of the equilibria: "exact" or "network".
    poses : ndarray of shape (n, 7) [m], [-]
        x, y, z and the quaternion x, y, z, w of the outer edge.
    angles : ndarray of shape (n,) [rad]
        Angles of the edge, which continue beyond pi. The quaternions are rotations by these angles about y.
    times : ndarray of shape (n,) [s]
        Times of the poses.
    plunges_at : float or None [s]
        Start of the plunge that `plunge` found. None without a plunge.
    plunge_slide : float [m]
        Slide of the expected sheet at the start of the plunge, for which the plunge meets the target.
    blocked : str or None
        Reason why the plan fails within its uncertainty, with the missing friction. None if it does not fail, or if
        this was not tested.
    """

    paper: Paper
    target: float
    method: str
    grasp: str
    jaw: Jaw
    limits: tuple[float, float, float]
    offset: float
    rise: float
    side: str
    clearance: float
    uncertainty: tuple[float, float]
    curvature: float
    manifold: str
    poses: FloatArray
    angles: FloatArray
    times: FloatArray
    plunges_at: float | None = None
    plunge_slide: float = 0.0
    blocked: str | None = None
    _foreseen: Elastica | None = field(default=None, repr=False)

    KIND: ClassVar[str] = KIND
    VERSION: ClassVar[int] = VERSION
    _parts_of = staticmethod(parts_of)

    @property
    def _saved_poses(self) -> FloatArray:
        return self.poses

    @cached_property
    def _inner(self) -> FloatArray:
        """Poses of the jaw's inner edge in Lgb."""
        outer = np.stack([self.poses[:, 0] - self.offset, self.poses[:, 2], self.angles], axis=1)
        lgb = self.paper.gravito_bending_length
        return inner_edge(outer, self.jaw.depth) / [lgb, lgb, 1.0]

    @property
    def _length(self) -> float:
        return (self.paper.length - self.jaw.depth) / self.paper.gravito_bending_length

    @cached_property
    def _width(self) -> Width:
        """Return the width of the freely hanging part."""
        return free_width(self.paper, self.jaw.depth)

    @cached_property
    def _motion(self) -> tuple[Elastica, FloatArray]:
        return self._moved(self.paper)

    def _moved(self, paper: Paper) -> tuple[Elastica, FloatArray]:
        """Return sheet and slide [Lgb] for another paper, from the first pose on in which it hangs freely."""
        factor = paper.gravito_bending_length / self.paper.gravito_bending_length
        width, length = self._width.of_other(factor), self._length / factor
        flat = flat_forces(width)
        if self._foreseen is not None:
            begin = int(np.argmax(self._foreseen.suspended > SHORT))
            ahead = at_forces(of_other(forces_of(self._foreseen)[:begin], factor), width)
            forces = of_other(forces_of(self._foreseen)[begin : begin + 1], factor)[0]
        else:
            begin = int(np.argmax(self._inner[:, 1] > _LOW))
            ahead, forces = at_forces(np.tile(flat, (begin, 1)), width), np.array(flat)
        sheet, slide = drag(self._inner[begin:] / [factor, factor, 1.0], forces, paper.friction, length, width)
        sheet, slide = join(ahead, sheet), np.concatenate([np.zeros(begin), slide])
        speed = np.abs(np.diff(slide)) * paper.gravito_bending_length / np.diff(self.times)
        coasts = speed**2 > 2.0 * paper.friction * _GRAVITY * _COAST
        lost = np.concatenate([[False], coasts]) | ~sheet.stable
        lost[:begin] = False
        known = np.cumsum(lost) == 0
        return replace(sheet, valid=sheet.valid & known, stable=sheet.stable & known), slide

    @property
    def sheet(self) -> Elastica:
        """Return the hanging sheet at each pose [Lgb], [w Lgb], as planned without slide, or else as predicted."""
        return self._motion[0] if self._foreseen is None else self._foreseen

    @cached_property
    def slip_ratio(self) -> FloatArray:
        """Friction coefficient below which the sheet slides at a pose, of shape (n,).

        It is the tangential force over the normal force below the lying part, ``|H| / (R + W)``, with the weight W of
        that part. For a method that does not prevent slides ("intuitive") it is that of the predicted motion, which is
        at most the friction. NaN from the pose on at which the predicted motion has no equilibrium within reach.
        """
        sheet = self.sheet
        lying = self._width.lying(sheet.suspended, self._length)
        return np.asarray(np.abs(sheet.tangential_force) / (sheet.normal_force + lying))

    @cached_property
    def slide(self) -> FloatArray:
        """Return the slide of the sheet towards +x at each pose [m], shape (n,), since the plan was made.

        The prediction uses exact elastica, a rigid lying part, and Coulomb's law with the friction of the paper, for a
        sheet without inertia. NaN from `jumps_at` on.
        """
        return self.slide_of(self.paper)

    def slide_of(self, paper: Paper) -> FloatArray:
        """Return the slide of another paper on these poses, as `slide` for the plan's paper.

        Parameters
        ----------
        paper : Paper
            Paper of the same size, possibly with another Lgb and friction.

        Returns
        -------
        ndarray of shape (n,) [m]

        Raises
        ------
        ValueError
            Not a paper, or one of another size.

        Examples
        --------
        >>> from dataclasses import replace
        >>> import withe
        >>> paper = withe.folding.Paper.a4()
        >>> stiffer = replace(paper, gravito_bending_length=1.1 * paper.gravito_bending_length)
        >>> print(f"{1e3 * withe.folding.plan(paper).slide_of(stiffer)[-1]:.1f} mm")
        7.9 mm
        """
        if not isinstance(paper, Paper):
            raise ValueError(f"paper must be a Paper, got {paper!r:.80}")
        mine = self.paper
        if (paper.length, paper.width, paper.outline) != (mine.length, mine.width, mine.outline):
            raise ValueError(
                f"paper must be as large as the plan's, {mine.length:g} m by {mine.width:g} m, got {paper!r:.200}"
            )
        sheet, slide = self._motion if paper == mine else self._moved(paper)
        return np.where(sheet.valid, slide * paper.gravito_bending_length, np.nan)

    def before_plunge(self) -> FoldPlan:
        """Return the part of the plan before a plunge; the whole plan without a plunge.

        Returns
        -------
        FoldPlan
        """
        if self.plunges_at is None:
            return self
        slow = self.times <= self.plunges_at
        seen = None if self._foreseen is None else take(self._foreseen, slow)
        parts = {name: getattr(self, name)[slow] for name in ("poses", "angles", "times")}
        return replace(self, plunges_at=None, _foreseen=seen, **parts)

    @property
    def papers(self) -> list[Paper]:
        """Return the papers within `uncertainty`, the estimate and the bounds.

        There are five papers: the estimate, and a smaller and a larger Lgb, each with the least friction and with the
        friction of the paper. There are fewer papers if a share is 0.
        """
        lgb, friction = self.uncertainty
        bounds = product((1.0 - friction, 1.0), (1.0 - lgb, 1.0 + lgb))
        shares = [(1.0, 1.0), *((of_lgb, of_friction) for of_friction, of_lgb in bounds)]
        return [
            replace(
                self.paper,
                gravito_bending_length=of_lgb * self.paper.gravito_bending_length,
                friction=of_friction * self.paper.friction,
            )
            for of_lgb, of_friction in dict.fromkeys(shares)
        ]

    @cached_property
    def worst_slide(self) -> tuple[float, Paper]:
        """Greatest slide of `papers` at any pose before a plunge [m], and its paper; infinite if one of them jumps."""
        slow = self.before_plunge()
        found = [(np.abs(slow.slide_of(paper)).max(), paper) for paper in self.papers]
        slides = [(float(slide) if np.isfinite(slide) else np.inf, paper) for slide, paper in found]
        return max(slides, key=lambda each: each[0])

    @property
    def jumps_at(self) -> float | None:
        """Time from which the slide is not predicted [s]; None if it is predicted to the end.

        A plunge always begins an unpredicted part. Elsewhere the sheet jumps at this time for one of three reasons:

        - no stable equilibrium is within reach
        - all of the sheet is lifted
        - the sheet would coast on by more than 5 mm, v^2 / (2 friction g)
        """
        lost = ~self._motion[0].valid
        return float(self.times[np.argmax(lost)]) if lost.any() else None

    @cached_property
    def max_curvature(self) -> FloatArray:
        """Greatest curvature of the sheet at each pose [1/m], of shape (n,)."""
        return np.asarray(self.sheet.max_curvature / self.paper.gravito_bending_length)

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        slow = self.before_plunge()
        # The forces of a half circle are not known from the time at which the sheet jumps.
        ratio, curvature = np.nanmax(slow.slip_ratio), np.nanmax(slow.max_curvature)
        way = f"{self.method}, {self.grasp}, {len(self)} poses in {self.times[-1]:.1f} s"
        if self.plunges_at is not None:
            way += f", plunges at {self.plunges_at:.1f} s"
        elif (slides := np.nanmax(np.abs(self.slide))) > 1e-3:
            way += f", slides {1e3 * slides:.1f} mm"
        if self.blocked is not None:
            way += ", fails within its uncertainty"
        greatest = f"slip ratio {ratio:.3f}, curvature {curvature:.0f}/m"
        return f"FoldPlan({way}, greatest {greatest}, fingers from the {self.side})"

    def plot(self, axes: Any | None = None, poses: int = 10) -> Any:
        """Draw the sheet from the side at some of the poses, with its predicted slide and shape.

        From `jumps_at` on nothing is predicted, and only the path of the edge is drawn.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Axes to draw into. By default those of a new figure.
        poses : int
            Number of poses, at equal travel over the whole path.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        ImportError
            matplotlib is not installed.
        ValueError
            `poses` is not a whole number above 0.
        """
        if axes is None:
            with style.context():
                return self.plot(require("matplotlib.pyplot", "view").subplots(figsize=(8.0, 3.2))[1], poses)
        (sheet, slide), lgb = self._motion, self.paper.gravito_bending_length
        index = np.unique(np.linspace(0, len(self) - 1, validation.integer(poses, "poses", 1, 1000)).astype(int))
        index = index[sheet.valid[index]]
        outer = self.poses[:, [0, 2]]
        moved = self.jaw.depth + self.offset + lgb * slide[index]  # the sheet's frame in the world
        views = [
            side_view(forces, self._length, self._width) * lgb + [along, 0.0]
            for forces, along in zip(forces_of(sheet)[index], moved, strict=True)
        ]
        beyond = 0.05 * self.paper.length
        farthest = max(float(points[:, 0].max()) for points in views)
        draw_fold(axes, views, outer[index], outer, (-beyond, farthest + beyond))
        return axes

    def to_dict(self) -> dict[str, Any]:
        """Return all values, with frames and units, for JSON. Values that are not finite become None.

        Returns
        -------
        dict
            Frames, units and all fields.
        """
        return {
            "frames": {
                "world": "origin where the middle of the lifted edge lay in the flat sheet; x along the sheet to its "
                "far edge, y across, z up; table at z = 0",
                "pose": "of the sheet's outer edge; x of its frame points into the sheet along the part that the jaw "
                "holds, z away from the side that lay on the table; the world's frame while the sheet is flat",
            },
            "units": {"length": "m", "time": "s", "angle": "rad", "quaternion": "x, y, z, w", "curvature": "1/m"},
            "paper": dict(vars(self.paper)),
            "target": self.target,
            "method": self.method,
            "grasp": self.grasp,
            "limits": dict(zip(("speed", "turning", "acceleration"), self.limits, strict=True)),
            "offset": self.offset,
            "rise": self.rise,
            "uncertainty": dict(zip(("gravito_bending_length", "friction"), self.uncertainty, strict=True)),
            "curvature": self.curvature,
            "manifold": self.manifold,
            "jaw": {**vars(self.jaw), "side": self.side, "clearance": self.clearance},
            "times": self.times.tolist(),
            "poses": self.poses.tolist(),
            "angles": self.angles.tolist(),
            "plunges_at": self.plunges_at,
            "plunge_slide": self.plunge_slide,
            "blocked": self.blocked,
            "sheet": sheet_listed(self._foreseen),
            "prediction": {
                "slip_ratio": listed(self.slip_ratio),
                "slide": listed(self.slide),
                "jumps_at": self.jumps_at,
                "max_curvature": listed(self.max_curvature),
            },
        }
