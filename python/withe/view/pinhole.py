"""Pictures for a camera of given pose and matrix, whose pixels can be converted to metres."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

__all__ = ["Pinhole", "check_pinhole", "look_through", "towards"]

FloatArray = npt.NDArray[np.float64]

_NEAREST = 1e-4  # least visible distance, relative to that of the farthest point


@runtime_checkable
class Pinhole(Protocol):
    """Camera of a picture, such as `withe.perception.Camera`.

    A point X of the world has the coordinates R X + t = (x, y, z) in the camera, with z forwards. Its pixel is the
    first two rows of the matrix times (x / z, y / z, 1), where (0, 0) is the centre of the first pixel.
    """

    matrix: FloatArray
    distortion: FloatArray
    rotation: FloatArray
    translation: FloatArray


def check_pinhole(camera: Pinhole) -> None:
    """Raise ValueError for a camera that is no pinhole camera, or whose pose is unknown."""
    if np.any(camera.distortion):
        raise ValueError(
            f"distortion of the camera must be zero, for pictures have no lens, got {np.ravel(camera.distortion)}"
        )
    if getattr(camera, "_flat", False):
        raise ValueError("camera must have a pose, but was calibrated on a plane only: give its matrix to from_points")


def towards(camera: Pinhole) -> FloatArray:
    """Unit vector from the centre of the view to the camera."""
    return np.asarray(-camera.rotation[2], np.float64)


def look_through(view: Any, camera: Pinhole, size: tuple[int, int], points: FloatArray) -> None:
    """Give PyVista's camera a pose and a matrix.

    Parameters
    ----------
    view : pyvista.Camera
    camera : Pinhole
    size : pair of int [px]
    points : ndarray of shape (n, 3) [m]
        Points in view, which determine the resolved range of depth.

    Raises
    ------
    ValueError
        All points lie behind the camera.
    """
    depths = points @ camera.rotation[2] + camera.translation[2]
    if not depths.max() > 0.0:
        raise ValueError(
            "camera must see the rods, but the rods lie behind the camera: rotation and translation must map the "
            "world to the camera, which looks along its z axis"
        )
    place = -camera.rotation.T @ camera.translation
    view.position = place
    view.focal_point = place + float(depths[depths > 0.0].mean()) * camera.rotation[2]
    view.up = -camera.rotation[1]
    far = 4.0 * float(depths.max())
    near = max(0.25 * float(depths.min()), _NEAREST * far)
    view.clipping_range = near, far
    view.SetExplicitProjectionTransformMatrix(_matrix(view, _projection(camera.matrix, size, near, far)))
    view.UseExplicitProjectionTransformMatrixOn()


def _projection(matrix: FloatArray, size: tuple[int, int], near: float, far: float) -> FloatArray:
    """Return the matrix from coordinates x right, y up, z backwards to the clip coordinates of OpenGL.

    Pixel (u, v), counted from the middle of the first, lies at 2 (u + 1/2) / width - 1 and 1 - 2 (v + 1/2) / height.
    """
    width, height = size
    (m00, m01, m02), (m10, m11, m12) = matrix[:2]
    return np.array(
        [
            [2.0 * m00 / width, -2.0 * m01 / width, 1.0 - 2.0 * (m02 + 0.5) / width, 0.0],
            [-2.0 * m10 / height, 2.0 * m11 / height, 2.0 * (m12 + 0.5) / height - 1.0, 0.0],
            [0.0, 0.0, (far + near) / (near - far), 2.0 * far * near / (near - far)],
            [0.0, 0.0, -1.0, 0.0],
        ]
    )


def _matrix(view: Any, values: FloatArray) -> Any:
    found = view.GetModelViewTransformMatrix().NewInstance()
    found.DeepCopy(values.ravel().tolist())
    return found
