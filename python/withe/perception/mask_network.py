"""The network of the learned mask: its layers, as a torch module for training and as an ONNX file for use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from withe.common.extras import require
from withe.perception.onnx_file import FLOAT, Graph

__all__ = ["LAYERS", "MULTIPLE", "as_written", "make_module", "to_onnx"]

MULTIPLE = 32  # the height and the width of the network's input are multiples of it [px]
_NEARLY_ZERO = 1e-5  # added to variances in batch normalization

Value = TypeVar("Value")


@dataclass(frozen=True)
class Layer:
    """A convolution, with normalization and a rectifier except in the last layer.

    Attributes
    ----------
    inputs, outputs : int
        Numbers of channels.
    kernel, stride, dilation : int [px]
    """

    inputs: int
    outputs: int
    kernel: int = 3
    stride: int = 1
    dilation: int = 1

    @property
    def padding(self) -> int:
        """Return the padding on each side, which keeps the size at stride 1."""
        return self.dilation * (self.kernel // 2)


# An encoder to 1/32 of the size, and a decoder to 1/2. The head has a channel for each of four pixels of the picture.
# The deep layers know what surrounds a cable, and cost little: they have a thousandth of the pixels.
LAYERS = {
    "half_1": Layer(3, 16, stride=2),
    "quarter_1": Layer(16, 32, stride=2),
    "quarter_2": Layer(32, 32),
    "eighth_1": Layer(32, 48, stride=2),
    "eighth_2": Layer(48, 48),
    "sixteenth_1": Layer(48, 72, stride=2),
    "sixteenth_2": Layer(72, 72, dilation=2),
    "thirtysecond_1": Layer(72, 96, stride=2),
    "thirtysecond_2": Layer(96, 96, dilation=2),
    "thirtysecond_3": Layer(96, 72),
    "sixteenth_3": Layer(72, 48),
    "eighth_3": Layer(48, 48),
    "eighth_4": Layer(48, 32, kernel=1),
    "quarter_3": Layer(32, 32),
    "quarter_4": Layer(32, 16, kernel=1),
    "half_2": Layer(16, 16),
    "head": Layer(16, 4, kernel=1),
}


def _scores(
    picture: Value,
    layer: Callable[[str, Value], Value],
    doubled: Callable[[Value], Value],
    plus: Callable[[Value, Value], Value],
) -> Value:
    """Pass a picture through the layers, with the operations of torch or of an ONNX graph."""
    half = layer("half_1", picture)
    quarter = layer("quarter_2", layer("quarter_1", half))
    eighth = layer("eighth_2", layer("eighth_1", quarter))
    sixteenth = layer("sixteenth_2", layer("sixteenth_1", eighth))
    thirtysecond = layer("thirtysecond_3", layer("thirtysecond_2", layer("thirtysecond_1", sixteenth)))
    sixteenth = layer("sixteenth_3", plus(sixteenth, doubled(thirtysecond)))
    eighth = layer("eighth_4", layer("eighth_3", plus(eighth, doubled(sixteenth))))
    quarter = layer("quarter_4", layer("quarter_3", plus(quarter, doubled(eighth))))
    return layer("head", layer("half_2", plus(half, doubled(quarter))))


def make_module() -> Any:
    """Return the network as a torch module that maps pictures, shape (n, 3, height, width), to logits (n, 1, ...)."""
    torch = require("torch", "learn")
    nn, functional = torch.nn, torch.nn.functional

    class CableNetwork(nn.Module):  # type: ignore[misc, name-defined]
        def __init__(self) -> None:
            super().__init__()
            self.layers = nn.ModuleDict({name: self._block(name, layer) for name, layer in LAYERS.items()})

        @staticmethod
        def _block(name: str, layer: Layer) -> Any:
            last = name == "head"
            convolution = nn.Conv2d(
                layer.inputs, layer.outputs, layer.kernel, layer.stride, layer.padding, layer.dilation, bias=last
            )
            if last:
                return convolution
            norm = nn.BatchNorm2d(layer.outputs, eps=_NEARLY_ZERO)
            return nn.Sequential(convolution, norm, nn.ReLU(inplace=True))

        def forward(self, pictures: Any) -> Any:
            scores = _scores(
                pictures - 0.5,
                lambda name, x: self.layers[name](x),
                lambda x: functional.interpolate(x, scale_factor=2, mode="nearest"),
                lambda x, y: x + y,
            )
            return functional.pixel_shuffle(scores, 2)

    return CableNetwork()


def _folded(weights: Mapping[str, NDArray[Any]], name: str) -> tuple[NDArray[np.float16], NDArray[np.float32]]:
    """Return the kernel of a layer with its normalization, rounded to 16 bits, and the bias."""
    stem = f"layers.{name}"
    if name == "head":
        return weights[f"{stem}.weight"].astype(np.float16), weights[f"{stem}.bias"].astype(np.float32)
    kernel = weights[f"{stem}.0.weight"].astype(float)
    mean, variance = (weights[f"{stem}.1.running_{word}"].astype(float) for word in ("mean", "var"))
    scale = weights[f"{stem}.1.weight"] / np.sqrt(variance + _NEARLY_ZERO)
    bias = weights[f"{stem}.1.bias"] - mean * scale
    return (kernel * scale[:, None, None, None]).astype(np.float16), bias.astype(np.float32)


def as_written(weights: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Return a state of the torch module whose layers are those of the ONNX file, with their normalization folded in.

    Parameters
    ----------
    weights : mapping of str to ndarray
        State of the torch module.
    """
    result = dict(weights)
    for name in LAYERS:
        kernel, bias = _folded(weights, name)
        stem = f"layers.{name}"
        if name == "head":
            result.update({f"{stem}.weight": kernel.astype(np.float32), f"{stem}.bias": bias})
            continue
        result[f"{stem}.0.weight"] = kernel.astype(np.float32)
        one = np.ones_like(bias)
        result |= {f"{stem}.1.weight": one * np.float32(np.sqrt(1 + _NEARLY_ZERO)), f"{stem}.1.bias": bias}
        result |= {f"{stem}.1.running_mean": 0 * one, f"{stem}.1.running_var": one}
    return result


