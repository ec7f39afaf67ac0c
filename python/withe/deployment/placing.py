"""Cables between posts: positions of the posts, and the side on which the laid cable passes each post."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.deployment.cable import Cable
from withe.deployment.pattern import Pattern, distances
from withe.deployment.posts import Post

__all__ = ["passed", "posts_along", "require_room"]

FloatArray = npt.NDArray[np.float64]
_ON_FLOOR = 1.0  # [radii] that the cable may be above the floor beside a post


@keyword_hints
def posts_along(
    pattern: Pattern,
    cable: Cable,
    at: npt.ArrayLike,
    *,
    gap: float = 0.003,
    radius: float = 0.004,
    height: float = 0.008,
) -> tuple[Post, ...]:
    """Place pairs of posts, one on either side of a pattern.

    Parameters
    ----------
    pattern : Pattern
    cable : Cable
    at : array_like of shape (pairs,) [m]
        Arc lengths along the pattern.
    gap : float [m]
        Distance between each post and the cable on its pattern.
    radius, height : float [m]
        Radius and height of the posts.

    Returns
    -------
    tuple of Post
        Posts pair by pair: first the post to the left of the pattern's direction, then the post to the right.

    Raises
    ------
    ValueError
        Arc lengths outside of the pattern, a negative gap, or posts that stand in the way of the cable elsewhere.

    Examples
    --------
    >>> import numpy as np
    >>> import withe
    >>> line = withe.deployment.Pattern(np.stack([np.linspace(0.0, 0.4, 50), np.zeros(50)], 1))
    >>> left, right = withe.deployment.posts_along(line, withe.deployment.Cable.dlo(5), [0.2])
    >>> print(f"{left.x:.3f} {left.y:.4f}, {right.x:.3f} {right.y:.4f}")
    0.200 0.0088, 0.200 -0.0088
    """
    places = validation.number_array(at, "at", ("pairs",))
    if not np.all((places >= 0.0) & (places <= pattern.length)):
        raise ValueError(f"at must be from 0 to the pattern's length of {pattern.length:.4g} m, got {places}")
    away = validation.non_negative(gap, "gap") + radius + cable.radius
    posts = []
    for place in places:
        x, y = (float(np.interp(place, pattern.arc_length, pattern.points[:, i])) for i in range(2))
        along = np.array([np.interp(place, pattern.arc_length, pattern.tangent[:, i]) for i in range(2)])
        along /= np.linalg.norm(along)
        posts += [Post(x - side * away * along[1], y + side * away * along[0], radius, height) for side in (1.0, -1.0)]
    require_room(posts, pattern, cable)
    return tuple(posts)


def require_room(posts: Sequence[Post], pattern: Pattern, cable: Cable) -> None:
    """Refuse posts on the pattern."""
    for post in posts:
        if not isinstance(post, Post):
            raise ValueError(f"posts must be withe.deployment.Post, got {post!r:.80}")
        away = float(distances(np.array([[post.x, post.y]]), pattern.points)[0])
        if away < (post.radius + cable.radius) * (1.0 - 1e-6):
            needs = f"the radii of post and cable together are {1e3 * (post.radius + cable.radius):.1f} mm"
            raise ValueError(f"{post} is too close to the pattern: the distance is {1e3 * away:.1f} mm, and {needs}")


def passed(posts: Sequence[Post], pattern: Pattern, cable: Cable, laid: FloatArray) -> npt.NDArray[np.bool_]:
    """Return True for each post that the laid cable passes on the side of its pattern, on the floor.

    The closed curve of pattern and cable then does not go round the post: its winding number is zero.

    Parameters
    ----------
    posts : sequence of Post
    pattern : Pattern
    cable : Cable
    laid : ndarray of shape (nodes, 3) [m]
        Centreline of the laid cable, for the part of the pattern.

    Returns
    -------
    ndarray of bool of shape (posts,)
    """
    loop = np.concatenate([pattern.points, laid[::-1, :2], pattern.points[:1]])
    found = np.zeros(len(posts), bool)
    for i, post in enumerate(posts):
        seen = loop - (post.x, post.y)
        angles = np.unwrap(np.arctan2(seen[:, 1], seen[:, 0]))
        near = np.linalg.norm(laid[:, :2] - (post.x, post.y), axis=1).argmin()
        lies = laid[near, 2] < (1.0 + _ON_FLOOR) * cable.radius
        found[i] = abs(angles[-1] - angles[0]) < np.pi and lies
    return found
