"""Pictures of cables with known centrelines and order, for tests and benchmarks.

Masks are exact: a pixel belongs to a cable if its centre is within half a width of the centreline. Ends are cut
straight. Pictures show round cables under a lamp, with grain, and with shadows of upper cables on lower ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from withe.common.short_repr import ShortRepr
from withe.perception.disturbances import add_frays, add_specks, strip_across

__all__ = ["SyntheticScene", "TrueCrossing", "make_case", "render", "render_mask"]

CASES = (
    "crossing 90",
    "crossing 60",
    "crossing 45",
    "crossing 30",
    "crossing 20",
    "crossing 15",
    "ragged 60",
    "ragged 30",
    "three at a point",
    "T",
    "gap",
    "loop",
    "self",
    "six cables",
    "curls",
    "specks",
)

Array = NDArray[np.float64]


@dataclass
class TrueCrossing:
    """Crossing of two strands: its place, and the cable and arc length [px] of either strand."""

    point: Array
    over: tuple[int, float]
    under: tuple[int, float]


@dataclass(repr=False)
class SyntheticScene(ShortRepr):
    """A mask and the truth behind it.

    Attributes
    ----------
    mask : ndarray of bool, shape (height, width)
    centrelines : list of ndarray of shape (n, 2) [px]
    widths : list of float [px]
    closed : list of bool
    crossings : list of TrueCrossing
    cut : list of bool
        True for cables with straight ends, False for round ends.
    """

    mask: NDArray[np.bool_]
    centrelines: list[Array]
    widths: list[float]
    closed: list[bool]
    crossings: list[TrueCrossing] = field(default_factory=list)
    cut: list[bool] = field(default_factory=list)


def _arc(line: Array, closed: bool = False) -> Array:
    steps = np.diff(np.vstack([line, line[:1]]) if closed else line, axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])


def _segments(line: Array, closed: bool) -> tuple[Array, Array]:
    end = np.roll(line, -1, axis=0) if closed else line[1:]
    return (line if closed else line[:-1]), end


def _boxes(
    line: Array, closed: bool, radius: float, shape: tuple[int, int], cut: bool
) -> list[tuple[int, slice, slice, Array, Array]]:
    """For every segment the pixels around it: distance to it and place along it, from 0 to 1."""
    start, end = _segments(line, closed)
    tips = [] if closed else [(line[0], line[0] - line[3]), (line[-1], line[-1] - line[-4])]
    arc = _arc(line, closed)
    found = []
    for i, (a, b) in enumerate(zip(start, end, strict=True)):
        near_tip = min(arc[i], arc[-1] - arc[i + 1]) < 2 * radius
        low = np.floor(np.minimum(a, b) - radius).astype(int)
        high = np.ceil(np.maximum(a, b) + radius).astype(int) + 1
        x0, y0 = np.maximum(low, 0)
        x1, y1 = min(high[0], shape[1]), min(high[1], shape[0])
        if x0 >= x1 or y0 >= y1:
            continue
        y, x = np.mgrid[y0:y1, x0:x1]
        d = b - a
        t = ((x - a[0]) * d[0] + (y - a[1]) * d[1]) / max(d @ d, 1e-12)
        t = np.clip(t, 0, 1)
        distance = np.hypot(x - a[0] - t * d[0], y - a[1] - t * d[1])
        if cut and near_tip:
            for tip, outwards in tips:
                distance[
                    ((x - tip[0]) * outwards[0] + (y - tip[1]) * outwards[1] > 0)
                    & (np.hypot(x - tip[0], y - tip[1]) < 2 * radius)
                ] = np.inf
        found.append((i, slice(y0, y1), slice(x0, x1), distance, t))
    return found


def render_mask(
    centrelines: Sequence[Array],
    widths: Sequence[float],
    closed: Sequence[bool],
    shape: tuple[int, int],
    cut: Sequence[bool] | None = None,
) -> NDArray[np.bool_]:
    """Return the mask of cables with the given centrelines and widths [px]; ends are round if `cut` is False."""
    mask = np.zeros(shape, bool)
    for i, (line, width, ring) in enumerate(zip(centrelines, widths, closed, strict=True)):
        for _, rows, columns, distance, _ in _boxes(line, ring, width / 2 + 1, shape, cut is None or cut[i]):
            mask[rows, columns] |= distance <= width / 2
    return mask


def _smooth_noise(rng: np.random.Generator, shape: tuple[int, ...], sigma: float) -> Array:
    """Noise of unit variance, smoothed by a Gaussian of the given standard deviation [px]."""
    noise = rng.standard_normal(shape)
    reach = max(1, int(3 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel /= np.sqrt(np.sum(kernel**2))
    for axis in range(len(shape)):
        noise = np.apply_along_axis(np.convolve, axis, noise, kernel, "same")
    return noise


# Curves


def _grow(
    rng: np.random.Generator, start: Array, heading: float, length: float, bend: float, step: float = 1.0
) -> Array:
    """A random smooth curve; `bend` is the typical curvature [1/px], varying over some 80 px."""
    return _turned(start, heading, _curvatures(rng, int(length / step), bend, step), step)


def _curvatures(rng: np.random.Generator, count: int, bend: float, step: float = 1.0) -> Array:
    """Random smooth curvatures [1/px] of `count` steps."""
    reach = 3 * 80
    return _smooth_noise(rng, (count + 2 * reach,), 40 / step)[reach : reach + count] * bend


def _curled(rng: np.random.Generator, start: Array, heading: float, length: float, bend: float, scale: float) -> Array:
    """A random smooth curve with a loop of about one turn."""
    curvature = _curvatures(rng, int(length), bend)
    radius = rng.uniform(18, 45) * scale
    turn = min(int(2 * np.pi * radius * rng.uniform(0.9, 1.15)), len(curvature))
    first = int(rng.integers(0, len(curvature) - turn + 1))
    share = np.zeros(len(curvature))
    share[first : first + turn] = 1
    share = np.convolve(share, np.full(15, 1 / 15), "same")
    return _turned(start, heading, curvature * (1 - share) + share * rng.choice([-1, 1]) / radius, 1.0)


def _turned(start: Array, heading: float, curvature: Array, step: float) -> Array:
    """The curve with given curvatures [1/px] at its steps."""
    angle = heading + np.concatenate([[0.0], np.cumsum(curvature * step)])[:-1]
    steps = step * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.vstack([start, start + np.cumsum(steps, axis=0)])


def _through(rng: np.random.Generator, point: Array, heading: float, reach: tuple[float, float], bend: float) -> Array:
    """A curve through a point in a direction."""
    forward = _grow(rng, point, heading, reach[1], bend)
    backward = _grow(rng, point, heading + np.pi, reach[0], bend)
    return np.vstack([backward[:0:-1], forward])


def _crossings(
    lines: Sequence[Array], closed: Sequence[bool]
) -> list[tuple[Array, tuple[int, float], tuple[int, float], float]]:
    """Every crossing of the lines: point, (cable, arc) twice, and the angle [rad] between 0 and 90 degrees."""
    found = []
    for i, first in enumerate(lines):
        a, b = _segments(first, closed[i])
        for j in range(i, len(lines)):
            c, d = _segments(lines[j], closed[j])
            near_p, near_q = _near_segments(a, b, c, d)
            u, v, w = (b - a)[near_p], (d - c)[near_q], c[near_q] - a[near_p]
            with np.errstate(divide="ignore", invalid="ignore"):
                denominator = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
                s = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / denominator
                t = (w[:, 0] * u[:, 1] - w[:, 1] * u[:, 0]) / denominator
                hit = (s >= 0) & (s < 1) & (t >= 0) & (t < 1)
            if i == j:
                apart = np.abs(near_p - near_q)
                if closed[i]:
                    apart = np.minimum(apart, len(a) - apart)
                hit &= (apart > 2) & (near_p < near_q)
            arcs = _arc(first, closed[i]), _arc(lines[j], closed[j])
            for k in np.flatnonzero(hit):
                p, q = near_p[k], near_q[k]
                point = a[p] + s[k] * (b[p] - a[p])
                cosine = abs(u[k] @ v[k]) / np.linalg.norm(u[k]) / np.linalg.norm(v[k])
                first_arc = arcs[0][p] + s[k] * (arcs[0][p + 1] - arcs[0][p])
                second_arc = arcs[1][q] + t[k] * (arcs[1][q + 1] - arcs[1][q])
                found.append((point, (i, first_arc), (j, second_arc), float(np.arccos(min(1.0, cosine)))))
    return found


def _near_segments(a: Array, b: Array, c: Array, d: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Numbers of segments a-b and c-d whose middles are near enough for them to meet, in order."""
    from scipy.spatial import cKDTree

    reach = 0.5 * (np.linalg.norm(b - a, axis=1).max() + np.linalg.norm(d - c, axis=1).max())
    by_first = cKDTree(0.5 * (a + b)).query_ball_point(0.5 * (c + d), reach * (1.0 + 1e-9))
    pairs = np.array([(p, q) for q, near in enumerate(by_first) for p in near], np.intp).reshape(-1, 2)
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    return pairs[:, 0], pairs[:, 1]


