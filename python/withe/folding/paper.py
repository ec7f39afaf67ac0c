"""Sheets of paper: how large they are, and how stiff against their own weight."""

from __future__ import annotations

from dataclasses import dataclass

from withe.common import validation

__all__ = ["Paper"]


@dataclass(frozen=True)
class Paper:
    """A sheet that is folded along its length.

    Parameters
    ----------
    length, width : float [m]
        Along the fold's way, and across it.
    gravito_bending_length : float [m]
        Lgb = (EI / 2w)^(1/3), EI the bending stiffness and w the weight per length: `measure` finds it with a ruler.
    friction : float
        Coefficient between sheet and table.
    thickness : float [m]

    Raises
    ------
    ValueError
        A length that is not positive, or negative friction.

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

    def __post_init__(self) -> None:
        for name in ("length", "width", "gravito_bending_length", "thickness"):
            object.__setattr__(self, name, validation.positive(getattr(self, name), name))
        object.__setattr__(self, "friction", validation.non_negative(self.friction, "friction"))

    @classmethod
    def a4(cls) -> Paper:
        """Office paper, 297 mm by 210 mm, Lgb 48 mm [Choi, dissertation, 7.8.3]."""
        return cls(0.297, 0.210, 0.048)

    @classmethod
    def us_letter(cls) -> Paper:
        """Office paper, 279.4 mm by 215.9 mm, Lgb 60 mm [Choi, dissertation, 7.8.3]."""
        return cls(0.2794, 0.2159, 0.060)

    @classmethod
    def cardboard(cls) -> Paper:
        """Cardboard of the size of US Letter, Lgb 132 mm [Choi, dissertation, 7.8.3]."""
        return cls(0.2794, 0.2159, 0.132)
