"""Unknown shapes and poses: natural curvature, drawn shapes of rods, poses of supports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from withe.common import drawing, validation
from withe.parts.handles import Handle, Rod
from withe.parts.kinds import JoinPart, RodPart, SupportPart
from withe.real2sim.places import rod_part, turning_axis
from withe.real2sim.unknowns import Unknown
from withe.simulation.simulation import Simulation
from withe.simulation.supports import find_support

__all__ = ["DrawnShape", "NaturalCurvature", "NaturalTwist", "Pose"]

FloatArray = npt.NDArray[np.float64]


class _NaturalStrain(Unknown):
    """Natural curvature or twist of a rod as a sum of functions along it.

    Parameters
    ----------
    directions : ndarray of shape (n, components)
        Unknown components of the strain. Each has its own functions.
    axes : list of str
        Text that distinguishes them in names.
    """

    names: tuple[str, ...]
    rods: tuple[str, ...]
    scales: FloatArray
    length: float
    per_frame = True

    def __init__(self, part: RodPart, basis: Any, directions: FloatArray, axes: list[str]) -> None:
        self._rod, self.rods = part.name, (part.name,)
        self.length = float(part.lengths.sum())
        functions, words = _basis(part, basis)
        self.names = tuple(f"{self.word} of {part.name!r}{axis}{word}" for axis in axes for word in words)
        fields = [functions.T[:, :, None] * direction for direction in directions]
        self._rows = np.concatenate(fields).reshape(len(self.names), -1)  # one a function: components of each stencil
        self._inverse = np.linalg.pinv(self._rows.T)
        largest = np.abs(functions).max(axis=0)
        self.scales = np.tile(1.0 / (self.length * largest), len(axes))

    def read(self, simulation: Simulation) -> FloatArray:
        """Coordinates of the nearest strain that the functions make."""
        return np.asarray(self._inverse @ simulation.get(self._rod, self.word).ravel())

    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Set them."""
        strain = coordinates @ self._rows
        simulation.set(self._rod, **{self.word: strain.reshape(np.shape(simulation.get(self._rod, self.word)))})

    @property
    def words(self) -> list[Any]:
        """The natural strain of the rod."""
        return [(self._rod, self.word)]

    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Derivatives by the coefficient of each function."""
        return np.asarray(np.reshape(found[0], (len(found[0]), -1)) @ self._rows.T)


class NaturalCurvature(_NaturalStrain):
    """Natural curvature of a rod as a sum of functions along it [1/m]."""

    word = "natural_curvature"

    def __init__(self, simulation: Simulation, rod: Rod | str, basis: Any = "constant") -> None:
        part = rod_part(simulation, rod)
        plane = turning_axis(simulation, part)
        directions = np.eye(2) if plane is None else plane[0][None]
        super().__init__(part, basis, directions, [" towards d1", " towards d2"] if plane is None else [""])


class NaturalTwist(_NaturalStrain):
    """Natural twist of a rod as a sum of functions along it [rad/m]."""

    word = "natural_twist"

    def __init__(self, simulation: Simulation, rod: Rod | str, basis: Any = "constant") -> None:
        part = rod_part(simulation, rod)
        if turning_axis(simulation, part) is not None:
            raise ValueError(f"natural_twist of {part.owner} cannot be unknown in a plane: use build(planar=False)")
        super().__init__(part, basis, np.ones((1, 1)), [""])


class DrawnShape(Unknown):
    """The drawn shape of a rod in a plane, by the rotations of its edges [rad].

    It acts as if the scene were built again: natural curvature and supports follow the drawing. Edges keep their
    lengths, and the first node its position.
    """

    names: tuple[str, ...]
    rods: tuple[str, ...]
    scales: FloatArray
    word: str = "points"
    per_frame: bool = False

    def __init__(self, simulation: Simulation, rod: Rod | str, basis: Any = "linear") -> None:
        part = rod_part(simulation, rod)
        plane = turning_axis(simulation, part)
        if plane is None:
            raise ValueError(
                f"points of {part.owner} can be unknown in a planar scene only: use build(planar=True), or make "
                "natural_curvature unknown"
            )
        if part.closed or simulation._session.directory.all(JoinPart):
            raise ValueError(
                f"points of {part.owner} cannot be unknown, because the rod is joined or closed: make "
                "natural_curvature unknown"
            )
        self._rod, self.rods, self._part = part.name, (part.name,), part
        self._components, self._axis = plane
        ends = np.cumsum(part.lengths)
        self._fields, words = _functions((ends - 0.5 * part.lengths) / ends[-1], basis, part.owner, "edge")
        self.names = tuple(f"turn of {part.name!r} as drawn{word}" for word in words)
        self.scales = 1.0 / np.abs(self._fields).max(axis=0)
        self._first = simulation.get(part.name, "natural_curvature")
        bends = np.diff(self._fields, axis=0) / part.voronoi[:, None]
        self._by_turns = bends[:, None, :] * self._components[:, None]  # by natural curvature
        self._held = _supports_of(simulation, part)
        self._poses = [_pose(simulation, support) for support in self._held]

    @property
    def supports(self) -> tuple[str, ...]:
        """Names of the supports of the rod."""
        return tuple(support.name for support in self._held)

    def points(self, coordinates: FloatArray) -> FloatArray:
        """Return the drawn nodes, shape (nodes, 3) [m]."""
        return self._drawn(coordinates)[0]

    def _drawn(self, coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Nodes, and tangents of edges."""
        turned = np.stack(
            [
                drawing.rotation_about(angle * self._axis) @ tangent
                for angle, tangent in zip(self._fields @ coordinates, self._part.tangents, strict=True)
            ]
        )
        ways = np.cumsum(turned * self._part.lengths[:, None], axis=0)
        start = self._part.points[0]
        return start + np.concatenate([np.zeros((1, 3)), ways]), turned

    def read(self, simulation: Simulation) -> FloatArray:
        """Return the coordinates of the drawing."""
        return np.zeros(len(self))

    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Set the natural curvature, and move the supports."""
        simulation.set(self._rod, natural_curvature=self._first + self._by_turns @ coordinates)
        shift = self.points(coordinates) - self._part.points
        for support, (position, rotation) in zip(self._held, self._poses, strict=True):
            angle = float(_turn_of(self._part, support) @ self._fields @ coordinates)
            turn = drawing.rotation_about(angle * self._axis)
            matrix = None if support.kind == "pin" else turn @ rotation
            simulation.move(support.name, position + shift[support.node[1]], matrix)

    @property
    def words(self) -> list[Any]:
        """Natural curvature, and poses of the supports."""
        poses = [
            (support.name, word)
            for support in self._held
            for word in (("position",) if support.kind == "pin" else ("position", "rotation"))
        ]
        return [(self._rod, "natural_curvature"), *poses]

    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Derivatives by rotations of edges, which move all later nodes and turn their supports."""
        total = np.tensordot(np.array(found[0]), self._by_turns, axes=([1, 2], [0, 1]))
        by_words = dict(zip(self.words, found, strict=True))
        turned = self._drawn(coordinates)[1] * self._part.lengths[:, None]
        ways = np.cumsum(np.cross(self._axis, turned)[:, :, None] * self._fields[:, None, :], axis=0)
        ways = np.concatenate([np.zeros((1, *ways.shape[1:])), ways])
        for support in self._held:
            total += np.array(by_words[support.name, "position"]) @ ways[support.node[1]]
            if support.kind != "pin":
                spin = np.array(by_words[support.name, "rotation"]) @ self._axis
                total += np.outer(spin, _turn_of(self._part, support) @ self._fields)
        return np.asarray(total)


