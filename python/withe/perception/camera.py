"""Cameras: from pixels to metres."""

from __future__ import annotations

import os
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe.perception.boards import CharucoBoard, Chessboard
from withe.perception.calibrating import calibrate_lens

__all__ = ["Camera"]

Array = NDArray[np.float64]
_ROUNDING = 1e-13  # error of a distorted direction, relative to its length or 1
_INVERTED = 1e-9  # the same: greatest error of a result when it is distorted again
_ITERATIONS = 60  # of Newton's method; where the lens turns back, each one only halves the error
_HALVINGS = 30


def _checked(values: ArrayLike, shape: tuple[int | None, ...], name: str) -> Array:
    array = np.asarray(values, dtype=float)
    fits = array.ndim == len(shape) and all(n is None or n == m for n, m in zip(shape, array.shape, strict=True))
    if not fits:
        wanted = ", ".join("n" if n is None else str(n) for n in shape)
        raise ValueError(f"{name} must have shape ({wanted}), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got NaN or infinity")
    return array


class Camera:
    """A pinhole camera with lens distortion (the model of OpenCV).

    A point X of the world has the coordinates R X + t = (x, y, z) in the camera, with z forwards. The ratios x/z and
    y/z are distorted and then multiplied by the matrix.

    Parameters
    ----------
    matrix : array_like of shape (3, 3) [px]
        Focal lengths and principal point; its last row is 0, 0, 1.
    distortion : array_like of shape (4,) or (5,), optional
        k1, k2, p1, p2 and k3.
    rotation : array_like of shape (3, 3), optional
        Rotation R from the world to the camera.
    translation : array_like of shape (3,), optional [m]
        Translation t: the position of the world's origin in the camera.

    Attributes
    ----------
    reprojection_error : float or None [px]
        Root mean square distance of the corners of a board from their projections, for a camera by `calibrate`.

    Raises
    ------
    ValueError
        A wrong shape, values that are not finite, a singular matrix or one with another last row, or a matrix that is
        no rotation.
    """

    def __init__(
        self,
        matrix: ArrayLike,
        distortion: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
        translation: ArrayLike | None = None,
    ) -> None:
        self.matrix: Array = _checked(matrix, (3, 3), "matrix")
        if abs(np.linalg.det(self.matrix)) < 1e-12:
            raise ValueError("matrix must be invertible, got a singular one")
        if np.abs(self.matrix[2] - [0.0, 0.0, 1.0]).max() > 1e-9:
            raise ValueError(f"matrix must have the last row 0, 0, 1, got {self.matrix[2]}")
        coefficients = np.zeros(5)
        if distortion is not None:
            given = _checked(np.ravel(np.asarray(distortion, dtype=float)), (None,), "distortion")
            if len(given) not in (4, 5):
                raise ValueError(f"distortion must have 4 or 5 coefficients, got {len(given)}")
            coefficients[: len(given)] = given
        self.distortion = coefficients
        self.rotation = np.eye(3) if rotation is None else _checked(rotation, (3, 3), "rotation")
        if not np.allclose(self.rotation @ self.rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(self.rotation) < 0:
            raise ValueError("rotation must be a rotation matrix, got one that is not orthogonal or mirrors")
        self.translation = np.zeros(3) if translation is None else _checked(translation, (3,), "translation")
        self._pose = np.column_stack([self.rotation, self.translation])
        self._flat = False
        self.reprojection_error: float | None = None

    @classmethod
    def calibrate(
        cls, images: Iterable[ArrayLike | str | os.PathLike[str]], board: Chessboard | CharucoBoard
    ) -> Camera:
        """Calibrate the lens of a camera from pictures of a board [Zhang 2000, PAMI 22], by OpenCV.

        Take about ten sharp pictures with one focus and zoom. Tilt the board by 20 to 40 degrees in different
        directions, and show it in all corners of the picture.

        Parameters
        ----------
        images : iterable of path, or of array_like of shape (height, width, 3) of uint8
            At least three pictures of one size that show the board: red, green and blue, or grey. Pictures without the
            board are not used.
        board : Chessboard or CharucoBoard

        Returns
        -------
        Camera
            Camera with the found `matrix` and `distortion`, at the origin of the world, and with `reprojection_error`.
            The coefficient k3 of the distortion is 0.
            `Camera.from_points` with this matrix and distortion finds its place in the world.

        Raises
        ------
        ValueError
            No pictures, or pictures of different sizes. Fewer than three pictures that show the board, boards that are
            all parallel, or a reprojection error of 2 px or more.
        ImportError
            OpenCV is not installed: ``pip install ".[vision]"`` in a clone of withe.
        """
        lens = calibrate_lens(images, board)
        camera = cls(lens.matrix, lens.distortion)
        camera.reprojection_error = lens.error
        return camera

    @classmethod
    def from_points(
        cls,
        pixels: ArrayLike,
        metres: ArrayLike,
        matrix: ArrayLike | None = None,
        distortion: ArrayLike | None = None,
    ) -> Camera:
        """Calibrate a camera from points with known positions.

        Parameters
        ----------
        pixels : array_like of shape (n, 2) [px]
            Points in the picture.
        metres : array_like of shape (n, 2) or (n, 3) [m]
            Positions of the points: on the plane z = 0 (at least four points, no three on a line), or anywhere (at
            least six, not in one plane).
        matrix, distortion : array_like of shape (3, 3) [px], and of shape (4,) or (5,) [-], optional
            Matrix and distortion of the camera, if they are known. Points on a plane do not determine other heights
            without the matrix.

        Returns
        -------
        Camera

        Raises
        ------
        ValueError
            Wrong shapes, too few points, points that do not determine the camera, or pixels outside of the range of the
            lens distortion.
        """
        seen = _checked(pixels, (None, 2), "pixels")
        known = np.asarray(metres, dtype=float)
        if known.ndim != 2 or known.shape[1] not in (2, 3) or len(known) != len(seen):
            raise ValueError(f"metres must have shape ({len(seen)}, 2) or ({len(seen)}, 3), got {known.shape}")
        known = _checked(known, (len(seen), known.shape[1]), "metres")
        flat = known.shape[1] == 2 or bool((known[:, 2] == 0).all())
        if flat:
            known = known[:, :2]
        needed = 4 if flat else 6
        if len(seen) < needed:
            raise ValueError(f"pixels must hold at least {needed} points, got {len(seen)}")
        camera = cls(np.eye(3) if matrix is None else matrix, distortion if matrix is not None else None)
        if matrix is None and distortion is not None:
            raise ValueError("distortion needs the matrix as well, got None")
        map_ = _direct_linear_transform(camera._normalised(seen), known)
        if not (map_[2] @ np.column_stack([known, np.ones(len(known))]).T > 0.0).all():
            raise ValueError("pixels and metres must be in the same order, but the fitted camera has points behind it")
        if flat and matrix is None:
            camera._pose = np.column_stack([map_[:, 0], map_[:, 1], np.full(3, np.nan), map_[:, 2]])
            camera._flat = True
        elif flat:
            camera._set_pose(*_pose_of_plane(map_, known))
        else:
            camera._pose = map_
            if matrix is not None:
                scale = np.cbrt(np.linalg.det(map_[:, :3]))
                u, _, v = np.linalg.svd(map_[:, :3] / scale)
                camera._set_pose(u @ v, map_[:, 3] / scale)
        return camera

    def _set_pose(self, rotation: Array, translation: Array) -> None:
        self.rotation, self.translation = rotation, translation
        self._pose = np.column_stack([rotation, translation])

    @property
    def flat(self) -> bool:
        """Return True if the camera is calibrated on the plane z = 0 only."""
        return self._flat

    def looks_from(self, pixels: ArrayLike) -> Array:
        """Return the side of the plane z = 0 from which pixels see it, 1 from above and -1 from below, shape (n,).

        Parameters
        ----------
        pixels : array_like of shape (n, 2) [px]
            Pixels that see the plane. Rows grow downwards, as in pictures.

        Returns
        -------
        ndarray of shape (n,)
        """
        x = self.to_plane(pixels)
        # From above, x to the right and y away from the eye make a mirror image of rows that grow downwards.
        seen = x[:, :2] @ self._pose[:, :2].T + self._pose[:, 3]
        by = self._pose[:2, :2] - (seen[:, :2] / seen[:, 2:])[:, :, None] * self._pose[2, :2]
        return np.asarray(-np.sign(np.linalg.det(self.matrix[:2, :2]) * np.linalg.det(by)))

    def project(self, points: ArrayLike) -> Array:
        """Project points of the world to pixels.

        Parameters
        ----------
        points : array_like of shape (n, 3) [m]

        Returns
        -------
        ndarray of shape (n, 2) [px]

        Raises
        ------
        ValueError
            A wrong shape, values that are not finite, or points off the plane of a camera that is calibrated on a plane
            only.
        """
        world = _checked(points, (None, 3), "points")
        if self._flat:
            if world[:, 2].any():
                raise ValueError("points must lie at height 0: the camera is calibrated on that plane only")
            seen = world[:, :2] @ self._pose[:, :2].T + self._pose[:, 3]
        else:
            seen = world @ self._pose[:, :3].T + self._pose[:, 3]
        distorted = self._distort(seen[:, :2] / seen[:, 2:])
        return distorted @ self.matrix[:2, :2].T + self.matrix[:2, 2]

    def to_plane(self, pixels: ArrayLike, height: ArrayLike = 0.0) -> Array:
        """Return the points where lines of sight meet a horizontal plane.

        Parameters
        ----------
        pixels : array_like of shape (n, 2) [px]
            Pixels of the lines of sight.
        height : float or array_like of shape (n,) [m]
            z of the plane, for all or for each.

        Returns
        -------
        ndarray of shape (n, 3) [m]

        Raises
        ------
        ValueError
            No direction leads to a pixel, because the distortion of the lens turns back before it. A line of sight does
            not meet its plane in front of the camera. A height other than 0 for a camera that is calibrated on the
            plane only.
        """
        seen = self._normalised(_checked(pixels, (None, 2), "pixels"))
        z = np.broadcast_to(np.asarray(height, dtype=float), (len(seen),))
        if not np.isfinite(z).all():
            raise ValueError("height must be finite, got NaN or infinity")
        if self._flat and z.any():
            raise ValueError("height must be 0: the camera is calibrated on that plane only; give its matrix as well")
        lift = np.zeros((len(seen), 3)) if self._flat else z[:, None] * self._pose[:, 2]
        # A x + B y + C = lambda (u, v, 1): three equations for x, y, lambda.
        system = np.empty((len(seen), 3, 3))
        system[:, :, 0], system[:, :, 1] = self._pose[:, 0], self._pose[:, 1]
        system[:, :2, 2], system[:, 2, 2] = -seen, -1
        constant = -(self._pose[:, 3] + lift)
        if (np.abs(np.linalg.det(system)) < 1e-12 * np.linalg.norm(self._pose[:, 0]) ** 2).any():
            raise ValueError("pixels must see the plane, but a line of sight is parallel to the plane")
        solution = np.linalg.solve(system, constant[..., None])[..., 0]
        if not self._flat and (solution[:, 2] <= 0).any():
            raise ValueError("pixels must see the plane in front of the camera, but some look above the plane")
        return np.column_stack([solution[:, :2], z])

    def directions(self, pixels: ArrayLike) -> Array:
        """Return the ratios x/z and y/z of lines of sight in the axes of the camera, without lens distortion.

        Parameters
        ----------
        pixels : array_like of shape (n, 2) [px]

        Returns
        -------
        ndarray of shape (n, 2)

        Raises
        ------
        ValueError
            A wrong shape, or pixels outside of the range of the lens distortion.
        """
        return self._normalised(_checked(pixels, (None, 2), "pixels"))

    def _normalised(self, pixels: Array) -> Array:
        """Directions (x/z, y/z) of pixels, distortion removed."""
        distorted = (pixels - self.matrix[:2, 2]) @ np.linalg.inv(self.matrix[:2, :2]).T
        if not self.distortion.any():
            return distorted
        ideal = self._undistort(distorted)
        lost = _size(self._distort(ideal) - distorted) > _INVERTED * np.maximum(1.0, _size(distorted))
        if lost.any():
            column, row = pixels[lost][0]
            raise ValueError(f"pixels must lie where the lens distortion is invertible, got ({column:g}, {row:g})")
        return ideal

    def _undistort(self, distorted: Array) -> Array:
        """Return the undistorted points that distortion maps to these, as nearly as possible, shape (n, 2).

        Newton's method starts at the optical axis. Distortion is the gradient of a potential, which is convex as far as
        the lens does not turn back. Steps that would leave that region or increase the error are halved.
        """
        ideal = np.zeros_like(distorted)
        tolerance = _ROUNDING * np.maximum(1.0, _size(distorted))
        limit = self._turning_radius()
        for _ in range(_ITERATIONS):
            left = distorted - self._distort(ideal)
            far = _size(left) > tolerance
            if not far.any():
                break
            at, wanted = ideal[far], distorted[far]
            step = np.linalg.solve(self._slope(at), left[far][..., None])[..., 0]
            for _ in range(_HALVINGS):
                ahead = at + step
                nearer = _size(wanted - self._distort(ahead)) < _size(left[far])
                good = nearer & (_size(ahead) < limit) & (np.linalg.eigvalsh(self._slope(ahead))[:, 0] > 0.0)
                if good.all():
                    break
                step[~good] *= 0.5
            ideal[far] += np.where(good[:, None], step, 0.0)
        return ideal

    def _turning_radius(self) -> float:
        """Least x/z at which radial distortion, r (1 + k1 r^2 + k2 r^4 + k3 r^6), does not grow any more."""
        k1, k2, _, _, k3 = self.distortion
        squares = np.roots([7.0 * k3, 5.0 * k2, 3.0 * k1, 1.0])
        real = squares.real[(np.abs(squares.imag) <= 1e-9 * np.abs(squares)) & (squares.real > 0.0)]
        return float(np.sqrt(real.min())) if real.size else np.inf

    def _distort(self, ideal: Array) -> Array:
        k1, k2, p1, p2, k3 = self.distortion
        x, y = ideal.T
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.column_stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
                y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y,
            ]
        )

    def _slope(self, ideal: Array) -> Array:
        """Derivative of `_distort`, shape (n, 2, 2); symmetric."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = ideal.T
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        growth = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
        mixed = x * y * growth + 2 * (p1 * x + p2 * y)
        along_x = radial + x * x * growth + 2 * p1 * y + 6 * p2 * x
        along_y = radial + y * y * growth + 6 * p1 * y + 2 * p2 * x
        return np.stack([np.stack([along_x, mixed], -1), np.stack([mixed, along_y], -1)], -2)


def _size(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _scaled(points: Array) -> tuple[Array, Array]:
    """Points moved and scaled to the unit ball, homogeneous, and the matrix that does so."""
    center = points.mean(axis=0)
    size = np.sqrt(((points - center) ** 2).sum(axis=1).mean()) or 1.0
    dimension = points.shape[1]
    matrix = np.eye(dimension + 1) / size
    matrix[:dimension, dimension] = -center / size
    matrix[dimension, dimension] = 1
    return np.column_stack([(points - center) / size, np.ones(len(points))]), matrix


def _direct_linear_transform(seen: Array, known: Array) -> Array:
    """The matrix that maps homogeneous known points to seen directions, least squares."""
    left, left_scale = _scaled(seen)
    right, right_scale = _scaled(known)
    zero = np.zeros_like(right)
    rows = np.vstack(
        [
            np.column_stack([right, zero, -left[:, :1] * right]),
            np.column_stack([zero, right, -left[:, 1:2] * right]),
        ]
    )
    _, values, vectors = np.linalg.svd(rows)
    if len(values) < vectors.shape[0] - 1 or values[vectors.shape[0] - 2] < 1e-9 * values[0]:
        raise ValueError("metres must determine the camera, got points on a line or in a plane")
    scaled = vectors[-1].reshape(3, right.shape[1])
    found: Array = np.linalg.inv(left_scale) @ scaled @ right_scale
    sample = np.append(known[0], 1.0)
    sign: float = np.sign(found[2] @ sample)
    return found * sign


def _pose_of_plane(map_: Array, known: Array) -> tuple[Array, Array]:
    """Rotation and translation of a camera with known matrix from its map of the plane z = 0."""
    scale = np.sqrt(np.linalg.norm(map_[:, 0]) * np.linalg.norm(map_[:, 1]))
    first, second, translation = (map_ / scale).T
    u, _, v = np.linalg.svd(np.column_stack([first, second, np.cross(first, second)]))
    return u @ v, translation
