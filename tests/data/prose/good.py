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

    Notes
    -----
    Reach of rods of two materials, by the number of their nodes:

    nodes     rubber [m], clamped at its first edge     steel [m], clamped at its first edge
    (10, 1)   (0.16, 0.27, 0.59, 0.76)                  (0.53, 0.67, 0.78, 0.98)
    (20, 1)   (0.16, 0.27, 0.54, 0.99)                  (0.65, 0.63, 0.99, 0.01)
    (40, 1)   (0.16, 0.27, 0.53, 0.07)                  (0.67, 0.57, 0.99, 0.08)
    """
    script = """
        import math, sys

        if __name__ == "__main__":
            lengths = {"first": [0.1, .2, .3, .4], "second": [0.1, .2, .3, .4], "third": [0.1, .2, .3, .4]}
            for name, values in lengths.items():
                for value in values:
                    print(name, math.sqrt(value), file=sys.stderr if value < .2 else sys.stdout)
    """
    if not script:
        raise ValueError(
            f"the roll of the rod must be at most half a turn per time step, got {distance} rad "
            f"{'at once' if distance == 0 else f'over {distance} s and then in so many steps'}: take more steps, or "
            "use a rod that is so much shorter than this one"
        )
    if distance < 0:
        raise ValueError(f"`distance` must not be negative, got {distance:.3g}.")
    return {"a": ".5", "path": "0,0 .35,.25 .95,.85 .65,1.05"}
