"""State of one tracked cable: prediction, search of the mask, and fit of the chain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from withe.perception.chain import Chain, Pulls
from withe.perception.mask_search import end_of_mask, search_normals
from withe.perception.plane import Plane
from withe.perception.rod_prior import RodPrior

__all__ = ["Tracked", "sample_points"]

Array = NDArray[np.float64]

_SAMPLES = 3  # normals per edge
_ROUNDS = 4  # greatest number of searches a frame
_NEWTON = 3  # iterations of Newton's method after a search
_FIRST_FITS = 5  # fits to the first frame, which start at rest
_SETTLED = 0.02  # step of a node at which a frame is done [px]
_HUBER = 4.0  # distance beyond which data pull with constant force [px]
_MATCHED = 3.0  # greatest distance from the mask of a visible node after the fit [px]
_END = 20.0  # weight of an end that the mask exceeds, relative to the data of a node
_END_INWARDS = 0.3  # weight of an end that exceeds the mask: the end may also be hidden
_MARGIN = 0.8  # greatest margin of a mask beyond the ends of a cable, relative to the width: ends may be round
_END_SCALE = 3.0  # distance at which this weight has fallen to a half [px]
_END_CLEAR = 1.2  # least distance of an end from other cables at which the mask shows it, relative to the width
_SAG = 0.02  # displacement of a visible node by its weight [px]
_CERTAIN = 0.25  # least certainty of a sample that makes a node visible
_RIVAL = 0.5  # lead over a rival prediction at which a centre is certain, relative to the width
_SELF = 4.0  # least distance along a cable of parts that may cross, relative to the width
_MEMORY = 0.5  # share of the curvature that is renewed in a frame, without a rod
_CALM = 0.9  # factor of the velocity of hidden nodes in a frame, without a rod
_INERTIA = 0.05  # stiffness of inertia over that of data at a node, without a rod
_BEND = 20.0  # the same for bending


def sample_points(nodes: Array) -> Array:
    """Return points along a chain, `_SAMPLES` an edge and the last node, shape (n, 2)."""
    edge, share = _places(len(nodes))
    return (1.0 - share[:, None]) * nodes[edge] + share[:, None] * nodes[edge + 1]


def _places(nodes: int) -> tuple[NDArray[np.intp], Array]:
    """Edges and shares of the samples."""
    place = np.arange(_SAMPLES * (nodes - 1) + 1)
    edge = np.minimum(place // _SAMPLES, nodes - 2)
    return edge, place / _SAMPLES - edge


class Tracked:
    """A cable that is tracked.

    Parameters
    ----------
    name : str
    x : ndarray of shape (nodes, 2)
        Nodes, in coordinates of the plane.
    length : float
        Length in these coordinates.
    width : float [px]
    rod : RodPrior or None
    plane : Plane
    step : float [s]
        Typical time between frames.
    """

    def __init__(
        self, name: str, x: Array, length: float, width: float, rod: RodPrior | None, plane: Plane, step: float
    ) -> None:
        self.name, self.x, self.length, self.width, self.rod, self.plane = name, x, length, width, rod, plane
        self.velocity = np.zeros_like(x)
        self.visible = np.ones(len(x), np.bool_)
        self.residual = 0.0
        spacing = length / (len(x) - 1)
        self.chain = _chain(rod, spacing, len(x), plane.scale, step)
        if rod is None:
            self.chain.set_curvature(_curvature(x, spacing))
        self.ahead = x
        self.predicted_pixels = plane.pixels(x)
        self.margins = [0.0, 0.0]  # length by which the mask exceeds either end in the first frame [px]

    def settle(self, mask: NDArray[np.uint8], others: list[Array], reach: int, step: float) -> None:
        """Fit the nodes to the first frame, and measure the margins of the mask, equal at both ends."""
        limit = _MARGIN * self.width
        excess = 0.5 * (float(np.linalg.norm(np.diff(self.x, axis=0), axis=1).sum()) - self.length)
        self.margins = [float(np.clip(excess, -limit, limit))] * 2
        for _ in range(_FIRST_FITS):
            self.predict(step)
            self.match(mask, None, others, reach, step)
            self.velocity[:] = 0.0
            samples = sample_points(self.plane.pixels(self.x))
            found = [end_of_mask(mask, tip, way, reach, self.width) for tip, way in _tips(samples)]
            crossed = any(
                self._is_crossed(np.stack([tip, tip + off * way]), end, samples, others)
                for end, ((tip, way), off) in enumerate(zip(_tips(samples), found, strict=True))
            )
            if np.isfinite(found).all() and not crossed:
                self.margins = [float(np.clip(np.mean(found), -limit, limit))] * 2

    def restart(self, x: Array) -> None:
        """Set the nodes to a trace, in the direction that is nearer to the last nodes."""
        if np.square(x[::-1] - self.x).sum() < np.square(x - self.x).sum():
            x = x[::-1].copy()
        self.x, self.velocity = x, np.zeros_like(x)
        self.visible[:] = True
        self.residual = 0.0
        if self.rod is None:
            self.chain.set_curvature(_curvature(x, self.chain.spacing))

    def hold(self, x: Array) -> None:
        """Stay at positions, at rest."""
        self.x, self.velocity = x, np.zeros_like(x)
        self.visible[:] = False
        self.residual = float("nan")

    def predict(self, step: float) -> None:
        """Predict the nodes after a step [s]."""
        self.ahead = self.x + step * self.velocity
        self.predicted_pixels = self.plane.pixels(self.ahead)

    def match(
        self, mask: NDArray[np.uint8], covered: NDArray[np.uint8] | None, others: list[Array], reach: int, step: float
    ) -> None:
        """Fit the chain to the mask."""
        x, last = self.ahead, self.x
        expected = sample_points(self.predicted_pixels)
        inertia = self._inertia(step)
        edge, share = _places(len(x))
        offset = np.full(len(edge), np.nan)
        for search in range(_ROUNDS):
            pulls, offset = self._pulls(mask, covered, x, expected, others, edge, share, reach)
            before = x
            x = self.chain.settle(x, self.ahead, inertia, pulls, _NEWTON, _SETTLED)
            if search > 0 and np.abs(x - before).max() < 5.0 * _SETTLED:
                break
        pulls, offset = self._pulls(mask, covered, x, expected, others, edge, share, reach)
        matched = np.abs(offset) < _MATCHED
        self.residual = float(np.sqrt(np.mean(offset[matched] ** 2))) if matched.any() else float("nan")
        near = np.concatenate([[False], matched, [False]])
        by_sample = near[:-2] | near[1:-1] | near[2:]
        self.visible = by_sample[::_SAMPLES].copy()
        if self.visible.sum() < 3:
            self.visible[:] = False
        self.velocity = (x - last) / step
        self.x = x
        if self.rod is None:
            self.velocity[~self.visible] *= _CALM
            self._remember()

    def _inertia(self, step: float) -> Array:
        """Stiffness of inertia of each node."""
        if self.rod is None:
            return np.full(len(self.x), _INERTIA)
        return np.asarray(self.chain.masses * (1.0 / step**2 + self.chain.damping / step))

    def _remember(self) -> None:
        """Renew the natural curvature of parts that are seen."""
        seen = self.visible.copy()
        seen[1:] &= self.visible[:-1]
        seen[:-1] &= self.visible[1:]
        change = _MEMORY * (_curvature(self.x, self.chain.spacing) - self.chain.curvature)
        self.chain.set_curvature(self.chain.curvature + np.where(seen, change, 0.0))

    def _pulls(
        self,
        mask: NDArray[np.uint8],
        covered: NDArray[np.uint8] | None,
        x: Array,
        expected: Array,
        others: list[Array],
        edge: NDArray[np.intp],
        share: Array,
        reach: int,
    ) -> tuple[Pulls, Array]:
        """Search the mask about a shape; also return the offsets of the centres that count [px]."""
        points, slopes = self.plane.pixels_and_slopes(x)
        samples = (1.0 - share[:, None]) * points[edge] + share[:, None] * points[edge + 1]
        tangents = np.gradient(samples, axis=0)
        tangents /= np.maximum(np.linalg.norm(tangents, axis=1), 1e-9)[:, None]
        normals = np.column_stack([-tangents[:, 1], tangents[:, 0]])
        offset, certainty = self._centres(mask, covered, samples, normals, expected, others, reach)
        good = certainty > 0.0
        weight = certainty[good] * self.chain.data / _SAMPLES
        weight *= np.minimum(1.0, _HUBER / np.maximum(np.abs(offset[good]), 1e-9))
        on = (1.0 - share[:, None]) * x[edge] + share[:, None] * x[edge + 1]
        slope = slopes[edge[good] + np.rint(share[good]).astype(np.intp)]
        axis = np.einsum("nij,ni->nj", slope, normals[good])
        size = np.maximum(np.linalg.norm(axis, axis=1), 1e-9)
        axis /= size[:, None]
        target = on[good] + (offset[good] / size)[:, None] * axis
        pulls = Pulls(edge[good], share[good], axis, target, weight)
        offset[certainty < _CERTAIN] = np.nan
        return self._with_ends(pulls, mask, covered, x, samples, slopes, others, reach), offset

    def _centres(
        self,
        mask: NDArray[np.uint8],
        covered: NDArray[np.uint8] | None,
        samples: Array,
        normals: Array,
        expected: Array,
        others: list[Array],
        reach: int,
    ) -> tuple[Array, Array]:
        """Return the offset of the cable at each sample and its certainty, 0 to 1.

        Another cable, or another part of this cable, explains a centre of the mask if its prediction is nearer. Of the
        remaining centres, the one nearest to the prediction counts.
        """
        seen = search_normals(mask, covered, samples, normals, reach, self.width)
        found = samples[seen.row] + seen.offset[:, None] * normals[seen.row]
        off = np.abs(seen.offset - ((expected - samples) * normals).sum(axis=1)[seen.row])
        rival = np.full(len(off), np.inf)
        for points in others:
            rival = np.minimum(rival, _nearest(found, points))
        places = np.arange(len(samples))
        apart = np.abs(seen.row[:, None] - places[None]) * self.length / len(samples)
        own = _squares(found, expected)
        own[apart < _SELF * self.width] = np.inf
        rival = np.minimum(rival, np.sqrt(np.maximum(own.min(axis=1, initial=np.inf), 0.0)))
        certainty = seen.weight * np.clip((rival - off) / (_RIVAL * self.width), 0.0, 1.0)
        kept = np.flatnonzero(certainty > 0.0)
        row = seen.row[kept]
        order = np.lexsort((off[kept], row))
        best = kept[order][np.flatnonzero(np.diff(row[order], prepend=-1))]
        offsets, certainties = np.zeros(len(samples)), np.zeros(len(samples))
        offsets[seen.row[best]] = seen.offset[best]
        certainties[seen.row[best]] = certainty[best]
        return offsets, certainties

    def _is_crossed(self, ends: Array, end: int, samples: Array, others: list[Array]) -> bool:
        """Return True if another cable, or another part of this one, passes an end: its mask hides the end.

        `end`: 0 for the first end, 1 for the last.
        """
        far = max(_SAMPLES, round(_SELF * self.width / self.length * len(samples)))
        own = samples[far:] if end == 0 else samples[:-far]
        return any(bool((_nearest(ends, points) < _END_CLEAR * self.width).any()) for points in (*others, own))

    def _with_ends(
        self,
        pulls: Pulls,
        mask: NDArray[np.uint8],
        covered: NDArray[np.uint8] | None,
        x: Array,
        samples: Array,
        slopes: Array,
        others: list[Array],
        reach: int,
    ) -> Pulls:
        """Add the pulls on both ends along the cable."""
        count = len(x)
        edges, shares, axes, targets, weights = [], [], [], [], []
        for end, (tip, direction) in enumerate(_tips(samples)):
            node, edge, share = (0, 0, 0.0) if end == 0 else (count - 1, count - 2, 1.0)
            off = end_of_mask(mask, tip, direction, reach, self.width)
            if not np.isfinite(off) or self._is_crossed(np.stack([tip, tip + off * direction]), end, samples, others):
                continue
            if covered is not None and _is_covered(covered, tip + (off + 2.0) * direction):
                continue
            off -= self.margins[end]
            axis = slopes[node].T @ direction
            size = max(float(np.hypot(*axis)), 1e-9)
            axis /= size
            # With known covers, an end inside the chain is an end; otherwise something may hide the rest.
            if off >= 0.0 or covered is not None:
                weight = _END * min(1.0, _HUBER / max(abs(off), 1e-9))
            else:
                weight = _END_INWARDS / (1.0 + (off / _END_SCALE) ** 2) ** 2
            edges.append(edge)
            shares.append(share)
            axes.append(axis)
            targets.append(x[node] + off / size * axis)
            weights.append(weight * self.chain.data)
        if not edges:
            return pulls
        return Pulls(
            np.append(pulls.edge, edges).astype(np.intp),
            np.append(pulls.share, shares),
            np.vstack([pulls.axis, axes]),
            np.vstack([pulls.target, targets]),
            np.append(pulls.weight, weights),
        )


def _squares(points: Array, line: Array) -> Array:
    """Squares of distances between points and samples of a line, shape (points, samples)."""
    return np.asarray((points**2).sum(axis=1)[:, None] + (line**2).sum(axis=1) - 2.0 * points @ line.T)


def _nearest(points: Array, line: Array) -> Array:
    """Distance of each point from the nearest sample of a line."""
    return np.asarray(np.sqrt(np.maximum(_squares(points, line).min(axis=1, initial=np.inf), 0.0)))


def _tips(samples: Array) -> list[tuple[Array, Array]]:
    """Points and outward directions of both ends."""
    tips = []
    for tip, inner in ((samples[0], samples[_SAMPLES]), (samples[-1], samples[-1 - _SAMPLES])):
        way = tip - inner
        tips.append((tip, way / max(float(np.hypot(*way)), 1e-9)))
    return tips


def _is_covered(covered: NDArray[np.uint8], point: Array) -> bool:
    x, y = (int(v) for v in np.rint(point))
    return 0 <= y < covered.shape[0] and 0 <= x < covered.shape[1] and bool(covered[y, x])


def _chain(rod: RodPrior | None, spacing: float, count: int, scale: float, step: float) -> Chain:
    """Return the chain of a rod, with stiffnesses in N/m, or one with the stiffness 1 of data."""
    if rod is None:
        return Chain(spacing, _BEND, 0.0, np.zeros(2), 0.0, np.zeros(count), 1.0)
    metric = spacing / scale
    bend = rod.bend_stiffness / metric**3
    mass = rod.line_density * metric
    load = mass * scale * np.array(rod.gravity)
    data = 4.0 * bend + float(np.hypot(*load)) / _SAG + 10.0 * mass / step**2
    curvature = np.full(count, rod.natural_curvature / scale)
    return Chain(spacing, bend, mass, load, rod.damping, curvature, data)


def _curvature(x: Array, spacing: float) -> Array:
    """Curvature at the nodes of a chain, 0 at both ends, shape (nodes,)."""
    bend = x[:-2] - 2.0 * x[1:-1] + x[2:]
    way = x[2:] - x[:-2]
    turned = np.column_stack([-way[:, 1], way[:, 0]])
    result = np.zeros(len(x))
    result[1:-1] = 2.0 / spacing * (bend * turned).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-12)
    return result
