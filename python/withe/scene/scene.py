"""Scenes: soft robots described rod by rod."""

from __future__ import annotations

import os
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
import numpy.typing as npt

from withe.batch import Batch
from withe.common import validation
from withe.common.attributes import known_attributes, of_a_simulation
from withe.common.deprecation import moved_into, renamed
from withe.common.keywords import keyword_hints
from withe.common.log import logs_info
from withe.parts.actuation import add_actuation
from withe.parts.applied_loads import AppliedLoads, Bearer
from withe.parts.bodies import make_body
from withe.parts.directory import Directory
from withe.parts.handles import Body, Joint, Load, NodeHandle, Rod, RodPlace, parse_place
from withe.parts.kinds import JoinKind, JointForm, LoadPart, RodPart
from withe.parts.materials import Material, Section, Stiffness
from withe.parts.options import Bending, BuildOptions, Integrator, Solver
from withe.parts.rods import Natural, make_rod
from withe.scene.contacts import Contacts
from withe.scene.declarations import Declaration, declares
from withe.scene.file_format import METHODS
from withe.scene.files import fill, save_scene
from withe.scene.joints import JoinedNodes
from withe.scene.loads import Loads
from withe.scene.options import checked_options, with_build_options
from withe.scene.robots import Robot, add_robot
from withe.scene.supports import Supports
from withe.simulation.logs import log_build
from withe.simulation.parameters import Settable
from withe.simulation.schedule import check_actuations
from withe.simulation.simulation import Simulation
from withe.solids.bodies import Solid

__all__ = ["Scene"]

FloatArray = npt.NDArray[np.float64]
_DEFAULT_SOLVER = Solver()
_IN_SOLVER = ("mixed", "step_tolerance", "force_tolerance", "max_iterations", "max_halvings", "max_steps")


