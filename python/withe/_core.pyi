"""
The engine of withe. Use the package withe instead: it checks what it is given.
"""

from __future__ import annotations
import collections.abc
import numpy
import numpy.typing
import scipy.sparse
import typing

__all__: list[str] = [
    "Batch",
    "BodyDescription",
    "ContactDescription",
    "ContactPairDescription",
    "ContactTable",
    "ConvergenceFailure",
    "Deflection",
    "DistanceField",
    "Energy",
    "EquilibriumGradient",
    "EquilibriumPath",
    "EquilibriumResult",
    "FaceDescription",
    "FluidDescription",
    "GraspTable",
    "HandDescription",
    "InitialGradient",
    "JointDescription",
    "JointLink",
    "Linearisation",
    "LoadDescription",
    "LoopDescription",
    "MomentAdjoint",
    "Momentum",
    "ObstacleDescription",
    "Options",
    "ParameterGradient",
    "PathPoint",
    "Plan",
    "PoseAdjoint",
    "Reached",
    "Reaction",
    "ReadoutAdjoint",
    "RingPassage",
    "RodDescription",
    "RodPass",
    "RodState",
    "RunJacobian",
    "SceneDescription",
    "Shape",
    "SheetManifold",
    "SheetWidth",
    "SpringDescription",
    "Statistics",
    "StraightRod",
    "SupportDescription",
    "Tape",
    "TendonDescription",
    "TorsionDescription",
    "Tube",
    "Warnings",
    "World",
    "check_turns",
    "close_and_open",
    "dragged_sheet",
    "drawn_strains",
    "foreground_mask",
    "ground_mask",
    "has_dark_ground",
    "hsv_mask",
    "sheets_at_forces",
    "sheets_at_poses",
    "slides_to_rest",
    "smooth_curvatures",
    "thin",
    "trace_lines",
]

