"""Grounds full of lines, edges and shading that are no cables, on which the learned mask is trained.

Each ground is a square canvas of shape (size, size, 3) [grey levels]. `cluttered_pictures` turns, tilts and lights it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withe.common.extras import require

__all__ = ["GROUNDS", "blobs", "cells", "clouds", "color", "fine_grain", "lit", "mixed", "number", "stroke"]

Array = NDArray[np.float32]
Generator = np.random.Generator


def _cv2() -> Any:
    return require("cv2", "vision")


# Ingredients


def number(rng: Generator, low: float, high: float) -> float:
    """Return a random number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def color(rng: Generator, dullest: float = 0.0, most_vivid: float = 1.0) -> Array:
    """Return a random colour of a saturation between two bounds, from dark to bright [grey levels]."""
    hue, saturation, value = rng.uniform(0, 6), rng.uniform(dullest, most_vivid), rng.uniform(0.08, 1.0)
    wheel = np.clip(np.abs((hue + np.array([0.0, 4.0, 2.0])) % 6 - 3) - 1, 0, 1)
    return np.asarray(255 * value * (1 - saturation * (1 - wheel)), np.float32)


def mixed(low: Array, high: Array, share: Array) -> Array:
    """Return the mixture of two colours or pictures by a share per pixel, from 0 to 1."""
    return np.asarray(low + (high - low) * share[..., None], np.float32)


def clouds(rng: Generator, size: int, finest: float = 4.0, stretch: float = 1.0, octaves: int = 5) -> Array:
    """Return noise of many scales, of zero mean and unit variance.

    Parameters
    ----------
    rng : numpy.random.Generator
    size : int [px]
    finest : float [px]
        Size of the smallest features.
    stretch : float
        Length over width of the features, along x.
    octaves : int
        Number of scales, each twice as coarse as the one before.
    """
    cv2 = _cv2()
    result = np.zeros((size, size), np.float32)
    for octave in range(octaves):
        cell = finest * 2**octave
        rows, columns = (max(2, int(np.ceil(size / each)) + 1) for each in (cell, cell * stretch))
        values = rng.standard_normal((rows, columns), np.float32)
        result += 1.6**octave * cv2.resize(values, (size, size), interpolation=cv2.INTER_CUBIC)
    return np.asarray((result - result.mean()) / max(float(result.std()), 1e-6), np.float32)


def fine_grain(rng: Generator, size: int, strength: float) -> Array:
    """Return factors of brightness, shape (size, size, 1), with fine texture."""
    return 1 + strength * clouds(rng, size, number(rng, 1.2, 4), octaves=3)[..., None]


