"""What a module is for."""


def reach(distance):
    """Return the reach.

    Parameters
    ----------
    distance : float
        Of a rod whose length, measured along its centreline from the first node that is not held to the last node that
        moves freely, is more than twice the distance to the wall behind it, or [m] .5 by default.
    """
    # Where it is held.
    if distance < 0:
        raise ValueError(f"the distance {distance:.3g} is likewise below .25 of the length")
    return distance  # between 0.1-0.3 mm
