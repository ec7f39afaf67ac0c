"""Calibration of a lens from pictures of a board."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe.common.extras import require
from withe.perception.boards import CharucoBoard, Chessboard
from withe.perception.images import check_image, read_image

__all__ = ["Lens", "calibrate_lens"]

Array = NDArray[np.float64]

FEWEST = 3  # least number of pictures that show the board
_LEAST_TILT = np.radians(5.0)  # least angle between the normals of two boards
_OFF = 2.0  # greatest reprojection error of a sharp board that is measured correctly [px]


@dataclass(frozen=True, eq=False)
class Lens:
    """Matrix, distortion, and the root mean square distance of corners from their projections [px]."""

    matrix: Array
    distortion: Array
    error: float


@contextmanager
def _one_thread(cv2: Any) -> Iterator[None]:
    """Let OpenCV use one thread: it adds the sums of several in the order in which they end, which varies."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def calibrate_lens(images: Iterable[ArrayLike | str | os.PathLike[str]], board: Chessboard | CharucoBoard) -> Lens:
    """Find the matrix and distortion of a camera, by OpenCV. `Camera.calibrate` has the arguments and errors."""
    if not isinstance(board, Chessboard | CharucoBoard):
        raise ValueError(f"board must be a Chessboard or a CharucoBoard, got {type(board).__name__}")
    if isinstance(images, str | os.PathLike):
        raise ValueError("images must be a sequence of pictures, got one path: pass a list of at least three")
    cv2: Any = require("cv2", "vision")
    shape: tuple[int, int] | None = None
    seen, places, given = [], [], 0
    for number, image in enumerate(images):
        name = f"images[{number}]"
        picture = read_image(image, name) if isinstance(image, str | os.PathLike) else check_image(image, name)
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        if shape is not None and grey.shape != shape:
            raise ValueError(
                f"{name} must have {shape[0]} rows and {shape[1]} columns as the first picture, got {grey.shape[0]} "
                f"and {grey.shape[1]}: use pictures of one camera, uncropped"
            )
        shape = (grey.shape[0], grey.shape[1])
        given += 1
        found = board.find(grey)
        if found is not None:
            seen.append(found[0].astype(np.float32))
            places.append(np.column_stack([found[1], np.zeros(len(found[1]))]).astype(np.float32))
    if len(seen) < FEWEST or shape is None:
        raise ValueError(
            f"images must show the board in at least {FEWEST} pictures, got {len(seen)} of {given}: check the "
            "numbers of squares of the board, and take sharp pictures in which the tilted board fills much of the frame"
        )
    # Boards that do not fill the corners of the picture hardly determine k3, the coefficient of r^6.
    with _one_thread(cv2):
        error, matrix, distortion, turns, _ = cv2.calibrateCamera(
            places, seen, shape[::-1], None, None, flags=cv2.CALIB_FIX_K3
        )
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    cosines = np.clip(normals @ normals.T, -1.0, 1.0)
    if np.arccos(cosines.min()) < _LEAST_TILT:
        raise ValueError(
            "images must show the board from different directions, got boards that are all parallel: tilt the board by "
            "20 to 40 degrees about both axes"
        )
    if not error < _OFF:
        raise ValueError(
            f"images must agree with one camera, got a reprojection error of {error:.2g} px: check the numbers of "
            "squares of the board, keep it flat, and use one focus and zoom"
        )
    return Lens(np.asarray(matrix, np.float64), np.asarray(distortion, np.float64).ravel()[:5], float(error))