def cells(rng: Generator, size: int, spacing: float, jitter: float = 0.5) -> tuple[NDArray[np.int32], Array]:
    """Return the number of the nearest of scattered points for each pixel, and the distance from the cell's border."""
    cv2 = _cv2()
    count = max(2, int(size / spacing) + 1)
    places = (np.stack(np.meshgrid(np.arange(count), np.arange(count)), axis=-1).reshape(-1, 2) + 0.5) * spacing
    places = places + rng.uniform(-jitter, jitter, places.shape) * spacing
    seeds = np.full((size, size), 255, np.uint8)
    x, y = np.clip(places.astype(int), 0, size - 1).T
    seeds[y, x] = 0
    _, labels = cv2.distanceTransformWithLabels(seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    edge = np.zeros((size, size), bool)
    edge[:, 1:] |= labels[:, 1:] != labels[:, :-1]
    edge[1:] |= labels[1:] != labels[:-1]
    inner = cv2.distanceTransform((~edge).astype(np.uint8), cv2.DIST_L2, 3)
    return labels, np.asarray(inner, np.float32)


def blobs(rng: Generator, size: int, levels: int, coarsest: float) -> NDArray[np.int32]:
    """Return a picture of regions with smooth outlines, numbered from 0 to `levels` - 1."""
    noise = clouds(rng, size, coarsest, octaves=2)
    bounds = np.quantile(noise, np.linspace(0, 1, levels + 1)[1:-1])
    return np.asarray(np.digitize(noise, bounds), np.int32)


def lit(picture: Array, heights: Array, rng: Generator, strength: float) -> Array:
    """Return a picture with the light and shade of a relief, with heights in px."""
    angle = rng.uniform(0, 2 * np.pi)
    slope_y, slope_x = np.gradient(heights)
    shade = np.clip(strength * (np.cos(angle) * slope_x + np.sin(angle) * slope_y), -0.8, 0.9)
    return np.asarray(picture * (1 + shade[..., None]), np.float32)


def _along(size: int) -> tuple[Array, Array]:
    """Return x and y of the pixels."""
    y, x = np.mgrid[:size, :size].astype(np.float32)
    return x, y


def _near(rng: Generator, base: Array, spread: float) -> Array:
    """Return a colour near another one."""
    return np.asarray(np.clip(base + rng.normal(0, spread) + rng.normal(0, spread / 3, 3), 0, 255), np.float32)


# Grounds


def plain(rng: Generator, size: int) -> Array:
    """Return one colour, often grey, white or nearly black."""
    kind = rng.random()
    if kind < 0.25:
        base = np.full(3, rng.uniform(3, 40), np.float32) + rng.uniform(0, 6, 3).astype(np.float32)
    elif kind < 0.6:
        base = 0.85 * np.float32(rng.uniform(60, 240)) + 0.15 * color(rng)
    else:
        base = color(rng)
    return base * fine_grain(rng, size, rng.uniform(0, 0.04))


def planks(rng: Generator, size: int) -> Array:
    """Return planks of wood, or of another colour, with grain along them and seams, dark or bright."""
    x, y = _along(size)
    width = number(rng, 14, 160)
    row = np.floor(y / width).astype(int)
    edge = y / width % 1
    tone = rng.uniform(1 - rng.uniform(0, 0.25), 1.1, row.max() + 1).astype(np.float32)[row]
    warm = np.array([1.0, rng.uniform(0.62, 0.9), rng.uniform(0.35, 0.75)], np.float32) * rng.uniform(60, 245)
    base = warm if rng.random() < 0.75 else color(rng, 0, 0.4)
    grain = rng.uniform(0.02, 0.12) * clouds(rng, size, number(rng, 1.2, 4), number(rng, 8, 40), 4)
    waves = y + rng.uniform(2, 14) * clouds(rng, size, 40, 4, 2) + 40 * tone
    grain += rng.uniform(0, 0.14) * np.sin(2 * np.pi * waves / number(rng, 5, 30))
    picture = base * (tone * (1 + grain))[..., None]
    seam = rng.uniform(0.6, 2.2) if rng.random() < 0.7 else rng.uniform(2, 9)
    apart = np.minimum(edge, 1 - edge) * width
    dark = np.float32(rng.uniform(0.2, 0.75) if rng.random() < 0.8 else rng.uniform(1.15, 1.6))
    ends = rng.random()
    lines = apart < seam / 2
    if ends < 0.6:
        length = width * rng.uniform(3, 9)
        shift = rng.uniform(0, length, row.max() + 1).astype(np.float32)[row]
        along = (x + shift) % length
        lines |= np.minimum(along, length - along) < seam / 2
    soft = _cv2().GaussianBlur(lines.astype(np.float32), (0, 0), rng.uniform(0.4, 1.2))
    return np.asarray(picture * (1 + (dark - 1) * soft)[..., None], np.float32)


def tiles(rng: Generator, size: int) -> Array:
    """Return tiles with grout, in a grid or shifted row by row."""
    x, y = _along(size)
    width, height = number(rng, 18, 150), number(rng, 18, 150)
    if rng.random() < 0.6:
        height = width
    row = np.floor(y / height).astype(int)
    shift = (row % 2) * width * (rng.uniform(0.3, 0.7) if rng.random() < 0.25 else 0.0)
    column = np.floor((x + shift) / width).astype(int)
    grout = number(rng, 1.5, 14)
    across = np.minimum((x + shift) % width, width - (x + shift) % width)
    down = np.minimum(y % height, height - y % height)
    inner = np.minimum(across, down) - grout / 2
    base, other = color(rng, 0, 0.5), color(rng, 0, 0.3)
    if rng.random() < 0.3:
        base, other = _near(rng, other, 30), other
    spread = rng.uniform(0, 0.2)
    tone = (1 + spread * rng.standard_normal((row.max() + 2, column.max() + 2), np.float32))[row, column]
    picture = base * tone[..., None] * fine_grain(rng, size, rng.uniform(0, 0.06))
    if rng.random() < 0.3:
        picture = np.where(((row + column) % 2 == 0)[..., None], picture, _near(rng, base, 50))
    picture = mixed(np.broadcast_to(other, picture.shape), picture, np.clip(inner + 0.5, 0, 1))
    if rng.random() < 0.5:
        bevel = rng.uniform(1.5, 6)
        picture = lit(picture, np.clip(inner, 0, bevel), rng, rng.uniform(0.1, 0.5))
    return picture


def page(rng: Generator, size: int) -> Array:
    """Return lines of printed text, with bars and boxes, in sizes from notes to headlines."""
    cv2 = _cv2()
    paper = np.full(3, rng.uniform(170, 255), np.float32) * rng.uniform(0.9, 1, 3).astype(np.float32)
    ink = color(rng, 0, 0.6) * 0.5
    if rng.random() < 0.25:
        paper, ink = ink, paper
    letters = np.broadcast_to(np.round(paper).astype(np.uint8), (size, size, 3)).copy()
    scale = number(rng, 0.35, 3.5)
    thick = max(1, round(scale * rng.uniform(0.8, 4)))
    font = int(rng.integers(0, 8))
    step = int(scale * 22 * rng.uniform(1.2, 2.2)) + thick
    for row in range(step, size + step, step):
        left = int(rng.uniform(-20, 0.2 * size))
        count = int(rng.uniform(0.3, 1.2) * size / (12 * scale)) + 1
        text = "".join(chr(rng.choice([*range(97, 123), *range(65, 91), 32, 32, 32, 48, 55])) for _ in range(count))
        shade = tuple(float(v) for v in (ink if rng.random() < 0.85 else color(rng)))
        cv2.putText(letters, text, (left, row), font, scale, shade, thick, cv2.LINE_AA)
    picture = letters.astype(np.float32)
    for _ in range(rng.integers(0, 5)):
        stroke(picture, rng, ink if rng.random() < 0.5 else color(rng), straight=True)
    return picture


def stroke(picture: Array, rng: Generator, shade: Array, straight: bool = False, longest: float = 0.5) -> None:
    """Draw a flat stroke, a closed shape or a bar."""
    cv2 = _cv2()
    size = picture.shape[0]
    middle = rng.uniform(0, size, 2)
    reach = number(rng, 12, longest * size)
    kind = rng.integers(0, 5)
    wide = max(1, round(number(rng, 1.5, 16)))
    given = tuple(float(v) for v in shade)
    fill = wide if rng.random() < 0.65 else -1
    corner = middle + reach * rng.uniform(0.3, 1, 2) * rng.choice([-1, 1], 2)
    ends = tuple(int(v) for v in middle), tuple(int(v) for v in corner)
    if kind == 0 or (straight and kind < 3):
        cv2.line(picture, *ends, given, wide, cv2.LINE_AA)
    elif kind == 1 or straight:
        cv2.rectangle(picture, *ends, given, fill, cv2.LINE_AA)
    elif kind == 2:
        axes = int(reach * rng.uniform(0.2, 1)) + 2, int(reach * rng.uniform(0.2, 1)) + 2
        first = rng.uniform(0, 360)
        last = first + (360 if rng.random() < 0.6 else rng.uniform(40, 200))
        cv2.ellipse(picture, ends[0], axes, rng.uniform(0, 180), first, last, given, fill, cv2.LINE_AA)
    else:
        count = int(rng.integers(3, 7))
        points = middle + np.cumsum(rng.normal(0, 0.3 * reach, (count, 2)), axis=0)
        if kind == 3:
            cv2.polylines(picture, [points.astype(np.int32)], bool(rng.random() < 0.5), given, wide, cv2.LINE_AA)
        else:
            cv2.fillPoly(picture, [points.astype(np.int32)], given, cv2.LINE_AA)


def print_of_shapes(rng: Generator, size: int) -> Array:
    """Return a print: coloured regions with outlines, and strokes over them, all flat."""
    cv2 = _cv2()
    levels = int(rng.integers(2, 8))
    regions = blobs(rng, size, levels, number(rng, 12, 80))
    palette = np.stack([color(rng, 0, rng.uniform(0.2, 1)) for _ in range(levels)])
    picture = palette[regions]
    if rng.random() < 0.7:
        line = np.zeros((size, size), np.uint8)
        line[:, 1:] |= (regions[:, 1:] != regions[:, :-1]).astype(np.uint8)
        line[1:] |= (regions[1:] != regions[:-1]).astype(np.uint8)
        wide = int(number(rng, 1, 9))
        line = cv2.dilate(line, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (wide, wide)))
        picture[line > 0] = color(rng, 0, 0.5) * rng.uniform(0.1, 1)
    for _ in range(rng.integers(0, 30)):
        stroke(picture, rng, color(rng), longest=0.3)
    return np.asarray(picture * fine_grain(rng, size, rng.uniform(0, 0.05)), np.float32)


