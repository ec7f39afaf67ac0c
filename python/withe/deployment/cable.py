"""Cables: how long and thick they are, and how stiff against their own weight."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.perception.images import check_image, read_image
from withe.perception.masks import border_filter

__all__ = ["JAW", "Cable", "MeasuredCable", "measure"]

JAW = 0.010  # [m], length of cable in a jaw
_HIGHEST_LOOP, _THICKEST = 10.0, 0.5  # [m]
LOOP_HEIGHT = 1.142240  # [Lgb], height of a hanging loop that touches the floor tangentially: 0.90660 (EI / w)^(1/3)
_TABLE = {  # Lgb, radius, length [m] [Choi, dissertation, table 9.1]
    1: (0.018, 1.6e-3, 0.875),
    2: (0.032, 1.6e-3, 0.885),
    3: (0.034, 2.0e-3, 0.89),
    4: (0.0286, 3.2e-3, 0.84),
    5: (0.0801, 1.8e-3, 0.87),
}


@dataclass(frozen=True)
class Cable:
    """A round cable.

    Parameters
    ----------
    length, radius : float [m]
    gravito_bending_length : float [m]
        Lgb = (EI / 2w)^(1/3), EI the bending stiffness and w the weight per length: `measure` finds it with a ruler.
    natural_curvature : (float, float) [1/m]
        Curvature of the unloaded cable, towards x and y of the plan while it hangs from the jaw. `measure_curvature`
        finds it. "optimised" plans compensate for it; other methods plan for a straight cable.

    Raises
    ------
    ValueError
        A length that is not positive. A radius that no cable has (often given in millimetres). A cable that is not
        longer than thick, or whose natural radius of curvature is below its own radius.

    Examples
    --------
    >>> import withe
    >>> cable = withe.deployment.Cable.dlo(2)
    >>> print(f"{cable.length / cable.gravito_bending_length:.1f} Lgb long, ks {cable.stretch_stiffness:.0f}")
    27.7 Lgb long, ks 1600
    """

    length: float
    radius: float
    gravito_bending_length: float
    natural_curvature: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("length", "radius", "gravito_bending_length"):
            object.__setattr__(self, name, validation.positive(getattr(self, name), name))
        if self.radius > _THICKEST:
            raise ValueError(f"radius must be at most {_THICKEST:g} m, got {self.radius:g} m: are all sizes in metres?")
        bent = validation.number_array(self.natural_curvature, "natural_curvature", (2,))
        object.__setattr__(self, "natural_curvature", (float(bent[0]), float(bent[1])))
        if np.hypot(*bent) * self.radius >= 1.0:
            raise ValueError(f"natural_curvature must be less than 1 / radius, {1 / self.radius:g} / m, got {bent}")
        if self.length <= 2.0 * self.radius:
            raise ValueError(f"length must exceed the cable's thickness of {2 * self.radius:g} m, got {self.length:g}")

    @property
    def stretch_stiffness(self) -> float:
        """EA Lgb^2 / EI of a solid round section, 4 (Lgb / radius)^2 [-] (dissertation, (9.10))."""
        return 4.0 * (self.gravito_bending_length / self.radius) ** 2

    @classmethod
    def dlo(cls, number: int) -> Cable:
        """Return one of the five cables of the experiments.

        They are pink and green silicone rubber, rope, thick rubber, and a USB cable.

        Parameters
        ----------
        number : int
            1 to 5 [Choi, dissertation, table 9.1].

        Returns
        -------
        Cable

        Raises
        ------
        ValueError
            A number that is not from 1 to 5.
        """
        lgb, radius, length = _TABLE[validation.integer(number, "number", 1, 5)]
        return cls(length, radius, lgb)


@dataclass(frozen=True)
class MeasuredCable:
    """A gravito-bending length with its standard deviation.

    Attributes
    ----------
    gravito_bending_length, error : float [m]
    """

    gravito_bending_length: float
    error: float


@keyword_hints
def measure(
    *,
    height: float | None = None,
    image: str | os.PathLike[str] | npt.ArrayLike | None = None,
    scale: float | None = None,
    error: float | None = None,
) -> MeasuredCable:
    """Find a cable's gravito-bending length Lgb = (EI / 2w)^(1/3) with a ruler or a camera.

    Fold the cable back over itself on a table, one layer on the other, and release it. The cable forms a loop. For any
    length of cable its highest point is 1.1422 Lgb above the lower layer [Pan et al. 2020]. Equation (9.10) of the
    dissertation uses another length, (EI / w)^(1/3), which is 26 % greater.

    Parameters
    ----------
    height : float [m]
        Height of the loop's highest point above the table, from centreline to centreline.
    image : str, Path or array_like of shape (height, width, 3)
        Picture of the loop from the side, instead of `height`. The table is level, the background is plain, and nothing
        else is visible. The lowest pixels of the cable must belong to the layer that lies on the table.
    scale : float [m]
        Size of one pixel of the image.
    error : float [m]
        Standard deviation of the height; by default 0.5 mm, or half a pixel of an image.

    Returns
    -------
    MeasuredCable

    Raises
    ------
    ValueError
        None or both of height and image, one that is not positive or above 10 m, an image without scale or without a
        loop, a negative error.
    ImportError
        An image file is given, and OpenCV is not installed.

    Examples
    --------
    >>> import withe
    >>> found = withe.deployment.measure(height=0.0366)
    >>> print(f"{1e3 * found.gravito_bending_length:.1f} mm, give or take {1e3 * found.error:.1f}")
    32.0 mm, give or take 0.4
    """
    if (height is None) == (image is None):
        raise ValueError("measure needs exactly one of height and image")
    if image is not None:
        pixel = pixel_size(scale)
        height = pixel * _loop_height(image)
        if not height < _HIGHEST_LOOP:
            raise ValueError(f"scale must be in metres per pixel, got {pixel:g}: the loop would be {height:.3g} m high")
        error = 0.5 * pixel if error is None else error
    height, error = (
        validation.positive(height, "height"),
        validation.non_negative(5e-4 if error is None else error, "error"),
    )
    if not height < _HIGHEST_LOOP:
        raise ValueError(f"height must be less than {_HIGHEST_LOOP:g} m, got {height:g} m: is it in metres?")
    return MeasuredCable(height / LOOP_HEIGHT, error / LOOP_HEIGHT)


def pixel_size(scale: float | None) -> float:
    """The size of a pixel of an image [m].

    Raises
    ------
    ValueError
        None, or not positive.
    """
    if scale is None:
        raise ValueError("an image needs scale, the size of a pixel in m")
    return validation.positive(scale, "scale")


def _loop_height(image: str | os.PathLike[str] | npt.ArrayLike) -> float:
    """From the centreline that lies to the highest one [px]: all that is seen less the cable's thickness."""
    from scipy.ndimage import distance_transform_edt

    picture = read_image(image) if isinstance(image, str | os.PathLike) else check_image(image)
    mask = border_filter(picture)
    rows = np.flatnonzero(mask.any(1))
    if not rows.size:
        raise ValueError("image must show a loop of cable, got a uniform image")
    extent = int(rows[-1] - rows[0]) + 1
    upper = np.zeros_like(mask)
    upper[: rows[0] + extent // 2] = True  # there the two layers are apart
    thickness = 2.0 * float(distance_transform_edt(mask)[upper].max()) - 1.0
    if extent < 4.0 * thickness:
        raise ValueError(
            f"image must show a loop of cable, got a shape {extent} pixels high and {thickness:.0f} pixels thick"
        )
    return extent - thickness