class FaceDescription:
    """
    A face of the surface of a rigid body.
    """
    def __init__(self) -> None: ...
    @property
    def aside(self) -> int: ...
    @aside.setter
    def aside(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def depth(self) -> float: ...
    @depth.setter
    def depth(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def edge(self) -> int: ...
    @edge.setter
    def edge(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def outline(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 4]"]: ...
    @outline.setter
    def outline(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 4]"]) -> None: ...

class RodDescription:
    """
    A rod as a chain of nodes.
    """

    closed: bool
    name: str
    def __init__(self) -> None: ...
    @property
    def arc_lengths(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @arc_lengths.setter
    def arc_lengths(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def bend_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    @bend_stiffness.setter
    def bend_stiffness(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"]) -> None: ...
    @property
    def body(self) -> int: ...
    @body.setter
    def body(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def contact_radius(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @contact_radius.setter
    def contact_radius(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def directors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @directors.setter
    def directors(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def drag(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @drag.setter
    def drag(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def edge_faces(self) -> list[typing.Annotated[list[int], "FixedSize(2)"]]: ...
    @edge_faces.setter
    def edge_faces(
        self,
        arg0: collections.abc.Sequence[
            typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"]
        ],
    ) -> None: ...
    @property
    def faces(self) -> list[FaceDescription]: ...
    @faces.setter
    def faces(self, arg0: collections.abc.Sequence[FaceDescription]) -> None: ...
    @property
    def fibre_distance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    @fibre_distance.setter
    def fibre_distance(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"]) -> None: ...
    @property
    def fluid_radius(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @fluid_radius.setter
    def fluid_radius(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def friction(self) -> float: ...
    @friction.setter
    def friction(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def line_density(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @line_density.setter
    def line_density(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def natural_curvature(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    @natural_curvature.setter
    def natural_curvature(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"]) -> None: ...
    @property
    def natural_twist(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @natural_twist.setter
    def natural_twist(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def nodes(self) -> list[int]: ...
    @nodes.setter
    def nodes(self, arg0: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> None: ...
    @property
    def rest_lengths(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @rest_lengths.setter
    def rest_lengths(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def restitution(self) -> float: ...
    @restitution.setter
    def restitution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def rotary_inertia(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @rotary_inertia.setter
    def rotary_inertia(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def stretch_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @stretch_stiffness.setter
    def stretch_stiffness(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def twist_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @twist_stiffness.setter
    def twist_stiffness(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def viscous_time(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @viscous_time.setter
    def viscous_time(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...

class BodyDescription:
    """
    A rigid body: a frame at a node, and nodes that it carries.
    """

    name: str
    def __init__(self) -> None: ...
    @property
    def carried(self) -> list[int]: ...
    @carried.setter
    def carried(self, arg0: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> None: ...
    @property
    def carrier(self) -> int: ...
    @carrier.setter
    def carrier(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def center(self) -> int: ...
    @center.setter
    def center(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def inertia(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]: ...
    @inertia.setter
    def inertia(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None: ...
    @property
    def node(self) -> int: ...
    @node.setter
    def node(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...

class LoopDescription:
    """
    A closed loop of joints: a body, and its copy at a joint.
    """
    def __init__(
        self,
        copy: typing.SupportsInt | typing.SupportsIndex,
        body: typing.SupportsInt | typing.SupportsIndex,
        copy_node: typing.SupportsInt | typing.SupportsIndex,
        body_node: typing.SupportsInt | typing.SupportsIndex,
    ) -> None: ...

class RodPass:
    """
    A node of a rod.
    """
    def __init__(
        self, rod: typing.SupportsInt | typing.SupportsIndex, node: typing.SupportsInt | typing.SupportsIndex
    ) -> None: ...
    @property
    def node(self) -> int: ...
    @node.setter
    def node(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def rod(self) -> int: ...
    @rod.setter
    def rod(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...

class JointLink:
    """
    The child cluster turns about an axis relative to the parent.
    """

    slides: bool
    def __init__(
        self,
        parent: typing.SupportsInt | typing.SupportsIndex,
        child: typing.SupportsInt | typing.SupportsIndex,
        axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None: ...
    def set_stops(
        self,
        low: typing.SupportsFloat | typing.SupportsIndex,
        high: typing.SupportsFloat | typing.SupportsIndex,
        stiffness: typing.SupportsFloat | typing.SupportsIndex,
        restitution: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    @property
    def axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @axis.setter
    def axis(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def child(self) -> int: ...
    @child.setter
    def child(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def damping(self) -> float: ...
    @damping.setter
    def damping(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_speed(self) -> float: ...
    @max_speed.setter
    def max_speed(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_torque(self) -> float: ...
    @max_torque.setter
    def max_torque(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def moment(self) -> float: ...
    @moment.setter
    def moment(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def parent(self) -> int: ...
    @parent.setter
    def parent(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def rest_angle(self) -> float: ...
    @rest_angle.setter
    def rest_angle(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def stiffness(self) -> float: ...
    @stiffness.setter
    def stiffness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class JointDescription:
    """
    A node that several rods share.
    """

    form: str
    def __init__(self) -> None: ...
    @property
    def bodies(self) -> list[int]: ...
    @bodies.setter
    def bodies(self, arg0: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex]) -> None: ...
    @property
    def clusters(self) -> list[list[RodPass]]: ...
    @clusters.setter
    def clusters(self, arg0: collections.abc.Sequence[collections.abc.Sequence[RodPass]]) -> None: ...
    @property
    def links(self) -> list[JointLink]: ...
    @links.setter
    def links(self, arg0: collections.abc.Sequence[JointLink]) -> None: ...

class HandDescription:
    """
    What a hand holds.
    """

    feeds: bool
    posed: bool
    slides: bool
    yields: bool
    def __init__(self) -> None: ...
    @property
    def at(self) -> float: ...
    @at.setter
    def at(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def feed_rate(self) -> float: ...
    @feed_rate.setter
    def feed_rate(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def force_limit(self) -> float: ...
    @force_limit.setter
    def force_limit(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def friction(self) -> float: ...
    @friction.setter
    def friction(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def length(self) -> float: ...
    @length.setter
    def length(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def node(self) -> int: ...
    @node.setter
    def node(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def position(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @position.setter
    def position(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def rotation(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]: ...
    @rotation.setter
    def rotation(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None: ...
    @property
    def stiffness(self) -> typing.Annotated[list[float], "FixedSize(6)"]: ...
    @stiffness.setter
    def stiffness(
        self,
        arg0: typing.Annotated[collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex], "FixedSize(6)"],
    ) -> None: ...

class SupportDescription:
    """
    Something that holds a node.
    """

    hand: HandDescription
    kind: str
    pass_: RodPass
    def __init__(self) -> None: ...
    @property
    def axis(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @axis.setter
    def axis(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def free(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]: ...
    @free.setter
    def free(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"]) -> None: ...

class LoadDescription:
    """
    A force, a moment or a distributed load.
    """

    follower: bool
    kind: str
    pass_: RodPass
    varies: bool
    def __init__(self) -> None: ...
    @property
    def values(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @values.setter
    def values(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...

class SpringDescription:
    """
    A spring with a damper beside it between two nodes.
    """
    def __init__(self) -> None: ...
    @property
    def damping(self) -> float: ...
    @damping.setter
    def damping(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def nodes(self) -> typing.Annotated[list[int], "FixedSize(2)"]: ...
    @nodes.setter
    def nodes(
        self,
        arg0: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"],
    ) -> None: ...
    @property
    def rest_length(self) -> float: ...
    @rest_length.setter
    def rest_length(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def stiffness(self) -> float: ...
    @stiffness.setter
    def stiffness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class TendonDescription:
    """
    A tendon that runs through guides on edges.
    """
    def __init__(
        self,
        guides: collections.abc.Sequence[
            tuple[typing.SupportsInt | typing.SupportsIndex, typing.SupportsInt | typing.SupportsIndex, str]
        ],
        offsets: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"],
        tension: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...

class TorsionDescription:
    """
    A torsion spring between two edges.
    """
    def __init__(
        self,
        rods: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"],
        edges: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(2)"],
        axis: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        reference: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        stiffness: typing.SupportsFloat | typing.SupportsIndex,
        rest_angle: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...

class Shape:
    """
    A solid that rods touch, in axes of its own.
    """
    def distances(
        self, points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]:
        """
        Distances of points, shape (n,) [m].
        """
    def normals(
        self, points: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
        """
        Gradients of the distances, shape (n, 3) [-].
        """

class Tube(Shape):
    """
    A tube about an axis of quadratic Bezier curves.
    """
    def __init__(
        self,
        ends: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
        middles: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
        radius: typing.SupportsFloat | typing.SupportsIndex,
        wall: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...

class DistanceField(Shape):
    """
    A signed distance as a cubic spline on a grid.
    """
    def __init__(
        self,
        coefficients: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        points: typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"],
        origin: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        spacing: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None: ...

class ObstacleDescription:
    """
    Something solid that does not move.
    """

    kind: str
    name: str
    def __init__(self) -> None: ...
    def set_shape(self, arg0: Shape) -> None: ...
    @property
    def other(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @other.setter
    def other(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def point(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @point.setter
    def point(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def radius(self) -> float: ...
    @radius.setter
    def radius(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class ContactPairDescription:
    """
    What two bodies have of their own.
    """

    ignored: bool
    def __init__(self) -> None: ...
    @property
    def first(self) -> int: ...
    @first.setter
    def first(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def friction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @friction.setter
    def friction(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def restitution(self) -> float: ...
    @restitution.setter
    def restitution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def second(self) -> int: ...
    @second.setter
    def second(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def shares(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @shares.setter
    def shares(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def stiffness(self) -> float: ...
    @stiffness.setter
    def stiffness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class ContactDescription:
    """
    What touches, and how.
    """

    centreline_friction: bool
    friction_law: str
    law: str
    overlap: str
    rods: bool
    stiffness_rule: str
    warns_of_crossings: bool
    def __init__(self) -> None: ...
    @property
    def distance_tolerance(self) -> float: ...
    @distance_tolerance.setter
    def distance_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def friction(self) -> float: ...
    @friction.setter
    def friction(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def obstacle_friction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @obstacle_friction.setter
    def obstacle_friction(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def obstacle_restitution(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @obstacle_restitution.setter
    def obstacle_restitution(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def obstacle_rolling(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @obstacle_rolling.setter
    def obstacle_rolling(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def obstacles(self) -> list[ObstacleDescription]: ...
    @obstacles.setter
    def obstacles(self, arg0: collections.abc.Sequence[ObstacleDescription]) -> None: ...
    @property
    def pairs(self) -> list[ContactPairDescription]: ...
    @pairs.setter
    def pairs(self, arg0: collections.abc.Sequence[ContactPairDescription]) -> None: ...
    @property
    def restitution(self) -> float: ...
    @restitution.setter
    def restitution(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def slip_tolerance(self) -> float: ...
    @slip_tolerance.setter
    def slip_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def stiffness(self) -> float: ...
    @stiffness.setter
    def stiffness(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class FluidDescription:
    """
    A viscous fluid around all rods.
    """

    model: str
    def __init__(self) -> None: ...
    @property
    def regularization(self) -> float: ...
    @regularization.setter
    def regularization(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def viscosity(self) -> float: ...
    @viscosity.setter
    def viscosity(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def wavelength(self) -> float: ...
    @wavelength.setter
    def wavelength(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...

class SceneDescription:
    """
    What the scene layer hands to the engine.
    """

    bending: str
    contact: ContactDescription
    custom_implicit: bool
    custom_moments: bool
    fluid: FluidDescription
    has_custom_force: bool
    def __init__(self) -> None: ...
    @property
    def added_mass(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @added_mass.setter
    def added_mass(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def bodies(self) -> list[BodyDescription]: ...
    @bodies.setter
    def bodies(self, arg0: collections.abc.Sequence[BodyDescription]) -> None: ...
    @property
    def gravity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @gravity.setter
    def gravity(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    @property
    def joints(self) -> list[JointDescription]: ...
    @joints.setter
    def joints(self, arg0: collections.abc.Sequence[JointDescription]) -> None: ...
    @property
    def loads(self) -> list[LoadDescription]: ...
    @loads.setter
    def loads(self, arg0: collections.abc.Sequence[LoadDescription]) -> None: ...
    @property
    def loops(self) -> list[LoopDescription]: ...
    @loops.setter
    def loops(self, arg0: collections.abc.Sequence[LoopDescription]) -> None: ...
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @positions.setter
    def positions(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def rods(self) -> list[RodDescription]: ...
    @rods.setter
    def rods(self, arg0: collections.abc.Sequence[RodDescription]) -> None: ...
    @property
    def springs(self) -> list[SpringDescription]: ...
    @springs.setter
    def springs(self, arg0: collections.abc.Sequence[SpringDescription]) -> None: ...
    @property
    def supports(self) -> list[SupportDescription]: ...
    @supports.setter
    def supports(self, arg0: collections.abc.Sequence[SupportDescription]) -> None: ...
    @property
    def tendons(self) -> list[TendonDescription]: ...
    @tendons.setter
    def tendons(self, arg0: collections.abc.Sequence[TendonDescription]) -> None: ...
    @property
    def torsions(self) -> list[TorsionDescription]: ...
    @torsions.setter
    def torsions(self, arg0: collections.abc.Sequence[TorsionDescription]) -> None: ...

class Options:
    """
    Choices of a simulation.
    """

    heuristics: typing.ClassVar[tuple[typing.Any, ...]] = (
        "reuse_across_steps",
        "reuse_within_step",
        "rest_from_reuse",
        "refresh_after_slow",
        "forget_contraction",
        "late_matrix",
        "matrix_worth",
        "reject_stagnation",
        "surface_search",
        "search_descent",
        "drop_geometric",
        "start_accelerated",
        "start_plain",
        "start_continuation",
        "start_record",
        "few_iterations",
        "hold_sticking",
        "predict_friction",
        "supports_linear",
    )
    adaptive: bool
    integrator: str
    mixed: bool
    planar: bool | None
    solver: str
    def __init__(self) -> None: ...
    def switch_off(self, arg0: str) -> None: ...
    @property
    def duration(self) -> float | None: ...
    @duration.setter
    def duration(self, arg0: typing.SupportsFloat | typing.SupportsIndex | None) -> None: ...
    @property
    def force_tolerance(self) -> float: ...
    @force_tolerance.setter
    def force_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def max_halvings(self) -> int: ...
    @max_halvings.setter
    def max_halvings(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def max_iterations(self) -> int: ...
    @max_iterations.setter
    def max_iterations(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def max_steps(self) -> int | None: ...
    @max_steps.setter
    def max_steps(self, arg0: typing.SupportsInt | typing.SupportsIndex | None) -> None: ...
    @property
    def step_tolerance(self) -> float: ...
    @step_tolerance.setter
    def step_tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def threads(self) -> int: ...
    @threads.setter
    def threads(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def time_step(self) -> float: ...
    @time_step.setter
    def time_step(self, arg0: typing.SupportsFloat | typing.SupportsIndex) -> None: ...
    @property
    def tolerance(self) -> float | None: ...
    @tolerance.setter
    def tolerance(self, arg0: typing.SupportsFloat | typing.SupportsIndex | None) -> None: ...

class ParameterGradient:
    """
    Derivatives of a scalar by the numbers that act.
    """
    @property
    def added_mass(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def bend_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    @property
    def drag(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def drawn_curvature(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]]: ...
    @property
    def drawn_twist(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]: ...
    @property
    def edge_turn(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def fluid_viscosity(self) -> float: ...
    @property
    def friction(self) -> float: ...
    @property
    def gravity(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @property
    def hand_limit(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def hand_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 6]"]: ...
    @property
    def joint_damping(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def joint_max_speed(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def joint_max_torque(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def joint_moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def joint_rest_angle(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def joint_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def line_density(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def loads(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def natural_curvature(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]]: ...
    @property
    def natural_stretch(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]: ...
    @property
    def natural_twist(self) -> list[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]]: ...
    @property
    def obstacle_friction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def obstacle_rolling(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def pair_friction(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def rest_length(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def rotary_inertia(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def slip_tolerance(self) -> float: ...
    @property
    def spring_damping(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def spring_rest_length(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def spring_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def stretch_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def tendon_tension(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def torsion_rest_angle(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def torsion_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def twist_stiffness(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def viscous_time(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...

class EquilibriumGradient:
    """
    Derivatives of a scalar of an equilibrium.
    """
    @property
    def drawn_nodes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def edge_turn(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def obstacle_positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def parameters(self) -> ParameterGradient: ...
    @property
    def support_positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def support_rotations(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...

class PoseAdjoint:
    """
    Derivatives of a scalar by poses of supports and obstacles.
    """
    @property
    def obstacles(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def rotations(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...

class Reached:
    """
    How far what moves has come, from 0 to 1; empty: all is there.
    """
    @property
    def obstacles(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def supports(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]: ...

class InitialGradient:
    """
    Derivatives of a scalar of a run by the state at its start.
    """
    @property
    def drawn_nodes(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def edge_turn(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def poses(self) -> PoseAdjoint: ...
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def velocities(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...

class RunJacobian:
    """
    Derivatives of the state that a run leads to.
    """
    @property
    def rows(self) -> list[ParameterGradient]: ...
    @property
    def state(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]: ...

class ReadoutAdjoint:
    """
    Derivatives of a scalar by what is read out of a state.
    """
    def __init__(self) -> None: ...
    @property
    def curvatures(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    @curvatures.setter
    def curvatures(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"]) -> None: ...
    @property
    def directors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 9]"]: ...
    @directors.setter
    def directors(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 9]"]) -> None: ...
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @positions.setter
    def positions(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def reaction_forces(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @reaction_forces.setter
    def reaction_forces(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def reaction_moments(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @reaction_moments.setter
    def reaction_moments(self, arg1: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def spins(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @spins.setter
    def spins(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def tensions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @tensions.setter
    def tensions(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def twists(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @twists.setter
    def twists(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def velocities(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @velocities.setter
    def velocities(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...

class MomentAdjoint:
    """
    What a scalar depends on after so many steps of a run.
    """
    def __init__(self, steps: typing.SupportsInt | typing.SupportsIndex, by: ReadoutAdjoint) -> None: ...

class Tape:
    """
    A run as the adjoint method needs it.
    """
    def divide(self) -> None:
        """
        What acts from here on is told apart.
        """
    def gradient(
        self,
        moments: collections.abc.Sequence[MomentAdjoint],
        visit: collections.abc.Callable[[int, int, float, ParameterGradient], None],
        visit_poses: collections.abc.Callable[[int, Reached, PoseAdjoint], None] | None,
    ) -> InitialGradient: ...
    def jacobian(self) -> RunJacobian: ...
    @property
    def count(self) -> int:
        """
        Steps taken.
        """

class RodState:
    """
    What a rod is to be like; what is empty stays as it is.
    """
    def __init__(self) -> None: ...
    @property
    def directors(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @directors.setter
    def directors(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @positions.setter
    def positions(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    @property
    def rod(self) -> int: ...
    @rod.setter
    def rod(self, arg0: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    @property
    def spins(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @spins.setter
    def spins(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def twists(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @twists.setter
    def twists(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    @property
    def velocities(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @velocities.setter
    def velocities(self, arg0: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...

class Warnings:
    """
    What is wrong with how a scene is run; empty where nothing is.
    """
    @property
    def branch(self) -> str: ...
    @property
    def crossing(self) -> str: ...
    @property
    def drift(self) -> str: ...
    @property
    def impact(self) -> str: ...
    @property
    def mesh(self) -> str: ...
    @property
    def plane(self) -> str: ...
    @property
    def squeeze(self) -> str: ...
    @property
    def steps(self) -> str: ...

class Linearisation:
    """
    Equations linearised about the present configuration.
    """
    @property
    def displacement(self) -> scipy.sparse.csc_matrix: ...
    @property
    def geometric(self) -> scipy.sparse.csc_matrix: ...
    @property
    def gradients(self) -> scipy.sparse.csc_matrix: ...
    @property
    def imbalance(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def mass(self) -> scipy.sparse.csc_matrix: ...
    @property
    def stiffnesses(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    @property
    def turn(self) -> scipy.sparse.csc_matrix: ...

class Energy:
    """
    Energies [J].
    """
    @property
    def bend(self) -> float: ...
    @property
    def contact(self) -> float: ...
    @property
    def dissipated(self) -> float: ...
    @property
    def gravity(self) -> float: ...
    @property
    def kinetic(self) -> float: ...
    @property
    def loads(self) -> float: ...
    @property
    def spring(self) -> float: ...
    @property
    def stretch(self) -> float: ...
    @property
    def total(self) -> float: ...
    @property
    def twist(self) -> float: ...
    @property
    def work(self) -> float: ...

class Momentum:
    """
    Of the whole scene, angular about the origin.
    """
    @property
    def angular(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @property
    def linear(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...

class Statistics:
    """
    What the work so far took.
    """
    @property
    def assembly_time(self) -> float: ...
    @property
    def branch_changes(self) -> int: ...
    @property
    def energy_momentum_steps(self) -> int: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def factorizations(self) -> int: ...
    @property
    def fluid_time(self) -> float: ...
    @property
    def fourth_order_steps(self) -> int: ...
    @property
    def iterations(self) -> int: ...
    @property
    def largest_turn(self) -> float: ...
    @property
    def rejected_steps(self) -> int: ...
    @property
    def solve_time(self) -> float: ...
    @property
    def steps(self) -> int: ...
    @property
    def total_time(self) -> float: ...
    @property
    def unresolved_amplitude(self) -> float: ...

class Deflection:
    """
    How far what a hand holds has gone.
    """
    @property
    def shift(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @property
    def slip(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @property
    def turn(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...

class RingPassage:
    """
    How a rod passes a ring.
    """
    @property
    def at(self) -> float: ...
    @property
    def feed_rate(self) -> float: ...
    @property
    def passes(self) -> bool: ...
    @property
    def press(self) -> float: ...
    @property
    def pull(self) -> float: ...

class Reaction:
    """
    Of a support on the rod.
    """
    @property
    def force(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @property
    def moment(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...

class ContactTable:
    """
    What touches, a row each.
    """
    @property
    def bodies(self) -> typing.Annotated[numpy.typing.NDArray[numpy.int32], "[m, 5]"]: ...
    @property
    def numbers(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 14]"]: ...

class EquilibriumResult:
    """
    How an equilibrium was found.
    """
    @property
    def branch_changed(self) -> bool: ...
    @property
    def decided(self) -> bool: ...
    @property
    def iterations(self) -> int: ...
    @property
    def residual(self) -> float: ...
    @property
    def stable(self) -> bool: ...

class PathPoint:
    """
    A point of a path of equilibria.
    """
    @property
    def factor(self) -> float: ...
    @property
    def forces(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def limit(self) -> bool: ...
    @property
    def moments(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def stable(self) -> bool: ...

class EquilibriumPath:
    """
    A path of equilibria.
    """
    @property
    def finished(self) -> bool: ...
    @property
    def iterations(self) -> int: ...
    @property
    def points(self) -> list[PathPoint]: ...

class Plan:
    """
    What build decided.
    """
    @property
    def notes(self) -> list[str]: ...
    @property
    def planar(self) -> bool: ...
    @property
    def plane_normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    @property
    def solver(self) -> str: ...
    @property
    def stable_step(self) -> float: ...
    @property
    def unknowns(self) -> int: ...

class ConvergenceFailure(RuntimeError):
    pass

class World:
    """
    A scene while it runs.
    """
    def __init__(self, description: SceneDescription, options: Options) -> None: ...
    def add_load(self, load: LoadDescription) -> int:
        """
        A load that acts from now on; its index.
        """
    def add_support(self, support: SupportDescription) -> int: ...
    def advance_to(
        self, time: typing.SupportsFloat | typing.SupportsIndex, callback: typing.Any, forces: typing.Any
    ) -> None:
        """
        Advance to a time [s].
        """
    def body_base(self, body: typing.SupportsInt | typing.SupportsIndex) -> int: ...
    def body_rotation(
        self, body: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]: ...
    def body_spin(
        self, body: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    def check_idle(self) -> None:
        """
        Raises in the middle of a step.
        """
    def contacts(self) -> ContactTable: ...
    def copy(self) -> World:
        """
        Another world like this.
        """
    def curvatures(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    def deflection(self, support: typing.SupportsInt | typing.SupportsIndex) -> Deflection: ...
    def directors(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 9]"]: ...
    def displace_state(self, by: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    def due(self, name: str, owner: typing.SupportsInt | typing.SupportsIndex) -> float | None:
        """
        Return the time at which the ramp of a parameter ends [s], or None.
        """
    def energy(self) -> Energy: ...
    def equilibrium(self, stable: bool, callback: typing.Any, forces: typing.Any) -> EquilibriumResult:
        """
        Find the static equilibrium.
        """
    def equilibrium_gradients(
        self, by: collections.abc.Sequence[ReadoutAdjoint]
    ) -> tuple[list[EquilibriumGradient], list[EquilibriumGradient]]: ...
    def equilibrium_path(
        self,
        loads: collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex],
        start: typing.SupportsFloat | typing.SupportsIndex,
        end: typing.SupportsFloat | typing.SupportsIndex,
        most_points: typing.SupportsInt | typing.SupportsIndex,
        turn: typing.SupportsFloat | typing.SupportsIndex,
        callback: typing.Any,
        forces: typing.Any,
    ) -> EquilibriumPath:
        """
        Follow a path of equilibria through limit points.
        """
    def equilibrium_residual(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def equilibrium_responses(
        self,
        residual: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
        held: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, n]"],
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]: ...
    def feed(
        self, support: typing.SupportsInt | typing.SupportsIndex, rate: typing.SupportsFloat | typing.SupportsIndex
    ) -> None: ...
    def joint_angle(self, joint: typing.SupportsInt | typing.SupportsIndex) -> float: ...
    def joint_rate(self, joint: typing.SupportsInt | typing.SupportsIndex) -> float: ...
    def joint_reaction(
        self, joint: typing.SupportsInt | typing.SupportsIndex, side: collections.abc.Sequence[RodPass]
    ) -> Reaction: ...
    def joint_torque(self, joint: typing.SupportsInt | typing.SupportsIndex) -> float: ...
    def linearise(self, forces: typing.Any) -> Linearisation: ...
    def load(
        self, load: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    def momentum(self) -> Momentum: ...
    def move_obstacle(
        self,
        obstacle: typing.SupportsInt | typing.SupportsIndex,
        position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None,
        turn: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None,
        over: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def move_support(
        self,
        support: typing.SupportsInt | typing.SupportsIndex,
        position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None,
        rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None,
        over: typing.SupportsFloat | typing.SupportsIndex,
        roll: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None: ...
    def natural_curvature(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]: ...
    def natural_twist(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def note_moment(self) -> None: ...
    def obstacle_position(
        self, obstacle: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    def obstacle_turn(
        self, obstacle: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    def own_contact(
        self, first: typing.SupportsInt | typing.SupportsIndex, second: typing.SupportsInt | typing.SupportsIndex
    ) -> int:
        """
        Return the index of the pair of two bodies that owns contact parameters, added where there is none.
        """
    def parameter(
        self, name: str, owner: typing.SupportsInt | typing.SupportsIndex = 0
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]:
        """
        Return the present values of a parameter of a rod, a part or the scene: a row an edge, stencil or node.
        """
    def passage(self, support: typing.SupportsInt | typing.SupportsIndex) -> RingPassage: ...
    def positions(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    def prescribe_obstacle(
        self,
        obstacle: typing.SupportsInt | typing.SupportsIndex,
        position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None,
        turn: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None,
    ) -> None: ...
    def prescribe_support(
        self,
        support: typing.SupportsInt | typing.SupportsIndex,
        position: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"] | None,
        rotation: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 3]"] | None,
    ) -> None: ...
    def reaction(self, support: typing.SupportsInt | typing.SupportsIndex) -> Reaction: ...
    def remove_load(self, load: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def remove_support(self, support: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def restore(self, state: bytes) -> None:
        """
        Go back to a snapshot.
        """
    def rod_energy(self, rod: typing.SupportsInt | typing.SupportsIndex) -> Energy: ...
    def set(
        self,
        owner: typing.SupportsInt | typing.SupportsIndex,
        values: dict[str, typing.Any],
        over: typing.SupportsFloat | typing.SupportsIndex = 0.0,
    ) -> None:
        """
        Set parameters of a rod, a part or the scene by their names, over a duration [s]: all, or where one is refused none.
        """
    def set_added_mass(self, mass: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"]) -> None: ...
    def set_body_motion(
        self,
        body: typing.SupportsInt | typing.SupportsIndex,
        velocity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        spin: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
        held: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"],
    ) -> None: ...
    def set_friction_shares(
        self,
        pair: typing.SupportsInt | typing.SupportsIndex,
        shares: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    ) -> None: ...
    def set_gravity(self, gravity: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[3, 1]"]) -> None: ...
    def set_load(
        self,
        load: typing.SupportsInt | typing.SupportsIndex,
        values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
    ) -> None: ...
    def set_natural_curvature(
        self,
        rod: typing.SupportsInt | typing.SupportsIndex,
        curvature: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"],
        over: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def set_natural_stretch(
        self,
        rod: typing.SupportsInt | typing.SupportsIndex,
        stretch: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        over: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def set_natural_twist(
        self,
        rod: typing.SupportsInt | typing.SupportsIndex,
        twist: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
        over: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def set_ring_friction(
        self, support: typing.SupportsInt | typing.SupportsIndex, friction: typing.SupportsFloat | typing.SupportsIndex
    ) -> None: ...
    def set_state(
        self, rods: collections.abc.Sequence[RodState], time: typing.SupportsFloat | typing.SupportsIndex | None
    ) -> None:
        """
        Put rods where they are told to be.
        """
    def set_velocities(self, velocities: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"]) -> None: ...
    def snapshot(self) -> bytes:
        """
        The whole state.
        """
    def spins(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def spring_tension(self, spring: typing.SupportsInt | typing.SupportsIndex) -> float: ...
    def start_tape(self) -> Tape: ...
    def state_difference(self, reference: World) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def step(self, count: typing.SupportsInt | typing.SupportsIndex, callback: typing.Any, forces: typing.Any) -> None:
        """
        Advance exactly `count` time steps.
        """
    def stop_tape(self) -> None: ...
    def support_directions(
        self, support: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, n]"]: ...
    def support_position(
        self, support: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"]: ...
    def support_rotation(
        self, support: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"]: ...
    def support_turn(
        self, support: typing.SupportsInt | typing.SupportsIndex
    ) -> tuple[typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 3]"], float]: ...
    def take_left_rings(self) -> list[tuple[int, float]]:
        """
        Supports that were released since rods have left them, and when [s].
        """
    def take_warnings(self) -> Warnings: ...
    def tendon_length(self, tendon: typing.SupportsInt | typing.SupportsIndex) -> float: ...
    def tendon_points(
        self, tendon: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    def tensions(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def twists(
        self, rod: typing.SupportsInt | typing.SupportsIndex
    ) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 1]"]: ...
    def velocities(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]: ...
    @property
    def contact(self) -> ContactDescription: ...
    @property
    def frames_as_drawn(self) -> bool: ...
    @property
    def plan(self) -> Plan: ...
    @property
    def plane_normal(self) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[3, 1]"] | None: ...
    @property
    def statistics(self) -> Statistics: ...
    @property
    def time(self) -> float: ...

class Batch:
    """
    Worlds that are stepped and read in one call.
    """
    def __init__(
        self, worlds: collections.abc.Sequence[typing.Any], workers: typing.SupportsInt | typing.SupportsIndex
    ) -> None: ...
    def failed(self) -> numpy.typing.NDArray[numpy.bool]:
        """
        Which lanes have failed.
        """
    def failure(self, lane: typing.SupportsInt | typing.SupportsIndex) -> typing.Any:
        """
        Message and numbers, or None.
        """
    def forgive(self, lane: typing.SupportsInt | typing.SupportsIndex) -> None: ...
    def read(
        self, what: str, rod: typing.SupportsInt | typing.SupportsIndex, out: numpy.typing.NDArray[numpy.float64]
    ) -> None:
        """
        Fill an array with a read-out of every lane.
        """
    def replace(self, lane: typing.SupportsInt | typing.SupportsIndex, world: typing.Any) -> None: ...
    def restore(
        self, lanes: typing.Annotated[numpy.typing.ArrayLike, numpy.int32], snapshots: collections.abc.Sequence[bytes]
    ) -> None: ...
    def set_natural_curvature(
        self,
        lanes: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
        rod: typing.SupportsInt | typing.SupportsIndex,
        values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        over: typing.SupportsFloat | typing.SupportsIndex,
        voronoi: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        discrete: bool,
        owner: str,
    ) -> None:
        """
        Rows of the lanes, smooth or discrete, which are made smooth in place; refused before any is led.
        """
    def set_natural_stretch(
        self,
        lanes: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
        rod: typing.SupportsInt | typing.SupportsIndex,
        values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        over: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def set_natural_twist(
        self,
        lanes: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
        rod: typing.SupportsInt | typing.SupportsIndex,
        values: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        over: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def step(
        self,
        lanes: typing.Annotated[numpy.typing.ArrayLike, numpy.int32],
        count: typing.SupportsInt | typing.SupportsIndex,
        functions: collections.abc.Mapping[typing.SupportsInt | typing.SupportsIndex, tuple[typing.Any, typing.Any]],
    ) -> None:
        """
        Advance lanes by `count` time steps; functions of Python are called with the lock of the interpreter.
        """
    def take_left_rings(self) -> list[tuple[int, int, float]]:
        """
        Lanes and supports that were released since rods have left them, and when [s].
        """
    def take_warnings(self) -> Warnings: ...
    @property
    def workers(self) -> int: ...

class SheetWidth:
    """
    Width of a sheet over the distance from its tip, in straight pieces.
    """
    @typing.overload
    def __init__(self) -> None:
        """
        1 everywhere.
        """
    @typing.overload
    def __init__(
        self,
        places: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
        widths: collections.abc.Sequence[typing.SupportsFloat | typing.SupportsIndex],
    ) -> None: ...
    def weight_at(self, place: typing.SupportsFloat | typing.SupportsIndex) -> float:
        """
        Return the weight of the part from the tip to a place.
        """
    def width_at(self, place: typing.SupportsFloat | typing.SupportsIndex) -> float: ...

class SheetManifold:
    """
    All poses in which a sheet can be held, tabulated once.
    """

    greatest_pull: typing.ClassVar[float] = 40.0
    longest: typing.ClassVar[float] = 6.84
    shortest: typing.ClassVar[float] = 0.958
    def __init__(self, width: SheetWidth) -> None: ...
    def at_length_and_angle(
        self,
        length: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        angle: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        tip_moment: typing.SupportsFloat | typing.SupportsIndex,
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        One row a pose.
        """
    def at_position(
        self,
        x: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        z: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        tip_moment: typing.SupportsFloat | typing.SupportsIndex,
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        One row a pose.
        """

class GraspTable:
    """
    Grasps that lay a rod, tabulated once.
    """

    greatest_curvature: typing.ClassVar[float] = 6.0
    longest: typing.ClassVar[float] = 100.0
    shortest: typing.ClassVar[float] = 0.1
    def __init__(self) -> None: ...
    def grasps(
        self,
        questions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        twist_stiffness: typing.SupportsFloat | typing.SupportsIndex,
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        One row a grasp, for rows of suspended length, curvature, stretching stiffness, axial force, base angle and lever of the floor's force.
        """
    def points(
        self,
        suspended: typing.SupportsFloat | typing.SupportsIndex,
        curvature: typing.SupportsFloat | typing.SupportsIndex,
        stretch_stiffness: typing.SupportsFloat | typing.SupportsIndex,
        axial_force: typing.SupportsFloat | typing.SupportsIndex,
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        The rod's points: s, position, quaternion.
        """

class StraightRod:
    """
    Poses in which a straight line is laid, for one suspended length.
    """

    longest: typing.ClassVar[float] = 50.0
    shortest: typing.ClassVar[float] = 0.3
    def __init__(
        self,
        suspended: typing.SupportsFloat | typing.SupportsIndex,
        stretch_stiffness: typing.SupportsFloat | typing.SupportsIndex,
    ) -> None: ...
    def optima(
        self, twist_stiffness: typing.SupportsFloat | typing.SupportsIndex
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        The gentle pose and the folded one.
        """
    def outline(self, angle_step: typing.SupportsFloat | typing.SupportsIndex) -> numpy.typing.NDArray[numpy.float64]:
        """
        Nearest and farthest position on each ray.
        """
    def points(
        self, x: typing.SupportsFloat | typing.SupportsIndex, z: typing.SupportsFloat | typing.SupportsIndex
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        The rod's points: s, position, quaternion.
        """
    def poses(
        self,
        positions: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
        twist_stiffness: typing.SupportsFloat | typing.SupportsIndex,
    ) -> numpy.typing.NDArray[numpy.float64]:
        """
        One row a position.
        """

def check_turns(
    smooth: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"],
    voronoi: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
    owner: str,
) -> None:
    """
    Refuse curvatures [1/m] that turn a rod by pi or more at a node.
    """

def close_and_open(mask: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8]) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Closing, then opening, by a square of 3 x 3 pixels.
    """

def dragged_sheet(
    poses: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    friction: typing.SupportsFloat | typing.SupportsIndex,
    sheet_length: typing.SupportsFloat | typing.SupportsIndex,
    width: SheetWidth,
) -> tuple[typing.Any, ...]:
    """
    A sheet moved from pose to pose, sliding by Coulomb's law: one row a pose, and how far it has slid.
    """

def drawn_strains(
    tangents: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
    directors: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 3]"],
    closed: bool,
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 3]"]:
    """
    Strains (kappa1, kappa2, tau) of the stencils of a rod as it is drawn, by its edges' tangents and first directors, a row each.
    """

def foreground_mask(
    image: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8], contrast: typing.SupportsInt | typing.SupportsIndex
) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Pixels whose colour is far from that of the border.
    """

def ground_mask(
    image: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8], contrast: typing.SupportsInt | typing.SupportsIndex
) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Pixels that differ from the ground beneath by more than a shadow can.
    """

def has_dark_ground(
    image: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8], contrast: typing.SupportsInt | typing.SupportsIndex
) -> bool:
    """
    True if shadows on the ground are fainter than the contrast.
    """

def hsv_mask(
    image: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8],
    ranges: collections.abc.Sequence[
        tuple[
            typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"],
            typing.Annotated[collections.abc.Sequence[typing.SupportsInt | typing.SupportsIndex], "FixedSize(3)"],
        ]
    ],
) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Pixels whose colour is in a range.
    """

def sheets_at_forces(
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64], width: SheetWidth
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Sheets of given floor forces and suspended length, one row a sheet.
    """

def sheets_at_poses(
    poses: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    width: SheetWidth,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Sheets held at poses, each followed from forces of its own, one row a sheet.
    """

def slides_to_rest(
    forces: typing.Annotated[numpy.typing.ArrayLike, numpy.float64],
    friction: typing.SupportsFloat | typing.SupportsIndex,
    sheet_length: typing.SupportsFloat | typing.SupportsIndex,
    width: SheetWidth,
) -> numpy.typing.NDArray[numpy.float64]:
    """
    Return the distances that sheets with resting jaws slide until friction holds them.
    """

def smooth_curvatures(
    discrete: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 2]"],
    voronoi: typing.Annotated[numpy.typing.ArrayLike, numpy.float64, "[m, 1]"],
) -> typing.Annotated[numpy.typing.NDArray[numpy.float64], "[m, 2]"]:
    """
    Curvatures [1/m] of the smooth rod that turns by the same angles as discrete ones 2 tan(phi / 2), a row a stencil.
    """

def thin(mask: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8]) -> numpy.typing.NDArray[numpy.uint8]:
    """
    Skeleton of a mask by Zhang and Suen's rule as scikit-image has it.
    """

def trace_lines(
    mask: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8],
    image: typing.Annotated[numpy.typing.ArrayLike, numpy.uint8] | None = None,
    method: str = "withe",
) -> dict[str, typing.Any]:
    """
    Every line in a mask, in order, and labels.
    """

__version__: str