def _is_clear(
    lines: Sequence[Array], widths: Sequence[float], closed: Sequence[bool], shape: tuple[int, int], angle: float
) -> bool:
    """No strands touch except where they cross, at no less than `angle` [rad]; ends are free."""
    crossings = _crossings(lines, closed)
    if any(found[3] < angle for found in crossings):
        return False
    for i, first in enumerate(lines):
        for j in range(i, len(lines)):
            reach = (widths[i] + widths[j]) / 2 + 4
            a, b = first[::2], lines[j][::2]
            near = np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]) < reach
            if i == j:
                k = np.arange(len(a))
                apart = np.abs(k[:, None] - k[None])
                if closed[i]:
                    apart = np.minimum(apart, len(a) - apart)
                near &= apart * 2 > 4 * reach
            for p, q in np.argwhere(near):
                place = 0.5 * (a[p] + b[q])
                if not any(
                    np.hypot(*(place - point)) < reach / 2 / np.sin(max(found_angle, 0.05) / 2) + 6
                    for point, _, _, found_angle in crossings
                ):
                    return False
    for i, line in enumerate(lines):
        if closed[i]:
            continue
        for end, other in ((line[0], line[min(30, len(line) - 1)]), (line[-1], line[-min(30, len(line))])):
            if not (3 <= end[0] < shape[1] - 3 and 3 <= end[1] < shape[0] - 3):
                continue
            for j, foreign in enumerate(lines):
                distance = np.hypot(*(foreign - end).T)
                if j == i:
                    own = max(45.0, 1.3 * np.hypot(*(other - end)))  # the end itself, however far apart rows are
                    distance = distance[np.hypot(*(foreign - other).T) > own]
                if len(distance) and distance.min() < 3 * max(widths):
                    return False
    return True


