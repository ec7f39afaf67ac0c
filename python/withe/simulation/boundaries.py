"""What holds rods or stands in their way, put on, moved and taken off while a simulation runs: part of `Simulation`."""

from __future__ import annotations

from typing import Any, Literal, cast

import numpy as np
import numpy.typing as npt

from withe import _core
from withe.common import drawing, validation
from withe.parts.contacts import body_of, touching
from withe.parts.description import describe_support
from withe.parts.directory import Directory
from withe.parts.friction import Friction, check_law, friction_pair, with_obstacle, with_pair
from withe.parts.handles import NodeHandle, Obstacle, Rod, Support
from withe.parts.kinds import ObstaclePart, RodPart, SupportPart
from withe.parts.supports import check_not_held, make_clamp, make_pin
from withe.simulation.motion import Path, Turn, evaluate_path, oriented
from withe.simulation.snapshots import Settings

__all__ = ["Boundaries"]

FloatArray = npt.NDArray[np.float64]


class Boundaries:
    """Supports, obstacles that move, and their friction."""

    _scene: Directory
    _directory: Directory
    _settings: Settings
    _world: _core.World
    _options: dict[str, Any]

    def clamp(
        self,
        node: NodeHandle | str,
        *,
        hold: Literal["frame", "edge"] = "frame",
        free: npt.ArrayLike | None = None,
        spin: bool = False,
        name: str | None = None,
    ) -> Support:
        """Hold a node where it is now, and the direction and roll of its rod. See `Scene.clamp`.

        Raises
        ------
        ValueError
            A node that is held already.
        """
        return self._hold(make_clamp(self._directory, node, hold, free, spin, name))

    def pin(self, node: NodeHandle | str, *, free: npt.ArrayLike | None = None, name: str | None = None) -> Support:
        """Hold a node where it is now. See `Scene.pin`.

        Raises
        ------
        ValueError
            A node that is held already.
        """
        return self._hold(make_pin(self._directory, node, free, name))

    def _hold(self, part: SupportPart) -> Support:
        check_not_held(self._directory, part, (other for _, other in self._settings.supports.values()))
        index = self._world.add_support(describe_support(part))
        self._settings.supports[part.name] = index, part
        return cast(Support, self._directory.add(part))

    def release(self, support: Support | NodeHandle | str) -> None:
        """Let go of a node.

        Parameters
        ----------
        support : Support, NodeHandle or str
            A support, or the node that it holds.

        Raises
        ------
        ValueError
            Nothing holds that node.
        """
        index, part = self._support(support)
        self._world.remove_support(index)
        del self._settings.supports[part.name]
        self._settings.paths.pop(part.name, None)
        if part.name not in self._scene.parts:
            self._directory.remove(part.name)

    def move(
        self,
        support: Support | NodeHandle | Obstacle | str,
        position: npt.ArrayLike | None = None,
        rotation: Any = None,
        *,
        tangent: npt.ArrayLike | None = None,
        roll: float | None = None,
        over: float = 0.0,
        path: Path | None = None,
    ) -> None:
        """Move a support or an obstacle, or let it move along a path from now on. What is not given stays as it is.

        Parameters
        ----------
        support : Support, NodeHandle, Obstacle or str
            A support, the node that it holds, or a floor, plane, sphere or capsule: its position is that of the point
            of a plane, the centre of a sphere, the start of a capsule. What it does to rods is part of
            ``energy().work``.
        position : array_like of shape (3,) [m]
        rotation : array_like of shape (3, 3), or a SciPy Rotation
            Relative to the orientation as drawn.
        tangent : array_like of shape (3,)
            Where the rod is to point, instead: the smallest turn from the drawn tangent, and then ...
        roll : float [rad]
            ... a turn about it. Full turns count, and take time: at most half a turn in a time step. An obstacle turns
            so about the normal of a plane, the axis of a capsule from start to end, or the tangent that is given for a
            sphere: rollers, drums and turntables, which drag rods by friction. A belt is a plane that moves along
            itself.
        over : float [s]
            Reached after so long, evenly; within the next step by default.
        path : callable
            Instead of all these: a function of time [s] that returns a position, or a position and a
            rotation; of an obstacle, a position and a roll (of a sphere, times the axis, shape (3,)).

        Raises
        ------
        ValueError
            Nothing holds that node, a direction for a pin or an obstacle, or arguments that contradict each other.

        Examples
        --------
        >>> hand = simulation.clamp(arm.end)
        >>> simulation.move(hand, position=(0.1, 0, 0.2), roll=np.pi, over=0.5)
        """
        obstacle = self._obstacle(support)
        if obstacle is not None:
            if rotation is not None:
                raise ValueError(
                    f"rotation of {obstacle[1]!r} must be None: an obstacle turns by a roll about its axis"
                )
            self._move_obstacle(*obstacle, position, tangent, roll, over, path)
            return
        index, part = self._support(support)
        turns = part.kind != "pin"
        owner = f"support {part.name!r}"
        if path is not None:
            if any(value is not None for value in (position, rotation, tangent, roll)) or over != 0.0:
                raise ValueError(f"path of {owner} must be given alone")
            validation.function(path, f"path of {owner}")
            now = self._world.time
            evaluate_path(path, now, self._world.support_rotation(index), turns, owner)
            self._settings.paths[part.name] = path
            return
        if rotation is not None and (tangent is not None or roll is not None):
            raise ValueError(f"rotation of {owner} must not be given together with tangent or roll")
        if not turns and any(value is not None for value in (rotation, tangent, roll)):
            raise ValueError(f"rotation, tangent and roll of {owner} must be None: a pin holds no direction")
        over = validation.non_negative(over, "over")
        target = np.array(self._world.support_position(index))
        if position is not None:
            target = validation.vector(position, f"position of {owner}")
        if tangent is None and roll is None:
            matrix = np.array(self._world.support_rotation(index))
            if rotation is not None:
                matrix = validation.rotation_matrix(rotation, f"rotation of {owner}")
            self._world.move_support(index, target, matrix, over)
            self._settings.paths.pop(part.name, None)
            return
        self._settings.paths[part.name] = self._turn(index, part, target, tangent, roll, over)

    def _turn(self, index: int, part: SupportPart, target: FloatArray, tangent: Any, roll: Any, over: float) -> Turn:
        """The way of a support from where it is to a tangent and a roll."""
        rod = self._directory.rod(self._directory.layout.rods[part.node[0]].name)
        if part.kind in ("clamp", "spinning_clamp"):
            drawn = drawing.drawn_frame(rod.tangents, rod.directors, rod.lengths, part.node[1], rod.closed)
        else:
            edge = min(part.node[1], len(rod.tangents) - 1)
            drawn = rod.tangents[edge], rod.directors[edge]
        now = self._world.time
        matrix = np.array(self._world.support_rotation(index))
        start_tangent = matrix @ drawn[0]
        start_tangent /= np.linalg.norm(start_tangent)
        flat = oriented(drawn[0], drawn[1], start_tangent, 0.0) @ drawn[1]
        turned = matrix @ drawn[1]
        start_roll = float(np.arctan2(np.cross(flat, turned) @ start_tangent, flat @ turned))
        before = self._settings.paths.get(part.name)
        if isinstance(before, Turn):
            full_turn = 2.0 * np.pi
            start_roll += full_turn * float(np.round((before.roll_at(now) - start_roll) / full_turn))
        owner = f"support {part.name!r}"
        end_tangent = start_tangent if tangent is None else validation.unit_vector(tangent, f"tangent of {owner}")
        end_roll = start_roll if roll is None else validation.number(roll, f"roll of {owner}")
        # Rotations at the ends of a step do not tell full turns between them.
        step = float(self._options["time_step"])
        way = abs(end_roll - start_roll)
        if way * min(step / over if over > 0.0 else 1.0, 1.0) > np.pi:
            raise ValueError(
                f"roll of {owner} must turn by at most half a turn in a time step, got {end_roll - start_roll:g} rad "
                f"{'at once' if over == 0.0 else f'over {over:g} s'}: take over={1.5 * way / np.pi * step:.2g} or more"
            )
        return Turn(
            positions=np.stack([np.array(self._world.support_position(index)), target]),
            tangents=np.stack([start_tangent, end_tangent]),
            rolls=np.array([start_roll, end_roll]),
            times=np.array([now, now + over]),
            drawn=np.stack(drawn),
        )

    def _support(self, support: Any) -> tuple[int, SupportPart]:
        """Index and part of a support, given by itself or by its node."""
        if isinstance(support, NodeHandle) or (
            isinstance(support, str) and support not in self._directory.parts and "." in support
        ):
            node, name = self._directory.node(support, "node")
            row = self._directory.row(node)
            for index, part in self._settings.supports.values():
                if self._directory.row(part.node) == row:
                    return index, part
            raise ValueError(f"node {name!r} is not held: clamp or pin it first")
        # One that came while running leaves the directory when it goes.
        gone = isinstance(support, Support) and support.name not in self._directory.parts
        if not gone or support.scene_id != self._directory.scene_id:
            part = self._directory.find(support, SupportPart, "support")
            if part.name in self._settings.supports:
                return self._settings.supports[part.name]
        name = support if isinstance(support, str) else support.name
        raise ValueError(f"support {name!r} is released: it is not in the scene any more")

    def _obstacle(self, handle: Any) -> tuple[int, str] | None:
        """Index and name of an obstacle; None where it is something else."""
        name = self._directory.find(handle, ObstaclePart, "obstacle").name if isinstance(handle, Obstacle) else handle
        names = [part.name for part in self._directory.all(ObstaclePart)]
        return (names.index(name), name) if isinstance(name, str) and name in names else None

    def _move_obstacle(
        self,
        index: int,
        name: str,
        position: npt.ArrayLike | None,
        tangent: npt.ArrayLike | None,
        roll: float | None,
        over: float,
        path: Path | None,
    ) -> None:
        over = validation.non_negative(over, "over")
        if path is not None:
            if any(value is not None for value in (position, tangent, roll)) or over != 0.0:
                raise ValueError(f"path of {name!r} must be given alone")
            validation.function(path, f"path of {name!r}")
            self._obstacle_pose(index, path, self._world.time)
            self._settings.paths[name] = path
            return
        if position is None and roll is None:
            raise ValueError(f"position, roll or path of {name!r} must be given")
        place, turn = np.array(self._world.obstacle_position(index)), np.array(self._world.obstacle_turn(index))
        if position is not None:
            place = validation.vector(position, f"position of {name!r}")
        axis = self._directory.all(ObstaclePart)[index].axis
        if (tangent is None) != (axis is not None or roll is None):
            what = "a sphere turns about the tangent that is given with a roll"
            raise ValueError(
                f"tangent of {name!r} must be given: {what}"
                if tangent is None
                else f"tangent of {name!r} must be None: only {what}, others about their axis"
            )
        if roll is not None:
            about = validation.unit_vector(tangent, f"tangent of {name!r}") if axis is None else axis
            turn = validation.number(roll, f"roll of {name!r}") * about
        self._world.move_obstacle(index, place, turn, over)
        self._settings.paths.pop(name, None)

    def _obstacle_pose(self, index: int, path: Path, time: float) -> tuple[FloatArray, FloatArray]:
        """Where the path of an obstacle leads, and how it has turned since it was drawn [rad]."""
        part = self._directory.all(ObstaclePart)[index]
        value = path(time)
        what = f"path of {part.name!r} at t = {time:g}"
        if not (isinstance(value, tuple | list) and len(value) == 2):
            return validation.vector(value, what), np.array(self._world.obstacle_turn(index))
        place, roll = validation.vector(value[0], f"position on the {what}"), f"roll on the {what}"
        if part.axis is None:
            return place, validation.vector(value[1], roll)
        return place, validation.number(value[1], roll) * part.axis

    # Friction

    def set_friction(self, a: Rod | Obstacle | str, b: Rod | Obstacle | str, friction: Friction) -> None:
        """Give two rods, or a rod and an obstacle, another friction coefficient of their own. See `Scene.set_friction`.

        Raises
        ------
        ValueError
            Two obstacles, negative friction, or two coefficients for two rods.
        """
        first, second = (touching(self._directory, body) for body in (a, b))
        if isinstance(first, ObstaclePart) and isinstance(second, ObstaclePart):
            raise ValueError(f"{first.name!r} and {second.name!r} are both obstacles, which never touch")
        what = f"friction of {first.name!r} and {second.name!r}"
        rods = isinstance(first, RodPart) and isinstance(second, RodPart)
        pair = friction_pair(friction, what, directed=not rods)
        contact = self._world.contact
        if rods and not contact.rods:
            raise ValueError(f"{what} cannot be set: rods do not touch in this scene, see Scene.enable_contact")
        check_law(pair, contact.friction_law, what)
        bodies = body_of(self._directory, first), body_of(self._directory, second)
        self._world.set_friction(with_pair(contact, bodies, pair))

    def _set_obstacle_friction(self, part: ObstaclePart, value: Any) -> None:
        what = f"friction of {part.name!r}"
        pair = friction_pair(value, what)
        contact = self._world.contact
        check_law(pair, contact.friction_law, what)
        index = self._directory.all(ObstaclePart).index(part)
        self._world.set_friction(with_obstacle(contact, index, pair))

    def _set_rod_friction(self, value: Any) -> None:
        """Of all rods with each other."""
        coefficient = validation.non_negative(value, "friction")
        contact = self._world.contact
        if not contact.rods:
            raise ValueError("friction of the scene is that between rods, which do not touch: see Scene.enable_contact")
        contact.friction = coefficient
        self._world.set_friction(contact)
