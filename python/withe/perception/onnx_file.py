"""ONNX files of convolutional networks, written without the package onnx.

The files use the protocol-buffer fields of the ONNX standard that a convolutional network needs, and no others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["FLOAT", "Graph"]

_IR_VERSION = 7  # of the ONNX format; OpenCV 4.8 and later read it
_OPSET = 11
FLOAT = 1  # TensorProto.DataType of 32 bits
_KINDS = {"float32": FLOAT, "int64": 7, "float16": 10}
# AttributeProto.AttributeType by the type of the value: a number, a text, or a list of integers.
_ATTRIBUTE_TYPES = {float: 1, int: 2, str: 3, list: 7}


def _varint(number: int) -> bytes:
    """Return an integer of seven bits a byte, the lowest first."""
    number &= (1 << 64) - 1
    parts = bytearray()
    while number > 0x7F:
        parts.append(number & 0x7F | 0x80)
        number >>= 7
    parts.append(number)
    return bytes(parts)


def _integer(tag: int, value: int) -> bytes:
    return _varint(tag << 3) + _varint(value)


def _block(tag: int, content: bytes | str) -> bytes:
    """Return a field with a length: a text, bytes, or a message."""
    content = content.encode() if isinstance(content, str) else content
    return _varint(tag << 3 | 2) + _varint(len(content)) + content


def _attribute(name: str, value: float | str | Sequence[int]) -> bytes:
    kind = _ATTRIBUTE_TYPES[type(value)]
    if isinstance(value, float):
        content = _varint(2 << 3 | 5) + np.float32(value).tobytes()
    elif isinstance(value, int):
        content = _integer(3, value)
    elif isinstance(value, str):
        content = _block(4, value)
    else:
        content = b"".join(_integer(8, each) for each in value)
    return _block(1, name) + content + _integer(20, kind)


def _tensor(name: str, values: NDArray[Any]) -> bytes:
    dims = b"".join(_integer(1, size) for size in values.shape)
    return (
        dims
        + _integer(2, _KINDS[values.dtype.name])
        + _block(8, name)
        + _block(9, np.ascontiguousarray(values).tobytes())
    )


def _value(name: str, shape: Sequence[int | str]) -> bytes:
    """Return the declaration of an input or output of floats. Sizes that vary are texts."""
    dims = b"".join(_block(1, _block(2, size) if isinstance(size, str) else _integer(1, size)) for size in shape)
    return _block(1, name) + _block(2, _block(1, _integer(1, FLOAT) + _block(2, dims)))


@dataclass
class Graph:
    """Operations of a network in the order of their computation.

    Attributes
    ----------
    nodes : list of bytes
        Encoded operations.
    weights : list of bytes
        Encoded constants.
    """

    nodes: list[bytes] = field(default_factory=list)
    weights: list[bytes] = field(default_factory=list)

    def add(self, kind: str, inputs: Sequence[str], constants: Mapping[str, NDArray[Any]], **attributes: Any) -> str:
        """Add an operation of an ONNX kind, and return the name of its output.

        Parameters
        ----------
        kind : str
            Kind of the operation, such as "Conv".
        inputs : sequence of str
            Names of earlier outputs, of the constants, or "" for an input that is left out.
        constants : mapping of str to ndarray of float32, float16 or int64
            Weights that are among the inputs.
        **attributes : float, int, str or list of int
            Attributes of the operation.
        """
        output = f"{kind.lower()}_{len(self.nodes)}"
        self.weights += [_tensor(name, values) for name, values in constants.items()]
        content = b"".join(_block(1, name) for name in inputs) + _block(2, output) + _block(3, output) + _block(4, kind)
        content += b"".join(_block(5, _attribute(name, value)) for name, value in attributes.items())
        self.nodes.append(content)
        return output

    def to_bytes(
        self, source: tuple[str, Sequence[int | str]], result: tuple[str, Sequence[int | str]], note: Mapping[str, str]
    ) -> bytes:
        """Return the content of an ONNX file.

        Parameters
        ----------
        source, result : (str, sequence of int or str)
            Name and shape of the input and of the output. Sizes that vary are texts.
        note : mapping of str to str
            Properties that are kept in the file.
        """
        graph = b"".join(_block(1, node) for node in self.nodes) + _block(2, "network")
        graph += b"".join(_block(5, values) for values in self.weights)
        graph += _block(11, _value(*source)) + _block(12, _value(*result))
        content = _integer(1, _IR_VERSION) + _block(2, "withe") + _block(7, graph)
        content += _block(8, _block(1, "") + _integer(2, _OPSET))
        return content + b"".join(_block(14, _block(1, name) + _block(2, text)) for name, text in note.items())
