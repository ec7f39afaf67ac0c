"""Reach of rods."""


def reach(distance):
    """Return the reach.

    Parameters
    ----------
    distance : float
        Distance to the wall, 0.5 by default [m].

    Examples
    --------
    >>> reach(.5)
    .5
    """
    if distance < 0:
        raise ValueError(f"`distance` must not be negative, got {distance:.3g}.")
    return {"a": ".5", "path": "0,0 .35,.25 .95,.85 .65,1.05"}
