"""Surfaces of rods: a section swept along a smooth centreline. Pure functions of positions and directors.

The centreline is a cubic spline through the nodes, so few nodes look as smooth as many. The interpolation and the faces
depend on the mesh only, and are computed once. A frame then costs two small products.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from withe.common.outlines import RodOutline

__all__ = ["Surface", "end_caps", "rectangle_section", "ring_faces", "round_section", "unit"]

FloatArray = npt.NDArray[np.float64]

_CAP_RINGS = 6
_LEAST_SHARE = 0.05  # of an upright rod, which is seen from above as its section


class Surface:
    """The surface of one rod. Round sections end in half spheres, rectangular ones in flat faces.

    Parameters
    ----------
    rod : RodOutline
    nodes : ndarray of shape (nodes, 3) [m]
        A shape of the rod, which determines the spacing of its nodes.
    samples_per_edge : int
        Rings of the surface between two nodes.
    sides : int
        Corners of a round section.

    Attributes
    ----------
    faces : ndarray of int, shape (faces, 4)
        Corners of each quadrilateral, counter-clockwise from outside.
    """

    def __init__(self, rod: RodOutline, nodes: FloatArray, samples_per_edge: int = 4, sides: int = 24) -> None:
        self.closed: bool = rod.closed
        chords = np.linalg.norm(np.diff(nodes, axis=0, append=nodes[:1]), axis=1)[: rod.edges]
        knots = np.concatenate([[0.0], np.cumsum(np.maximum(chords, 1e-12 * chords.max()))])
        samples = _subdivide(knots, samples_per_edge)
        if rod.closed:
            samples = samples[:-1]
        middles = 0.5 * (knots[1:] + knots[:-1])
        self._position_weights, self._tangent_weights = _spline(knots, samples, rod.closed)
        self._edge_weights = _hats(middles, samples, knots[-1] if rod.closed else None)
        half = 0.5 * rod.widths if rod.widths is not None else np.stack([rod.radii, rod.radii], axis=1)
        self._half_widths = self._edge_weights @ half
        self._section, self._section_normals = round_section(sides) if rod.widths is None else rectangle_section()
        self._caps = end_caps(rod.widths is None) if not rod.closed else np.zeros((0, 3))
        self._ring_samples = self._rings(len(samples))
        self.faces: npt.NDArray[np.int64] = ring_faces(len(self._ring_samples), len(self._section), rod.closed)

    def _rings(self, samples: int) -> npt.NDArray[np.int64]:
        """Sample of every ring: the first one repeated for its cap, then all, then the last one."""
        caps = len(self._caps)
        return np.concatenate([np.zeros(caps, int), np.arange(samples), np.full(caps, samples - 1)])

    def mesh(self, nodes: FloatArray, directors: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points and normals of the surface.

        Parameters
        ----------
        nodes : ndarray of shape (nodes, 3) [m]
        directors : ndarray of shape (edges, 3)
            First director of every edge.

        Returns
        -------
        points, normals : ndarrays of shape (points, 3)
        """
        centres = self._position_weights @ nodes
        tangents = unit(self._tangent_weights @ nodes)
        first = self._edge_weights @ directors
        first = unit(first - np.sum(first * tangents, axis=1, keepdims=True) * tangents)
        second = np.cross(tangents, first)

        count = len(self._caps)
        scale = np.ones((len(self._ring_samples), 1))
        along = np.zeros((len(self._ring_samples), 1))
        lean = np.zeros((len(self._ring_samples), 1))
        if count:
            scale[:count, 0], scale[-count:, 0] = self._caps[:, 0], self._caps[::-1, 0]
            along[:count, 0], along[-count:, 0] = -self._caps[:, 1], self._caps[::-1, 1]
            lean[:count, 0], lean[-count:, 0] = -self._caps[:, 2], self._caps[::-1, 2]

        rings = self._ring_samples
        half = self._half_widths[rings]
        axes = np.stack([half[:, :1] * scale * first[rings], half[:, 1:] * scale * second[rings]], axis=1)
        shift = centres[rings] + along * half[:, :1] * tangents[rings]
        points = shift[:, None] + self._section @ axes
        unit_axes = np.stack([first[rings], second[rings]], axis=1)
        flat = np.sqrt(1.0 - lean**2)[:, None]
        normals = flat * (self._section_normals @ unit_axes) + (lean * tangents[rings])[:, None]
        return points.reshape(-1, 3), normals.reshape(-1, 3)

    def spread(self, points: FloatArray) -> FloatArray:
        """Return points of the surface, pulled towards the centreline so that they fill the sections, for shadows.

        The shadow of an upright rod is otherwise a ring.
        """
        rings = points.reshape(len(self._ring_samples), -1, 3)
        middle = rings.mean(axis=1, keepdims=True)
        places = (
            np.arange(rings.shape[1]) * 0.618034 % 1.0
        )  # of equal areas of a disc, in the order of the golden ratio
        return np.asarray((middle + np.sqrt(places)[:, None] * (rings - middle)).reshape(-1, 3))

    def footprint(self, nodes: FloatArray) -> FloatArray:
        """Area of the rod, seen from the side, that belongs to each point of the surface [m^2]."""
        centres = self._position_weights @ nodes
        steps = np.linalg.norm(np.diff(centres, axis=0, append=centres[:1] if self.closed else centres[-1:]), axis=1)
        areas = 2.0 * self._half_widths.max(axis=1) * steps
        caps = len(self._caps)
        padded = np.concatenate([np.zeros(caps), areas, np.zeros(caps)])
        return np.repeat(padded / len(self._section), len(self._section))

    def level_share(self, nodes: FloatArray) -> FloatArray:
        """Share of the length seen from above, at each point of the surface; small where the rod is upright."""
        tangents = unit(self._tangent_weights @ nodes)
        share = np.maximum(np.hypot(tangents[:, 0], tangents[:, 1]), _LEAST_SHARE)
        return np.repeat(share[self._ring_samples], len(self._section))

    def on_surface(self, nodal: FloatArray) -> FloatArray:
        """Interpolate nodal values, shape (nodes,), to the points of the surface."""
        values = np.clip(self._position_weights @ nodal, nodal.min(), nodal.max())
        return np.repeat(values[self._ring_samples], len(self._section))


