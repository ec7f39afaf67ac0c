"""Cross-sections of rods: area, moments of area, torsion constant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.short_repr import ShortRepr

__all__ = ["Circle", "Rectangle", "Section", "SectionProperties", "Tube"]

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class SectionProperties(ShortRepr):
    """Properties of the section of every edge of a rod.

    Attributes
    ----------
    area : ndarray of shape (edges,) [m^2]
    moment1, moment2 : ndarray of shape (edges,) [m^4]
        Second moments of area that resist curvature towards d1 and d2.
    torsion : ndarray of shape (edges,) [m^4]
        Torsion constant J.
    radii : ndarray of shape (edges,) [m]
        Radius of a round section, half the larger side of another.
    widths : ndarray of shape (edges, 2) [m], or None
        Sides along d1 and d2; None for a round section.
    """

    area: FloatArray
    moment1: FloatArray
    moment2: FloatArray
    torsion: FloatArray
    radii: FloatArray
    widths: FloatArray | None = None

    @property
    def touching(self) -> FloatArray:
        """Default radius of the round surface that touches others (half the smaller side), shape (edges,) [m]."""
        return self.radii if self.widths is None else 0.5 * self.widths.min(axis=1)

    @property
    def fibres(self) -> FloatArray:
        """Distances of the outermost fibres along d1 and d2, shape (edges, 2) [m]."""
        return np.column_stack([self.radii, self.radii]) if self.widths is None else 0.5 * self.widths

    @cached_property
    def moments(self) -> FloatArray:
        """Both second moments of area, shape (edges, 2) [m^4]."""
        return np.stack([self.moment1, self.moment2], axis=1)


@keyword_hints
@dataclass(frozen=True)
class Circle:
    """A full circle.

    Parameters
    ----------
    radius : float or array_like of shape (edges,) [m]
    """

    radius: npt.ArrayLike

    def properties(self, edges: int, owner: str) -> SectionProperties:
        """Return the properties of the section of every edge of a rod.

        Parameters
        ----------
        edges : int
            Number of edges.
        owner : str
            Name of the rod in errors, such as "rod 'arm'".

        Returns
        -------
        SectionProperties
            Area [m^2] and moments of area [m^4], each of shape (edges,).

        Raises
        ------
        ValueError
            A radius that is not positive, or an array of another length.
        """
        r = validation.per_item(self.radius, f"radius of {owner}", edges, "edges")
        moment = 0.25 * math.pi * r**4
        return SectionProperties(math.pi * r**2, moment, moment.copy(), 2.0 * moment, r)


@keyword_hints
@dataclass(frozen=True)
class Tube:
    """A circle with a round hole in its middle.

    Parameters
    ----------
    outer_radius, inner_radius : float or array_like of shape (edges,) [m]
    """

    outer_radius: npt.ArrayLike
    inner_radius: npt.ArrayLike

    def properties(self, edges: int, owner: str) -> SectionProperties:
        """Return the properties of the section of every edge of a rod.

        Parameters
        ----------
        edges : int
            Number of edges.
        owner : str
            Name of the rod in errors, such as "rod 'arm'".

        Returns
        -------
        SectionProperties
            Area [m^2] and moments of area [m^4], each of shape (edges,).

        Raises
        ------
        ValueError
            A radius that is not positive, an inner radius that is not below the outer one, or an array of another
            length.
        """
        outer = validation.per_item(self.outer_radius, f"outer_radius of {owner}", edges, "edges")
        inner = validation.per_item(self.inner_radius, f"inner_radius of {owner}", edges, "edges", zero=True)
        if np.any(inner >= outer):
            place = int(np.flatnonzero(inner >= outer)[0])
            raise ValueError(
                f"inner_radius of {owner} must be below its outer_radius {outer[place]:g}, got {inner[place]:g}"
            )
        moment = 0.25 * math.pi * (outer**4 - inner**4)
        return SectionProperties(math.pi * (outer**2 - inner**2), moment, moment.copy(), 2.0 * moment, outer)


@keyword_hints
@dataclass(frozen=True)
class Rectangle:
    """A full rectangle, with its width along the first director and its height along the second.

    Parameters
    ----------
    width, height : float or array_like of shape (edges,) [m]
    """

    width: npt.ArrayLike
    height: npt.ArrayLike

    def properties(self, edges: int, owner: str) -> SectionProperties:
        """Return the properties of the section of every edge of a rod.

        Parameters
        ----------
        edges : int
            Number of edges.
        owner : str
            Name of the rod in errors, such as "rod 'arm'".

        Returns
        -------
        SectionProperties
            Area [m^2] and moments of area [m^4], each of shape (edges,).

        Raises
        ------
        ValueError
            A side that is not positive, or an array of another length.
        """
        width = validation.per_item(self.width, f"width of {owner}", edges, "edges")
        height = validation.per_item(self.height, f"height of {owner}", edges, "edges")
        return SectionProperties(
            area=width * height,
            moment1=height * width**3 / 12.0,
            moment2=width * height**3 / 12.0,
            torsion=_rectangle_torsion(np.maximum(width, height), np.minimum(width, height)),
            radii=0.5 * np.maximum(width, height),
            widths=np.stack([width, height], axis=1),
        )


Section = Circle | Tube | Rectangle


def _rectangle_torsion(long: FloatArray, short: FloatArray) -> FloatArray:
    """J = a b^3 [1/3 - (64/pi^5) (b/a) sum over odd n of tanh(n pi a / 2b) / n^5], a >= b (Saint-Venant)."""
    n = np.arange(1, 80, 2, dtype=float)[:, None]
    series = np.sum(np.tanh(0.5 * n * math.pi * long / short) / n**5, axis=0)
    torsion: FloatArray = long * short**3 * (1.0 / 3.0 - 64.0 / math.pi**5 * (short / long) * series)
    return torsion


def check_section(section: object, owner: str) -> Section:
    """One of the sections above."""
    if not isinstance(section, Section):
        raise ValueError(
            f"section of {owner} must be a withe.Circle, withe.Tube or withe.Rectangle, got {type(section).__name__}"
        )
    return section
