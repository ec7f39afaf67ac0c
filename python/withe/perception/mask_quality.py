"""Quality of a mask: whether its shapes are those of cables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "CLEAR_CONTRAST",
    "MaskQuality",
    "compare_with_network",
    "compare_with_picture",
    "has_plain_border",
    "measure_quality",
]

Array = NDArray[np.float64]

# Bounds for masks of cables. The 99 labelled photographs of the benchmark reach 0.1, 0, 0 and 0.53; masks made of
# drawn cables 0.08, 0.11, 0 and 0.51. Tiles, keyboards, printed text and gravel exceed at least one of the bounds.
_GREATEST_COVER = 0.3
_GREATEST_UNEXPLAINED = 0.15
_GREATEST_SHORT = 0.3
_GREATEST_SPREAD = 0.7
_SHORT_LENGTH = 10.0  # a cable is short below this length over width
_FEW_SHORT = 3  # so many short cables may lie in any picture
_FEW_WIDTHS = 6  # widths of so many cables may differ

# Bounds for pictures. The labelled photographs reach a contrast of 14 and a sharpness of 0.48, drawn cables on plain
# ground 5 and 0.54. Noise of 40 grey levels gives a contrast of 0.8 to 1.2, a blur of 5 px a sharpness of 0.25.
_LEAST_CONTRAST = 1.1
LEAST_SHARPNESS = 0.35
_BLURRED = "the picture is blurred at its borders"
_BLOCK = 3  # width and height of the blocks whose means are compared along the border [px]
_BORDER_REACH = 3  # distance over which steps along the border are measured [blocks]
_PLAIN_ROUGHNESS = 6.0  # [grey levels]
_LEAST_CERTAINTY = 0.78  # 97 % of 98 masks with an intersection over union below 0.5 are below it, or have a fault
_FEW_PIXELS = 100.0  # expected number of pixels of cables in a picture without any
_NOISE_SHARE = 0.9  # steps between neighbouring pixels over those of the ground, above which these are noise
CLEAR_CONTRAST = 2.0  # above it the ground filter is reliable on a plain ground
_SEAM_CONTRAST = 3.0  # below it, seams and grain of the ground may be in the mask
_SEAM_BEND = 0.05  # seams and fibres deviate from their chord by less than this share of it
_SEAM_ALIGNMENT = 0.98  # length of the mean of their directions, with doubled angles


@dataclass(frozen=True)
class MaskQuality:
    """Measures that tell a mask of cables from a mask of something else. The masks of cables have small values.

    Attributes
    ----------
    cover : float [-]
        Share of the picture that is in the mask, from 0 to 1.
    unexplained : float [-]
        Share of the mask that belongs to no cable, from 0 to 1. Specks of single pixels do not count.
    short : float [-]
        Share of the cables that are shorter than ten widths, from 0 to 1.
    width_spread : float [-]
        Difference of the 90 % and 10 % quantiles of the widths over their median.
    reasons : tuple of str
        Reasons why the mask is poor; empty for a good mask.
    contrast : float [-]
        Step of the grey levels across the border of the mask, over the steps that occur in the ground. Infinite if the
        mask was not made by the default filter.
    sharpness : float [-]
        Share of that step within 2 px. Infinite if the mask was not made by the default filter.
    certainty : float [-]
        Intersection over union that the network expects between its mask and the cables, from 0 to 1. Infinite if the
        mask is not the learned one.
    """

    cover: float
    unexplained: float
    short: float
    width_spread: float
    reasons: tuple[str, ...] = ()
    contrast: float = math.inf
    sharpness: float = math.inf
    certainty: float = math.inf

    @property
    def is_good(self) -> bool:
        """Return True if the mask looks like cables."""
        return not self.reasons


def measure_quality(
    cover: float, labelled: float, centrelines: Sequence[Array], widths: Sequence[Array]
) -> MaskQuality:
    """Return the quality of a mask from what was traced in it.

    Parameters
    ----------
    cover, labelled : float
        Share of the picture in the mask, and share of the mask in cables.
    centrelines : sequence of ndarray of shape (n, 2) [px]
    widths : sequence of ndarray of shape (n,) [px]
    """
    lengths = np.array([np.hypot(*np.diff(line, axis=0).T).sum() for line in centrelines])
    middle = np.array([np.median(rows) for rows in widths])
    is_short = lengths < _SHORT_LENGTH * middle
    short = float(is_short.mean()) if len(lengths) else 0.0
    spread = 0.0
    if len(lengths):
        low, median, high = np.percentile(np.concatenate(list(widths)), [10, 50, 90])
        spread = float((high - low) / max(median, 1e-9))
    reasons = []
    if cover > _GREATEST_COVER:
        reasons.append(f"it covers {100 * cover:.0f} % of the picture")
    if 1.0 - labelled > _GREATEST_UNEXPLAINED:
        reasons.append(f"{100 * (1.0 - labelled):.0f} % of it belongs to no cable")
    if short > _GREATEST_SHORT and is_short.sum() >= _FEW_SHORT:
        reasons.append(f"{is_short.sum()} of {len(lengths)} cables are shorter than {_SHORT_LENGTH:.0f} widths")
    if spread > _GREATEST_SPREAD and len(lengths) > _FEW_WIDTHS:
        reasons.append(f"the widths of {len(lengths)} cables differ by {100 * spread:.0f} %")
    return MaskQuality(cover, 1.0 - labelled, short, spread, tuple(reasons))


def compare_with_picture(
    quality: MaskQuality,
    image: NDArray[np.uint8],
    mask: NDArray[np.uint8],
    centrelines: Sequence[Array],
    widths: Sequence[Array],
) -> MaskQuality:
    """Return the quality with the measures of the picture: contrast, sharpness, and lines as straight as seams.

    Parameters
    ----------
    quality : MaskQuality
        Quality of the mask alone.
    image : ndarray of uint8, shape (height, width, 3)
    mask : ndarray of uint8, shape (height, width)
    centrelines : sequence of ndarray of shape (n, 2) [px]
    widths : sequence of ndarray of shape (n,) [px]
    """
    found = _with_borders(quality, image, mask > 0, centrelines, widths)
    if found is None:
        return quality
    quality, _ = found
    reasons = list(quality.reasons)
    if quality.contrast < _LEAST_CONTRAST:
        reasons.append(_faint(quality))
    elif quality.contrast < _SEAM_CONTRAST and _are_seams(centrelines):
        reasons.append("all of its lines are straight and parallel, as seams of the ground are")
    if quality.sharpness < LEAST_SHARPNESS:
        reasons.append(_BLURRED)
    return replace(quality, reasons=tuple(reasons))


def compare_with_network(
    quality: MaskQuality,
    image: NDArray[np.uint8],
    probability: NDArray[np.float32],
    mask: NDArray[np.uint8],
    centrelines: Sequence[Array],
    widths: Sequence[Array],
) -> MaskQuality:
    """Return the quality of a learned mask: the certainty of the network, and the blur and noise of the picture.

    The ground of a cluttered picture may differ more than the cables do, which says nothing about a learned mask. Noise
    is told from clutter by the steps between neighbouring pixels, which are as large as those over a longer distance.

    Parameters
    ----------
    quality : MaskQuality
        Quality of the mask alone.
    image : ndarray of uint8, shape (height, width, 3)
    probability : ndarray of shape (height, width)
        Probability of a cable at each pixel.
    mask : ndarray of uint8, shape (height, width)
    centrelines : sequence of ndarray of shape (n, 2) [px]
    widths : sequence of ndarray of shape (n,) [px]
    """
    inside = mask > 0
    expected = float(probability.sum())
    reasons = list(quality.reasons)
    if inside.any():
        certainty = float(probability[inside].sum() / (inside.sum() + probability[~inside].sum()))
        if certainty < _LEAST_CERTAINTY:
            reasons.append(f"the network expects it to agree with the cables by {100 * certainty:.0f} % only")
    else:
        certainty = 1.0 if expected < _FEW_PIXELS else 0.0
        if certainty < _LEAST_CERTAINTY:
            reasons.append("it is empty, and the network expects cables")
    quality = replace(quality, certainty=certainty)
    found = _with_borders(quality, image, inside, centrelines, widths)
    if found is not None:
        quality, level = found
        neighbours = np.abs(np.diff(image[::3].astype(np.int16), axis=1)).max(axis=-1)
        is_noise = float(np.percentile(neighbours, 95)) > _NOISE_SHARE * level
        if quality.contrast < _LEAST_CONTRAST and is_noise:
            reasons.append(_faint(quality))
        if quality.sharpness < LEAST_SHARPNESS:
            reasons.append(_BLURRED)
    return replace(quality, reasons=tuple(reasons))


def _with_borders(
    quality: MaskQuality,
    image: NDArray[np.uint8],
    inside: NDArray[np.bool_],
    centrelines: Sequence[Array],
    widths: Sequence[Array],
) -> tuple[MaskQuality, float] | None:
    """Return the quality with contrast and sharpness, and the steps of the ground [grey levels]; None without lines."""
    if len(centrelines) == 0:
        return None
    border, ground, near = _steps(image, inside, int(np.clip(np.median(np.concatenate(list(widths))), 4, 16)))
    if len(border) == 0 or len(ground) == 0 or len(near) == 0:
        return None
    step, level = float(np.median(border)), max(float(np.percentile(ground, 95)), 1.0)
    return replace(quality, contrast=step / level, sharpness=float(np.median(near)) / max(step, 1.0)), level


def _faint(quality: MaskQuality) -> str:
    return f"its borders differ only {quality.contrast:.1f} times as much as the ground itself"


def has_plain_border(image: NDArray[np.uint8]) -> bool:
    """Return True if a frame along the border of a picture is nearly free of edges, except those of a few cables."""
    return border_roughness(image) < _PLAIN_ROUGHNESS


def border_roughness(image: NDArray[np.uint8]) -> float:
    """Return the 80 % quantile of the steps of the grey levels along a frame at the border of a picture.

    The steps are those of means over 3 x 3 px, which noise changes little.
    """
    height, width = image.shape[:2]
    depth = max(_BLOCK, min(height, width) // 20)
    steps = []
    for frame in (image[:depth], image[-depth:], image[:, :depth].swapaxes(0, 1), image[:, -depth:].swapaxes(0, 1)):
        rows, columns = frame.shape[0] // _BLOCK, frame.shape[1] // _BLOCK
        blocks = frame[: rows * _BLOCK, : columns * _BLOCK].reshape(rows, _BLOCK, columns, _BLOCK, 3)
        lines = blocks.mean(axis=(1, 3), dtype=np.float32)
        if rows > 0 and columns > _BORDER_REACH:
            steps.append(np.abs(lines[:, _BORDER_REACH:] - lines[:, :-_BORDER_REACH]).max(axis=-1).ravel())
    return float(np.percentile(np.concatenate(steps), 80)) if steps else 0.0


def _are_seams(lines: Sequence[Array]) -> bool:
    """Return True if all lines are straight and parallel."""
    mean, total = 0j, 0.0
    for line in lines:
        chord = complex(*(line[-1] - line[0]))
        length = max(abs(chord), 1e-9)
        across = (line - line[0]) @ np.array([-chord.imag, chord.real]) / length
        if np.abs(across).max() > _SEAM_BEND * length:
            return False
        mean += length * (chord / length) ** 2
        total += length
    return abs(mean) > _SEAM_ALIGNMENT * total


def _steps(
    image: NDArray[np.uint8], mask: NDArray[np.bool_], distance: int
) -> tuple[NDArray[np.int16], NDArray[np.int16], NDArray[np.int16]]:
    """Return steps of the grey levels: over `distance` across the border and in the ground, over 2 px at the border."""
    found: tuple[list[NDArray[np.int16]], ...] = ([], [], [])
    for picture, inside in ((image, mask), (image.transpose(1, 0, 2), mask.T)):
        rows, cover = np.ascontiguousarray(picture[::3]).astype(np.int16), np.ascontiguousarray(inside[::3])
        if rows.shape[1] <= distance:
            continue
        crosses = cover[:, :-distance] != cover[:, distance:]
        first = rows[:, :-distance][crosses]
        found[0].append(np.abs(first - rows[:, distance:][crosses]).max(axis=-1))
        ends = cover[:, :-distance:4], cover[:, distance::4]
        free = ~(ends[0] | ends[1] | cover[:, distance // 2 :: 4][:, : ends[0].shape[1]])
        found[1].append(np.abs(rows[:, :-distance:4][free] - rows[:, distance::4][free]).max(axis=-1))
        crosses = cover[:, :-2] != cover[:, 2:]
        found[2].append(np.abs(rows[:, :-2][crosses] - rows[:, 2:][crosses]).max(axis=-1))
    empty = np.zeros(0, np.int16)
    border, ground, near = (np.concatenate(steps) if steps else empty for steps in found)
    return border, ground, near
