"""Solids of rigid bodies: mass, centre and inertia from their shapes."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, cast

import numpy as np
import numpy.typing as npt

from withe.common import extras, validation
from withe.common.polyhedra import convex_hull

__all__ = ["Box", "Capsule", "Cylinder", "Hull", "Mesh", "Sphere"]

FloatArray = npt.NDArray[np.float64]


class Solid(Protocol):
    """A shape of uniform density in axes of its own.

    Attributes
    ----------
    volume : float [m^3]
    center : ndarray of shape (3,) [m]
        Centre of mass.
    inertia_per_mass : ndarray of shape (3, 3) [m^2]
        Moment of inertia about the centre of mass over the mass.
    """

    @property
    def volume(self) -> float:
        """Volume [m^3]."""

    @property
    def center(self) -> FloatArray:
        """Centre of mass, shape (3,) [m]."""

    @property
    def inertia_per_mass(self) -> FloatArray:
        """Moment of inertia about the centre of mass over the mass, shape (3, 3) [m^2]."""

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """


@dataclass(frozen=True)
class Sphere:
    """A ball.

    Parameters
    ----------
    radius : float [m]

    Raises
    ------
    ValueError
        A radius that is not positive.
    """

    radius: float

    def __post_init__(self) -> None:
        validation.positive(self.radius, "radius of the sphere")

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return 4.0 / 3.0 * np.pi * float(self.radius) ** 3

    @property
    def center(self) -> FloatArray:
        """Centre of mass, shape (3,) [m]."""
        return np.zeros(3)

    @property
    def inertia_per_mass(self) -> FloatArray:
        """Moment of inertia about the centre of mass over the mass, shape (3, 3) [m^2]."""
        return 0.4 * float(self.radius) ** 2 * np.eye(3)

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        angles = np.linspace(0.0, np.pi, 37)
        return _turned(self.radius * np.sin(angles), -self.radius * np.cos(angles), sides=72)


@dataclass(frozen=True)
class Box:
    """A cuboid about the origin.

    Parameters
    ----------
    size : tuple of three floats [m]
        Lengths of the edges along x, y and z.
    rounding : float [m]
        Radius of the edges where the box touches. By default 0.0002 of the thinnest side.

    Raises
    ------
    ValueError
        A length that is not positive, or a rounding of half of the thinnest side and more.
    """

    size: tuple[float, float, float]
    rounding: float | None = None

    def __post_init__(self) -> None:
        sides = validation.vector(self.size, "size of the box")
        if not (sides > 0.0).all():
            raise ValueError(f"size of the box must be positive, got {tuple(map(float, sides))}")
        _check_rounding(self.rounding, float(sides.min()), "box")

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(np.prod(np.asarray(self.size, dtype=float)))

    @property
    def center(self) -> FloatArray:
        """Centre of mass, shape (3,) [m]."""
        return np.zeros(3)

    @property
    def inertia_per_mass(self) -> FloatArray:
        """Moment of inertia about the centre of mass over the mass, shape (3, 3) [m^2]."""
        squares = np.asarray(self.size, dtype=float) ** 2
        return np.diag(squares.sum() - squares) / 12.0

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
        quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
        triangles = [triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))]
        return 0.5 * signs * np.asarray(self.size, dtype=float), np.array(triangles)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder along z, about the origin.

    Parameters
    ----------
    radius, length : float [m]

    Raises
    ------
    ValueError
        A radius or a length that is not positive.
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        validation.positive(self.radius, "radius of the cylinder")
        validation.positive(self.length, "length of the cylinder")

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(np.pi * self.radius**2 * self.length)

    @property
    def center(self) -> FloatArray:
        """Centre of mass, shape (3,) [m]."""
        return np.zeros(3)

    @property
    def inertia_per_mass(self) -> FloatArray:
        """Moment of inertia about the centre of mass over the mass, shape (3, 3) [m^2]."""
        across = self.radius**2 / 4.0 + self.length**2 / 12.0
        return np.diag([across, across, self.radius**2 / 2.0])

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        half = 0.5 * self.length
        return _turned(self.radius * np.array([0.0, 1.0, 1.0, 0.0]), np.array([-half, -half, half, half]))


