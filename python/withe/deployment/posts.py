"""Posts that stand on the floor."""

from __future__ import annotations

from dataclasses import dataclass

from withe.common import validation

__all__ = ["Post"]


@dataclass(frozen=True)
class Post:
    """A round post with a round head that stands on the floor.

    Parameters
    ----------
    x, y : float [m]
        Position of its axis.
    radius : float [m]
        Radius of post and head.
    height : float [m]
        Height of the top of its head above the floor, at least its radius.

    Raises
    ------
    ValueError
        Values that are not finite or not positive, or a height below the radius.

    Examples
    --------
    >>> import withe
    >>> withe.deployment.Post(0.1, 0.02)
    Post(x=0.1, y=0.02, radius=0.004, height=0.008)
    """

    x: float
    y: float
    radius: float = 0.004
    height: float = 0.008

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", validation.number(self.x, "x of a post"))
        object.__setattr__(self, "y", validation.number(self.y, "y of a post"))
        object.__setattr__(self, "radius", validation.positive(self.radius, "radius of a post"))
        object.__setattr__(self, "height", validation.positive(self.height, "height of a post"))
        if self.height < self.radius:
            raise ValueError(f"height of a post must be at least its radius of {self.radius:g} m, got {self.height:g}")
