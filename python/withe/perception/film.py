"""Frames of films, by OpenCV."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from withe.common.extras import require
from withe.common.short_repr import ShortRepr

__all__ = ["FilmFrame", "read_film"]

_DEFAULT_RATE = 30.0  # of films whose file does not state it [1/s]


@dataclass(frozen=True, eq=False, repr=False)
class FilmFrame(ShortRepr):
    """A frame of a film.

    Attributes
    ----------
    time : float [s]
        Time since the first frame.
    image : ndarray of uint8, shape (height, width, 3)
        Red, green and blue.
    rate : float [1/s]
        Frames per second of the film.
    """

    time: float
    image: NDArray[np.uint8]
    rate: float


def read_film(path: str | os.PathLike[str]) -> Iterator[FilmFrame]:
    """Read the frames of a film, one at a time.

    Parameters
    ----------
    path : str or Path
        File in a format that `cv2.VideoCapture` reads, such as MP4 or AVI.

    Yields
    ------
    FilmFrame

    Raises
    ------
    ValueError
        The file does not exist, or holds no frame that OpenCV can read.
    ImportError
        OpenCV is not installed: ``pip install ".[vision]"`` in a clone of withe.
    """
    cv2 = require("cv2", "vision")
    if not Path(path).is_file():
        raise ValueError(f"path must be a film that can be read, got {os.fspath(path)!r}, which is not a file")
    capture = cv2.VideoCapture(os.fspath(path))
    try:
        stated = float(capture.get(cv2.CAP_PROP_FPS)) if capture.isOpened() else 0.0
        rate = stated if np.isfinite(stated) and stated > 0.0 else _DEFAULT_RATE
        number = 0
        while capture.isOpened():
            read, picture = capture.read()
            if not read:
                break
            yield FilmFrame(number / rate, np.ascontiguousarray(picture[..., ::-1]), rate)
            number += 1
        if number == 0:
            raise ValueError(
                f"path must be a film that can be read, got {os.fspath(path)!r}: convert it to MP4 with H.264, or to "
                "AVI with MJPG"
            )
    finally:
        capture.release()
