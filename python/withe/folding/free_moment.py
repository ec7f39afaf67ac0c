"""Paths of a jaw that turns the end of the sheet freely. Any moment is allowed; the curvature is bounded instead.

Three numbers name an equilibrium: R and H, the forces of the table at the lift-off point, and the suspended length.
Equilibria with H = 0 need no friction, so the lying part does not slide even on a slippery table. These equilibria form
one connected surface with a gentle part (R about 1.5) and a folded part (R about 4.9). All quantities are in units of
Lgb and w.

Bending alone determines short suspended parts, whose forces grow as 1 / length. For a suspended length below 1 the
lattice therefore stores R and H times the length.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product

import numpy as np
import numpy.typing as npt

from withe.folding.sheets import Elastica, at_forces, at_poses, forces_of, join, of_other, poses_of, take
from withe.folding.widths import EVEN, Width

__all__ = ["Holding", "Lattice", "Way", "forces_at", "goals", "make_lattice", "smoothed", "way_to"]

FloatArray = npt.NDArray[np.float64]
_SLOPE = 0.2  # slope of the path of an edge that comes down
_STEEPEST = 5.5  # [rad] of an edge; at 4.7 it points straight down, at 6.3 it would lie under the sheet
_TURN = 0.5  # [Lgb/rad] lengths that angles count as
_SHORTEST = 0.05  # [Lgb]
_NEAR = 1.2  # cells
_THIN = 0.2  # relative to a cell
_BEST = 3  # goals that are looked at more closely


@dataclass(frozen=True)
class Holding:
    """A sheet and its jaw [Lgb], and the largest curvature of the sheet [1/Lgb].

    `length` is the length of the sheet from the inner edge of the jaw on, and `width` its width there. `share` is the
    relative uncertainty of Lgb. On the way to a `goal`, which is a position of the outer edge, the height of the edge
    over the sheet is at least the remaining distance times a slope, and at least `clearance`. An edge that grazes the
    sheet pushes it if the jaw is off by a small amount.
    """

    length: float
    depth: float
    finger: float
    thickness: float
    curvature: float
    share: float
    width: Width = EVEN
    clearance: float = 0.0
    goal: float = np.inf

    def outer(self, sheet: Elastica) -> tuple[FloatArray, FloatArray]:
        """Return x of the outer edge, from its position in the flat sheet, and its height above the least allowed."""
        x = sheet.x + self.depth * (1 - np.cos(sheet.angle))
        z = sheet.z + self.depth * np.sin(sheet.angle)
        return x, z - self.thickness - self.finger * np.abs(np.cos(sheet.angle))

    def ratio(self, sheet: Elastica) -> FloatArray:
        """Friction coefficient below which the sheet slides."""
        lying = self.width.lying(sheet.suspended, self.length)
        return np.asarray(np.abs(sheet.tangential_force) / (sheet.normal_force + lying))

    def worst_ratio(self, sheet: Elastica) -> FloatArray:
        """Greatest `ratio` at these poses if Lgb changes by the share; infinite if that sheet has no stable pose."""
        worst = self.ratio(sheet)
        for factor in (1 - self.share, 1 + self.share) if self.share > 0 else ():
            it = replace(self, length=self.length / factor, width=self.width.of_other(factor))
            other = at_poses(poses_of(sheet) / [factor, factor, 1.0], of_other(forces_of(sheet), factor), it.width)
            ratio = it.ratio(other)
            worst = np.maximum(worst, np.where(other.valid & other.stable, ratio, np.inf))
        return worst

    def has_room(self, sheet: Elastica, least: float = -1e-9) -> npt.NDArray[np.bool_]:
        """Return True if an edge that looks back is higher above the table than the fingers and `least` need."""
        x, room = self.outer(sheet)
        above = np.clip(_SLOPE * (self.goal - x), 0.0, self.clearance)
        return np.asarray((sheet.angle <= 0.5 * np.pi) | (room >= least + above))

    def bearable(self, sheet: Elastica) -> npt.NDArray[np.bool_]:
        """Return True if the pose is possible for sheet and jaw, and the curvature is within its bound."""
        fits = (sheet.suspended < self.length) & (sheet.angle < _STEEPEST) & (sheet.max_curvature <= self.curvature)
        return sheet.valid & sheet.stable & fits & self.has_room(sheet)


def forces_at(places: FloatArray) -> FloatArray:
    """Forces and lengths from places in the lattice: R and H scaled, lifted length."""
    scale = np.minimum(places[..., 2:], 1.0)
    return np.concatenate([places[..., :2] / scale, places[..., 2:]], axis=-1)


def places_at(forces: FloatArray) -> FloatArray:
    """Undo `forces_at`."""
    scale = np.minimum(forces[..., 2:], 1.0)
    return np.concatenate([forces[..., :2] * scale, forces[..., 2:]], axis=-1)


@dataclass(frozen=True)
class Lattice:
    """Equilibria on a grid of places; invalid equilibria have an infinite ratio.

    Attributes
    ----------
    axes : tuple of three arrays
    sheet : Elastica
        Arrays of shape (nodes,).
    ratio : ndarray of shape (nodes,)
        Needed friction, for the worst Lgb.
    edges : ndarray of shape (edges, 2)
    lengths : ndarray of shape (edges,)
    """

    axes: tuple[FloatArray, FloatArray, FloatArray]
    sheet: Elastica
    ratio: FloatArray
    edges: npt.NDArray[np.intp]
    lengths: FloatArray


def _ways(first: Elastica, second: Elastica) -> FloatArray:
    turn = _TURN * (second.angle - first.angle)
    return np.asarray(np.sqrt((second.x - first.x) ** 2 + (second.z - first.z) ** 2 + turn**2))


@lru_cache(maxsize=16)
def make_lattice(holding: Holding, pulls: bool, most: float = np.inf, fine: int = 1) -> Lattice:
    """Solve all nodes: only H = 0, or, with `pulls`, H of both signs, as far as the needed friction is below `most`.

    `fine` divides the spacings.
    """
    count = (20 if pulls else 48) * fine
    # Without weight forces grow as the square of the curvature that they make.
    greatest = max(2.4 * holding.curvature, 0.75 * holding.curvature**2)
    normal = np.linspace(greatest / count, greatest, count)
    widest = min(greatest / 2, most * (holding.length + 3.0))
    sideways = np.linspace(-widest, widest, count + 1) if pulls else np.zeros(1)
    short = np.geomspace(_SHORTEST, 0.5, count // 6, endpoint=False)
    lifted = np.concatenate([short, np.linspace(0.5, holding.length * (1 - 1e-6), count)])
    axes = (normal, sideways, lifted)
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    sheet = at_forces(forces_at(places).reshape(-1, 3))
    good = holding.bearable(sheet)
    good[good] = holding.ratio(take(sheet, good)) <= most
    ratio = np.full(len(good), np.inf)
    some = take(sheet, good)
    ratio[good] = holding.worst_ratio(some)
    edges = _neighbours(places.shape[:3], np.isfinite(ratio))
    lengths = _ways(take(sheet, edges[:, 0]), take(sheet, edges[:, 1]))
    return Lattice(axes, sheet, ratio, edges, lengths)


def _neighbours(shape: tuple[int, ...], good: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    """Pairs of good nodes next to each other, also over corners."""
    name = np.arange(np.prod(shape)).reshape(shape)
    pairs = []
    for step in product((-1, 0, 1), repeat=3):
        if step <= (0, 0, 0):
            continue
        near = name[tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(step, shape, strict=True))].ravel()
        far = name[tuple(slice(max(0, s), n + min(0, s)) for s, n in zip(step, shape, strict=True))].ravel()
        both = good[near] & good[far]
        pairs.append(np.stack([near[both], far[both]], axis=1))
    return np.concatenate(pairs)


def goals(lattice: Lattice, holding: Holding, x: float) -> Elastica:
    """Equilibria whose outer edge is at x and whose fingers rest on the sheet there, near all nodes next to such poses.

    They are points of curves, in no order. If only H = 0 is allowed, they are a few points, which are among the others
    too. The least ratio is accurate to much less than a cell. Apart from the ratio, the poses may be impossible.
    """
    near = _next_to_goals(lattice, holding, x)
    found = _on_goal(near, holding, x, len(lattice.axes[1]) > 1)
    if len(lattice.axes[1]) > 1:
        level = near[near[:, 1] == 0.0]
        found = np.concatenate(
            [_on_goal(level, holding, x, False), _least(_thinned(found, lattice), lattice, holding, x)]
        )
    return at_forces(forces_at(_thinned(found, lattice)))


def _cell(lattice: Lattice) -> FloatArray:
    """Size of one, where the lattice is even."""
    return np.array([axis[-1] - axis[-2] if len(axis) > 1 else 1.0 for axis in lattice.axes])


def _next_to_goals(lattice: Lattice, holding: Holding, x: float) -> FloatArray:
    """Places of nodes that are about a cell away, by the slopes that differences of neighbours give."""
    shape = tuple(len(axis) for axis in lattice.axes)
    over, room = (values.reshape(shape) for values in holding.outer(lattice.sheet))
    gap = np.stack([over - x, room], axis=-1)
    axes = [i for i in range(3) if shape[i] > 1]
    slopes = np.stack([np.gradient(gap, axis=i) for i in axes], axis=-1)  # per cell
    fits = np.isfinite(slopes).all(axis=(-2, -1)) & np.isfinite(gap).all(axis=-1)
    fits &= (lattice.sheet.angle > 0.5 * np.pi).reshape(shape)
    fits &= (lattice.sheet.max_curvature < 1.3 * holding.curvature).reshape(shape)
    index = np.argwhere(fits)
    step = np.einsum("nij,nj->ni", np.linalg.pinv(slopes[fits], rcond=1e-6), gap[fits])
    index = index[np.abs(step).max(axis=1) < _NEAR]
    return np.stack([axis[i] for axis, i in zip(lattice.axes, index.T, strict=True)], axis=1)


def _on_goal(places: FloatArray, holding: Holding, x: float, pulls: bool) -> FloatArray:
    """Return results of Newton's method from many places, with differences and the shortest steps.

    Places that do not converge are omitted. Without `pulls` H does not change.
    """
    free = [0, 1, 2] if pulls else [0, 2]
    moves = np.concatenate([np.zeros((1, 3)), 1e-6 * np.eye(3)[free]])
    places = places.copy()
    there = np.zeros(len(places), dtype=bool)
    left = np.arange(len(places))
    for _ in range(25):
        sheet = at_forces(forces_at(places[left, None] + moves), keep=True)
        gaps = np.stack(holding.outer(sheet), axis=-1) - [x, 0.0]
        good = np.isfinite(gaps).all(axis=(1, 2)) & (places[left, 2] > _SHORTEST)
        done = np.abs(gaps[:, 0]).max(axis=1) < 1e-9
        there[left[done & good]] = True
        left, gaps = left[good & ~done], gaps[good & ~done]
        if not len(left):
            break
        slopes = (gaps[:, 1:] - gaps[:, :1]).transpose(0, 2, 1) / 1e-6
        step = -np.einsum("nij,nj->ni", np.linalg.pinv(slopes, rcond=1e-9), gaps[:, 0])
        step *= np.minimum(1.0, 0.3 / np.maximum(np.abs(step).max(axis=1), 1e-12))[:, None]
        places[left[:, None], free] += step
    return places[there]


def _thinned(places: FloatArray, lattice: Lattice) -> FloatArray:
    """Return the places, with only the first of nearly equal ones."""
    cells = np.round(places / (_THIN * _cell(lattice)))
    return np.asarray(places[np.sort(np.unique(cells, axis=0, return_index=True)[1])])


def _least(places: FloatArray, lattice: Lattice, holding: Holding, x: float) -> FloatArray:
    """Return the places, and from the best ones on places of smaller and smaller ratio whose sheets are bearable."""

    def ratios(tried: FloatArray) -> FloatArray:
        sheet = at_forces(forces_at(tried))
        good = holding.bearable(sheet)
        ratio = np.full(len(tried), np.inf)
        ratio[good] = holding.ratio(take(sheet, good))
        return ratio

    ratio = ratios(places)
    if not np.isfinite(ratio).any():
        return places
    better = [places]
    for start in np.argsort(ratio)[:_BEST]:
        if not np.isfinite(ratio[start]):
            break
        place, least, reach = places[start], ratio[start], 0.5 * _cell(lattice)
        for _ in range(14):
            around = place + reach * np.concatenate([np.eye(3), -np.eye(3)])
            tried = _on_goal(around, holding, x, pulls=True)
            needed = ratios(tried)
            if len(tried) and needed.min() < least:
                place, least = tried[np.argmin(needed)], needed.min()
                better.append(place[None])
            else:
                reach = 0.4 * reach
    return np.concatenate(better)


@dataclass(frozen=True)
class Way:
    """Places from flat to a goal, and the greatest ratio on this path."""

    places: FloatArray
    ratio: float


def _goal_links(lattice: Lattice, goal: Elastica) -> tuple[npt.NDArray[np.intp], FloatArray]:
    """Edges from goals, named on from the lattice's nodes, to nodes around their places."""
    place = places_at(forces_of(goal))
    shape = tuple(len(axis) for axis in lattice.axes)
    pairs = []
    for g, row in enumerate(place):
        spans = []
        for axis, value in zip(lattice.axes, row, strict=True):
            middle = int(np.clip(np.searchsorted(axis, value), 0, len(axis) - 1))
            spans.append(range(max(0, middle - 2), min(len(axis), middle + 2)))
        names = [int(np.ravel_multi_index(index, shape)) for index in product(*spans)]
        pairs += [(name, len(lattice.ratio) + g) for name in names if np.isfinite(lattice.ratio[name])]
    edges = np.array(pairs, dtype=int).reshape(-1, 2)
    ends = take(goal, edges[:, 1] - len(lattice.ratio))
    return edges, _ways(take(lattice.sheet, edges[:, 0]), ends)


