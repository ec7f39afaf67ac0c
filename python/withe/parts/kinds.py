"""Parts of a scene as values, which are never changed in place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from withe.common.drawing import voronoi_lengths
from withe.common.polyhedra import Core
from withe.parts.friction import Coefficients
from withe.parts.parameters import RodParameters
from withe.parts.sections import SectionProperties
from withe.solids import Field, Tube

__all__ = [
    "LOAD_KINDS",
    "SUPPORT_KINDS",
    "Actuation",
    "BodyPart",
    "ClosedLoop",
    "ContactModel",
    "ContactSettings",
    "CustomForcePart",
    "DragPart",
    "FluidModel",
    "FluidPart",
    "FrictionModel",
    "Grasp",
    "Guide",
    "GuidePlace",
    "JoinPart",
    "LoadPart",
    "MassPart",
    "ObstaclePart",
    "Overlap",
    "PairSettings",
    "Part",
    "Pass",
    "RodPart",
    "SpringPart",
    "SupportPart",
    "TendonPart",
]

FloatArray = npt.NDArray[np.float64]
Pass = tuple[int, int]  # rod, node of the rod; or -1 - body, point of the body
JoinKind = Literal["rigid", "pinned", "revolute", "sliding"]
JointForm = Literal["frame", "pairs"]
ContactModel = Literal["imcv2", "barrier", "imcv1", "spillmann_teschner"]
FrictionModel = Literal["implicit", "lagged", "anchored", "semi_explicit"]
Overlap = Literal["error", "separate"]
FluidModel = Literal["stokeslets", "resistive"]
LoadKind = Literal["force", "moment", "load", "pressure"]
SupportKind = Literal["pin", "clamp", "hold_edge", "spinning_clamp", "spinning_edge", "hand"]
GuidePlace = Literal["start", "middle", "end"]
# Guide of a tendon: rod, edge of the rod, place along the edge; or -1 - body, point of the body, "middle".
Guide = tuple[int, int, GuidePlace]
LOAD_KINDS: tuple[str, ...] = get_args(LoadKind)
SUPPORT_KINDS: tuple[str, ...] = get_args(SupportKind)


@dataclass(frozen=True, eq=False)
class Part:
    """A part of a scene; see `withe.parts.table` for what its kind states."""

    name: str


@dataclass(frozen=True, eq=False)
class Drawing:
    """Drawing of a rod: its directors and natural shape from its nodes."""

    normal: FloatArray | None  # as it was given
    natural_curvature: bool  # whether it follows
    natural_twist: bool


@dataclass(frozen=True, eq=False)
class RodPart(Part):
    """A rod as it was drawn."""

    index: int
    closed: bool
    points: FloatArray  # (nodes, 3) [m]
    tangents: FloatArray  # (edges, 3)
    directors: FloatArray  # first directors, (edges, 3)
    lengths: FloatArray  # (edges,) [m]
    arcs: FloatArray  # of the curve that they are chords of, (edges,) [m]
    voronoi: FloatArray  # (stencils,) [m]
    section: SectionProperties
    contact_radius: FloatArray  # (edges,) [m]
    parameters: RodParameters
    natural_curvature: FloatArray  # (stencils, 2) [1/m]
    natural_twist: FloatArray  # (stencils,) [rad/m]
    in_balance: bool = False  # whether its natural shape is to be found by which it is in balance as drawn
    drawing: Drawing | None = None  # None: its nodes were found, or its curvature depends on them otherwise

    @property
    def owner(self) -> str:
        """Return the name of the rod in errors."""
        return f"rod {self.name!r}"

    def without_arcs(self) -> RodPart:
        """The same shape, made of its edges instead of the arcs over them."""
        voronoi = voronoi_lengths(self.lengths, self.closed)
        longer = self.voronoi / voronoi
        return replace(
            self,
            arcs=self.lengths,
            voronoi=voronoi,
            natural_curvature=self.natural_curvature * longer[:, None],
            natural_twist=self.natural_twist * longer,
        )


@dataclass(frozen=True, eq=False)
class BodyFace:
    """A flat face of the surface of a body."""

    edge: int  # of the chain, along the normal, from a plane outwards
    aside: int  # node of the chain; from the tail of that edge to its foot is the first axis of the outline
    depth: float  # of that plane below the surface [m]
    outline: FloatArray  # segments x0, y0, x1, y1; the second axis is normal x first, (k, 4) [m]


@dataclass(frozen=True, eq=False)
class BodySurface:
    """The surface of a rigid body that touches others: all points at a distance from edges, and flat faces."""

    core: Core  # in the axes of the body
    points: FloatArray  # a chain of nodes as drawn, (n, 3) [m]
    radii: FloatArray  # of its edges; 0: an edge that touches nothing, (n - 1,) [m]
    faces: tuple[BodyFace, ...]
    beside: list[list[int]]  # faces on the left and on the right of each edge; -1: none; empty without faces
    friction: float | None  # [-]; None: that of the scene
    restitution: float | None  # [-]
    nodes: tuple[Pass, ...] = ()  # the chain among the points of the body


@dataclass(frozen=True, eq=False)
class BodyPart(Part):
    """A rigid body as it was drawn. Its points in the layout begin with its centre of mass."""

    index: int
    mass: float  # [kg]
    inertia: FloatArray  # about the centre of mass, axes of the world, (3, 3) [kg m^2]
    center: FloatArray  # centre of mass (3,) [m]
    position: FloatArray  # origin of its axes (3,) [m]
    rotation: FloatArray  # of its axes, columns, (3, 3)
    solid: Any  # for pictures; None: a body without shape
    surface: BodySurface | None = None  # None: it touches nothing
    drawn_only: bool = False  # True if it was to touch, and its solid cannot


@dataclass(frozen=True, eq=False)
class JoinPart(Part):
    """Two nodes that are one."""

    nodes: tuple[Pass, Pass]
    node_names: tuple[str, str]
    kind: JoinKind
    axis: FloatArray | None
    form: JointForm
    stiffness: float = 0.0  # of a revolute one [N m/rad]
    rest_angle: float = 0.0  # [rad]
    damping: float = 0.0  # [N m s/rad]
    moment: float = 0.0  # [N m]
    max_torque: float = np.inf  # of the spring [N m]
    max_speed: float = np.inf  # of the rest angle [rad/s]
    limits: tuple[float, float] | None = None  # [rad]
    limit_stiffness: float = 0.0  # [N m/rad]
    restitution: float = 1.0  # of the stops [-]


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """Closure of a loop of joints: a joint has a massless copy of its second body, which multipliers hold together."""

    joint: str
    body: int  # index of the body
    copy: int  # index of the copy among the bodies of the layout
    node: Pass  # point of the body at the joint


@dataclass(frozen=True, eq=False)
class Grasp:
    """Grasp of a hand."""

    at: float  # arc length [m]
    length: float  # [m]
    pose: tuple[FloatArray, FloatArray] | None  # position (3,) [m] and rotation (3, 3) as it grasps
    stiffness: FloatArray | None  # (6,): along d1, d2, t [N/m], about them [N m/rad]; None: it does not yield
    force_limit: float  # [N]
    edges: tuple[int, ...]  # that it touches; none of a ring
    slides: bool = False  # a ring, which the rod passes through
    friction: float = 0.0  # of a ring [-]
    feed_rate: float | None = None  # at first, where a drive holds the rod along itself [m/s]
    by: Pass | None = None  # point of a rigid body that carries a ring


@dataclass(frozen=True, eq=False)
class SupportPart(Part):
    """Support of a node, or of a length of a rod by a hand."""

    kind: SupportKind
    node: Pass
    node_name: str
    free: FloatArray  # projector onto the directions along which the node may slide, (3, 3)
    grasp: Grasp | None = None  # of a hand
    axis: FloatArray | None = None  # about which a held body may turn


@dataclass(frozen=True, eq=False)
class LoadPart(Part):
    """A force at a node, a moment at a node, a load along a rod, or a pressure on it."""

    kind: LoadKind
    node: Pass
    value: FloatArray  # (3,), or (edges, 3) along a rod; of one that varies that at t = 0
    function: Callable[[float], npt.ArrayLike] | None
    follower: bool
    axis: FloatArray | None = None  # of a pressure: unit normal that its value is along


@dataclass(frozen=True, eq=False)
class MassPart(Part):
    """A mass at a node."""

    node: Pass
    mass: float


@dataclass(frozen=True, eq=False)
class SpringPart(Part):
    """A spring, with a damper beside it, between two nodes."""

    nodes: tuple[Pass, Pass]
    node_names: tuple[str, str]
    stiffness: float  # [N/m]
    rest_length: float  # [m]
    damping: float  # [N s/m]
    as_drawn: bool = False  # whether it is as long at rest as it was drawn


@dataclass(frozen=True, eq=False)
class TendonPart(Part):
    """A tendon through guides on edges and ends of rods, and on points of rigid bodies."""

    guides: tuple[Guide, ...]
    offsets: FloatArray  # of each guide along d1 and d2 of its edge, (guides, 2) [m]
    tension: float  # [N]


@dataclass(frozen=True, eq=False)
class DragPart(Part):
    """Viscous drag along rods; None: all of them."""

    coefficient: float
    rods: tuple[int, ...] | None


@dataclass(frozen=True, eq=False)
class FluidPart(Part):
    """A viscous fluid around all rods."""

    model: FluidModel
    viscosity: float  # [Pa s]
    regularization: float | None  # [m]
    wavelength: float | None  # [m]


@dataclass(frozen=True, eq=False)
class CustomForcePart(Part):
    """Forces that a function computes."""

    function: Callable[[float, FloatArray, FloatArray], Any]
    jacobian: Callable[[float, FloatArray, FloatArray], Any] | None = None
    moments: bool = False


@dataclass(frozen=True, eq=False)
class Actuation:
    """Values that a simulation sets at a given time."""

    target: str | tuple[str, str] | None  # name of a part, of two bodies, or None for the scene
    at: float  # [s]
    over: float  # [s]
    values: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class ObstaclePart(Part):
    """Something solid, as it was drawn."""

    kind: Literal["plane", "capsule", "shape"]
    point: FloatArray  # on the plane; start of the axis; where the origin of a shape is (3,) [m]
    other: FloatArray  # normal; end of the axis (3,)
    radius: float
    friction: Coefficients
    restitution: float
    rolling_friction: float
    solid: Tube | Field | None = None  # of a shape

    @property
    def axis(self) -> FloatArray | None:
        """Return the axis of rotation (normal or axis); None for a sphere, which may turn about any axis."""
        axis = self.other if self.kind == "plane" else self.other - self.point
        length = float(np.linalg.norm(axis))
        return axis / length if length > 0.0 else None


@dataclass(frozen=True)
class PairSettings:
    """Settings of a pair of bodies; None: those of the scene."""

    ignored: bool = False
    friction: Coefficients | None = None
    restitution: float | None = None
    stiffness: float | None = None  # [N/m]


@dataclass(frozen=True, eq=False)
class ContactSettings:
    """Settings of contact and friction."""

    rods: bool | None = None  # None: not said
    friction: float = 0.0
    restitution: float = 1.0
    model: ContactModel = "imcv2"
    friction_model: FrictionModel = "anchored"
    distance_tolerance: float | None = None
    slip_tolerance: float = 1e-3
    stiffness: float | Literal["source"] | None = None
    centreline_friction: bool = False
    overlap: Overlap = "error"
    pairs: Mapping[tuple[str, str], PairSettings] = field(default_factory=dict)
    groups: Mapping[str, str] = field(default_factory=dict)  # of rods
