"""Sheets of paper: their size, and their stiffness relative to their weight."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from withe.common import validation

__all__ = ["Paper", "folded_share", "require_length"]

FloatArray = npt.NDArray[np.float64]
_LARGEST = 20.0  # [m]
_SHARES = {"half": 1.0 / 2.0, "third": 1.0 / 3.0, "quarter": 1.0 / 4.0}
_STIFFEST = 10.0  # lengths that Lgb may be: such a sheet droops by 6e-5 of its length


@dataclass(frozen=True)
class Paper:
    """A sheet that is folded along its length.

    Parameters
    ----------
    length, width : float [m]
        Length along the fold, and largest width across it.
    gravito_bending_length : float [m]
        Lgb = (EI / 2w)^(1/3), with EI the bending stiffness and w the weight per length. `measure` finds it with a
        ruler.
    friction : float [-]
        Friction coefficient between sheet and table.
    thickness : float [m]
        Thickness of the sheet.
    outline : sequence of pairs of float [-]
        Width along the sheet: pairs of a share of the length, from the lifted edge on, and a share of `width`, linear
        in between. By default the width is uniform.

    Raises
    ------
    ValueError
        A length or friction that is not positive. Sizes that no paper has (often given in millimetres): above 20 m,
        thicker than a tenth of the length, or an Lgb of more than ten lengths. An outline that does not run from 0 to
        1, or whose width is nowhere 1.

    Examples
    --------
    >>> import withe
    >>> paper = withe.folding.Paper.a4()
    >>> pose = withe.folding.elastica(0.1 / paper.gravito_bending_length, 0.1 / paper.gravito_bending_length)
    >>> print(f"{paper.gravito_bending_length * pose.suspended:.3f} m of {paper.length} m are lifted")
    0.147 m of 0.297 m are lifted
    """

    length: float
    width: float
    gravito_bending_length: float
    friction: float = 0.12
    thickness: float = 1e-4
    outline: Sequence[tuple[float, float]] = ((0.0, 1.0), (1.0, 1.0))

    def __post_init__(self) -> None:
        for name in ("length", "width", "gravito_bending_length", "friction", "thickness"):
            object.__setattr__(self, name, validation.positive(getattr(self, name), name))
        self._require_metres()
        object.__setattr__(self, "outline", _checked_outline(self.outline))

    def _require_metres(self) -> None:
        """Refuse sizes that no paper has, such as sizes in millimetres."""
        for name, value, most, what in (
            ("length", self.length, _LARGEST, f"{_LARGEST:g} m"),
            ("width", self.width, _LARGEST, f"{_LARGEST:g} m"),
            ("thickness", self.thickness, 0.1 * self.length, f"a tenth of the length of {self.length:g} m"),
            ("gravito_bending_length", self.gravito_bending_length, _STIFFEST * self.length, f"{_STIFFEST:g} lengths"),
        ):
            if value > most:
                raise ValueError(f"{name} must be at most {what}, got {value:g} m: are all sizes in metres?")

    def width_at(self, place: npt.ArrayLike) -> FloatArray:
        """Return the width at distances from the lifted edge.

        Parameters
        ----------
        place : array_like of shape (...) [m]
            Distances from the lifted edge.

        Returns
        -------
        ndarray of shape (...) [m]
        """
        shares, widths = np.array(self.outline).T
        return np.asarray(self.width * np.interp(np.asarray(place, dtype=float) / self.length, shares, widths))

    @property
    def is_strip(self) -> bool:
        """Return True if the width is uniform."""
        return all(width == 1.0 for _, width in self.outline)

    @classmethod
    def a4(cls) -> Paper:
        """Return office paper, 297 mm by 210 mm, Lgb 48 mm [Choi, dissertation, 7.8.3].

        Returns
        -------
        Paper
        """
        return cls(0.297, 0.210, 0.048)

    @classmethod
    def us_letter(cls) -> Paper:
        """Return office paper, 279.4 mm by 215.9 mm, Lgb 60 mm [Choi, dissertation, 7.8.3].

        Returns
        -------
        Paper
        """
        return cls(0.2794, 0.2159, 0.060)

    @classmethod
    def cardboard(cls) -> Paper:
        """Return cardboard of the size of US Letter, Lgb 132 mm [Choi, dissertation, 7.8.3].

        Returns
        -------
        Paper
        """
        return cls(0.2794, 0.2159, 0.132)

    @classmethod
    def origami(cls, side: float = 0.35) -> Paper:
        """Return square origami paper, Lgb 43 mm [Choi, dissertation, 7.8.3], to be folded over its diagonal.

        A jaw holds it by a corner: the width grows from there to the middle, and falls again. A fold of corner on
        corner (the target "half") at the default size would lift more of it than a jaw without a moment can lead. The
        dissertation's target is 0.30 m.

        Parameters
        ----------
        side : float [m]
            Side of the square. The dissertation does not state it; its C = 0.30 m needs at least 0.213 m. A smaller
            sheet has too little lying weight to stay in place.

        Returns
        -------
        Paper

        Raises
        ------
        ValueError
            A side that is not positive or too large for paper.
        """
        diagonal = np.sqrt(2.0) * validation.positive(side, "side")
        return cls(diagonal, diagonal, 0.043, outline=((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)))


def folded_share(target: str) -> float:
    """Return the share of a sheet that is folded over, for a word or a fraction such as "1/3".

    Raises
    ------
    ValueError
        An unknown word, or a fraction that is not above 0 and at most a half.
    """
    fraction = re.fullmatch(r"(\d{1,6})/(\d{1,6})", target.replace(" ", "")) if isinstance(target, str) else None
    if fraction is None:
        return _SHARES[validation.choice(target, "target, if not in m or a fraction such as '1/3',", list(_SHARES))]
    part, whole = int(fraction[1]), int(fraction[2])
    if not 0 < 2 * part <= whole:
        raise ValueError(f"target must be a fraction up to 1/2, the share that is folded over, got {target!r}")
    return part / whole


def require_length(paper: Paper, planned: Paper) -> None:
    """Refuse a sheet whose length differs from that of a plan, since the jaw would hold it at a wrong place."""
    if paper.length != planned.length:
        raise ValueError(f"plan must be for a sheet of {paper.length:g} m, got one for {planned.length:g} m")


def _checked_outline(outline: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    rows = validation.number_array(outline, "outline", ("places", 2))
    shares, widths = rows.T
    if len(rows) < 2 or shares[0] != 0.0 or shares[-1] != 1.0 or (np.diff(shares) <= 0.0).any():
        raise ValueError(f"outline must have shares of the length that increase from 0 to 1, got {shares.tolist()}")
    if (widths < 0.0).any() or widths.max() != 1.0 or (widths[1:-1] == 0.0).any():
        raise ValueError(
            "outline must have shares of the width whose maximum is 1 and that are positive between the ends, got "
            f"{widths.tolist()}"
        )
    return tuple((float(share), float(width)) for share, width in rows)
