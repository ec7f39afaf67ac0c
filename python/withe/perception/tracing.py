"""From an image or a mask to cables."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe import _core
from withe.perception.results import Ambiguity, Crossing, Joint, Tracing

__all__ = ["trace_mask"]


def check_mask(mask: ArrayLike, name: str = "mask") -> NDArray[np.uint8]:
    """A mask as bytes, row by row, or a ValueError that says what is wrong with it."""
    array = np.asarray(mask)
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


def _tracing(found: dict[str, Any]) -> Tracing:
    return Tracing(
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


def trace_mask(mask: ArrayLike) -> Tracing:
    """Find every cable in a mask.

    Parameters
    ----------
    mask : array_like of shape (height, width)
        Booleans, or numbers of which zero is background.

    Returns
    -------
    Tracing
        Empty where there is nothing like a cable: an empty or a full mask, single pixels.

    Raises
    ------
    ValueError
        A mask of another shape or type, or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> mask = np.zeros((60, 200), bool)
    >>> mask[26:34, 20:180] = True
    >>> trace_mask(mask)
    <Tracing: 1 cables, 0 crossings, 0 joints>
    """
    pixels = check_mask(mask)
    if 0 in pixels.shape:
        return Tracing(labels=np.zeros(pixels.shape, np.int32))
    return _tracing(_core.trace_lines(pixels))
