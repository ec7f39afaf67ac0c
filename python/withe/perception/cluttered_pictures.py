"""Pictures of cables on cluttered grounds with exact masks, made fast, to train and to measure the learned mask."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withe.common.extras import require
from withe.perception.clutter import GROUNDS, clouds, color, mixed, number, stroke

__all__ = ["ClutteredPicture", "draw_cables", "lay_ground", "make_picture", "photographed"]

Array = NDArray[np.float32]
Generator = np.random.Generator
Ground = Callable[[Generator, int], Array]

_WIDTHS = (4.0, 18.0)  # [px]
_NO_CABLE = 0.08  # share of pictures without a cable
_PLAIN = 0.1  # share of pictures on plain ground, beside those drawn as one kind among the others
_LEAST_SHADING = 0.3  # of cables on cluttered ground, where flat lines are no cables
_LEAST_COVER = 0.004  # share of a picture with cables that its cables cover
_TURNED = 1.5  # size of a ground over the size of the picture, so that a turned ground fills the picture


@dataclass
class ClutteredPicture:
    """A picture of cables and its mask.

    Attributes
    ----------
    image : ndarray of uint8, shape (height, width, 3)
    mask : ndarray of bool, shape (height, width)
        Pixels whose centres are within half a width of a centreline.
    ground : str
        Kind of the ground.
    """

    image: NDArray[np.uint8]
    mask: NDArray[np.bool_]
    ground: str


@dataclass
class _Style:
    """Look of a cable: colours along it, shading and shadow."""

    colors: Array  # (colours, 3)
    pattern: str
    period: float  # [px]
    share: float  # of the second colour
    twist: float
    shading: float
    gloss: float
    ribs: float


# Cables


def _curve(rng: Generator, shape: tuple[int, int]) -> Array:
    """Return a smooth random curve with points 1 px apart, which may leave the picture."""
    height, width = shape
    start = rng.uniform([-0.1 * width, -0.1 * height], [1.1 * width, 1.1 * height])
    count = int(number(rng, 0.35, 3.0) * max(height, width))
    bend = rng.choice([0.0, 1 / 250, 1 / 110, 1 / 55, 1 / 30], p=[0.06, 0.2, 0.34, 0.28, 0.12])
    knots = np.arange(0, count + 200, rng.uniform(40, 120))
    curvature = np.interp(np.arange(count), knots, rng.normal(0, bend, len(knots)))
    target = np.array([rng.uniform(0.2, 0.8) * width, rng.uniform(0.2, 0.8) * height])
    heading = np.arctan2(*(target - start)[::-1]) + rng.normal(0, 0.5)
    angle = heading + np.cumsum(curvature)
    return np.asarray(start + np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0), np.float32)


def _hue_of(rng: Generator, ground: Array) -> Array:
    """Return the colour of a cable: vivid, white, black, grey, or a shade of the ground."""
    kind = rng.random()
    if kind < 0.45:
        return color(rng, 0.4, 1.0)
    if kind < 0.6:
        return np.asarray(rng.uniform(185, 255) * rng.uniform(0.92, 1, 3), np.float32)
    if kind < 0.75:
        return np.asarray(rng.uniform(8, 50) * rng.uniform(0.85, 1, 3), np.float32)
    if kind < 0.85:
        return color(rng, 0, 0.3)
    shade = ground.reshape(-1, 3)[rng.integers(ground.shape[0] * ground.shape[1])]
    return np.asarray(np.clip(shade + rng.choice([-1, 1]) * rng.uniform(15, 60), 5, 255), np.float32)


def _style(rng: Generator, ground: Array, width: float, least_shading: float) -> _Style:
    colors = np.stack([_hue_of(rng, ground), _hue_of(rng, ground)])
    pattern = str(rng.choice(["plain", "bands", "helix", "stripe", "braid"], p=[0.72, 0.07, 0.08, 0.07, 0.06]))
    return _Style(
        colors,
        pattern,
        width * number(rng, 0.4, 6) if pattern != "braid" else width * rng.uniform(0.3, 0.9),
        rng.uniform(0.25, 0.6),
        rng.uniform(0.2, 1.2),
        rng.uniform(least_shading, 0.9),
        rng.uniform(0, 0.8) if rng.random() < 0.6 else 0.0,
        rng.uniform(0, 0.25) if rng.random() < 0.25 else 0.0,
    )


def _tube(line: Array, width: float, shape: tuple[int, int]) -> tuple[Any, Any, Array, Array]:
    """Return rows and columns of the pixels of a cable, their arc lengths [px], and their offsets from the middle."""
    height, wide = shape
    way = np.gradient(line, axis=0)
    way /= np.maximum(np.hypot(*way.T), 1e-6)[:, None]
    normal = np.stack([-way[:, 1], way[:, 0]], axis=1)
    offsets = np.arange(-width / 2 - 1.5, width / 2 + 1.6, 0.6, dtype=np.float32)
    places = np.rint(line[:, None] + offsets[None, :, None] * normal[:, None]).astype(np.int32)
    x, y = places[..., 0].ravel(), places[..., 1].ravel()
    inside = (x >= 0) & (x < wide) & (y >= 0) & (y < height)
    step = np.full(height * wide, -1, np.int32)
    step[(y * wide + x)[inside]] = np.repeat(np.arange(len(line)), len(offsets))[inside]
    flat = np.flatnonzero(step >= 0)
    rows, columns = np.divmod(flat, wide)
    at = step[flat]
    offset = (columns - line[at, 0]) * normal[at, 0] + (rows - line[at, 1]) * normal[at, 1]
    return rows, columns, at.astype(np.float32), np.asarray(offset, np.float32)


def _painted(style: _Style, at: Array, u: Array, lit: Array) -> Array:
    """Return the colours of pixels at arc lengths [px] and relative offsets u, from -1 to 1."""
    phase = at / style.period
    if style.pattern == "bands":
        second = phase % 1 < style.share
    elif style.pattern == "helix":
        second = (phase + style.twist * u) % 1 < style.share
    elif style.pattern == "stripe":
        second = np.abs(u - 0.3) < style.share
    elif style.pattern == "braid":
        second = np.sin(np.pi * (phase + u)) * np.sin(np.pi * (phase - u)) > 0.1
    else:
        second = np.zeros(len(at), bool)
    base = np.where(second[:, None], style.colors[1], style.colors[0])
    light = 1 - style.shading + style.shading * 1.15 * np.clip(lit, 0, 1)
    light = light * (1 + style.ribs * np.sin(2 * np.pi * at / 4.0))
    bright = 200 * style.gloss * np.clip(lit, 0, 1) ** 25
    return np.asarray(base * light[:, None] + bright[:, None], np.float32)


def draw_cables(
    picture: Array, rng: Generator, lines: Sequence[Array], widths: Sequence[float], least_shading: float = 0.0
) -> tuple[Array, NDArray[np.bool_]]:
    """Return the picture with cables and their shadows, and the mask of the cables.

    Parameters
    ----------
    picture : ndarray of float32, shape (height, width, 3) [grey levels]
    rng : numpy.random.Generator
        Random generator of the colours, the lamp and the shadows.
    lines : sequence of ndarray of shape (n, 2) [px]
        Centrelines with points 1 px apart, from the lowest to the topmost cable.
    widths : sequence of float [px]
    least_shading : float
        Least darkening of the flanks of a cable, from 0 to 1.
    """
    cv2 = require("cv2", "vision")
    picture = picture.copy()
    shape = picture.shape[0], picture.shape[1]
    mask = np.zeros(shape, bool)
    angle = rng.uniform(0, 2 * np.pi)
    lamp = np.array([np.cos(angle), np.sin(angle)])
    slant = rng.uniform(0, 0.85)
    far, soft = number(rng, 1.5, 30), number(rng, 0.8, 7)
    dark = rng.uniform(0.1, 0.65) if rng.random() < 0.75 else 0.0
    contact = rng.uniform(0, 0.5) if rng.random() < 0.5 else 0.0
    shared = _style(rng, picture, float(np.mean(widths)), least_shading) if len(widths) else None
    for line, width in zip(lines, widths, strict=True):
        rows, columns, at, offset = _tube(line, width, shape)
        if len(rows) == 0:
            continue
        style = shared if shared is not None and rng.random() < 0.35 else _style(rng, picture, width, least_shading)
        cover = np.zeros(shape, np.float32)
        cover[rows, columns] = np.clip(width / 2 - np.abs(offset) + 0.5, 0, 1)
        if dark:
            reach = far * rng.uniform(0.7, 1.3)
            moved = np.array([[1, 0, -lamp[0] * reach], [0, 1, -lamp[1] * reach]], np.float32)
            shadow = cv2.GaussianBlur(cv2.warpAffine(cover, moved, shape[::-1]), (0, 0), soft)
            picture *= 1 - dark * shadow[..., None]
        if contact:
            halo = cv2.GaussianBlur(cover, (0, 0), 0.35 * width)
            picture *= 1 - contact * halo[..., None]
        u = np.clip(offset / (width / 2), -1, 1)
        way = np.gradient(line, axis=0)[at.astype(int)]
        side = lamp[0] * -way[:, 1] + lamp[1] * way[:, 0]
        lit = slant * side * u + np.sqrt(1 - slant**2) * np.sqrt(1 - u**2)
        share = cover[rows, columns][:, None]
        picture[rows, columns] = picture[rows, columns] * (1 - share) + share * _painted(style, at, u, lit)
        mask[rows, columns] |= np.abs(offset) <= width / 2
    return picture, mask


# Grounds and photography


def lay_ground(rng: Generator, shape: tuple[int, int], ground: Ground) -> Array:
    """Return a ground turned, tilted and lit, shape (height, width, 3) [grey levels]."""
    cv2 = require("cv2", "vision")
    height, width = shape
    size = int(_TURNED * max(shape))
    canvas = np.ascontiguousarray(ground(rng, size), np.float32)
    angle = rng.choice([0.0, rng.normal(0, 0.1), rng.uniform(0, 2 * np.pi)])
    zoom = number(rng, 0.7, 1.5)
    cosine, sine = zoom * np.cos(angle), zoom * np.sin(angle)
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    tilt = np.eye(3)
    if rng.random() < 0.5:
        tilt[2, :2] = rng.normal(0, 0.15, 2) / max(shape)
    to_middle = np.array([[1, 0, -size / 2], [0, 1, -size / 2], [0, 0, 1]])
    back = np.array([[1, 0, width / 2], [0, 1, height / 2], [0, 0, 1]])
    picture = cv2.warpPerspective(
        canvas, back @ tilt @ turn @ to_middle, (width, height), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT
    )
    return np.asarray(picture, np.float32)


def _overlay(picture: Array, rng: Generator) -> Array:
    """Draw flat lines as wide as cables: a family of parallels, curves through the picture, or strokes."""
    cv2 = require("cv2", "vision")
    height, width = picture.shape[:2]
    square = max(height, width)
    canvas = np.zeros((square, square, 3), np.float32)
    canvas[:height, :width] = picture
    kind = rng.random()
    if kind < 0.35:
        angle, pitch = rng.uniform(0, np.pi), number(rng, 15, 150)
        wide = max(1, round(number(rng, 1, 14)))
        shade = np.clip(picture.mean(axis=(0, 1)) * rng.uniform(0.2, 1.8), 0, 255) if rng.random() < 0.6 else color(rng)
        way = np.array([np.cos(angle), np.sin(angle)])
        for place in np.arange(-square, square, pitch)[:60]:
            middle = np.array([square / 2, square / 2]) + place * np.array([-way[1], way[0]])
            ends = [tuple(int(v) for v in middle + sign * 2 * square * way) for sign in (-1, 1)]
            cv2.line(canvas, *ends, tuple(float(v) for v in shade), wide, cv2.LINE_AA)
    elif kind < 0.65:
        wide = max(1, round(number(rng, 1.5, 14)))
        shade = tuple(float(v) for v in color(rng))
        for _ in range(rng.integers(1, 6)):
            points = np.round(8 * _curve(rng, (square, square))[::4]).astype(np.int32)
            cv2.polylines(canvas, [points], False, shade, wide, cv2.LINE_AA, 3)
    else:
        for _ in range(rng.integers(1, 12)):
            stroke(canvas, rng, color(rng), longest=0.8)
    return canvas[:height, :width]


def _lit(picture: Array, rng: Generator) -> Array:
    """Return the picture under uneven light, at times with the shadow of something large."""
    cv2 = require("cv2", "vision")
    height, width = picture.shape[:2]
    y, x = np.mgrid[:height, :width].astype(np.float32)
    angle, size = rng.uniform(0, 2 * np.pi), max(height, width)
    ramp = (np.cos(angle) * (x - width / 2) + np.sin(angle) * (y - height / 2)) / size
    light = 1 + rng.uniform(0, 0.7) * ramp
    if rng.random() < 0.4:
        spot = ((x - rng.uniform(0, width)) ** 2 + (y - rng.uniform(0, height)) ** 2) / size**2
        light *= 1 + rng.uniform(-0.3, 0.6) * np.exp(-spot / rng.uniform(0.02, 0.3))
    if rng.random() < 0.25:
        region = (clouds(rng, size, 0.25 * size, octaves=2)[:height, :width] > rng.uniform(-0.5, 1)).astype(np.float32)
        light *= 1 - rng.uniform(0.1, 0.55) * cv2.GaussianBlur(region, (0, 0), number(rng, 1, 25))
    return np.asarray(picture * np.maximum(light, 0.05)[..., None], np.float32)


def photographed(picture: Array, rng: Generator) -> NDArray[np.uint8]:
    """Return a picture with the faults of a camera: blur, noise, contrast, colour cast and compression."""
    cv2 = require("cv2", "vision")
    if rng.random() < 0.9:
        picture = cv2.GaussianBlur(
            picture, (0, 0), rng.uniform(0.3, 1.1) if rng.random() < 0.85 else rng.uniform(1, 2.5)
        )
    if rng.random() < 0.15:
        small = rng.uniform(0.5, 0.9)
        size = picture.shape[1], picture.shape[0]
        picture = cv2.resize(cv2.resize(picture, None, fx=small, fy=small, interpolation=cv2.INTER_AREA), size)
    gain, cast = rng.uniform(0.75, 1.25), rng.uniform(0.9, 1.1, 3)
    bright = np.clip(picture * gain * cast, 0, 255).astype(np.float32) / 255
    picture = np.asarray(255 * bright ** np.float32(rng.uniform(0.7, 1.4)), np.float32)
    grain = rng.uniform(0, 6) if rng.random() < 0.85 else rng.uniform(6, 30)
    noise = rng.standard_normal(picture.shape, np.float32)
    if rng.random() < 0.3:
        noise = cv2.GaussianBlur(noise, (0, 0), 0.8) * 2
    picture = picture + grain * noise
    if rng.random() < 0.06:
        picture = np.repeat(picture.mean(axis=2, keepdims=True), 3, axis=2)
    image = np.clip(np.round(picture), 0, 255).astype(np.uint8)
    if rng.random() < 0.5:
        quality = int(rng.integers(35, 96))
        _, code = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
        image = cv2.imdecode(code, cv2.IMREAD_COLOR)
    return np.ascontiguousarray(image)


def make_picture(
    seed: int | Sequence[int],
    shape: tuple[int, int] = (360, 640),
    grounds: Mapping[str, Ground] = GROUNDS,
    ground: str | None = None,
    *,
    background: Array | None = None,
    cables: bool | None = None,
    widths: tuple[float, float] = _WIDTHS,
) -> ClutteredPicture:
    """Return a random picture of cables on cluttered ground.

    Parameters
    ----------
    seed : int or sequence of int
        Equal seeds give equal pictures with the same versions of NumPy and OpenCV.
    shape : (int, int)
        Height and width [px].
    grounds : mapping of str to callable
        Kinds of grounds.
    ground : str, optional
        Kind of the ground; by default random.
    background : ndarray of float32, shape (height, width, 3), optional
        Picture, such as a photograph, to draw the cables on instead of a drawn ground.
    cables : bool, optional
        True for cables that cover 0.4 % of the picture or more, False for none. By default a twelfth has none.
    widths : (float, float) [px]
        Least and greatest width of the cables.
    """
    rng = np.random.default_rng(seed)
    names = list(grounds)
    kind = names[int(rng.integers(len(names)))] if ground is None else ground
    if ground is None and "plain" in grounds and rng.random() < _PLAIN:
        kind = "plain"
    is_cluttered = kind != "plain" or background is not None
    if background is not None:
        picture, kind = background.astype(np.float32), "photograph"
    else:
        picture = lay_ground(rng, shape, grounds[kind])
        if rng.random() < 0.3:
            other = lay_ground(rng, shape, grounds[names[int(rng.integers(len(names)))] if ground is None else ground])
            region = clouds(rng, max(shape), 0.4 * max(shape), octaves=1)[: shape[0], : shape[1]]
            picture = mixed(picture, other, (region > rng.uniform(-1, 1)).astype(np.float32))
            is_cluttered = True
        if ground is None and rng.random() < 0.45 and is_cluttered:
            picture = _overlay(picture, rng)
            is_cluttered = True
    lines: list[Array] = []
    sizes: list[float] = []
    if cables if cables is not None else rng.random() > _NO_CABLE:
        typical = number(rng, *widths)
        for _ in range(int(rng.integers(1, 6))):
            lines.append(_curve(rng, shape))
            sizes.append(float(np.clip(typical * rng.uniform(0.75, 1.3), *widths)))
    light_first = rng.random() < 0.5
    if light_first and background is None:
        picture = _lit(picture, rng)
    picture, mask = draw_cables(picture, rng, lines, sizes, _LEAST_SHADING if is_cluttered else 0.0)
    if not light_first and background is None:
        picture = _lit(picture, rng)
    image = photographed(picture, rng)
    if cables and mask.mean() < _LEAST_COVER:
        again = [*np.atleast_1d(seed).tolist(), 1]
        return make_picture(again, shape, grounds, ground, background=background, cables=True, widths=widths)
    return ClutteredPicture(image, mask, kind)