def unit(vectors: FloatArray) -> FloatArray:
    """Return vectors of unit length, along the last axis."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, 1e-300), float)


def _subdivide(knots: FloatArray, count: int) -> FloatArray:
    fractions = np.arange(count) / count
    inner = knots[:-1, None] + np.diff(knots)[:, None] * fractions
    return np.append(inner.ravel(), knots[-1])


def _spline(knots: FloatArray, samples: FloatArray, closed: bool) -> tuple[FloatArray, FloatArray]:
    """Matrices that take the nodes to the points and the tangents of a cubic spline at the samples.

    The spline is periodic, or its third derivative is continuous at the second and the last but one knot ("not a knot")
    [de Boor 1978, chapter IV]. The import of a package for splines takes longer than a first picture may.
    """
    nodes = len(knots) - 1 if closed else len(knots)
    values = np.eye(nodes)
    if closed:
        values = np.concatenate([values, values[:1]])
    steps = np.diff(knots)
    chords = np.diff(values, axis=0) / steps[:, None]
    slopes = _periodic_slopes(steps, chords) if closed else _open_slopes(steps, chords)

    piece = np.clip(np.searchsorted(knots, samples, side="right") - 1, 0, len(steps) - 1)
    step = steps[piece][:, None]
    u = (samples - knots[piece])[:, None] / step
    left, right, start, end = values[piece], values[piece + 1], slopes[piece], slopes[piece + 1]
    points = left + u**2 * (3.0 - 2.0 * u) * (right - left) + step * u * (1.0 - u) * ((1.0 - u) * start - u * end)
    tangents = (
        6.0 * u * (1.0 - u) * (right - left) / step + (1.0 - u) * (1.0 - 3.0 * u) * start + u * (3.0 * u - 2.0) * end
    )
    return points, tangents


def _open_slopes(steps: FloatArray, chords: FloatArray) -> FloatArray:
    """Slopes at the knots of a spline without an end condition but that of its second and last but one knot."""
    if len(steps) == 1:
        return np.repeat(chords, 2, axis=0)
    before, after = steps[:-1, None], steps[1:, None]
    if len(steps) == 2:  # a parabola
        middle = (after * chords[:1] + before * chords[1:]) / (before + after)
        return np.concatenate([2.0 * chords[:1] - middle, middle, 2.0 * chords[1:] - middle])
    right = 3.0 * (after * chords[:-1] + before * chords[1:])
    lower, diagonal, upper = steps[1:].copy(), 2.0 * (steps[:-1] + steps[1:]), steps[:-1].copy()
    (a, b), (y, z) = steps[:2], steps[-2:]
    first = ((3.0 * a + 2.0 * b) * b * chords[0] + a**2 * chords[1]) / (a + b)
    last = (z**2 * chords[-2] + (3.0 * z + 2.0 * y) * y * chords[-1]) / (y + z)
    # The conditions at the ends, b s0 + (a + b) s1 = first and its mirror image, taken off their neighbours.
    right[0] -= first
    right[-1] -= last
    diagonal[0], diagonal[-1] = a + b, y + z
    inner = _tridiagonal(lower, diagonal, upper, right)
    start, end = (first - (a + b) * inner[0]) / b, (last - (y + z) * inner[-1]) / y
    return np.concatenate([start[None], inner, end[None]])


def _periodic_slopes(steps: FloatArray, chords: FloatArray) -> FloatArray:
    """Slopes at the knots of a closed spline; the last knot is the first one.

    The corners of its cyclic matrix are a product of two vectors [Sherman and Morrison 1950].
    """
    before, after = np.roll(steps, 1), steps
    right = 3.0 * (after[:, None] * np.roll(chords, 1, axis=0) + before[:, None] * chords)
    diagonal = 2.0 * (before + after)
    top, bottom = after[0], before[-1]  # in the last column and in the first
    gamma = -diagonal[0]
    diagonal[0] -= gamma
    diagonal[-1] -= top * bottom / gamma
    column = np.zeros((len(steps), 1))
    column[0], column[-1] = gamma, bottom
    solved = _tridiagonal(after, diagonal, before, np.concatenate([right, column], axis=1))
    slopes, way = solved[:, :-1], solved[:, -1]
    share = (slopes[0] + top / gamma * slopes[-1]) / (1.0 + way[0] + top / gamma * way[-1])
    slopes = slopes - np.outer(way, share)
    return np.concatenate([slopes, slopes[:1]])


def _tridiagonal(lower: FloatArray, diagonal: FloatArray, upper: FloatArray, right: FloatArray) -> FloatArray:
    """Solve a diagonally dominant tridiagonal system for many right sides.

    Parameters
    ----------
    lower, diagonal, upper : ndarray of shape (n,)
        By rows: the first of `lower` and the last of `upper` are not used.
    right : ndarray of shape (n, m)

    Returns
    -------
    ndarray of shape (n, m)
    """
    solution, ratios, pivot = right.copy(), np.zeros(len(right)), diagonal[0]
    solution[0] /= pivot
    for row in range(1, len(right)):
        ratios[row - 1] = upper[row - 1] / pivot
        pivot = diagonal[row] - lower[row] * ratios[row - 1]
        solution[row] = (solution[row] - lower[row] * solution[row - 1]) / pivot
    for row in range(len(right) - 2, -1, -1):
        solution[row] -= ratios[row] * solution[row + 1]
    return solution


def _hats(knots: FloatArray, samples: FloatArray, period: float | None) -> FloatArray:
    """Matrix of piecewise linear interpolation from the knots to the samples, constant beyond them."""
    return np.stack([np.interp(samples, knots, row, period=period) for row in np.eye(len(knots))], axis=1)


def round_section(sides: int) -> tuple[FloatArray, FloatArray]:
    """Corners and normals of a circle of radius 1, counter-clockwise, shape (sides, 2)."""
    angles = 2.0 * np.pi * np.arange(sides) / sides
    corners = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return corners, corners


def rectangle_section() -> tuple[FloatArray, FloatArray]:
    """Corners and normals of a square of side 2. Every corner has a row for each of its faces, so edges stay sharp."""
    corners = np.array([[1, -1], [1, 1], [1, 1], [-1, 1], [-1, 1], [-1, -1], [-1, -1], [1, -1]], float)
    normals = np.repeat(np.array([[1, 0], [0, 1], [-1, 0], [0, -1]], float), 2, axis=0)
    return corners, normals


def end_caps(round_section: bool) -> FloatArray:
    """Rows of scale, offset along the rod in half widths, and lean of the normal; from the pole inwards."""
    if not round_section:
        return np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]])
    angles = 0.5 * np.pi * np.arange(_CAP_RINGS, 0, -1) / _CAP_RINGS
    return np.stack([np.cos(angles), np.sin(angles), np.sin(angles)], axis=1)


def ring_faces(rings: int, sides: int, closed: bool) -> npt.NDArray[np.int64]:
    """Quadrilaterals between rings of points, counter-clockwise from outside, shape (faces, 4)."""
    ring = np.arange(rings if closed else rings - 1)[:, None]
    side = np.arange(sides)[None]
    following, beside = (ring + 1) % rings, (side + 1) % sides
    corners = [ring * sides + side, ring * sides + beside, following * sides + beside, following * sides + side]
    return np.stack(corners, axis=-1).reshape(-1, 4)