def strokes(rng: Generator, size: int) -> Array:
    """Return a ground with many strokes of one width and one or two colours: hatching, pens, straws, blades."""
    cv2 = _cv2()
    base = color(rng, 0, 0.6)
    picture = np.broadcast_to(base, (size, size, 3)) * fine_grain(rng, size, rng.uniform(0, 0.06))
    shades = [color(rng), _near(rng, base, 50), color(rng)]
    wide, reach = number(rng, 1, 10), number(rng, 15, 120)
    heading, spread = rng.uniform(0, np.pi), rng.choice([0.05, 0.4, 3.0])
    count = int(rng.uniform(0.02, 0.6) * size * size / (wide * reach))
    for _ in range(min(count, 500)):
        start, angle = rng.uniform(-20, size + 20, 2), heading + rng.normal(0, spread)
        bend = rng.normal(0, 0.3)
        t = np.linspace(0, 1, 6)[:, None]
        way = np.concatenate([np.cos(angle + bend * t), np.sin(angle + bend * t)], axis=1)
        points = start + t * reach * rng.uniform(0.5, 1.3) * way
        shade = _near(rng, shades[int(rng.integers(3))], 15)
        cv2.polylines(
            picture,
            [np.round(points * 8).astype(np.int32)],
            False,
            tuple(float(v) for v in shade),
            max(1, round(wide)),
            cv2.LINE_AA,
            3,
        )
    return np.asarray(picture, np.float32)