class Pose(Unknown):
    """Position of a support [m], or its rotation against the initial guess, as a rotation vector [rad]."""

    names: tuple[str, ...]
    rods: tuple[str, ...]
    scales: FloatArray
    per_frame = False

    def __init__(
        self,
        simulation: Simulation,
        support: Handle | str,
        word: Literal["position", "rotation"],
        others: Sequence[Unknown] = (),
    ) -> None:
        _, part = find_support(simulation._session, support)
        if word == "rotation" and part.kind == "pin":
            raise ValueError(f"rotation of {part.name!r} cannot be unknown, because a pin does not hold directions")
        self.word, self.rods, self._name = word, (part.name,), part.name
        self._position, self._rotation = _pose(simulation, part)
        # A support is moved at once, also where its position is one unknown and its rotation another.
        same = [other for other in others if isinstance(other, Pose) and other._name == part.name]
        self._target: dict[str, FloatArray] = same[0]._target if same else {}
        normal = simulation.plan.plane_normal
        self._axes = np.eye(3)
        if normal is not None:
            across = drawing.default_normal(np.asarray(normal))
            in_plane = np.stack([across, np.cross(normal, across)])
            self._axes = in_plane if word == "position" else np.asarray(normal)[None]
            signs = np.take_along_axis(self._axes, np.abs(self._axes).argmax(axis=1)[:, None], axis=1)
            self._axes = self._axes * np.sign(signs)
        rods = simulation._session.directory.all(RodPart)
        length = float(rods[part.node[0]].lengths.sum())
        self.scales = np.full(len(self._axes), length if word == "position" else 1.0)
        self.names = tuple(f"{word} of {part.name!r} {_along(axis, word)}" for axis in self._axes)

    def read(self, simulation: Simulation) -> FloatArray:
        """Return the initial guess."""
        return np.zeros(len(self))

    def write(self, simulation: Simulation, coordinates: FloatArray) -> None:
        """Move the support."""
        way = coordinates @ self._axes
        moved = self._position + way if self.word == "position" else drawing.rotation_about(way) @ self._rotation
        self._target[self.word] = moved
        simulation.move(self._name, self._target.get("position"), self._target.get("rotation"))

    @property
    def words(self) -> list[Any]:
        """Position or rotation of the support."""
        return [(self._name, self.word)]

    def chain(self, coordinates: FloatArray, found: list[list[Any]]) -> FloatArray:
        """Derivatives by the position, or by the rotation vector through its left Jacobian."""
        by_way = np.array(found[0])
        if self.word == "rotation":
            by_way = by_way @ _further_turn(coordinates @ self._axes)
        return np.asarray(by_way @ self._axes.T)

    def value(self, coordinates: FloatArray) -> FloatArray:
        """Components of the position [m], or of the rotation vector [rad]."""
        return np.asarray(coordinates + (self._axes @ self._position if self.word == "position" else 0.0))