@dataclass(frozen=True)
class Capsule:
    """A cylinder along z with hemispheres at both ends, about the origin.

    Parameters
    ----------
    radius, length : float [m]
        `length` is that of the cylinder, without the hemispheres.

    Raises
    ------
    ValueError
        A radius or a length that is not positive.
    """

    radius: float
    length: float

    def __post_init__(self) -> None:
        validation.positive(self.radius, "radius of the capsule")
        validation.positive(self.length, "length of the capsule")

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(np.pi * self.radius**2 * (self.length + 4.0 / 3.0 * self.radius))

    @property
    def center(self) -> FloatArray:
        """Centre of mass, shape (3,) [m]."""
        return np.zeros(3)

    @property
    def inertia_per_mass(self) -> FloatArray:
        """Moment of inertia about the centre of mass over the mass, shape (3, 3) [m^2]."""
        r, h = float(self.radius), float(self.length)
        barrel, caps = np.pi * r**2 * h, 4.0 / 3.0 * np.pi * r**3
        along = barrel * r**2 / 2.0 + caps * 0.4 * r**2
        # A hemisphere's centre of mass is 3 r / 8 from its flat side.
        across = barrel * (r**2 / 4.0 + h**2 / 12.0) + caps * (0.4 * r**2 + h**2 / 4.0 + 3.0 * h * r / 8.0)
        return np.diag([across, across, along]) / (barrel + caps)

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        angles = np.linspace(0.0, np.pi, 26)
        shift = np.where(angles < 0.5 * np.pi, -0.5, 0.5) * self.length
        return _turned(self.radius * np.sin(angles), shift - self.radius * np.cos(angles))