def weave(rng: Generator, size: int) -> Array:
    """Return cloth: threads over and under, stripes, or a plaid."""
    x, y = _along(size)
    pitch = number(rng, 2.5, 16)
    base, other = color(rng, 0, 0.7), color(rng, 0, 0.7)
    if rng.random() < 0.6:
        other = _near(rng, base, 40)
    over = np.sin(np.pi * x / pitch) * np.sin(np.pi * y / pitch) > 0
    ridge = np.where(over, np.abs(np.sin(np.pi * x / pitch)), np.abs(np.sin(np.pi * y / pitch)))
    picture = np.where(over[..., None], base, other) * (1 - rng.uniform(0, 0.5) * (1 - ridge))[..., None]
    for axis in (x, y):
        for _ in range(rng.integers(0, 4)):
            period, wide = number(rng, 30, 200), number(rng, 4, 50)
            stripe = ((axis + rng.uniform(0, period)) % period < wide)[..., None]
            picture = np.where(stripe, rng.uniform(0.3, 0.8) * picture + 0.3 * color(rng), picture)
    return np.asarray(picture * fine_grain(rng, size, rng.uniform(0.01, 0.08)), np.float32)


def ridges(rng: Generator, size: int) -> Array:
    """Return corrugated sheet: straight parallel ridges with the shading of round bars."""
    _, y = _along(size)
    pitch = number(rng, 8, 60)
    share = rng.uniform(0.4, 1.0)
    place = (y + rng.uniform(0, 3) * clouds(rng, size, 60, octaves=2)) / pitch % 1
    u = np.clip((place - 0.5) / (0.5 * share), -1, 1)
    heights = np.sqrt(1 - u**2)
    lamp = rng.uniform(-0.8, 0.8)
    light = 0.25 + 0.75 * np.clip(lamp * u + np.sqrt(1 - lamp**2) * heights, 0, 1)
    light += rng.uniform(0, 0.8) * np.clip(lamp * u + np.sqrt(1 - lamp**2) * heights, 0, 1) ** 20
    picture = mixed(color(rng, 0, 0.4) * 0.7, color(rng, 0, 0.6), (np.abs(u) < 1).astype(np.float32))
    return np.asarray(picture * light[..., None] * fine_grain(rng, size, rng.uniform(0, 0.05)), np.float32)