def to_onnx(weights: Mapping[str, NDArray[Any]], note: Mapping[str, str]) -> bytes:
    """Return the network as an ONNX file, from RGB, 0 to 1, to probabilities of a cable.

    The output has four channels at half the size: the pixels of each square of 2 x 2, row by row. OpenCV unfolds them
    slower than NumPy does.

    Parameters
    ----------
    weights : mapping of str to ndarray
        State of the torch module.
    note : mapping of str to str
        Properties that are kept in the file, such as the seed.
    """
    graph = Graph()

    def layer(name: str, source: str) -> str:
        shape = LAYERS[name]
        kernel, bias = _folded(weights, name)
        half = graph.add("Cast", [f"{name}.kernel"], {f"{name}.kernel": kernel}, to=FLOAT)
        output = graph.add(
            "Conv",
            [source, half, f"{name}.bias"],
            {f"{name}.bias": bias},
            kernel_shape=[shape.kernel] * 2,
            strides=[shape.stride] * 2,
            pads=[shape.padding] * 4,
            dilations=[shape.dilation] * 2,
            group=1,
        )
        return output if name == "head" else graph.add("Relu", [output], {})

    def doubled(source: str) -> str:
        scales = {} if "scales" in known else {"scales": np.array([1, 1, 2, 2], np.float32)}
        known.add("scales")
        return graph.add(
            "Resize",
            [source, "", "scales"],
            scales,
            mode="nearest",
            nearest_mode="floor",
            coordinate_transformation_mode="asymmetric",
        )

    known: set[str] = set()
    half = np.array([0.5], np.float32)
    centred = graph.add("Sub", ["image", "half"], {"half": half})
    logits = _scores(centred, layer, doubled, lambda x, y: graph.add("Add", [x, y], {}))
    result = graph.add("Sigmoid", [logits], {})
    picture, quarters = (1, 3, "height", "width"), (1, 4, "half_height", "half_width")
    return graph.to_bytes(("image", picture), (result, quarters), note)
