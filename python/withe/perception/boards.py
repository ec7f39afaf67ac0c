"""Boards for the calibration of cameras: chessboards and ChArUco boards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withe.common import validation
from withe.common.extras import require

__all__ = ["CharucoBoard", "Chessboard"]

Array = NDArray[np.float64]
_WINDOW = 11  # half size of the window that refines a corner, at most [px]
_CLEAR = 0.3  # half size of this window on a chessboard, relative to the distance of corners
_DICTIONARIES = ("4X4_50", "4X4_100", "4X4_250", "5X5_50", "5X5_100", "5X5_250", "6X6_50", "6X6_100", "6X6_250")


@dataclass(frozen=True)
class Chessboard:
    """A chessboard for `Camera.calibrate`.

    Parameters
    ----------
    columns, rows : int
        Numbers of squares, at least 4. One should be odd and the other even, so that the board has one way up.
    square : float [m]
        Side of a square.

    Raises
    ------
    ValueError
        Fewer than 4 squares, or a side that is not positive.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        _check_squares(self)

    def picture(self, pixels: int = 80) -> NDArray[np.uint8]:
        """Draw the board for printing, with a border of one square.

        Parameters
        ----------
        pixels : int
            Pixels per square.

        Returns
        -------
        ndarray of uint8, shape ((rows + 2) pixels, (columns + 2) pixels)

        Raises
        ------
        ValueError
            Fewer than 8 pixels.
        """
        pixels = validation.integer(pixels, "pixels", 8, 2000)
        dark = np.add.outer(np.arange(self.rows), np.arange(self.columns)) % 2 == 0
        cells = np.pad(np.where(dark, np.uint8(0), np.uint8(255)), 1, constant_values=255)
        return np.kron(cells, np.ones((pixels, pixels), np.uint8))

    def find(self, picture: NDArray[np.uint8]) -> tuple[Array, Array] | None:
        """Find the inner corners of the board in a picture.

        Parameters
        ----------
        picture : ndarray of uint8, shape (height, width)
            Grey picture.

        Returns
        -------
        pair of ndarray of shape (n, 2), or None
            Corners in the picture [px], and on the board [m], from the outer corner of the first square. None if the
            picture does not show the whole board.

        Raises
        ------
        ImportError
            OpenCV is not installed.
        """
        cv2: Any = require("cv2", "vision")
        inner = self.columns - 1, self.rows - 1
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
        found, corners = cv2.findChessboardCorners(picture, inner, flags=flags)
        if not found:
            return None
        column, row = np.meshgrid(np.arange(1, self.columns), np.arange(1, self.rows))
        places = np.column_stack([column.ravel(), row.ravel()]).astype(np.float64) * self.square
        return _refined(picture, np.asarray(corners, np.float64).reshape(-1, 2), _CLEAR), places


@dataclass(frozen=True)
class CharucoBoard:
    """A chessboard with a marker in each white square, for `Camera.calibrate`. A part of the board suffices.

    Parameters
    ----------
    columns, rows : int
        Numbers of squares, at least 4.
    square, marker : float [m]
        Sides of a square and of a marker, which is smaller.
    dictionary : str
        Markers of OpenCV, such as "4X4_50" or "5X5_100".

    Raises
    ------
    ValueError
        Fewer than 4 squares, a side that is not positive, a marker that does not fit into a square, an unknown
        dictionary, or a dictionary with too few markers.
    """

    columns: int
    rows: int
    square: float
    marker: float
    dictionary: str = "4X4_50"

    def __post_init__(self) -> None:
        _check_squares(self)
        object.__setattr__(self, "marker", validation.positive(self.marker, "marker"))
        if not self.marker < self.square:
            raise ValueError(
                f"marker must be smaller than square, {self.square:g} m, got {self.marker:g} m: measure both on the "
                "printed board"
            )
        validation.choice(self.dictionary, "dictionary", _DICTIONARIES)
        needed, held = self.columns * self.rows // 2, int(self.dictionary.split("_")[1])
        if needed > held:
            raise ValueError(f"dictionary must hold {needed} markers, got {self.dictionary!r} with {held}")

    def _made(self) -> Any:
        """Return the board of OpenCV."""
        cv2: Any = require("cv2", "vision")
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{self.dictionary}"))
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.marker, dictionary)

    def picture(self, pixels: int = 80) -> NDArray[np.uint8]:
        """Draw the board for printing, with a border of one square.

        Parameters
        ----------
        pixels : int
            Pixels per square.

        Returns
        -------
        ndarray of uint8, shape ((rows + 2) pixels, (columns + 2) pixels)

        Raises
        ------
        ValueError
            Fewer than 8 pixels.
        ImportError
            OpenCV is not installed.
        """
        pixels = validation.integer(pixels, "pixels", 8, 2000)
        size = (self.columns + 2) * pixels, (self.rows + 2) * pixels
        return np.asarray(self._made().generateImage(size, marginSize=pixels), np.uint8)

    def find(self, picture: NDArray[np.uint8]) -> tuple[Array, Array] | None:
        """Find the inner corners of the board in a picture.

        Parameters
        ----------
        picture : ndarray of uint8, shape (height, width)
            Grey picture.

        Returns
        -------
        pair of ndarray of shape (n, 2), or None
            Corners in the picture [px], and on the board [m], from the outer corner of the first square. None if the
            picture shows fewer than six corners.

        Raises
        ------
        ImportError
            OpenCV is not installed.
        """
        cv2: Any = require("cv2", "vision")
        board = self._made()
        corners, numbers, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(picture)
        if numbers is None or len(numbers) < 6:
            return None
        places = np.asarray(board.getChessboardCorners(), np.float64)[np.ravel(numbers), :2]
        clear = min(_CLEAR, 0.5 * (1.0 - self.marker / self.square))
        return _refined(picture, np.asarray(corners, np.float64).reshape(-1, 2), clear), places


def _refined(picture: NDArray[np.uint8], corners: Array, clear: float) -> Array:
    """Return corners of squares to fractions of a pixel, by windows that hold no other corner and no marker."""
    cv2: Any = require("cv2", "vision")
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    half = int(np.clip(clear * np.median(apart.min(axis=1)), 2, _WINDOW))
    start = np.ascontiguousarray(corners.reshape(-1, 1, 2), np.float32)
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
    found = cv2.cornerSubPix(picture, start, (half, half), (-1, -1), stop)
    return np.asarray(found, np.float64).reshape(-1, 2)


def _check_squares(board: Any) -> None:
    for name in ("columns", "rows"):
        object.__setattr__(board, name, validation.integer(getattr(board, name), name, 4, 100))
    object.__setattr__(board, "square", validation.positive(board.square, "square"))