def pebbles(rng: Generator, size: int) -> Array:
    """Return gravel, pebbles or crumbs: round cells with light and shade."""
    labels, inner = cells(rng, size, number(rng, 7, 60))
    base = color(rng, 0, 0.4)
    tone = 1 + rng.uniform(0.05, 0.35) * rng.standard_normal((labels.max() + 1, 3), np.float32) * [1, 0.9, 0.8]
    tone = tone.mean(axis=1, keepdims=True) + 0.4 * (tone - tone.mean(axis=1, keepdims=True))
    gap = rng.uniform(0.5, 4)
    picture = base * tone[labels] * (0.35 + 0.65 * np.clip(inner / gap, 0, 1))[..., None]
    picture = lit(picture, gap * np.sqrt(np.clip(inner / gap, 0, 4)), rng, rng.uniform(0.1, 0.6))
    return np.asarray(picture * fine_grain(rng, size, rng.uniform(0, 0.12)), np.float32)


def stains(rng: Generator, size: int) -> Array:
    """Return cloudy colours, as concrete, stone, rust and out-of-focus scenery have."""
    finest = number(rng, 1.5, 40)
    first, second, third = color(rng, 0, 0.6), color(rng, 0, 0.6), color(rng, 0, 0.6)
    if rng.random() < 0.6:
        second, third = _near(rng, first, 30), _near(rng, first, 30)
    spread = rng.uniform(0.1, 0.5)
    picture = mixed(first, second, np.clip(0.5 + spread * clouds(rng, size, finest), 0, 1))
    picture = mixed(picture, np.broadcast_to(third, picture.shape), np.clip(spread * clouds(rng, size, 8), 0, 1))
    return np.asarray(picture * fine_grain(rng, size, rng.uniform(0, 0.1)), np.float32)


