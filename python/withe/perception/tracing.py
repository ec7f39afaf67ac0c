"""Tracing: from an image or a mask to cables."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe import _core
from withe.common.user_warnings import warn
from withe.errors import PoorMaskWarning
from withe.perception.images import as_array, check_image, read_image
from withe.perception.learned_mask import LIKELY, cable_probability, can_run, least_width
from withe.perception.mask_quality import (
    CLEAR_CONTRAST,
    LEAST_SHARPNESS,
    MaskQuality,
    compare_with_network,
    compare_with_picture,
    has_plain_border,
    measure_quality,
)
from withe.perception.masks import MaskFunction, ground_filter, has_dark_ground
from withe.perception.results import Ambiguity, Crossing, Joint, MadeMask, MaskMethod, Tracing

__all__ = ["check_mask", "trace", "trace_mask"]

Image = NDArray[np.uint8]
Method = Literal["withe", "mbest"]

_CONFIRMED = 0.5  # least intersection over union of both masks, with which the learned one confirms the other
_SURE = 0.7  # probability above which the network adds a pixel to the mask of a plain ground


def check_mask(mask: ArrayLike, name: str = "mask") -> NDArray[np.uint8]:
    """Return a mask as bytes, row by row, or raise ValueError with the reason."""
    array = as_array(mask, name)
    if array.ndim != 2:
        raise ValueError(f"{name} must have shape (height, width), got {array.shape}")
    if array.dtype == np.bool_:
        return np.ascontiguousarray(array).view(np.uint8)
    if array.dtype == np.uint8:
        return np.ascontiguousarray(array)
    if array.dtype.kind not in "iuf":
        raise ValueError(f"{name} must hold booleans or numbers, got {array.dtype}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got NaN or infinity")
    return np.ascontiguousarray(array != 0).view(np.uint8)


def _quality(found: dict[str, Any]) -> MaskQuality:
    return measure_quality(found["cover"], found["labelled"], found["centrelines"], found["widths"])


def _tracing(found: dict[str, Any], quality: MaskQuality, mask_method: MaskMethod) -> Tracing:
    """Return the tracing, and warn if its mask is poor."""
    if not quality.is_good:
        advice = "mask='learned', a color_filter" if mask_method == "ground" else "a color_filter"
        warn(
            f"the mask does not look like cables: {', '.join(quality.reasons)}. Give mask= to trace, such as {advice}, "
            "a network_mask or an array, or take a sharp picture on a plain ground",
            PoorMaskWarning,
        )
    return Tracing(
        mask_quality=quality,
        mask_method=mask_method,
        centrelines=found["centrelines"],
        widths=found["widths"],
        closed=found["closed"],
        labels=found["labels"],
        crossings=[
            Crossing(np.array([x, y]), over, under, confidence) for x, y, over, under, confidence in found["crossings"]
        ],
        joints=[Joint(np.array([x, y]), end, through) for x, y, end, through in found["joints"]],
        ambiguous=[Ambiguity(np.array([x, y]), reason) for x, y, reason in found["ambiguous"]],
        timings=found["timings"],
    )


def _check_method(method: str) -> None:
    if method not in ("withe", "mbest"):
        raise ValueError(f"method must be 'withe' or 'mbest', got {method!r}")


@dataclass
class _Attempt:
    """A mask of a picture that withe made, what was traced in it, its quality, and the time of making it [s]."""

    method: MadeMask
    pixels: NDArray[np.uint8]
    found: dict[str, Any]
    quality: MaskQuality
    seconds: float


def _mask_word(mask: str) -> MadeMask:
    for word in get_args(MadeMask):
        if mask == word:
            return word  # type: ignore[no-any-return]
    raise ValueError(f"mask must be 'ground', 'both', 'learned', an array or a function, got {mask!r}")


def _make_mask(
    picture: Image, word: MadeMask, ground: NDArray[np.uint8] | None
) -> tuple[NDArray[np.uint8], NDArray[np.float32] | None]:
    """Return a mask, and for "learned" the probabilities by which its quality is judged.

    `ground` is the mask of the ground filter, if it is known.
    """
    if word == "learned":
        probability = cable_probability(picture)
        return check_mask(probability > LIKELY), probability
    pixels = check_mask(ground_filter(picture)) if ground is None else ground
    if word == "both":
        pixels = check_mask((pixels > 0) | (cable_probability(picture) > _SURE))
    return pixels, None


def _attempt(picture: Image, word: MadeMask, method: Method, ground: NDArray[np.uint8] | None = None) -> _Attempt:
    started = time.perf_counter()
    pixels, probability = _make_mask(picture, word, ground)
    seconds = time.perf_counter() - started
    found = _core.trace_lines(pixels, picture, method)
    quality, lines = _quality(found), (found["centrelines"], found["widths"])
    if probability is None:
        quality = compare_with_picture(quality, picture, pixels, *lines)
    else:
        quality = compare_with_network(quality, picture, probability, pixels, *lines)
    return _Attempt(word, pixels, found, quality, seconds)


def _typical_width(found: dict[str, Any]) -> float:
    return float(np.median(np.concatenate(found["widths"])))


def _best_attempt(picture: Image, method: Method) -> _Attempt:
    """Return the tracing by the ground filter, with the network's help where the ground is plain, or by the network.

    On a plain ground that is not dark, the ground filter misses white cables on white ground, and cables in the shadow
    of others; the network adds pixels of which it is sure. Where the ground is not plain, the mask of the ground filter
    is kept if the network confirms it: cables on weak textures, such as wood, have sharper borders in it. The network
    does not see cables that are thinner than those of its training.
    """
    ground = _attempt(picture, "ground", method)
    is_clear = ground.quality.is_good and len(ground.found["centrelines"]) > 0
    if not can_run() or (is_clear and _typical_width(ground.found) < least_width(picture)):
        return ground
    is_plain = has_plain_border(picture)
    if is_plain and is_clear and ground.quality.contrast > CLEAR_CONTRAST:
        return ground if has_dark_ground(picture) else _attempt(picture, "both", method, ground.pixels)
    # A blurred picture is no better for the network, and its blur is the reason to report.
    if is_plain and ground.quality.sharpness < LEAST_SHARPNESS:
        return ground
    learned = _attempt(picture, "learned", method)
    both, either = (f(ground.pixels > 0, learned.pixels > 0).sum() for f in (np.logical_and, np.logical_or))
    is_confirmed = both > _CONFIRMED * either
    return ground if is_confirmed and not (is_plain and learned.quality.is_good) else learned


def trace(
    image: ArrayLike | str | os.PathLike[str],
    mask: ArrayLike | MaskFunction | MadeMask | None = None,
    method: Method = "withe",
) -> Tracing:
    """Find every cable in a picture, and which one lies on top where they cross.

    Parameters
    ----------
    image : str, Path or array_like of shape (height, width, 3)
        A file, or red, green and blue as uint8. One channel (grey) and a fourth (alpha, ignored) are accepted.
    mask : array_like of shape (height, width), callable, or {"ground", "both", "learned"}, optional
        Pixels of cables: booleans or numbers, or a function from the picture to such an array, as `color_filter` and
        `network_mask` return. The word "ground" takes the pixels that differ from a plain ground (`ground_filter`). The
        word "learned" takes those that the shipped network finds on any ground (`learned_filter`). The word "both"
        takes those of "ground" and those of which the network is sure. By default "both" where the border of the
        picture is plain and the mask looks like cables, but "ground" where that ground is dark, and else mostly
        "learned".
    method : {"withe", "mbest"}
        Method of this package, or the published one for comparison.

    Returns
    -------
    Tracing
        Its `mask_method` is the mask that was used: "ground", "both", "learned" or "given".

    Warns
    -----
    PoorMaskWarning
        The mask does not look like cables, or the picture is too noisy or too blurred for the default filter, so the
        tracing is probably wrong.

    Raises
    ------
    ValueError
        A picture that cannot be read or has another shape or type, or a mask of another size.
    FileNotFoundError
        The network of "both" and "learned" is missing.
    ImportError
        A file, "both" or "learned" was given and OpenCV is not installed: ``pip install ".[vision]"`` in a clone of
        withe. Without OpenCV the default mask is "ground".

    Examples
    --------
    >>> import numpy as np
    >>> image = np.zeros((60, 200, 3), np.uint8)
    >>> image[26:34, 20:180] = (200, 60, 60)
    >>> trace(image)
    <Tracing: 1 cable, 0 crossings, 0 joints>
    """
    _check_method(method)
    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    if mask is None or isinstance(mask, str):
        chosen = _best_attempt(picture, method) if mask is None else _attempt(picture, _mask_word(mask), method)
        tracing = _tracing(chosen.found, chosen.quality, chosen.method)
        masked = chosen.seconds
    else:
        started = time.perf_counter()
        pixels = check_mask(mask(picture) if callable(mask) else mask)
        masked = time.perf_counter() - started
        if pixels.shape != picture.shape[:2]:
            raise ValueError(f"mask must be as large as the image, {picture.shape[:2]}, got {pixels.shape}")
        found = _core.trace_lines(pixels, picture, method)
        tracing = _tracing(found, _quality(found), "given")
    tracing.timings = {"mask": masked, **tracing.timings}
    return tracing


def trace_mask(mask: ArrayLike, method: Method = "withe") -> Tracing:
    """Find every cable in a mask.

    Parameters
    ----------
    mask : array_like of shape (height, width)
        Booleans, or numbers where zero is background.
    method : {"withe", "mbest"}
        Method of this package, or the published one for comparison.

    Returns
    -------
    Tracing
        Tracing, which is empty if nothing resembles a cable: an empty or a full mask, or single pixels.

    Raises
    ------
    ValueError
        A mask of another shape or type, or values that are not finite.

    Examples
    --------
    >>> import numpy as np
    >>> mask = np.zeros((60, 200), bool)
    >>> mask[26:34, 20:180] = True
    >>> trace_mask(mask)
    <Tracing: 1 cable, 0 crossings, 0 joints>
    """
    _check_method(method)
    pixels = check_mask(mask)
    if 0 in pixels.shape:
        return Tracing(labels=np.zeros(pixels.shape, np.int32), mask_method="given")
    found = _core.trace_lines(pixels, None, method)
    return _tracing(found, _quality(found), "given")