def _turn_of(part: RodPart, support: SupportPart) -> FloatArray:
    """Return weights of edges in the rotation of a supported frame, shape (edges,); see `drawing.drawn_frame`."""
    edges, node = len(part.lengths), support.node[1]
    shares = np.zeros(edges)
    if support.kind == "pin":
        return shares
    if support.kind not in ("clamp", "spinning_clamp") or edges == 1:
        shares[min(node, edges - 1)] = 1.0
        return shares
    before = int(np.clip(node - 1, 0, edges - 2))
    near, far = part.lengths[before], part.lengths[before + 1]
    middle = near if node == before + 1 else -near if node == 0 else near + 2.0 * far  # from that of the edge before
    shares[before + 1] = middle / (near + far)
    shares[before] = 1.0 - shares[before + 1]
    return shares


def _further_turn(vector: FloatArray) -> FloatArray:
    """Left Jacobian of the rotation by a vector [Chirikjian 2012, 10.87]."""
    angle = float(np.linalg.norm(vector))
    cross = np.cross(np.eye(3), vector)  # cross @ w = vector x w
    if angle < 1e-4:
        return np.asarray(np.eye(3) + cross / 2.0 + cross @ cross / 6.0)
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)


def _along(axis: FloatArray, word: str) -> str:
    verb = "along" if word == "position" else "about"
    if np.abs(axis).max() > 1.0 - 1e-12:
        return f"{verb} {'xyz'[int(np.abs(axis).argmax())]}"
    return f"{verb} ({axis[0]:.3g}, {axis[1]:.3g}, {axis[2]:.3g})"


def _supports_of(simulation: Simulation, part: RodPart) -> list[SupportPart]:
    supports = [support for _, support in simulation._session.settings.supports.values()]
    return [support for support in supports if support.node[0] == part.index]


def _pose(simulation: Simulation, support: SupportPart) -> tuple[FloatArray, FloatArray]:
    """Position and rotation of a support now."""
    index, _ = find_support(simulation._session, support.name)
    world = simulation._session.world
    return np.array(world.support_position(index)), np.array(world.support_rotation(index))


def _basis(part: RodPart, basis: Any) -> tuple[FloatArray, list[str]]:
    """Return functions along a rod at its stencils, shape (stencils, n), and texts that distinguish them."""
    stencils = len(part.voronoi)
    if stencils == 0:
        raise ValueError(f"{part.owner} has no stencil that could bend: a rod needs at least three nodes")
    ends = np.cumsum(part.lengths)
    share = (ends if part.closed else ends[:-1]) / ends[-1]
    return _functions(share, basis, part.owner, "stencil")


def _functions(share: FloatArray, basis: Any, owner: str, what: str) -> tuple[FloatArray, list[str]]:
    """Values of functions at shares of a length, shape (shares, n)."""
    if isinstance(basis, str):
        validation.choice(basis, f"basis of {owner}", ("constant", "linear", "segment"))
        if basis == "constant":
            return np.ones((len(share), 1)), [""]
        if basis == "linear":
            return np.stack([1.0 - share, share], axis=1), [" at its start", " at its end"]
        return np.eye(len(share)), [f" at {what} {i}" for i in range(len(share))]
    functions = validation.number_array(basis, f"basis of {owner}", (len(share), "n"))
    if functions.shape[1] == 0:
        raise ValueError(f"basis of {owner} must have at least one column")
    if not np.abs(functions).max(axis=0).all():
        raise ValueError(f"basis of {owner} must have no column of zeros")
    return functions, [f" [{i}]" for i in range(functions.shape[1])]