def machine(rng: Generator, size: int) -> Array:
    """Return glossy parts: plates, bars and discs with shading, screws, slots and shadows."""
    cv2 = _cv2()
    base = color(rng, 0, rng.uniform(0, 0.8))
    picture = np.broadcast_to(base, (size, size, 3)) * fine_grain(rng, size, rng.uniform(0, 0.04))
    picture = np.asarray(picture, np.float32)
    metal = color(rng, 0, 0.15)
    for _ in range(rng.integers(6, 26)):
        length, width = number(rng, 20, size), number(rng, 14, 0.35 * size)
        if rng.random() < 0.2:
            width = number(rng, 5, 14)  # bars as narrow as cables: straight, and short or without ends
            length = min(length, 25 * width)
        angle, middle = rng.choice([0.0, np.pi / 2, rng.uniform(0, np.pi)]), rng.uniform(0, size, 2)
        _part(picture, rng, middle, angle, length, width, metal if rng.random() < 0.6 else color(rng))
    for _ in range(rng.integers(0, 20)):
        place, radius = tuple(int(v) for v in rng.uniform(0, size, 2)), int(number(rng, 3, 16))
        shade = float(rng.uniform(0.2, 1.3))
        cv2.circle(picture, place, radius, tuple(float(min(v * shade, 255)) for v in metal), -1, cv2.LINE_AA)
        dark = tuple(float(v) for v in metal * 0.3)
        cv2.circle(picture, place, radius, dark, 1 + int(radius > 8), cv2.LINE_AA)
        turn = rng.uniform(0, np.pi)
        way = 0.7 * radius * np.array([np.cos(turn), np.sin(turn)])
        ends = [tuple(int(v) for v in np.array(place) + sign * way) for sign in (-1, 1)]
        cv2.line(picture, *ends, dark, 1 + radius // 5, cv2.LINE_AA)
    return picture


def _part(
    picture: Array, rng: Generator, middle: NDArray[Any], angle: float, length: float, width: float, shade: Array
) -> None:
    """Draw a box, a round bar or a disc with shading and a shadow."""
    cv2 = _cv2()
    size = picture.shape[0]
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [length / 2, width / 2] @ turn + middle
    margin = 24
    low = np.clip(np.floor(corners.min(axis=0)).astype(int) - margin, 0, size - 1)
    high = np.clip(np.ceil(corners.max(axis=0)).astype(int) + margin, low + 1, size)
    part = picture[low[1] : high[1], low[0] : high[0]]
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]].astype(np.float32)
    across = ((y - middle[1]) * np.cos(angle) - (x - middle[0]) * np.sin(angle)) / (width / 2)
    outline = np.zeros(part.shape[:2], np.float32)
    polygon = np.round(corners - low).astype(np.int32)
    disc = rng.random() < 0.25
    if disc:
        cv2.circle(outline, tuple(int(v) for v in middle - low), int(width / 2) + 1, 1.0, -1)
    else:
        cv2.fillPoly(outline, [polygon], 1.0)
    offset = rng.uniform(-8, 8, 2)
    moved = np.array([[1, 0, offset[0]], [0, 1, offset[1]]], np.float32)
    shadow = cv2.GaussianBlur(cv2.warpAffine(outline, moved, outline.shape[::-1]), (0, 0), rng.uniform(1, 6))
    part *= 1 - rng.uniform(0, 0.6) * shadow[..., None]
    u = np.clip(across, -1, 1)
    lamp = rng.uniform(-0.8, 0.8)
    facing = np.clip(lamp * u + np.sqrt(1 - lamp**2) * np.sqrt(1 - u**2), 0, 1)
    kind = rng.random()
    if kind < 0.5:
        light = 0.25 + 0.75 * facing + rng.uniform(0, 0.9) * facing ** rng.uniform(10, 60)
    elif kind < 0.75:
        light = 0.8 + rng.uniform(-0.4, 0.4) * u
    else:
        light = 0.9 + 0.05 * np.sin(across * width / number(rng, 0.5, 2))
    inside = cv2.GaussianBlur(outline, (0, 0), 0.6)[..., None]
    part[:] = part * (1 - inside) + inside * np.clip(shade * light[..., None], 0, 255)
    if rng.random() < 0.4 and not disc:
        rim = tuple(float(v) for v in shade * rng.uniform(0.2, 0.7))
        cv2.polylines(picture, [np.round(corners).astype(np.int32)], True, rim, int(rng.integers(1, 4)), cv2.LINE_AA)


