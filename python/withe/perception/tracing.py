"""Tracing: from an image or a mask to cables."""

from __future__ import annotations

import os
import time
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe import _core
from withe.common.user_warnings import warn
from withe.errors import PoorMaskWarning
from withe.perception.images import as_array, check_image, read_image
from withe.perception.mask_quality import compare_with_picture, measure_quality
from withe.perception.masks import MaskFunction, ground_filter
from withe.perception.results import Ambiguity, Crossing, Joint, Tracing

__all__ = ["check_mask", "trace", "trace_mask"]

Method = Literal["withe", "mbest"]


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


def _tracing(
    found: dict[str, Any], image: NDArray[np.uint8] | None = None, mask: NDArray[np.uint8] | None = None
) -> Tracing:
    """Return the tracing with the quality of its mask. With the picture that the mask was made of, compare both."""
    lines = found["centrelines"], found["widths"]
    quality = measure_quality(found["cover"], found["labelled"], *lines)
    if image is not None and mask is not None:
        quality = compare_with_picture(quality, image, mask, *lines)
    if not quality.is_good:
        warn(
            f"the mask does not look like cables: {', '.join(quality.reasons)}. Give mask= to trace, such as a "
            "color_filter, a network_mask or an array, or take a sharp picture on a plain ground",
            PoorMaskWarning,
        )
    return Tracing(
        mask_quality=quality,
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


def trace(
    image: ArrayLike | str | os.PathLike[str],
    mask: ArrayLike | MaskFunction | None = None,
    method: Method = "withe",
) -> Tracing:
    """Find every cable in a picture, and which one lies on top where they cross.

    Parameters
    ----------
    image : str, Path or array_like of shape (height, width, 3)
        A file, or red, green and blue as uint8. One channel (grey) and a fourth (alpha, ignored) are accepted.
    mask : array_like of shape (height, width), or callable, optional
        Pixels of cables: booleans or numbers, or a function from the picture to such an array, as `color_filter` and
        `network_mask` return. By default the pixels that differ from the ground (`ground_filter`).
    method : {"withe", "mbest"}
        Method of this package, or the published one for comparison.

    Returns
    -------
    Tracing

    Warns
    -----
    PoorMaskWarning
        The mask does not look like cables, or the picture is too noisy or too blurred for the default filter, so the
        tracing is probably wrong.

    Raises
    ------
    ValueError
        A picture that cannot be read or has another shape or type, or a mask of another size.
    ImportError
        A file was given and OpenCV is not installed: ``pip install ".[vision]"`` in a clone of withe.

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
    started = time.perf_counter()
    by_default = mask is None
    if mask is None:
        mask = ground_filter
    pixels = check_mask(mask(picture) if callable(mask) else mask)
    masked = time.perf_counter() - started
    if pixels.shape != picture.shape[:2]:
        raise ValueError(f"mask must be as large as the image, {picture.shape[:2]}, got {pixels.shape}")
    found = _core.trace_lines(pixels, picture, method)
    tracing = _tracing(found, picture, pixels) if by_default else _tracing(found)
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
        return Tracing(labels=np.zeros(pixels.shape, np.int32))
    return _tracing(_core.trace_lines(pixels, None, method))