def way_to(lattice: Lattice, holding: Holding, goal: Elastica, goal_ratio: FloatArray, limit: float) -> Way | None:
    """Shortest path, bends counted, whose ratio is at most the limit; otherwise the path of least greatest ratio.

    None if there is no path.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components, dijkstra

    count, goals_count = len(lattice.ratio), len(goal.x)
    flat, total = count + goals_count, count + goals_count + 1
    links, link_lengths = _goal_links(lattice, goal)
    shape = tuple(len(axis) for axis in lattice.axes)
    first = np.arange(count).reshape(shape)[:, :, 0].ravel()
    first = first[np.isfinite(lattice.ratio[first])]
    starts = np.stack([np.full_like(first, flat), first], axis=1)
    edges = np.concatenate([lattice.edges, links, starts])
    lengths = np.concatenate([lattice.lengths, link_lengths, np.full(len(first), _SHORTEST)])
    ratio = np.concatenate([lattice.ratio, goal_ratio, [0.0]])
    needed = ratio[edges].max(axis=1)
    ends = np.arange(count, flat)

    def open_to(bound: float) -> npt.NDArray[np.intp]:
        kept = edges[needed <= bound]
        graph = csr_array((np.ones(len(kept)), (kept[:, 0], kept[:, 1])), shape=(total, total))
        label = connected_components(graph, directed=False)[1]
        return np.asarray(ends[label[ends] == label[flat]])

    if not len(open_to(limit)):
        low, high = limit, 1e3
        if not len(open_to(high)):
            return None
        while high - low > 1e-4 * max(high, 0.01):
            middle = 0.5 * (low + high) if high < 2 else np.sqrt(max(low, 1e-3) * high)
            low, high = (low, middle) if len(open_to(middle)) else (middle, high)
        limit = high
    kept = needed <= limit
    bend = np.concatenate([lattice.sheet.max_curvature, goal.max_curvature, [0.0]]) / holding.curvature
    weight = lengths * (1.0 + np.nan_to_num(bend)[edges].mean(axis=1)) + 1e-9
    graph = csr_array((weight[kept], (edges[kept, 0], edges[kept, 1])), shape=(total, total))
    distance, before = dijkstra(graph, directed=False, indices=flat, return_predecessors=True)
    end = ends[np.argmin(distance[ends])]
    way = [int(end)]
    while before[way[-1]] != flat:
        way.append(int(before[way[-1]]))
    nodes = np.array(way[::-1])
    sheet = take(join(lattice.sheet, goal), nodes)
    return Way(places_at(forces_of(sheet)), float(ratio[nodes].max()))


def smoothed(way: Way, holding: Holding, limit: float) -> FloatArray:
    """Dense places of a path without the corners of its lattice; the ends and the bounds of the path are kept."""
    from scipy.ndimage import gaussian_filter1d

    sheet = at_forces(forces_at(way.places))
    first, second = take(sheet, slice(0, -1)), take(sheet, slice(1, None))
    travelled = np.concatenate([[0.0], np.cumsum(_ways(first, second) + 1e-6)])
    count = 300
    even = np.linspace(0.0, travelled[-1], count)
    dense = np.stack([np.interp(even, travelled, way.places[:, i]) for i in range(3)], axis=1)
    for sigma in (12.0, 6.0, 3.0, 1.5):
        pad = int(4 * sigma)
        padded = np.concatenate([2 * dense[0] - dense[pad:0:-1], dense, 2 * dense[-1] - dense[-2 : -pad - 2 : -1]])
        smooth = gaussian_filter1d(padded, sigma, axis=0)[pad : pad + count]
        if (smooth[:, 2] <= 0).any():
            continue
        sheet = at_forces(forces_at(smooth), keep=True)
        loose = replace(
            holding,
            finger=0.0,
            thickness=0.0,
            clearance=0.5 * holding.clearance,
            curvature=1.02 * holding.curvature,
        )
        if loose.bearable(sheet).all() and holding.worst_ratio(sheet).max() <= 1.05 * max(limit, way.ratio) + 1e-9:
            return np.asarray(smooth)
    return dense
