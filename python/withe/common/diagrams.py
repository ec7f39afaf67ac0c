"""Diagrams of knots: crossings of a closed curve seen from one side, in their order along the curve.

A diagram determines two invariants of the knot: the Alexander polynomial [Alexander 1928, by Fox's calculus], and the
signature, from a checkerboard surface [Gordon and Litherland 1978].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["Diagram", "alexander", "closed_far_away", "diagram", "signature"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
_FAR = 20.0  # sizes of an open curve, at which its ends are joined
_VIEW_SEED = 7  # seed of random view directions, none of which is special
_VIEWS = 50
_ROUND = 0.2  # greatest distance of a coefficient of a polynomial from an integer


@dataclass(frozen=True)
class Diagram:
    """Crossings by number, and passages through them along the curve.

    Attributes
    ----------
    crossing : ndarray of shape (2 crossings,)
        Crossing of each passage.
    over : ndarray of bool, shape (2 crossings,)
        True if the passage is above the other one.
    sign : ndarray of shape (crossings,)
        1 if the lower strand goes to the left of the upper strand's direction, else -1.
    """

    crossing: IntArray
    over: npt.NDArray[np.bool_]
    sign: IntArray

    def passages(self) -> tuple[IntArray, IntArray]:
        """Return for each crossing its upper and its lower passage."""
        count = len(self.sign)
        above, below = np.empty(count, int), np.empty(count, int)
        above[self.crossing[self.over]] = np.flatnonzero(self.over)
        below[self.crossing[~self.over]] = np.flatnonzero(~self.over)
        return above, below


def closed_far_away(points: FloatArray) -> FloatArray:
    """Join the ends of an open curve on the outside, straight away from its middle and around at a distance, (n, 3)."""
    middle = points.mean(0)
    size = float(np.linalg.norm(points - middle, axis=1).max())
    ways = []
    for end, inner in ((points[-1], points[-2]), (points[0], points[1])):
        way = end - middle
        if np.linalg.norm(way) < 1e-6 * size:
            way = end - inner
        ways.append(way / np.linalg.norm(way))
    share = np.linspace(0.0, 1.0, 33)[:, None]
    between = (1.0 - share) * ways[0] + share * ways[1]
    aside = np.cross(ways[0], ways[1])
    if np.linalg.norm(aside) < 1e-3:  # opposite or equal ends: round by any side
        aside = np.cross(ways[0], np.eye(3)[np.abs(ways[0]).argmin()])
    between = between + np.sin(np.pi * share) * 0.3 * aside / np.linalg.norm(aside)
    around = middle + _FAR * size * between / np.linalg.norm(between, axis=1)[:, None]
    return np.concatenate([points, around])


def diagram(points: FloatArray) -> Diagram:
    """Return the view of a closed curve, shape (n, 3), with the fewest crossings among some views."""
    random = np.random.default_rng(_VIEW_SEED)
    found = None
    for _ in range(_VIEWS):
        axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
        axes[:, 0] *= np.sign(np.linalg.det(axes))
        seen = _seen(points @ axes)
        if found is None or len(seen.sign) < len(found.sign):
            found = seen
    assert found is not None
    return found


def _seen(points: FloatArray) -> Diagram:
    """The diagram from above."""
    start, way = points, np.roll(points, -1, axis=0) - points
    count = len(points)
    first, second = np.triu_indices(count, 2)
    near = (first == 0) & (second == count - 1)
    first, second = first[~near], second[~near]
    apart = start[second, :2] - start[first, :2]
    turn = _cross(way[first], way[second])
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (apart[:, 0] * way[second, 1] - apart[:, 1] * way[second, 0]) / turn
        other = (apart[:, 0] * way[first, 1] - apart[:, 1] * way[first, 0]) / turn
    meet = (along >= 0) & (along < 1) & (other >= 0) & (other < 1)
    first, second, along, other, turn = first[meet], second[meet], along[meet], other[meet], turn[meet]
    above = start[first, 2] + along * way[first, 2] > start[second, 2] + other * way[second, 2]
    number = np.arange(len(first))
    place = np.concatenate([first + along, second + other])
    order = np.argsort(place)
    return Diagram(
        np.concatenate([number, number])[order],
        np.concatenate([above, ~above])[order],
        np.where(above, np.sign(turn), -np.sign(turn)).astype(int),
    )


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def alexander(found: Diagram) -> IntArray:
    """Return the coefficients of the Alexander polynomial, from the lowest power on; they sum to 1.

    Each crossing relates its upper arc to the two arcs below it. A minor of these relations is the polynomial, up to a
    power of t and a sign. Its values at roots of unity determine the coefficients.

    Raises
    ------
    ValueError
        Too many crossings: rounding hides the coefficients.
    """
    count = len(found.sign)
    if count < 3:
        return np.array([1])
    above, below = found.passages()
    arc = np.cumsum(~found.over) % count  # a passage below begins the next one
    after, before, top = arc[below], (arc[below] - 1) % count, arc[above]
    row = np.arange(count)
    values = np.empty(count + 1, complex)
    for k, t in enumerate(np.exp(2j * np.pi * np.arange(count + 1) / (count + 1))):
        matrix = np.zeros((count, count), complex)
        np.add.at(matrix, (row, top), 1.0 - t)
        np.add.at(matrix, (row, np.where(found.sign > 0, before, after)), t)
        np.add.at(matrix, (row, np.where(found.sign > 0, after, before)), -1.0)
        values[k] = np.linalg.det(matrix[1:, 1:])
    numbers = np.fft.fft(values).real / (count + 1)
    whole = np.round(numbers).astype(int)
    if np.abs(numbers - whole).max() > _ROUND or abs(whole.sum()) != 1:
        raise ValueError(
            f"points must have fewer crossings, got {count}: rounding errors would exceed the coefficients of the "
            "polynomial"
        )
    used = np.flatnonzero(whole)
    return np.asarray(whole.sum() * whole[used[0] : used[-1] + 1])


def signature(found: Diagram) -> int:
    """Return the signature of the knot.

    Faces of the diagram are coloured like a chessboard. The white faces determine Goeritz's form. The result is its
    signature, minus the crossings where the black surface cannot follow the direction of the curve. With these signs
    the right-handed trefoil has -2.
    """
    count = len(found.sign)
    if count < 3:
        return 0
    darts, faces = _faces(found)
    white = _white(faces)
    names = {int(face): k for k, face in enumerate(np.unique(faces[white[faces]]))}
    form, correction = np.zeros((len(names), len(names))), 0
    for crossing in range(count):
        corners = faces[darts[crossing]]  # the face to the left of each, counterclockwise from the way out above
        swept = bool(white[corners[0]])  # by the upper strand as it turns to the left
        a, b = (names[int(face)] for face in (corners[[0, 2]] if swept else corners[[1, 3]]))
        kind = 1 if swept else -1
        if a != b:
            form[[a, b], [b, a]] -= kind
            form[[a, b], [a, b]] += kind
        ahead = swept if found.sign[crossing] > 0 else not swept  # white lies between both ways out
        correction += 0 if ahead else kind
    sizes = np.linalg.eigvalsh(form[1:, 1:])
    return int(correction + (sizes < -1e-9).sum() - (sizes > 1e-9).sum())


def _faces(found: Diagram) -> tuple[IntArray, IntArray]:
    """Darts that leave each crossing, counterclockwise, shape (crossings, 4), and the face to the left of each dart.

    Dart 2 e leaves the passage e forwards, dart 2 e + 1 the passage after it backwards, along the same edge e.
    """
    count = len(found.crossing)
    above, below = found.passages()
    out = [2 * above, 2 * below]
    back = [2 * ((passage - 1) % count) + 1 for passage in (above, below)]
    left = np.stack([out[0], out[1], back[0], back[1]], 1)
    right = np.stack([out[0], back[1], back[0], out[1]], 1)
    darts = np.where(found.sign[:, None] > 0, left, right)
    clockwise = np.empty(2 * count, int)
    clockwise[darts] = np.roll(darts, 1, axis=1)
    following = clockwise[np.arange(2 * count) ^ 1]  # at the other end, the next one to the left
    faces = np.full(2 * count, -1)
    for dart in range(2 * count):
        face = faces.max() + 1
        while faces[dart] < 0:
            faces[dart] = face
            dart = following[dart]
    return darts, faces


def _white(faces: IntArray) -> npt.NDArray[np.bool_]:
    """Which faces are white, so that faces on both sides of an edge differ."""
    colour = np.zeros(faces.max() + 1, int)
    colour[0] = 1
    todo = [0]
    while todo:
        face = todo.pop()
        for other in faces[np.flatnonzero(faces == face) ^ 1]:
            if colour[other] == 0:
                colour[other] = -colour[face]
                todo.append(int(other))
    return np.asarray(colour > 0)
