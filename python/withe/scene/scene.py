"""Scenes: soft robots described rod by rod."""

from __future__ import annotations

import uuid
from typing import TYPE_CHECKING, Any, cast, overload

import numpy as np
import numpy.typing as npt

from withe.batch import Batch
from withe.common import validation
from withe.common.attributes import known_attributes, of_a_simulation
from withe.common.keywords import keyword_hints
from withe.parts.applied_loads import AppliedLoads, Bearer
from withe.parts.directory import Directory
from withe.parts.handles import Joint, Load, NodeHandle, Rod, RodPlace, parse_place
from withe.parts.kinds import JoinKind, JointForm, LoadPart, RodPart
from withe.parts.materials import Material, Section, Stiffness
from withe.parts.options import Bending, BuildOptions, Integrator, LineSearch, Solver
from withe.parts.rods import Natural, make_rod
from withe.scene.contacts import Contacts
from withe.scene.joints import JoinedNodes
from withe.scene.loads import Loads
from withe.scene.supports import Supports
from withe.simulation.simulation import Simulation

__all__ = ["Scene"]

FloatArray = npt.NDArray[np.float64]


@keyword_hints
@known_attributes("use a method such as set_friction, or an option of build")
class Scene(AppliedLoads, Loads, Contacts, Supports):
    """A description of rods, joints, supports and loads, from which simulations are built.

    Parameters
    ----------
    gravity : array_like of shape (3,) [m/s^2]

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
        """The handle of the part, node or edge of that name: ``scene["arm"]``, ``scene["arm.end"]``.

        Raises
        ------
        ValueError
            There is none.
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
        """Add a rod, from end to end or along any centreline. It stretches, bends and twists; it does not shear.

        Parameters
        ----------
        start, end : array_like of shape (3,) [m]
            Ends of a straight rod of `nodes` nodes.
        points : array_like of shape (n, 3) [m]
            Centreline instead. Its points are the nodes, and the edges between them the rod; or `nodes`
            asks for so many evenly spaced by arc length along it. Edges are then chords, and have the mass
            and, where the rod is curved by nature, the compliance of their arcs: give smooth curves so.
        nodes : int
            Number of nodes, ends included.
        closed : bool
            Whether the last point is joined to the first (which may be repeated at the end).
        normal : array_like of shape (3,) or (edges, 3)
            First director of the first edge, which the others get by parallel transport, or of every
            edge; made normal to the edge. By default the first coordinate axis not close to the edge.
        radius : float or array_like of shape (edges,) [m]
            Of a circular section; no more than ten times the length of the rod.
        section : Circle, Tube or Rectangle
            Section instead of a radius; a rectangle's width lies along the first director.
        contact_radius : float or array_like of shape (edges,) [m]
            Of the round surface that touches obstacles and rods, apart from the section, which gives stiffness and
            mass and is drawn. By default the radius, of a rectangle half its smaller side: what lies flat.
        material : Material
        stiffness : Stiffness
            Stiffnesses instead of a material, with `line_density`.
        line_density : float or array_like of shape (edges,) [kg/m]
            Mass per length.
        natural : {"as_built", "straight", "in_balance"}
            Shape that is free of stress: the one drawn, or straight, or that with which the rod hangs as it is drawn,
            under its weight and what loads, tendons and joints do as the scene is built.
        natural_curvature : array_like of shape (2,) or (stencils, 2) [1/m]
            Stress-free curvature towards d1 and d2 instead, that of the smooth rod.
        natural_twist : float or array_like of shape (stencils,) [rad/m]
            Stress-free twist instead.
        discrete : bool
            Whether natural_curvature is 2 tan(phi / 2) [-], phi the angle between two edges.
        name : str
            By default "rod 1", "rod 2", ...

        Returns
        -------
        Rod

        Raises
        ------
        ValueError
            What cannot be a rod: the message names the argument, what was expected and what came.

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

    @overload
    def join(
        self,
        a: NodeHandle | str,
        b: NodeHandle | str,
        kind: JoinKind = "rigid",
        *,
        axis: npt.ArrayLike | None = None,
        form: JointForm = "frame",
        stiffness: float = 0.0,
        rest_angle: float = 0.0,
        damping: float = 0.0,
        moment: float = 0.0,
        name: str | None = None,
    ) -> Joint: ...

    @overload
    def join(
        self,
        a: NodeHandle | str,
        b: NodeHandle | str,
        c: NodeHandle,
        /,
        *others: NodeHandle | str,
        kind: JoinKind = "rigid",
        axis: npt.ArrayLike | None = None,
        form: JointForm = "frame",
        stiffness: float = 0.0,
        rest_angle: float = 0.0,
        damping: float = 0.0,
        moment: float = 0.0,
        name: str | None = None,
    ) -> tuple[Joint, ...]: ...

    def join(
        self,
        a: NodeHandle | str,
        b: NodeHandle | str,
        *others: NodeHandle | str,
        kind: JoinKind = "rigid",
        axis: npt.ArrayLike | None = None,
        form: JointForm = "frame",
        stiffness: float = 0.0,
        rest_angle: float = 0.0,
        damping: float = 0.0,
        moment: float = 0.0,
        name: str | None = None,
    ) -> Joint | tuple[Joint, ...]:
        """Make nodes that coincide one: two of them, or any number.

        Several nodes are joined to the first, each by a joint of its own. Joins at the same node add up. Revolute ones
        there all turn against one rod, to which each of the others is joined; a clamp at that node holds that rod.

        A revolute joint has an angle theta, by which b has turned about the axis since it was drawn, seen from a, by
        the right-hand rule. Its motor, spring and damper turn b, and a the other way, by the torque

            moment - stiffness (theta - rest_angle) - damping dtheta/dt.

        A stiffness whose rest_angle `Simulation.set` moves is a servo; `Simulation.joint_angle` reads theta.

        Parameters
        ----------
        a, b, *others : NodeHandle or str
            Ends or inner nodes, of several rods or of one.
        kind : {"rigid", "pinned", "revolute"}
            Whether the rods keep their angles, may turn freely, or about one axis. It may follow the nodes by position.
        axis : array_like of shape (3,)
            Of a revolute joint, as it is drawn; it turns with a.
        form : {"frame", "pairs"}
            A rigid joint as a body of its own, bent against every edge, or as one bending element for
            every pair of edges (archival; stiffer).
        stiffness : float [N m/rad]
            Of a revolute joint, as are those that follow. What it stores is in `energy().spring`.
        rest_angle : float [rad]
            At which the spring is free of stress; whole turns count.
        damping : float [N m s/rad]
        moment : float [N m]
            Of a motor; its work is in `energy().loads`, as that of loads is.
        name : str
            Of several joints "NAME 1", "NAME 2", ...

        Returns
        -------
        Joint
            Of two nodes; else a tuple of joints, of the first node with each of the others in turn.

        Raises
        ------
        ValueError
            Nodes that are apart by more than 1e-9 of the scene, one and the same node, joins that contradict each
            other, or an axis, a stiffness, a rest_angle, a damping or a moment without a revolute joint. Then nothing
            is joined.

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
        if others and isinstance(others[-1], str) and parse_place(others[-1]) is None:
            if kind != "rigid":
                raise ValueError(f"kind of the joint must be given once, got {others[-1]!r} and {kind!r}")
            kind = cast(JoinKind, nodes.pop())
        numbers = (stiffness, rest_angle, damping, moment)
        parts = self._joints.join(nodes, kind, axis, form, numbers, name)
        joints = tuple(cast(Joint, self._directory.add(part)) for part in parts)
        return joints if len(joints) > 1 else joints[0]

    # Simulations

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
        solver: Solver = "automatic",
        line_search: LineSearch = "automatic",
        mixed: bool = True,
        step_tolerance: float = 1e-9,
        force_tolerance: float = 1e-8,
        max_iterations: int = 40,
        max_halvings: int | None = None,
        max_steps: int | None = None,
    ) -> Simulation:
        """Turn the scene into the equations that it needs, ready to run. The scene may go on changing.

        Parameters
        ----------
        integrator : {"energy_momentum", "backward_euler", "implicit_midpoint", "fourth_order", "verlet", "static"}
            * "energy_momentum" (second order) conserves energy, linear and angular momentum at any time step.
            * "backward_euler" (first order) damps motion that the time step does not resolve. Use it for scenes that
              should come to rest.
            * "implicit_midpoint" (second order) conserves momentum. Its energy drifts where edges turn by more than
              about 0.1 rad in a step; a drift above 1 % of the greatest kinetic energy warns with
              :class:`withe.EnergyDriftWarning`.
            * "fourth_order" composes five energy-momentum steps, the third of which goes back in time. It refuses
              contact and viscosity, and takes drag only up to mass over time_step. Once a support has moved, the mass
              of the edges that supports hold sits at their nodes, an error of the mesh that no step removes: 3 % of
              the deflection of a cantilever whose clamp is accelerated with 5 nodes, 0.02 % with 17.
            * "verlet" (second order) is explicit and stable for short time steps only.
            * "static" takes quasi-static steps, without mass.
        time_step : float [s]
        adaptive : bool
            Whether an implicit step that fails is halved; steps grow back. So are those in which surfaces that graze
            would go through each other, impacts are not resolved for their restitution, or a clamp turns by more than
            a quarter of a radian, but under backward Euler.
        tolerance : float [m]
            Cut steps so that the error of positions stays below it, over `duration`. A fifth of it is kept for events
            such as impacts, in which steps go by the error of each rather than by that per unit of time.
        planar : bool
            Force two or three dimensions; by default a scene that lies in a plane is solved in it, also where it
            could buckle out of it: `equilibrium` warns of that, and steps stay in the plane as exact ones would. A
            straight scene without gravity lies in many, and ``True`` takes that in which its revolute joints turn, or
            that of its first director.
            Loads that are functions and custom forces may leave any plane; with ``True`` they must not.
        duration : float [s]
            Over which `tolerance` holds; 1 s by default.
        bending : {"angle", "tangent"}
            What bending strain is: the angle phi between two edges, to sixth order, or 2 tan(phi / 2) as in
            [Bergou et al. 2008], which bends too stiffly on coarse meshes, and with which edges are always the
            rod and never chords of its arcs.
        solver : {"automatic", "band", "sparse"}
        line_search : {"automatic", "goldstein_price"}
        mixed : bool
            Newton's method with the axial forces as unknowns of their own.
        step_tolerance : float
            A Newton step below it, relative to the length of the scene, has converged.
        force_tolerance : float
            And forces out of balance below it, relative to those in the scene.
        max_iterations : int
            Of one Newton solve.
        max_halvings : int
            The smallest step is time_step / 2^max_halvings; 12 by default, 20 with a tolerance. A run that needs
            smaller ones ends in a :class:`withe.ConvergenceError`.
        max_steps : int
            Inner steps that error control may take in one time step; by default 3e7 over the number of nodes, about
            half a minute on one core. More raise a :class:`withe.ConvergenceError`, which names remedies.

        Returns
        -------
        Simulation

        Raises
        ------
        ValueError
            A scene without rods, planar=True for one that lies in no plane, an explicit step above
            the stable limit, "fourth_order" with viscosity or strong drag, or an option out of range.
        """
        options = BuildOptions(
            integrator=integrator,
            time_step=time_step,
            adaptive=adaptive,
            tolerance=tolerance,
            planar=planar,
            duration=duration,
            bending=bending,
            solver=solver,
            line_search=line_search,
            mixed=mixed,
            step_tolerance=step_tolerance,
            force_tolerance=force_tolerance,
            max_iterations=max_iterations,
            max_halvings=max_halvings,
            max_steps=max_steps,
        ).checked()
        directory = self._directory.copy()
        if bending == "tangent":
            directory.parts.update({rod.name: rod.without_arcs() for rod in directory.all(RodPart)})
        return Simulation._build(directory, self._gravity.copy(), options)

    def build_batch(self, n: int, *, workers: int | None = None, **options: Any) -> Batch:
        """Build the scene many times over, for simulations that go side by side, as in reinforcement learning.

        Parameters
        ----------
        n : int
            How many simulations.
        workers : int, optional
            Number of threads that step them; by default one a processor.
        **options
            As in `build`.

        Returns
        -------
        Batch

        Raises
        ------
        ValueError
            See `build`; or n or workers below 1.

        Examples
        --------
        >>> batch = scene.build_batch(3, time_step=5e-3)
        >>> batch.set(arm, youngs_modulus=[0.8e6, 1.0e6, 1.2e6])
        >>> batch.step(10)
        """
        count = validation.integer(n, "n", 1, 1_000_000)
        threads = None if workers is None else validation.integer(workers, "workers", 1, 4096)
        first = self.build(**options)
        return Batch([first, *(first.copy() for _ in range(count - 1))], threads)

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
