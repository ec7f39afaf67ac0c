"""Grounds of kinds that the learned mask was not trained on, to measure it: no training may import this module.

Each ground is a square canvas of shape (size, size, 3) [grey levels], as in `clutter`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from withe.common.extras import require
from withe.perception.clutter import cells, clouds, color, fine_grain, lit, mixed, number

__all__ = ["UNSEEN_GROUNDS"]

Array = NDArray[np.float32]
Generator = np.random.Generator


def keyboard(rng: Generator, size: int) -> Array:
    """Return a keyboard: rows of bevelled keys with letters."""
    cv2 = require("cv2", "vision")
    case, cap = color(rng, 0, 0.2) * 0.6, color(rng, 0, 0.25)
    pitch, gap = number(rng, 28, 70), rng.uniform(2, 8)
    picture = np.full((size, size, 3), np.round(case), np.uint8)
    heights = np.zeros((size, size), np.float32)
    ink = tuple(float(v) for v in (255 - cap))
    for row in range(int(size / pitch) + 1):
        left = -rng.uniform(0, pitch)
        while left < size:
            wide = pitch * rng.choice([1.0, 1.0, 1.0, 1.0, 1.5, 2.0])
            first = int(left + gap / 2), int(row * pitch + gap / 2)
            last = int(left + wide - gap / 2), int((row + 1) * pitch - gap / 2)
            shade = cap if rng.random() < 0.9 else cap * 0.7
            cv2.rectangle(picture, first, last, tuple(float(v) for v in shade), -1)
            cv2.rectangle(heights, first, last, 4.0, -1)
            letter = chr(int(rng.integers(65, 91)))
            place = first[0] + int(0.2 * pitch), first[1] + int(0.5 * pitch)
            cv2.putText(picture, letter, place, cv2.FONT_HERSHEY_SIMPLEX, pitch / 70, ink, 1, cv2.LINE_AA)
            left += wide
    relief = cv2.GaussianBlur(heights, (0, 0), rng.uniform(0.8, 2))
    return lit(picture.astype(np.float32), relief, rng, rng.uniform(0.1, 0.5))


def marble(rng: Generator, size: int) -> Array:
    """Return marble with branching veins."""
    base = rng.uniform(120, 245) * np.array([1, rng.uniform(0.94, 1), rng.uniform(0.88, 1)], np.float32)
    if rng.random() < 0.3:
        base = base * 0.25
    vein = color(rng, 0, 0.4)
    picture = base * (1 + 0.04 * clouds(rng, size, 6))[..., None]
    for _ in range(rng.integers(1, 4)):
        field = clouds(rng, size, number(rng, 10, 40), number(rng, 1, 3), 4)
        width = rng.uniform(0.02, 0.12)
        share = np.exp(-np.abs(field - rng.uniform(-1, 1)) / width) * rng.uniform(0.3, 0.8)
        picture = mixed(picture, np.broadcast_to(vein, picture.shape), share)
    return np.asarray(picture, np.float32)


def leaves(rng: Generator, size: int) -> Array:
    """Return leaves with midribs and stalks, over each other."""
    cv2 = require("cv2", "vision")
    picture = np.full((size, size, 3), 0.4 * color(rng, 0.2, 0.6), np.float32)
    hue = color(rng, 0.4, 0.8)
    reach = number(rng, 15, 70)
    for _ in range(int(min(2.5 * (size / reach) ** 2, 350))):
        middle, angle = rng.uniform(0, size, 2), rng.uniform(0, 360)
        shade = tuple(float(v) for v in np.clip(hue * rng.uniform(0.5, 1.3) + rng.normal(0, 12, 3), 0, 255))
        dark = tuple(float(v) * 0.55 for v in shade)
        long, wide = reach * rng.uniform(0.7, 1.3), reach * rng.uniform(0.25, 0.45)
        place = tuple(int(v) for v in middle)
        shadow = place[0] + 3, place[1] + 4
        cv2.ellipse(picture, shadow, (int(long), int(wide)), angle, 0, 360, dark, -1, cv2.LINE_AA)
        cv2.ellipse(picture, place, (int(long), int(wide)), angle, 0, 360, shade, -1, cv2.LINE_AA)
        way = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        ends = [tuple(int(v) for v in middle + sign * long * way) for sign in (-1.2, 1)]
        bright = tuple(min(255.0, 1.35 * v + 15) for v in shade)
        cv2.line(picture, *ends, bright, 1 + int(reach > 40), cv2.LINE_AA)
    return picture


def bricks(rng: Generator, size: int) -> Array:
    """Return a wall of rough bricks in running bond, with mortar."""
    y, x = np.mgrid[:size, :size].astype(np.float32)
    wavy = 1.5 * clouds(rng, size, 8, octaves=3)
    height = number(rng, 16, 60)
    width, mortar = height * rng.uniform(2, 3.5), height * rng.uniform(0.08, 0.25)
    row = np.floor((y + wavy) / height).astype(int)
    column = np.floor((x + wavy + (row % 2) * width / 2) / width).astype(int)
    tone = rng.uniform(0.7, 1.25, (row.max() - row.min() + 1, column.max() - column.min() + 1)).astype(np.float32)
    across = (x + wavy + (row % 2) * width / 2) % width
    down = (y + wavy) % height
    inner = np.minimum(np.minimum(across, width - across), np.minimum(down, height - down)) - mortar / 2
    base = np.array([rng.uniform(110, 190), rng.uniform(55, 110), rng.uniform(40, 90)], np.float32)
    stone = base * tone[row - row.min(), column - column.min()][..., None] * fine_grain(rng, size, 0.12)
    joint = rng.uniform(90, 210) * fine_grain(rng, size, 0.08) * np.ones(3, np.float32)
    picture = mixed(joint, stone, np.clip(inner + 0.5, 0, 1))
    return lit(picture, np.clip(inner, 0, 3) + wavy * 0.3, rng, rng.uniform(0.1, 0.4))


def circuit(rng: Generator, size: int) -> Array:
    """Return a circuit board: flat traces with corners of 45 degrees, pads, chips and print."""
    cv2 = require("cv2", "vision")
    board = np.array([[20, 90, 45], [15, 40, 110], [35, 35, 40], [120, 25, 30]], np.float32)[rng.integers(4)]
    picture = np.full((size, size, 3), np.round(board), np.uint8)
    trace = tuple(float(v) for v in np.clip(board * rng.uniform(1.3, 1.9) + 12, 0, 255))
    metal, wide = (215.0, 205.0, 170.0), int(rng.integers(2, 7))
    for _ in range(int(rng.integers(20, 60))):
        place = rng.uniform(0, size, 2)
        turn = int(rng.integers(8))
        points = [place]
        for _ in range(rng.integers(2, 6)):
            turn += int(rng.integers(-1, 2))
            way = np.array([np.cos(turn * np.pi / 4), np.sin(turn * np.pi / 4)])
            points.append(points[-1] + number(rng, 15, 150) * way)
        cv2.polylines(picture, [np.round(points).astype(np.int32)], False, trace, wide, cv2.LINE_AA)
        for end in (points[0], points[-1]):
            cv2.circle(picture, tuple(int(v) for v in end), wide + 2, metal, -1, cv2.LINE_AA)
    for _ in range(int(rng.integers(3, 12))):
        left, top = (int(v) for v in rng.uniform(0, size, 2))
        width, height = int(number(rng, 15, 110)), int(number(rng, 15, 110))
        for pin in range(left, left + width, 9):
            cv2.rectangle(picture, (pin, top - 6), (pin + 4, top + height + 6), metal, -1)
        cv2.rectangle(picture, (left, top), (left + width, top + height), (28.0, 28.0, 30.0), -1)
        text = f"U{rng.integers(99)}"
        cv2.putText(picture, text, (left, top - 9), cv2.FONT_HERSHEY_SIMPLEX, 0.4, (230.0, 230.0, 230.0), 1)
    return picture.astype(np.float32)


def herringbone(rng: Generator, size: int) -> Array:
    """Return a floor of short boards in a herringbone, with dark joints."""
    y, x = np.mgrid[:size, :size].astype(np.float32)
    width, ratio = number(rng, 10, 40), int(rng.integers(3, 6))
    column, row = np.floor(x / width).astype(int), np.floor(y / width).astype(int)
    turn = (column - row) % (2 * ratio)
    lies = turn < ratio  # this board is along x, the others are along y
    number_of = np.where(lies, (column - turn) * 131 + row * 7919, column * 104729 + (row - (turn - ratio)) * 31)
    tone = np.random.default_rng(int(rng.integers(2**31))).uniform(0.72, 1.2, 1024).astype(np.float32)[number_of % 1024]
    edge = np.zeros((size, size), np.float32)
    edge[:, 1:] = number_of[:, 1:] != number_of[:, :-1]
    edge[1:] = np.maximum(edge[1:], number_of[1:] != number_of[:-1])
    along = clouds(rng, size, 2, 20, 3)
    grain = np.where(lies, along, along.T)
    base = np.array([1, rng.uniform(0.66, 0.85), rng.uniform(0.4, 0.65)], np.float32) * rng.uniform(110, 235)
    picture = base * (tone * (1 + rng.uniform(0.03, 0.1) * grain))[..., None]
    joint = require("cv2", "vision").GaussianBlur(edge, (0, 0), rng.uniform(0.6, 1.4)) * rng.uniform(0.8, 1.6)
    return np.asarray(picture * (1 - np.clip(joint, 0, 0.8))[..., None], np.float32)


def cracked_paint(rng: Generator, size: int) -> Array:
    """Return paint with branching cracks whose width varies."""
    base, under = color(rng, 0, 0.5), color(rng, 0, 0.4) * 0.5
    picture = base * fine_grain(rng, size, 0.05)
    for spacing in (number(rng, 50, 150), number(rng, 15, 50)):
        _, inner = cells(rng, size, spacing, 0.9)
        width = np.clip(1.2 + 1.5 * clouds(rng, size, 12, octaves=3), 0, 5)
        picture = mixed(picture, np.broadcast_to(under, picture.shape), np.clip(width - inner, 0, 1))
    return np.asarray(picture, np.float32)


UNSEEN_GROUNDS: dict[str, Callable[[Generator, int], Array]] = {
    "keyboard": keyboard,
    "marble": marble,
    "leaves": leaves,
    "bricks": bricks,
    "circuit": circuit,
    "herringbone": herringbone,
    "cracked paint": cracked_paint,
}