def buttons(rng: Generator, size: int) -> Array:
    """Return a panel with rows of raised round or square buttons and holes."""
    x, y = _along(size)
    pitch, share = number(rng, 14, 80), rng.uniform(0.4, 0.92)
    dx, dy = np.abs(x % pitch - pitch / 2), np.abs(y % pitch - pitch / 2)
    distance = np.hypot(dx, dy) if rng.random() < 0.5 else np.maximum(dx, dy)
    inner = share * pitch / 2 - distance
    base, other = color(rng, 0, 0.4), color(rng, 0, 0.6)
    picture = mixed(base, other, np.clip(inner + 0.5, 0, 1))
    picture = lit(picture, np.clip(inner, 0, rng.uniform(1, 6)), rng, rng.uniform(0, 0.6))
    return np.asarray(picture * fine_grain(rng, size, rng.uniform(0, 0.05)), np.float32)


def sheets(rng: Generator, size: int) -> Array:
    """Return papers, cards and boxes that lie over each other, with straight edges and soft shadows."""
    cv2 = _cv2()
    picture = np.full((size, size, 3), color(rng, 0, 0.5), np.float32)
    for _ in range(rng.integers(3, 14)):
        length, width, angle = number(rng, 30, size), number(rng, 30, size), rng.uniform(0, np.pi)
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [length / 2, width / 2] @ turn
        corners += rng.uniform(0, size, 2)
        outline = np.zeros((size, size), np.float32)
        cv2.fillPoly(outline, [np.round(corners * 8).astype(np.int32)], 1.0, cv2.LINE_AA, 3)
        shadow = cv2.GaussianBlur(outline, (0, 0), number(rng, 1, 12))
        picture = picture * (1 - rng.uniform(0, 0.5) * shadow[..., None])
        shade = color(rng, 0, 0.7) * fine_grain(rng, size, rng.uniform(0, 0.03))
        picture = mixed(picture, shade, outline)
    return np.asarray(picture, np.float32)


def foils(rng: Generator, size: int) -> Array:
    """Return crumpled foil, cloth or a bag: folds with light and shade."""
    labels, inner = cells(rng, size, number(rng, 20, 120), 0.7)
    slopes = rng.normal(0, 1, (labels.max() + 1, 2)).astype(np.float32)
    x, y = _along(size)
    heights = slopes[labels, 0] * x + slopes[labels, 1] * y
    smooth = _cv2().GaussianBlur(clouds(rng, size, number(rng, 6, 40), octaves=3), (0, 0), 2)
    relief = 10 * smooth if rng.random() < 0.6 else np.zeros_like(smooth)
    tone = 1 + rng.uniform(0, 0.25) * np.tanh(slopes[labels, 0]) + 0 * heights
    base = color(rng, 0, 0.6)
    picture = lit(base * tone[..., None] * np.ones((size, size, 1), np.float32), relief, rng, rng.uniform(0.1, 0.7))
    crease = np.exp(-inner / rng.uniform(0.7, 3))[..., None]
    return np.asarray(picture * (1 + rng.uniform(-0.5, 0.5) * crease), np.float32)


GROUNDS: dict[str, Callable[[Generator, int], Array]] = {
    "plain": plain,
    "planks": planks,
    "tiles": tiles,
    "page": page,
    "print of shapes": print_of_shapes,
    "strokes": strokes,
    "weave": weave,
    "ridges": ridges,
    "pebbles": pebbles,
    "stains": stains,
    "machine": machine,
    "buttons": buttons,
    "sheets": sheets,
    "foils": foils,
}
