"""Pictures as arrays: checks of their shape and type, and files."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe.common.extras import require

__all__ = ["as_array", "check_image", "read_image"]


def as_array(values: ArrayLike, name: str) -> NDArray[Any]:
    """Return an array of any type, or raise ValueError with the name of the argument."""
    try:
        return np.asarray(values)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{name} must be an array, got rows of different lengths or no numbers: {error}") from None


def check_image(image: ArrayLike, name: str = "image") -> NDArray[np.uint8]:
    """Return a picture as RGB bytes, row by row, or raise ValueError with the reason."""
    array = as_array(image, name)
    shape = array.shape
    if array.ndim == 2:
        array = array[..., None]
    if array.ndim != 3 or array.shape[2] not in (1, 3, 4) or 0 in array.shape:
        raise ValueError(f"{name} must have shape (height, width, 3) and hold a pixel, got {shape}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got NaN or infinity")
    if array.dtype == np.bool_:
        array = array.astype(np.uint8) * 255
    if array.dtype != np.uint8:
        raise ValueError(f"{name} must be of type uint8, got {array.dtype}")
    if array.shape[2] == 1:
        array = np.repeat(array, 3, axis=2)
    return np.ascontiguousarray(array[..., :3])


def read_image(path: str | os.PathLike[str], name: str = "image") -> NDArray[np.uint8]:
    """Read a picture from a file as RGB bytes.

    Raises
    ------
    ValueError
        The file does not exist, or OpenCV cannot read it.
    """
    cv2 = require("cv2", "vision")
    try:
        content = np.fromfile(path, np.uint8)
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte in it
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"{name} must be a file that can be read, got {os.fspath(path)!r}: {reason}") from None
    picture = cv2.imdecode(content, cv2.IMREAD_COLOR) if len(content) else None
    if picture is None:
        raise ValueError(f"{name} must be a picture that can be read, got {os.fspath(path)!r}, which is not a picture")
    return np.ascontiguousarray(picture[..., ::-1])