@declares(*METHODS)
@keyword_hints
@known_attributes("use a method such as set_friction, or an option of build")
class Scene(AppliedLoads, Loads, Contacts, Supports):
    """Describe rods, joints, supports and loads, and build simulations from the description.

    Methods and properties by purpose:

    * describe: `add_rod`, `add_body`, `add_robot`, `join`, `add_mass`, `add_spring`, `add_torsion_spring`,
      `add_tendon`, `gravity`
    * hold: `clamp`, `pin`, `grasp`
    * load: `add_force`, `add_moment`, `add_load`, `add_pressure`, `add_drag`, `add_fluid`, `add_custom_force`,
      `actuate` at given times
    * touch: `enable_contact`, `add_floor`, `add_plane`, `add_sphere`, `add_capsule`, `add_obstacle`, `set_friction`,
      `set_restitution`, `set_contact_stiffness`, `ignore_contact`, `set_contact_group`
    * run: `build`, `build_batch`, `build_options`
    * read: `rods`, and ``scene["arm"]`` for the handle of a name; `save`, `load` of TOML files
    * differentiate: see `withe.Simulation`, whose equations have derivatives

    Parameters
    ----------
    gravity : array_like of shape (3,) [m/s^2]
        Acceleration of free fall.

    See Also
    --------
    Simulation : A running scene, made by `build`.
    Batch : Many simulations that step together, made by `build_batch`.
    Material : Elasticity and density of a rod.

    Examples
    --------
    >>> import withe
    >>> scene = withe.Scene()
    >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
    >>> arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=rubber, name="arm")
    >>> scene.clamp(arm.start)
    Support(name='clamp 1')
    >>> simulation = scene.build(integrator="static")
    >>> simulation.equilibrium().stable
    True
    """

    def __init__(self, gravity: npt.ArrayLike = (0.0, 0.0, -9.81)) -> None:
        self._directory = Directory(uuid.uuid4().hex)
        self._joints = JoinedNodes(self._directory)
        self._declarations: list[Declaration] = []
        self._build_options: dict[str, Any] = {}
        self._material_names: dict[str, Material] = {}  # of the file that the scene was read from
        self.gravity = gravity

    @property
    def gravity(self) -> FloatArray:
        """Acceleration of free fall, shape (3,) [m/s^2]."""
        return self._gravity.copy()

    @gravity.setter
    def gravity(self, value: npt.ArrayLike) -> None:
        self._gravity = validation.vector(value, "gravity")

    @property
    def rods(self) -> tuple[Rod, ...]:
        """Handles of all rods, in the order they were added."""
        return self._directory.rods

    def __getitem__(self, name: str) -> Any:
        """Return the handle of a part, node or edge by its name: ``scene["arm"]``, ``scene["arm.end"]``.

        Raises
        ------
        ValueError
            The scene has no part, node or edge of this name.
        """
        return self._directory.handle(name)

    if not TYPE_CHECKING:  # a misspelt attribute stays an error to type checkers

        def __getattr__(self, word: str) -> Any:
            raise of_a_simulation("Scene", word, "simulation.{}")

    def __repr__(self) -> str:
        return f"Scene({', '.join(part.name for part in self._directory.parts.values())})"

    # Rods and joints

    def add_rod(
        self,
        *,
        start: npt.ArrayLike | None = None,
        end: npt.ArrayLike | None = None,
        points: npt.ArrayLike | None = None,
        nodes: int | None = None,
        closed: bool = False,
        normal: npt.ArrayLike | None = None,
        radius: npt.ArrayLike | None = None,
        section: Section | None = None,
        contact_radius: npt.ArrayLike | None = None,
        material: Material | None = None,
        stiffness: Stiffness | None = None,
        line_density: npt.ArrayLike | None = None,
        natural: Natural = "as_built",
        natural_curvature: npt.ArrayLike | None = None,
        natural_twist: npt.ArrayLike | None = None,
        discrete: bool = False,
        name: str | None = None,
    ) -> Rod:
        """Add a rod between two ends or along a centreline.

        The rod stretches, bends and twists. It does not shear (Kirchhoff rod).

        Parameters
        ----------
        start, end : array_like of shape (3,) [m]
            Ends of a straight rod with `nodes` nodes.
        points : array_like of shape (n, 3) [m]
            Centreline, instead of `start` and `end`. Without `nodes`, the points are the nodes of the rod. With
            `nodes`, the centreline is sampled at even arc lengths: its edges are then chords with the mass and the
            natural compliance of their arcs. Use `nodes` for smooth curves.
        nodes : int
            Number of nodes, ends included.
        closed : bool
            True if the last point is joined to the first, which may be repeated at the end.
        normal : array_like of shape (3,) or (edges, 3)
            First director of the first edge, from which the other edges get theirs by parallel transport; or the first
            director of every edge. The part along the edge is removed. By default the first coordinate axis that is
            not close to the edge.
        radius : float or array_like of shape (edges,) [m]
            Radius of a circular section, at most ten times the length of the rod.
        section : Circle, Tube or Rectangle
            Section, instead of a radius. The width of a rectangle lies along the first director.
        contact_radius : float or array_like of shape (edges,) [m]
            Radius of the round surface that touches obstacles and rods. It does not change stiffness, mass or pictures.
            By default the radius; for a rectangle half its smaller side.
        material : Material
            Material, from which stiffness and mass follow.
        stiffness : Stiffness
            Stiffnesses, instead of a material. Needs `line_density`.
        line_density : float or array_like of shape (edges,) [kg/m]
            Mass per length.
        natural : {"as_built", "straight", "in_balance"}
            Natural (stress-free) shape: as drawn, straight, or the shape with which the drawn rod is in equilibrium
            under the weight, loads, tendons and joints of the scene.
        natural_curvature : array_like of shape (2,) or (stencils, 2) [1/m]
            Natural curvature towards d1 and d2, instead of the one of `natural`.
        natural_twist : float or array_like of shape (stencils,) [rad/m]
            Natural twist, instead of the one of `natural`.
        discrete : bool
            True if `natural_curvature` is given as 2 tan(phi / 2) [-], with phi the angle between two edges.
        name : str
            Name of the rod. By default "rod 1", "rod 2", ...

        Returns
        -------
        Rod

        Raises
        ------
        ValueError
            An argument is out of range or contradicts another one. The message names the argument.

        See Also
        --------
        withe.shapes.helix : Centreline of a helix; `withe.shapes` has other shapes.
        join : Join nodes of rods.
        Material : Elasticity and density.
        clamp : Clamp a node.

        Examples
        --------
        >>> scene = Scene()
        >>> stiff = Stiffness(stretch=100.0, bend=(2e-3, 1e-3), twist=1e-3)
        >>> scene.add_rod(start=(0, 0, 0), end=(0, 0, 1), nodes=11, radius=0.01, stiffness=stiff, line_density=0.1)
        Rod(name='rod 1')
        """
        name = self._directory.new_name(name, "rod")
        rod = make_rod(
            name,
            len(self._directory.layout.rods),
            start=start,
            end=end,
            points=points,
            nodes=nodes,
            closed=closed,
            normal=normal,
            radius=radius,
            section=section,
            contact_radius=contact_radius,
            material=material,
            stiffness=stiffness,
            line_density=line_density,
            natural=natural,
            natural_curvature=natural_curvature,
            natural_twist=natural_twist,
            discrete=discrete,
        )
        place = RodPlace(name, len(rod.points), rod.closed, rod.section.radii, rod.section.widths)
        self._directory.layout.add(place)
        return cast(Rod, self._directory.add(rod))

    def add_body(
        self,
        solid: Solid | None = None,
        *,
        density: float | None = None,
        mass: float | None = None,
        inertia: npt.ArrayLike | None = None,
        center: npt.ArrayLike | None = None,
        position: npt.ArrayLike = (0.0, 0.0, 0.0),
        rotation: npt.ArrayLike | None = None,
        friction: float | None = None,
        restitution: float | None = None,
        touches: bool = True,
        name: str | None = None,
    ) -> Body:
        """Add a rigid body: a plug, a payload, a hub, the trunk of a robot.

        A body is free until it is joined to rods or to other bodies by `join`. Its motion conserves momentum and
        angular momentum, and in energy-momentum steps also energy, to rounding.

        Parameters
        ----------
        solid : Sphere, Box, Cylinder, Capsule, Hull or Mesh of withe.solids
            Shape of uniform density, from which centre and inertia follow. Give `density` or `mass` with it. With
            `mass` and `inertia` the solid is only drawn.
        density : float [kg/m^3]
            Density of the solid.
        mass : float [kg]
            Mass.
        inertia : float, or array_like of shape (3,) or (3, 3) [kg m^2]
            Moment of inertia about the centre of mass in the axes of the body. Three numbers are principal moments
            about these axes.
        center : array_like of shape (3,) [m]
            Centre of mass in the axes of the body. By default their origin.
        position : array_like of shape (3,) [m]
            Origin of the axes of the body, as drawn.
        rotation : array_like of shape (3, 3) or (4,), or scipy.spatial.transform.Rotation
            Orientation of the axes of the body: a matrix whose columns are the axes, or a unit quaternion
            (w, x, y, z). By default the axes of the world.
        friction : float [-]
            Friction coefficient of the surface. Of two bodies, the greater coefficient counts, and against an obstacle
            the greater one too. By default the surface has the friction that rods have between each other.
        restitution : float [-]
            Speed after an impact over the speed before, from 0 to 1, of which the smaller one of two bodies counts. By
            default that of rods.
        touches : bool
            False if the solid is only drawn. Solids touch planes, and after `enable_contact` rods and other bodies.
            Spheres and capsules touch other obstacles too. A cylinder is only drawn.
        name : str
            Name of the body.

        Returns
        -------
        Body

        Raises
        ------
        ValueError
            A mass that is not positive, a mass and a density, an inertia without a mass, a centre without an inertia,
            or a rotation that is none. An inertia that is not symmetric and positive, or that no body has because
            J1 + J2 < J3 for its principal moments.

        See Also
        --------
        join : Join the body to rods and other bodies.
        add_mass : Add a point mass at a node.
        add_robot : Add the bodies and joints of a file.
        Simulation.position : Position of a body.

        Notes
        -----
        Midpoint steps integrate the rates of turn about the axes of the body with the Cayley map [Simo and Wong 1991].

        References
        ----------
        J. C. Simo and K. K. Wong, Unconditionally stable algorithms for rigid body dynamics that exactly preserve
        energy and momentum, Int. J. Numer. Methods Eng. 31 (1991) 19-52.

        Examples
        --------
        >>> cord = scene.add_rod(
        ...     start=(0, 0, 0), end=(0, 0, -0.5), nodes=21, radius=3e-3,
        ...     material=withe.Material(youngs_modulus=1e7, density=1100),
        ... )
        >>> hold = scene.clamp(cord.start)
        >>> plug = scene.add_body(withe.solids.Box((0.03, 0.03, 0.06)), density=1200, position=(0, 0, -0.53))
        >>> joint = scene.join(cord.end, plug)
        >>> simulation = scene.build()
        >>> record = simulation.run(0.5)
        """
        name = self._directory.new_name(name, "body")
        index = len(self._directory.layout.body_points)
        part = make_body(
            name, index, solid, density, mass, inertia, center, position, rotation, friction, restitution, touches
        )
        self._directory.layout.add_body(part.center)
        return cast(Body, self._directory.add(part))

    def add_robot(
        self,
        path: str | os.PathLike[str],
        *,
        position: npt.ArrayLike = (0.0, 0.0, 0.0),
        rotation: npt.ArrayLike | None = None,
        name: str | None = None,
    ) -> Robot:
        """Add the rigid bodies and joints of a robot from a URDF, MJCF or USD file.

        The robot is drawn in the reference configuration of the file, where all joints of a URDF file are at zero.
        Rods can be joined to its bodies. MuJoCo reads URDF and MJCF, and usd-core reads USD, both of the extra
        ``robots``.

        Parameters
        ----------
        path : path-like
            File, ending in ".urdf", in ".xml" for MJCF, or in ".usd", ".usda", ".usdc" or ".usdz". Macros of xacro must
            be expanded.
        position : array_like of shape (3,) [m]
            Where the origin of the file is.
        rotation : array_like of shape (3, 3) or (4,), or scipy.spatial.transform.Rotation
            Orientation of the axes of the file: a matrix whose columns are the axes, or a unit quaternion (w, x, y, z).
            By default the axes of the world.
        name : str
            Name of the robot. By default that in the file. Bodies and joints have their names in the file. If the scene
            already has such a name, the name of the robot precedes it.

        Returns
        -------
        Robot
            ``robot["gripper"]`` is the handle of a body or joint; `bodies`, `joints` and `points` list all of them.

        Raises
        ------
        ValueError
            The suffix is another one, MuJoCo or usd-core cannot read the file, or a mesh is neither STL nor OBJ. Joints
            of one body move it alike, such as two hinges with one axis. A joint of USD has different places on its two
            bodies.
        FileNotFoundError
            The file or one of its meshes does not exist.
        ImportError
            MuJoCo or usd-core is not installed.

        Warns
        -----
        UnsupportedRobotWarning
            The file has content that a scene lacks: armature and friction loss of joints, actuators, equality
            constraints, tendons, contact, sensors and others. One warning lists all of it with its names.
        PlausibilityWarning
            The robot is larger than 20 m, a body has more than 10,000 kg, or a USD file has no ``metersPerUnit``.

        See Also
        --------
        add_body : Add a single body.
        join : Join a rod to a body of the robot.
        Simulation.set : Move a servo by the ``rest_angle`` of its joint.

        Notes
        -----
        - Hinges, slides and ball joints become joints of kind "revolute", "sliding" and "pinned", with their stiffness,
          spring reference and damping. A body with a free joint is a free body.
        - Bodies that are fixed to each other become one body with their common mass, centre and inertia.
        - Bodies that are fixed to the world become one clamped body, to which the joints are attached. If they have no
          mass, the clamped body has 1e-6 of the robot's mass. Without such bodies, a joint to the world is a support
          made by `clamp` or `pin`. A joint to the world with a spring, damper or actuator has a clamped body too.
        - Several joints of one body, such as a hip of three hinges, become a chain of joints. Between them are bodies
          named "BODY after JOINT", which are not in `Robot.bodies`. They have 1e-8 of the mass of the outer body.
        - A joint may be moved along its axis if another joint of the same body is at the same point. The motion does
          not depend on this position.
        - Geoms are only drawn. If a body has geoms that touch nothing, these are its shape. A mesh that is not closed
          is drawn as its convex hull.
        - USD: units and the up axis of the stage are converted to m, kg and z. Mass, density and inertia follow the
          rules of UsdPhysics: without a mass, that of the colliders at their density, by default 1,000 kg/m^3.
          Drives by force of joints become ``stiffness``, ``rest_angle`` and ``damping``.
        - Cameras, lights, colours and textures are not read. The integrator and the time step are options of `build`.

        Examples
        --------
        >>> robot = scene.add_robot("arm.xml", position=(0, 0, 0.5))  # doctest: +SKIP
        >>> hold = scene.join(cable.start, robot["gripper"])  # doctest: +SKIP
        >>> scene.build().set(robot.joints["elbow"], stiffness=20.0, rest_angle=0.5)  # doctest: +SKIP
        """
        return add_robot(self, path, position, rotation, name)

    @overload
    def join(
        self,
        a: NodeHandle | Body | str,
        b: NodeHandle | Body | str,
        kind: JoinKind = "rigid",
        *,
        at: npt.ArrayLike | None = None,
        axis: npt.ArrayLike | None = None,
        form: JointForm = "frame",
        stiffness: float = 0.0,
        rest_angle: float = 0.0,
        damping: float = 0.0,
        moment: float = 0.0,
        max_torque: float = np.inf,
        max_speed: float = np.inf,
        limits: tuple[float, float] | None = None,
        limit_stiffness: float | None = None,
        restitution: float = 1.0,
        name: str | None = None,
    ) -> Joint: ...

    @overload
    def join(
        self,
        a: NodeHandle | Body | str,
        b: NodeHandle | Body | str,
        c: NodeHandle | Body,
        /,
        *others: NodeHandle | Body | str,
        kind: JoinKind = "rigid",
        at: npt.ArrayLike | None = None,
        axis: npt.ArrayLike | None = None,
        form: JointForm = "frame",
        stiffness: float = 0.0,
        rest_angle: float = 0.0,
        damping: float = 0.0,
        moment: float = 0.0,
        max_torque: float = np.inf,
        max_speed: float = np.inf,
        limits: tuple[float, float] | None = None,
        limit_stiffness: float | None = None,
        restitution: float = 1.0,
        name: str | None = None,
    ) -> tuple[Joint, ...]: ...

    def join(
        self,
        a: NodeHandle | Body | str,
        b: NodeHandle | Body | str,
        *others: NodeHandle | Body | str,
        kind: JoinKind = "rigid",
        at: npt.ArrayLike | None = None,
        axis: npt.ArrayLike | None = None,
        form: JointForm = "frame",
        stiffness: float = 0.0,
        rest_angle: float = 0.0,
        damping: float = 0.0,
        moment: float = 0.0,
        max_torque: float = np.inf,
        max_speed: float = np.inf,
        limits: tuple[float, float] | None = None,
        limit_stiffness: float | None = None,
        restitution: float = 1.0,
        name: str | None = None,
    ) -> Joint | tuple[Joint, ...]:
        """Join two or more coincident nodes rigidly, by a pin or by a hinge.

        With more than two nodes, each of the others is joined to the first by its own joint. Further calls may add
        rods to the same node. All revolute joints at one node turn against the same rod, to which each of the others
        must be joined; a clamp at this node holds that rod.

        The angle theta of a revolute joint is the rotation of `b` relative to `a` about the axis since the drawing,
        by the right-hand rule. Motor, spring and damper act on `b` with the torque

            moment - stiffness (theta - rest_angle) - damping dtheta/dt,

        and on `a` with the opposite torque. For a servo, give a stiffness and move `rest_angle` by `Simulation.set`.
        `max_torque` limits the part with the stiffness: beyond it, the servo has a constant torque.
        For a sliding joint theta is the displacement of `b` along the axis [m], and the torque is a force. Stiffness is
        then in N/m, rest_angle in m, damping in N s/m and moment in N.
        `Simulation.joint_angle` returns theta.

        Joints of bodies may form closed loops, such as a four-bar linkage. `build` finds them.

        Parameters
        ----------
        a, b, *others : NodeHandle, Body or str
            Ends or inner nodes of one or several rods, and rigid bodies.
        kind : {"rigid", "pinned", "revolute", "sliding"}
            Relative motion: none, free rotation, rotation about one axis, or, on a body, displacement along one axis
            without rotation. May follow the nodes by position.
        at : array_like of shape (3,) [m]
            Place of the joint of two bodies, as drawn. With a rod, the joint is at its node.
        axis : array_like of shape (3,)
            Axis of a revolute or sliding joint as drawn. The axis turns with `a`.
        form : {"frame", "pairs"}
            Model of a rigid joint: "frame" is a body that is bent against every edge, "pairs" is one bending element
            for every pair of edges (archival and stiffer).
        stiffness : float [N m/rad]
            Stiffness of the spring of a revolute joint. Its energy is part of `energy().spring`.
        rest_angle : float [rad]
            Angle at which the spring is free of stress, whole turns included.
        damping : float [N m s/rad]
            Damping coefficient of a revolute joint.
        moment : float [N m]
            Torque of the motor of a revolute joint. Its work is part of `energy().loads`.
        max_torque : float [N m]
            Greatest torque of the spring. The energy of the spring grows linearly beyond it. The damper has no limit.
        max_speed : float [rad/s]
            Greatest rate of the rest angle. `Simulation.set` and `actuate` then ramp `rest_angle` to its value in the
            time that this rate needs, or in `over` if that is longer. Integrator "static" has no rates.
        limits : tuple of two floats [rad]
            Least and greatest angle; one of them may be infinite. Beyond a limit a stop pushes back with the torque
            `limit_stiffness` times the angle beyond it.
        limit_stiffness : float [N m/rad]
            Stiffness of the stops. It must be given with `limits`.
        restitution : float [-]
            Rate of the joint after it has met a stop, over the rate before, from 0 to 1. With 1 the joint rebounds
            without loss. Below 1, the stop is damped by the rate at which the joint has met it [Hunt and Crossley 1975,
            J. Appl. Mech. 42], and 0 counts as 0.01.
        name : str
            Name of the joint. Several joints are named "NAME 1", "NAME 2", ...

        Returns
        -------
        Joint or tuple of Joint
            One joint for two nodes. For more, the joints of the first node with each of the others, in order.

        Raises
        ------
        ValueError
            Nodes further apart than 1e-9 of the scene, a node given twice, contradicting joints at one node, or an
            axis, stiffness, rest_angle, damping, moment, max_torque, max_speed or limits for a joint without an axis.
            Limits that exclude the drawn angle, or have no stiffness; a restitution without limits. Then no node is
            joined.

        See Also
        --------
        add_torsion_spring : Add a torsion spring without a joint.
        Simulation.joint_angle : Angle of a revolute joint.
        Simulation.reaction : Force and moment that a joint with a body transmits.

        Examples
        --------
        >>> leg = dict(nodes=6, radius=5e-3, material=withe.Material(youngs_modulus=1e8, density=1100))
        >>> thigh = scene.add_rod(start=(0, 0, 0), end=(0.1, 0, 0), **leg)
        >>> shank = scene.add_rod(start=(0.1, 0, 0), end=(0.1, 0, -0.1), **leg)
        >>> knee = scene.join(thigh.end, shank.start, "revolute", axis=(0, 1, 0), stiffness=0.5, damping=2e-3)
        >>> hold = scene.clamp(thigh.start)
        >>> simulation = scene.build()
        >>> simulation.set(knee, rest_angle=0.3)
        >>> record = simulation.run(1.0)
        """
        nodes = [a, b, *others]
        last = others[-1] if others else None
        if isinstance(last, str) and parse_place(last) is None and last not in self._directory.parts:
            if kind != "rigid":
                raise ValueError(f"kind of the joint must be given once, got {others[-1]!r} and {kind!r}")
            kind = cast(JoinKind, nodes.pop())
        numbers = (stiffness, rest_angle, damping, moment, max_torque, max_speed)
        stops = (limits, limit_stiffness, restitution)
        parts = self._joints.join(nodes, at, kind, axis, form, numbers, stops, name)
        joints = tuple(cast(Joint, self._directory.add(part)) for part in parts)
        return joints if len(joints) > 1 else joints[0]

    # Actuation over time

    def actuate(
        self, target: Settable | str | None = None, /, *, at: float = 0.0, over: float = 0.0, **values: Any
    ) -> None:
        """Set parameters of a part at a given time of every simulation of the scene.

        The simulation calls `Simulation.set` at the first time step that begins at the time `at` or later.
        `Simulation.equilibrium` does not advance time and therefore applies no actuation.

        Parameters
        ----------
        target : handle, str, or pair of bodies
            Part to change, as in `Simulation.set`. By default the scene.
        at : float [s]
            Time, counted from the start of the simulation.
        over : float [s]
            Duration of a linear ramp to the values. By default the change is immediate.
        **values
            Parameters of the target, as in `Simulation.set`.

        Raises
        ------
        ValueError
            A target that the scene does not have, a parameter that the target does not have or that `over` does not
            ramp, or a negative time. `build` also raises it for a value out of range.

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene(gravity=(0, 0, 0))
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=100.0)
        >>> arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=rubber)
        >>> support = scene.clamp(arm.start)
        >>> scene.actuate(arm, at=0.1, over=0.2, natural_curvature=(5.0, 0.0))
        >>> simulation = scene.build()
        >>> record = simulation.run(0.3)
        >>> simulation.get(arm, "natural_curvature")[0].round(6).tolist()
        [5.0, 0.0]
        """
        add_actuation(self._directory, target, at, over, values)

    # Files

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the scene to a TOML file, which `load` reads and people can edit.

        The file has the arguments of the calls that described the scene, so that the loaded scene equals this one to
        the last bit. Its keys are the names of the arguments.

        Parameters
        ----------
        path : path-like
            Path of the file, ending in ".toml".

        Returns
        -------
        pathlib.Path

        Raises
        ------
        ValueError
            Another suffix, or a Python function in the scene: a load or friction that varies, or a custom force.
        OSError
            The file cannot be written.

        Examples
        --------
        >>> import withe
        >>> scene = withe.Scene()
        >>> rubber = withe.Material(youngs_modulus=1e6, density=1000.0)
        >>> arm = scene.add_rod(start=(0, 0, 0), end=(0.3, 0, 0), nodes=31, radius=5e-3, material=rubber, name="arm")
        >>> path = scene.save("arm.toml")
        >>> withe.Scene.load(path)
        Scene(arm)
        """
        return save_scene(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Scene:
        """Read a scene from a TOML file.

        Parameters
        ----------
        path : path-like
            File that `save` or a person wrote. The documentation has its keys under "Scenes in files", and
            ``scene.schema.json`` in this package is its JSON schema, for editors.

        Returns
        -------
        Scene
            `build` uses the options in the table [build] of the file as its defaults.

        Raises
        ------
        ValueError
            A file that is not TOML or describes no scene. The message names the file, the line, and for a misspelt key
            the key that may be meant.
        OSError
            The file, or a CSV file that it names, cannot be opened.
        """
        scene = cls()
        fill(scene, path)
        return scene

    # Simulations

    @property
    def build_options(self) -> dict[str, Any]:
        """Options that `build` and `build_batch` use where a call does not give them. Assign a dictionary to set them.

        Raises
        ------
        ValueError
            On assignment: an unknown option, or a value out of range.
        """
        return dict(self._build_options)

    @build_options.setter
    def build_options(self, options: Mapping[str, Any]) -> None:
        self._build_options = checked_options(options, type(self).build)

    @with_build_options
    @moved_into("solver", Solver, solver="linear_solver", **{word: word for word in _IN_SOLVER})
    def build(
        self,
        *,
        integrator: Integrator = "energy_momentum",
        time_step: float = 5e-3,
        adaptive: bool = True,
        tolerance: float | None = None,
        planar: bool | None = None,
        duration: float | None = None,
        bending: Bending = "angle",
        threads: int = 1,
        solver: Solver = _DEFAULT_SOLVER,
    ) -> Simulation:
        """Build a simulation of the scene.

        Later changes of the scene do not affect the simulation.

        Parameters
        ----------
        integrator : {"energy_momentum", "backward_euler", "implicit_midpoint", "fourth_order", "verlet", "static"}
            * "energy_momentum" (second order) conserves energy, linear and angular momentum at any time step.
            * "backward_euler" (first order) damps motion that the time step does not resolve. Use it for scenes that
              should come to rest.
            * "implicit_midpoint" (second order) conserves momentum. Its energy drifts where edges turn by more than
              about 0.1 rad in a step; a drift above 1 % of the greatest kinetic energy warns with
              :class:`withe.EnergyDriftWarning`.
            * "fourth_order" composes five energy-momentum steps, the third of which goes back in time. It does not
              support contact and viscosity, and drag only up to mass over time_step. Once a support has moved, the mass
              of held edges is lumped at their nodes. For a cantilever with an accelerated clamp, the deflection is then
              wrong by 3 % with 5 nodes and by 0.02 % with 17 nodes, at any time step.
            * "verlet" (second order) is explicit and stable for short time steps only.
            * "static" takes quasi-static steps, without mass.
        time_step : float [s]
            Time step, which `adaptive` and `tolerance` may subdivide.
        adaptive : bool
            True to halve implicit steps that do not converge; later steps grow back. Except with backward Euler, steps
            are also subdivided for glancing contacts, for impacts with restitution, and for clamps that turn by more
            than 0.25 rad.
        tolerance : float [m]
            Bound on the error of positions over `duration`, by which steps are subdivided. A fifth of the bound is
            reserved for events such as impacts. With "energy_momentum", steps may also have fourth order: see
            `Statistics.fourth_order_steps`.
        planar : bool
            True for two dimensions, False for three. By default a planar scene is solved in its plane, and
            `equilibrium` warns if the scene would buckle out of the plane. With True, custom forces and loads that are
            functions must stay in the plane. A straight scene without gravity is solved in the plane of its revolute
            joints, or of its first director.
        duration : float [s]
            Time over which `tolerance` bounds the error. By default 1 s.
        bending : {"angle", "tangent"}
            Measure of bending strain. For "angle", it is the angle phi between two edges, to sixth order. For
            "tangent", it is 2 tan(phi / 2) [Bergou et al. 2008], which is too stiff on coarse meshes and does not model
            the arcs of edges.
        threads : int
            Number of threads that share the work of each step. The results have the same bits for every number. More
            than one thread pays in nets and piles of 5,000 unknowns and more. Unbranched rods, and rods joined in a
            tree, are too fast to share.
        solver : withe.Solver
            Options of Newton's method, of its linear equations and of the subdivision of steps.

        Returns
        -------
        Simulation

        Raises
        ------
        ValueError
            A scene without rods, planar=True for a scene that is not planar, an explicit step above the stable limit,
            "fourth_order" with viscosity or strong drag, or an option out of range.

        See Also
        --------
        build_batch : Build many simulations that step together.
        Solver : Options of Newton's method and of the subdivision of steps.
        Simulation.plan : Decisions of `build`.
        """
        options = BuildOptions(
            integrator=integrator,
            time_step=time_step,
            adaptive=adaptive,
            tolerance=tolerance,
            planar=planar,
            duration=duration,
            bending=bending,
            threads=threads,
            solver=solver,
        ).checked()
        directory = self._directory.copy()
        if bending == "tangent":
            directory.parts.update({rod.name: rod.without_arcs() for rod in directory.all(RodPart)})
        simulation = Simulation._build(directory, self._gravity.copy(), options)
        check_actuations(simulation._session)
        if logs_info():
            log_build(simulation.plan)
        return simulation

    @renamed(n="count")
    def build_batch(self, count: int, *, workers: int | None = None, **options: Any) -> Batch:
        """Build a batch of equal simulations that step together, for example for reinforcement learning.

        Parameters
        ----------
        count : int
            Number of simulations.
        workers : int, optional
            Number of threads. By default one per processor.
        **options
            Options of `build`.

        Returns
        -------
        Batch

        Raises
        ------
        ValueError
            See `build`; count or workers below 1; or threads above 1, since each simulation steps on one thread.

        See Also
        --------
        build : The options of each simulation.
        Batch : Methods of a batch.

        Examples
        --------
        >>> batch = scene.build_batch(3, time_step=5e-3)
        >>> batch.set(arm, youngs_modulus=[0.8e6, 1.0e6, 1.2e6])
        >>> batch.step(10)
        """
        if self._directory.actuations:
            raise ValueError("build_batch does not support actuate(): call batch.set() between steps instead")
        number = validation.integer(count, "count", 1, 1_000_000)
        threads = None if workers is None else validation.integer(workers, "workers", 1, 4096)
        first = self.build(**options)
        if first._session.options.threads > 1:
            raise ValueError("threads of build_batch must be 1: workers= is the number of threads of a batch")
        return Batch([first, *(first.copy() for _ in range(number - 1))], threads)

    @property
    def _bearer(self) -> Bearer:
        return _Drawn(self._directory)


class _Drawn:
    """A scene as loads see it: they act from the start."""

    def __init__(self, directory: Directory) -> None:
        self.directory = directory
        self.time = 0.0

    def take(self, part: LoadPart) -> Load:
        return cast(Load, self.directory.add(part))
