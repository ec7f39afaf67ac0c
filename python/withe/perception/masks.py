"""Masks of cable pixels: by contrast with the ground or the border, by colour, or by a network."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from withe import _core
from withe.common.extras import require

__all__ = ["MaskFunction", "border_filter", "color_filter", "ground_filter", "has_dark_ground", "network_mask"]

_CONTRAST = 25  # least difference of a cable from the ground [grey levels]

Image = NDArray[np.uint8]
MaskFunction = Callable[[Image], Any]
Range = tuple[Sequence[int], Sequence[int]]

_HIGHEST = (180, 255, 255)


def ground_filter(image: Image, contrast: int = _CONTRAST) -> NDArray[np.bool_]:
    """Return the pixels that differ from the ground by more than a shadow can. This is the default filter.

    The filter suits cables on a ground of one colour or of weak texture, such as plain wood, under uneven light and
    with soft shadows. It does not find a cable whose colour is a shade of the ground.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        Red, green, blue.
    contrast : int
        Least difference of a cable from the ground [grey levels].

    Returns
    -------
    ndarray of bool, shape (height, width)

    Notes
    -----
    The logarithms of the channels are compared with a quadratic surface through the ground, fitted by robust least
    squares. A shadow lowers the three logarithms alike, to no less than 0.26 of the light. A pixel therefore counts if
    its ratios of the channels differ, if it is brighter than the ground, or if it is darker than a shadow. Thresholds
    are five standard deviations of the ground. On a ground so dark that its shadows are below `contrast`, the result is
    that of `border_filter`.
    """
    mask: NDArray[np.bool_] = _core.ground_mask(image, contrast).view(np.bool_)
    return mask


def has_dark_ground(image: Image) -> bool:
    """Return True if the ground of a picture is so dark that cables are brighter, and shadows do not count."""
    return _core.has_dark_ground(image, _CONTRAST)


def border_filter(image: Image, contrast: int = _CONTRAST) -> NDArray[np.bool_]:
    """Return the pixels that differ from the median colour of the image's border.

    The threshold on the largest difference of a channel is the one that separates two classes best (Otsu). It uses
    square roots, so that dark cables are found beside bright ones.

    Parameters
    ----------
    image : ndarray of uint8, shape (height, width, 3)
        Red, green, blue.
    contrast : int
        Least difference of the two classes; with less contrast nothing is found [grey levels].

    Returns
    -------
    ndarray of bool, shape (height, width)
    """
    mask: NDArray[np.bool_] = _core.foreground_mask(image, contrast).view(np.bool_)
    return mask


def color_filter(ranges: Sequence[Range], clean: bool = True) -> MaskFunction:
    """Return a filter for pixels whose colour lies in one of several ranges.

    Parameters
    ----------
    ranges : sequence of (lowest, highest)
        Hue 0 to 180 (half degrees), saturation and value 0 to 255, all inclusive, as in OpenCV. If the lowest hue
        exceeds the highest, the range passes through red.
    clean : bool
        Close, then open, the mask by a square of 3 x 3 pixels.

    Returns
    -------
    callable
        Function from an image of shape (height, width, 3), uint8 RGB, to a mask, for the argument `mask` of `trace`.

    Raises
    ------
    ValueError
        No range, or bounds that are not three numbers within their limits.

    Examples
    --------
    >>> reds = color_filter([((170, 60, 60), (10, 255, 255))])
    >>> bool(reds(np.full((1, 1, 3), (200, 30, 30), np.uint8))[0, 0])
    True
    """
    checked: list[tuple[list[int], list[int]]] = []
    if len(ranges) == 0:
        raise ValueError("ranges must hold at least one pair of colours, got none")
    for index, pair in enumerate(ranges):
        bounds = np.asarray(pair, dtype=object)
        if bounds.shape != (2, 3):
            raise ValueError(f"ranges[{index}] must be a pair of (hue, saturation, value), got {pair!r}")
        values = np.asarray(pair, dtype=float)
        if not ((values >= 0) & (values <= _HIGHEST)).all() or (values != np.round(values)).any():
            raise ValueError(f"ranges[{index}] must hold integers from 0 to (180, 255, 255), got {pair!r}")
        low, high = values.astype(int).tolist()
        if (values[0, 1:] > values[1, 1:]).any():
            raise ValueError(f"ranges[{index}] must go from the lowest to the highest, got {pair!r}")
        if low[0] > high[0]:
            checked += [(low, [180, *high[1:]]), ([0, *low[1:]], high)]
        else:
            checked.append((low, high))

    def apply(image: Image) -> NDArray[np.bool_]:
        mask = _core.hsv_mask(image, checked)
        result: NDArray[np.bool_] = (_core.close_and_open(mask) if clean else mask).view(np.bool_)
        return result

    return apply


def network_mask(model: Any, threshold: float = 0.5, size: tuple[int, int] | None = None) -> MaskFunction:
    """Return a filter that uses a segmentation network.

    Parameters
    ----------
    model : str, Path, or torch.nn.Module
        An ONNX file (run by OpenCV), a TorchScript file (.pt), or a module. Its input is one image of shape
        (1, 3, height, width), RGB from 0 to 1. Its output is one value per pixel, of shape (1, 1, height, width) or
        without leading ones. Of several channels the last is used.
    threshold : float [-]
        Pixels above it belong to cables.
    size : (int, int), optional
        Height and width of the network's input. The image is resized to it, and the result is resized back.

    Returns
    -------
    callable
        Filter for `trace`: a function from an image to a mask of shape (height, width).

    Raises
    ------
    ValueError
        A file that cannot be read, or (on use) a result of another shape, or a network of a fixed size without `size`.
    ImportError
        OpenCV or torch is not installed.
    """
    run = _onnx_runner(Path(model)) if _is_onnx(model) else _torch_runner(model)

    def apply(image: Image) -> NDArray[np.bool_]:
        given = image.shape[:2]
        if size is not None:
            image = require("cv2", "vision").resize(image, (size[1], size[0]))
        blob = np.ascontiguousarray(image.transpose(2, 0, 1)[None], dtype=np.float32) / np.float32(255)
        answer = np.asarray(run(blob), dtype=np.float32)
        answer = answer.reshape(answer.shape[-3:]) if answer.ndim > 3 else answer
        score = answer[-1] if answer.ndim == 3 else answer
        if score.shape != image.shape[:2]:
            raise ValueError(f"model must return one value per pixel, of shape {image.shape[:2]}, got {score.shape}")
        if not np.isfinite(score).all():
            raise ValueError("model must return finite values, got NaN or infinity")
        if score.shape != given:
            score = require("cv2", "vision").resize(score, (given[1], given[0]))
        mask: NDArray[np.bool_] = score > threshold
        return mask

    return apply


def _is_onnx(model: Any) -> bool:
    if isinstance(model, str | Path):
        if not Path(model).is_file():
            raise ValueError(f"model must be a file or a torch module, got {str(model)!r}, which is not a file")
        return Path(model).suffix.lower() == ".onnx"
    if not callable(model):
        raise ValueError(f"model must be a file or a torch module, got {type(model).__name__}")
    return False


def _onnx_runner(path: Path) -> Callable[[NDArray[np.float32]], Any]:
    cv2 = require("cv2", "vision")
    try:
        network = cv2.dnn.readNetFromONNX(str(path))
    except cv2.error as error:
        raise ValueError(f"model must be an ONNX file that OpenCV can read, got {str(path)!r}: {error}") from error

    def run(blob: NDArray[np.float32]) -> Any:
        network.setInput(blob)
        try:
            return network.forward()
        except cv2.error as error:
            size = blob.shape[2:]
            raise ValueError(
                f"model must take a picture of {size[0]} x {size[1]} px, and OpenCV cannot run it at this size. If the "
                f"network has a fixed size, give size=(height, width): {error}"
            ) from error

    return run


def _torch_runner(model: Any) -> Callable[[NDArray[np.float32]], Any]:
    torch = require("torch", "learn")
    if isinstance(model, str | Path):
        try:
            model = torch.jit.load(str(model), map_location="cpu")
        except RuntimeError as error:
            raise ValueError(f"model must be an ONNX or TorchScript file, got {str(model)!r}: {error}") from error
    if hasattr(model, "eval"):
        model.eval()

    def run(blob: NDArray[np.float32]) -> Any:
        with torch.no_grad():
            return model(torch.from_numpy(blob)).cpu().numpy()

    return run
