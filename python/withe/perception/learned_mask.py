"""The learned mask: a small network, shipped with withe, that finds cables on any ground. OpenCV runs it."""

from __future__ import annotations

import threading
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withe.common import validation
from withe.common.extras import require
from withe.perception.mask_network import MULTIPLE

__all__ = ["LIKELY", "SHIPPED", "cable_probability", "can_run", "learned_filter", "least_width"]

Image = NDArray[np.uint8]

SHIPPED = Path(__file__).parent / "mask.onnx"
LIKELY = 0.5  # probability above which a pixel is in the mask
_LONGEST = 960  # a larger picture is reduced to this width or height, at which cables are as wide as in training [px]
_NARROWEST = 3.5  # cables in the training are 4 px wide or more [px]
_BLACK = 12  # darker pixels are brightened to this level: no picture in the training has a ground of pure black
_in_use = threading.Lock()  # OpenCV's networks serve one thread at a time


def learned_filter(image: Image, threshold: float = LIKELY) -> NDArray[np.bool_]:
    """Return the pixels that the shipped network takes for cables.

    The network was trained on made pictures of cables, 4 to 18 px wide, on cluttered grounds.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        Red, green, blue.
    threshold : float [-]
        Pixels whose probability is above it belong to cables, between 0 and 1.

    Returns
    -------
    ndarray of bool, shape (height, width)

    Raises
    ------
    ValueError
        A threshold that is not between 0 and 1.
    FileNotFoundError
        The file of the network is missing. ``withe train-mask`` makes it.
    ImportError
        OpenCV is not installed.
    """
    return np.asarray(cable_probability(image) > validation.share(threshold, "threshold"))


def cable_probability(image: Image, path: Path = SHIPPED) -> NDArray[np.float32]:
    """Return the probability that each pixel belongs to a cable, from 0 to 1, shape (height, width).

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        Red, green, blue. A picture of more than 960 px is reduced, and the result enlarged.
    path : Path
        Network, as `withe.perception.mask_training.train_mask` writes it.

    Raises
    ------
    ValueError
        A file that is not such a network.
    FileNotFoundError
        The file of the network is missing.
    ImportError
        OpenCV is not installed.
    """
    cv2 = require("cv2", "vision")
    network = _network(path)
    height, width = image.shape[:2]
    factor = _reduction(image)
    if factor < 1:
        size = max(1, round(width * factor)), max(1, round(height * factor))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    rows, columns = image.shape[:2]
    image = np.maximum(image, _BLACK)
    padding = ((0, -rows % MULTIPLE), (0, -columns % MULTIPLE), (0, 0))
    blob = cv2.dnn.blobFromImage(np.pad(image, padding, mode="symmetric"), 1 / 255)
    with _in_use:
        network.setInput(blob)
        quarters = np.array(network.forward())
    _, _, half_rows, half_columns = quarters.shape
    unfolded = quarters.reshape(2, 2, half_rows, half_columns).transpose(2, 0, 3, 1)
    result: NDArray[np.float32] = unfolded.reshape(2 * half_rows, 2 * half_columns)[:rows, :columns]
    if factor < 1:
        result = cv2.resize(np.ascontiguousarray(result), (width, height), interpolation=cv2.INTER_LINEAR)
    return np.ascontiguousarray(result)


def _reduction(image: Image) -> float:
    return float(min(1.0, _LONGEST / max(image.shape[:2])))


def least_width(image: Image) -> float:
    """Return the width of the thinnest cables in a picture that the network was trained to see [px]."""
    return _NARROWEST / _reduction(image)


def can_run() -> bool:
    """Return True if OpenCV is installed and the network is there."""
    try:
        require("cv2", "vision")
    except ImportError:
        return False
    return SHIPPED.is_file()


@cache
def _network(path: Path) -> Any:
    cv2 = require("cv2", "vision")
    if not path.is_file():
        raise FileNotFoundError(
            f"the learned mask needs its network, and {path} is missing. Install withe again, or train the network: "
            "withe train-mask"
        )
    content = np.frombuffer(path.read_bytes(), np.uint8)
    try:
        # The older of OpenCV 5's two engines is faster for convolutions, and like that of OpenCV 4.
        classic = getattr(cv2.dnn, "ENGINE_CLASSIC", None)
        network = cv2.dnn.readNetFromONNX(content) if classic is None else cv2.dnn.readNetFromONNX(content, classic)
        network.setInput(np.zeros((1, 3, MULTIPLE, MULTIPLE), np.float32))
        shape = network.forward().shape
    except cv2.error as error:
        raise ValueError(f"{path} must be a network of withe train-mask, and OpenCV cannot run it: {error}") from error
    if shape != (1, 4, MULTIPLE // 2, MULTIPLE // 2):
        raise ValueError(f"{path} must be a network of withe train-mask, got a result of shape {shape}")
    return network