def _inside(line: Array, shape: tuple[int, int], margin: float) -> bool:
    low, high = line.min(axis=0), line.max(axis=0)
    return bool(low.min() > margin and high[0] < shape[1] - margin and high[1] < shape[0] - margin)


def _random_lines(
    case: str, rng: np.random.Generator, scale: float, shape: tuple[int, int]
) -> tuple[list[Array], list[bool], float] | None:
    """One attempt at the lines of a case; None where it went out of the picture."""
    height, width = shape
    center = np.array([width / 2, height / 2]) + rng.uniform(-40, 40, 2) * scale
    kind, _, number = case.rpartition(" ") if case[-1].isdigit() else (case, "", "")
    bend = rng.uniform(0.0, 1 / 120) / scale
    base = rng.uniform(0, 2 * np.pi)
    lines: list[Array] = []

    def reach() -> tuple[float, float]:
        before, after = rng.uniform(110, 190, 2) * scale
        return before, after

    if kind in ("crossing", "ragged", "specks"):
        degrees = float(number or rng.choice([60.0, 90.0]))
        headings = [base, base + np.radians(degrees)]
        bend *= min(1.0, degrees / 45)
        lines = [_through(rng, center, heading, reach(), bend) for heading in headings]
        return lines, [False, False], np.radians(0.7 * degrees)
    if kind == "three at a point":
        spread = base + np.radians([0, 60, 120]) + np.radians(rng.uniform(-8, 8, 3))
        lines = [_through(rng, center, heading, reach(), bend) for heading in spread]
        return lines, [False] * 3, np.radians(35)
    if kind == "T":
        through = _through(rng, center, base, reach(), bend)
        stem = _grow(rng, center, base + np.radians(rng.uniform(60, 120)), rng.uniform(110, 190) * scale, bend)
        return [through, stem], [False] * 2, 0.0
    if kind == "gap":
        line = _through(rng, center, base, reach(), bend)
        return [line], [False], 0.0
    if kind == "loop":
        t = np.linspace(0, 2 * np.pi, 500, endpoint=False)
        radius = rng.uniform(60, 140) * scale
        r = radius * (1 + sum(rng.uniform(-0.12, 0.12) * np.cos(k * t + rng.uniform(0, 6.3)) for k in (2, 3, 4)))
        return [center + np.stack([r * np.cos(t), r * np.sin(t)], axis=1)], [True], 0.0
    if kind == "self":
        t = np.linspace(-1, 1, 700)
        turn = np.pi + np.radians(rng.uniform(30, 120))
        angle = base + turn * (t / 0.45).clip(-1, 1) * rng.choice([-1, 1]) / 1 * 0.5 * 1.2
        angle = angle + rng.uniform(-0.5, 0.5) * t**2
        step = rng.uniform(0.8, 1.1) * scale
        line = np.cumsum(step * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
        line += center - line.mean(axis=0)
        return [line], [False], np.radians(25)
    if kind in ("six cables", "curls"):
        count, shortest = (6, 250) if kind == "six cables" else (4, 300)
        grow = _grow if kind == "six cables" else partial(_curled, scale=scale)
        for _ in range(400):
            start = rng.uniform([20, 20], [width - 20, height - 20])
            heading, length = rng.uniform(0, 6.3), rng.uniform(shortest, shortest + 300) * scale
            line = grow(rng, start, heading, length, 1 / 120 / scale)
            ok = _inside(line, shape, 14 * scale)
            if ok and _is_clear([*lines, line], [12 * scale] * count, [False] * count, shape, np.radians(25)):
                lines.append(line)
            if len(lines) == count:
                return lines, [False] * count, np.radians(25)
        return None
    raise ValueError(f"case must be one of {', '.join(CASES)}, got {case!r}")


def make_case(case: str, seed: int, scale: float = 1.0, shape: tuple[int, int] = (480, 640)) -> SyntheticScene:
    """Return a random scene of a kind.

    Parameters
    ----------
    case : str
        One of `CASES`.
    seed : int
        Equal seeds give equal scenes.
    scale : float
        Scale of lengths and widths. With 1 the cables are 8 to 12 px wide.
    shape : (int, int)
        Height and width of the picture [px].

    Raises
    ------
    ValueError
        An unknown case.

    Examples
    --------
    >>> scene = make_case("crossing 60", seed=1)
    >>> len(scene.centrelines), len(scene.crossings)
    (2, 1)
    """
    rng = np.random.default_rng([seed, sum(map(ord, case))])
    shape = (int(shape[0] * max(scale, 1)), int(shape[1] * max(scale, 1)))
    while True:
        attempt = _random_lines(case, rng, scale, shape)
        if attempt is None:
            continue
        lines, closed, angle = attempt
        if not all(_inside(line, shape, 14 * scale) for line in lines):
            continue
        widths = [float(rng.uniform(8, 12) * scale) for _ in lines]
        if case == "T":
            # The stem ends where the flank of the other cable is.
            through, stem = lines
            distance = np.min(np.hypot(*(stem[:, None] - through[None]).transpose(2, 0, 1)), axis=1)
            keep = np.argmax(distance >= widths[0] / 2)
            if (distance[keep + int(40 * scale) :] < 40 * scale * 0.7).any():
                continue
            lines = [through, stem[keep:]]
        elif not _is_clear(lines, widths, closed, shape, angle):
            continue
        crossings = _crossings(lines, closed) if case != "T" else []
        wanted = {"three at a point": 3, "self": 1, "gap": 0, "loop": 0}.get(case)
        if wanted is None and case.split()[0] in ("crossing", "ragged", "specks"):
            wanted = 1
        if wanted is not None and len(crossings) != wanted:
            continue
        break
    cut = [bool(rng.random() < 0.5) for _ in lines]
    mask = render_mask(lines, widths, closed, shape, cut)
    if case.startswith("ragged"):
        mask = add_frays(mask, rng, min(scale, 1.0))
    if case == "specks":
        mask = add_specks(mask, rng)
    if case == "gap":
        line = lines[0]
        at = int(len(line) * rng.uniform(0.3, 0.7))
        length = rng.uniform(4, 14) * min(scale, 1)
        mask &= ~strip_across(line, at, length, 3 * widths[0], shape)
    true = []
    for point, first, second, _ in crossings:
        over, under = (first, second) if rng.random() < 0.5 else (second, first)
        true.append(TrueCrossing(point, over, under))
    return SyntheticScene(mask, lines, widths, closed, true, cut)


# Pictures


def _heights(scene: SyntheticScene) -> list[Array]:
    """Height of every strand along its arc, so that the upper strand of every crossing is above."""
    heights = []
    for cable, (line, ring) in enumerate(zip(scene.centrelines, scene.closed, strict=True)):
        arc = _arc(line, ring)
        height = np.zeros(len(line) + (1 if ring else 0))
        weight = np.full(len(height), 1e-9)
        for crossing in scene.crossings:
            for (which, place), level in ((crossing.over, 1.0), (crossing.under, -1.0)):
                if which != cable:
                    continue
                apart = np.abs(arc[: len(height)] - place)
                if ring:
                    apart = np.minimum(apart, arc[-1] - apart)
                near = np.exp(-0.5 * (apart / (1.5 * scene.widths[cable])) ** 2)
                height += level * near**2
                weight += near
        heights.append(height / np.maximum(weight, 0.05))
    return heights


def render(
    scene: SyntheticScene,
    rng: np.random.Generator,
    colours: Sequence[Sequence[float]] | None = None,
    *,
    background: Sequence[float] | Array = (30, 32, 36),
    shading: float = 0.6,
    grain: float = 6.0,
    shadow: float = 0.45,
) -> NDArray[np.uint8]:
    """Render a picture of a scene.

    Parameters
    ----------
    scene : SyntheticScene
    rng : numpy.random.Generator
        Random generator of the direction of the light and the grain.
    colours : sequence of (red, green, blue) from 0 to 255, optional
        Colour of each cable; by default random bright ones.
    background : (red, green, blue), or array_like of shape (height, width, 3)
        Colour of the background, or a picture of it, such as `withe.perception.backgrounds.wood` returns.
    shading : float
        Darkening of the flank that faces away from the lamp, from 0 to 1.
    grain : float
        Standard deviation of the noise [grey levels].
    shadow : float
        Darkening of the lower strand by the shadow of the upper one, from 0 to 1.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
    """
    shape = scene.mask.shape
    colour = (
        [np.asarray(c, float) for c in colours]
        if colours is not None
        else [rng.uniform(90, 250, 3) for _ in scene.centrelines]
    )
    picture = np.ones((*shape, 3)) * np.asarray(background, float)
    top = np.full(shape, -np.inf)
    light = rng.uniform(0, 2 * np.pi)
    lamp = np.array([np.cos(light), np.sin(light)]) * 0.6
    shade = np.ones(shape)
    for cable, line in enumerate(scene.centrelines):
        width, ring = scene.widths[cable], scene.closed[cable]
        height = _heights(scene)[cable]
        start, end = _segments(line, ring)
        texture = 1 + 0.06 * _smooth_noise(rng, (len(height),), 3)
        for i, rows, columns, distance, t in _boxes(line, ring, width / 2 + 6, shape, scene.cut[cable]):
            inside = distance <= width / 2
            u = np.clip(distance / (width / 2), 0, 1)
            z = height[i] + (height[min(i + 1, len(height) - 1)] - height[i]) * t + 0.4 * np.sqrt(1 - u**2)
            visible = inside & (z > top[rows, columns])
            y, x = np.mgrid[rows, columns]
            d = (end[i] - start[i]) / max(np.hypot(*(end[i] - start[i])), 1e-9)
            side = (x - start[i, 0]) * -d[1] + (y - start[i, 1]) * d[0]
            normal = np.clip(side / (width / 2), -1, 1)
            lit = lamp @ np.array([-d[1], d[0]]) * normal + np.sqrt(1 - normal**2) * 0.8
            bright = (1 - shading) + shading * np.clip(lit, 0, 1)
            value = (bright * texture[i])[..., None] * colour[cable]
            picture[rows, columns] = np.where(visible[..., None], value, picture[rows, columns])
            top[rows, columns] = np.where(visible, z, top[rows, columns])
    # Shadows fall from strands at least half a level higher, a few pixels away from the lamp.
    offset = np.round(-lamp / 0.6 * 3).astype(int)
    shifted = np.roll(top, (offset[1], offset[0]), axis=(0, 1))
    with np.errstate(invalid="ignore"):
        shade[np.isfinite(shifted) & (shifted > top + 0.6)] -= shadow
    picture *= shade[..., None]
    picture += rng.normal(0, grain, picture.shape)
    result: NDArray[np.uint8] = np.clip(np.round(picture), 0, 255).astype(np.uint8)
    return result