class _OfTriangles:
    """A solid whose volume, centre and inertia follow from its surface."""

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface, see `Solid`."""
        raise NotImplementedError

    def _corners(self) -> tuple[FloatArray, FloatArray]:
        """Return the corners of the tetrahedra from the origin to each triangle, and their signed volumes."""
        vertices, triangles = self.surface()
        corners = vertices[triangles]
        return corners, np.linalg.det(corners) / 6.0

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return float(self._corners()[1].sum())

    @property
    def center(self) -> FloatArray:
        """Centre of mass, shape (3,) [m]."""
        corners, volumes = self._corners()
        return np.asarray(volumes @ corners.sum(axis=1) / 4.0 / volumes.sum())

    @property
    def inertia_per_mass(self) -> FloatArray:
        """Moment of inertia about the centre of mass over the mass, shape (3, 3) [m^2]."""
        corners, volumes = self._corners()
        sums = corners.sum(axis=1)
        # Second moments of a tetrahedron with a corner at the origin: V / 20 (sum_i x_i x_i^T + s s^T).
        second = np.einsum("m,mij,mik->jk", volumes, corners, corners) + np.einsum("m,mj,mk->jk", volumes, sums, sums)
        second = second / 20.0 / volumes.sum() - np.outer(self.center, self.center)
        return np.asarray(np.trace(second) * np.eye(3) - second)


@dataclass(frozen=True, eq=False)
class Mesh(_OfTriangles):
    """A closed surface of triangles, whose normals point outwards.

    Parameters
    ----------
    vertices : array_like of shape (n, 3) [m]
    triangles : array_like of shape (m, 3)
        Rows of `vertices`, counter-clockwise when seen from outside.
    rounding : float [m]
        Radius of the edges where the mesh touches. By default 0.0002 of its thinnest extent along an axis.

    Raises
    ------
    ValueError
        A surface that is not closed, triangles that face inwards or have no area, rows that are not those of vertices,
        or a rounding of half of the thinnest extent and more.
    """

    vertices: npt.ArrayLike
    triangles: npt.ArrayLike
    rounding: float | None = None

    def __post_init__(self) -> None:
        vertices = validation.number_array(self.vertices, "vertices of the mesh", ("n", 3))
        triangles = np.array(self.triangles)
        if triangles.ndim != 2 or triangles.shape[1:] != (3,) or not np.issubdtype(triangles.dtype, np.integer):
            raise ValueError(f"triangles must be whole numbers of shape (m, 3), got shape {triangles.shape}")
        if triangles.size == 0 or triangles.min() < 0 or triangles.max() >= len(vertices):
            raise ValueError("triangles must be rows of vertices")
        _check_closed(vertices, triangles)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)
        if not self.volume > 0.0:
            raise ValueError(
                f"triangles of the mesh must be counter-clockwise when seen from outside, and enclose a volume, got "
                f"{self.volume:.3g} m^3: swap two columns of triangles if it is negative"
            )
        _check_rounding(self.rounding, float(np.ptp(vertices, axis=0).min()), "mesh")

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, scale: float = 1.0, rounding: float | None = None) -> Mesh:
        """Read a mesh from a file, with the extra ``view``.

        Parameters
        ----------
        path : path-like
            STL, OBJ or PLY file, or another one that PyVista reads.
        scale : float [-]
            Metres per unit of the file, for example 1e-3 of a file in millimetres.
        rounding : float [m]
            Radius of the edges where the mesh touches.

        Returns
        -------
        Mesh

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            A file without triangles, or a surface that `Mesh` refuses.
        ImportError
            PyVista is not installed.
        """
        file = Path(path)
        if not file.is_file():
            raise FileNotFoundError(f"no such file: {file}")
        read = extras.require("pyvista", "view").read(str(file)).extract_surface().triangulate().clean()
        if read.n_cells == 0:
            raise ValueError(f"{file} has no triangles")
        triangles = np.asarray(read.faces).reshape(-1, 4)[:, 1:].astype(np.int64)
        return cls(validation.positive(scale, "scale") * np.asarray(read.points, dtype=float), triangles, rounding)

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        return np.asarray(self.vertices), np.asarray(self.triangles)


@dataclass(frozen=True, eq=False)
class Hull(_OfTriangles):
    """The convex hull of points.

    Parameters
    ----------
    points : array_like of shape (n, 3) [m]
        At least four points that are not in one plane.
    rounding : float [m]
        Radius of the edges where the hull touches. By default 0.0002 of its thinnest extent along an axis.

    Raises
    ------
    ValueError
        Points in one plane, or a rounding of half of the thinnest extent and more.
    """

    points: npt.ArrayLike
    rounding: float | None = None

    def __post_init__(self) -> None:
        points = validation.number_array(self.points, "points of the hull", ("n", 3))
        object.__setattr__(self, "points", points)
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if len(points) < 4 or spread[2] < 1e-9 * spread[0]:
            raise ValueError("points of the hull must be at least four that are not in one plane")
        vertices, triangles = convex_hull(points)
        _check_rounding(self.rounding, float(np.ptp(vertices, axis=0).min()), "hull")
        object.__setattr__(self, "_surface", (vertices, triangles))

    def surface(self) -> tuple[FloatArray, npt.NDArray[np.int64]]:
        """Return the surface for pictures.

        Returns
        -------
        vertices : ndarray of shape (n, 3) [m]
        triangles : ndarray of int, shape (m, 3)
            Rows of the vertices, counter-clockwise from outside.
        """
        return cast("tuple[FloatArray, npt.NDArray[np.int64]]", self.__dict__["_surface"])


def _check_closed(vertices: FloatArray, triangles: npt.NDArray[np.int64]) -> None:
    """Refuse a surface that is open or that has triangles without area, and name triangles."""
    corners = vertices[triangles]
    double_areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    flat = np.flatnonzero(double_areas <= 1e-12 * sides**2)
    if len(flat):
        raise ValueError(f"triangles {flat[:5].tolist()} of the mesh have no area: remove them and their vertices")
    owners: dict[tuple[int, int], int] = {}
    twice = set()
    for k, triangle in enumerate(triangles.tolist()):
        for i in range(3):
            edge = (triangle[i], triangle[(i + 1) % 3])
            if edge in owners:
                twice |= {owners[edge], k}
            owners[edge] = k
    wrong = sorted({k for (a, b), k in owners.items() if (b, a) not in owners} | twice)
    if wrong:
        raise ValueError(
            "the mesh must be closed and its triangles equally oriented: each edge belongs to two of them, with "
            f"opposite directions. Edges of triangles {wrong[:5]} do not. Vertices at one place must be one vertex"
        )


def _check_rounding(given: float | None, size: float, owner: str) -> None:
    """Refuse a radius of edges that a solid is too thin for."""
    if given is not None and validation.positive(given, f"rounding of the {owner}") >= 0.5 * size:
        raise ValueError(
            f"rounding of the {owner} must be less than half of its thinnest side, {size:g} m, got {given:g} m"
        )


def _turned(radii: FloatArray, heights: FloatArray, sides: int = 48) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """Return the surface that a profile draws when it turns about z."""
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(sides)])
    rings = [radius * circle + (0.0, 0.0, height) for radius, height in zip(radii, heights, strict=True)]
    here = np.arange(sides)
    after = (here + 1) % sides
    triangles = []
    for ring in range(len(radii) - 1):
        low, high = ring * sides, (ring + 1) * sides
        triangles.append(np.column_stack([low + here, low + after, high + after]))
        triangles.append(np.column_stack([low + here, high + after, high + here]))
    return np.concatenate(rings), np.concatenate(triangles)
