"""Small letters that a pen writes without lifting, one after the other, as patterns for a cable."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

__all__ = ["LETTERS", "written"]

FloatArray = npt.NDArray[np.float64]
_SAMPLES_PER_HEIGHT = 50

# Points that the pen passes, x,y in heights of a small x, each letter from 0,0 along the base line to where the next
# one begins. No dots, and no bars across f and t.
LETTERS = {
    " ": "0,0 .4,0 .8,0",
    "a": "0,0 .35,.25 .95,.85 .65,1.05 .25,.8 .2,.3 .55,0 1,.25 1.35,.8 1.15,1.1 .9,.75 1,.2 1.3,-.02 1.7,0",
    "b": "0,0 .45,.4 .9,1.35 .65,2 .32,1.6 .3,.6 .4,.1 .75,-.02 "
    "1.12,.3 1.15,.8 .9,1 .85,.75 1.2,.62 1.6,.55 1.9,.25 2.2,0",
    "c": "0,0 .3,.25 .85,.75 .8,1 .5,1.05 .2,.65 .3,.15 .75,-.02 1.3,0",
    "d": "0,0 .35,.25 .95,.85 .65,1.05 .25,.8 .2,.3 .55,0 "
    "1.1,.45 1.55,1.35 1.3,2 .95,1.6 .95,.6 1.1,.1 1.45,-.02 1.8,0",
    "e": "0,0 .4,.2 .8,.65 .65,1.02 .3,.85 .25,.3 .6,-.02 1.2,0",
    "f": "0,0 .4,.4 .8,1.4 .68,2 .45,1.7 .4,.5 .42,-.6 .58,-1.05 .78,-.7 .65,-.1 .9,-.02 1.3,0",
    "g": "0,0 .35,.25 .95,.85 .65,1.05 .25,.8 .2,.3 .55,0 1,.25 "
    "1.22,.85 1.08,1.06 .92,.8 1.08,0 1,-.75 .7,-1.02 .52,-.7 .9,-.25 1.6,0",
    "h": "0,0 .45,.4 .9,1.35 .65,2 .32,1.6 .25,.6 .38,.08 .62,.3 .8,.85 1.1,1.02 1.4,.75 1.45,.25 1.7,0 2.05,0",
    "i": "0,0 .35,.25 .68,.75 .5,1.1 .22,.8 .3,.2 .65,-.02 1.05,0",
    "j": "0,0 .35,.3 .68,.8 .5,1.1 .3,.75 .42,-.3 .25,-.95 0,-.85 .15,-.45 .6,-.15 1.1,0",
    "k": "0,0 .4,.4 .75,1.4 .6,2 .38,1.7 .32,.8 .32,.25 .42,.3 .75,.95 1.05,.95 1,.65 .7,.52 .75,.4 1.05,.05 1.5,0",
    "l": "0,0 .45,.35 .9,1.3 .65,2 .32,1.6 .3,.6 .45,.1 .8,-.03 1.25,0",
    "m": "0,0 .2,.5 .5,1.03 .8,.6 .85,.2 1,.06 1.15,.2 1.25,.7 1.5,1.02 "
    "1.8,.6 1.85,.2 2,.06 2.15,.2 2.25,.7 2.5,1.02 2.8,.7 2.85,.25 3.1,0 3.4,0",
    "n": "0,0 .2,.5 .5,1.03 .8,.6 .85,.2 1,.06 1.15,.2 1.25,.7 1.5,1.02 1.8,.7 1.85,.25 2.1,0 2.4,0",
    "o": "0,0 .6,.05 1.1,.5 .65,1.05 .2,.5 .6,0 1.3,0",
    "p": "0,0 .3,.5 .52,1.1 .56,.3 .5,-.7 .62,-1.05 .8,-.7 .68,.2 "
    ".85,.85 1.2,1.02 1.45,.6 1.3,.1 1,-.02 .88,.2 1.15,.28 1.5,.08 1.9,0",
    "q": "0,0 .35,.25 .95,.85 .65,1.05 .25,.8 .2,.3 .55,0 1,.25 1.22,.85 "
    "1.08,1.06 .92,.8 1.05,-.2 1.05,-.85 1.25,-1.05 1.45,-.75 1.3,-.25 1.45,-.03 1.9,0",
    "r": "0,0 .25,.5 .5,1.02 .8,1 1.05,.75 1.1,.3 1.35,0 1.7,0",
    "s": "0,0 .4,.5 .7,1.05 1,.75 1.05,.3 .75,0 .45,.15 .6,.35 1,.1 1.5,0",
    "t": "0,0 .4,.3 .78,1.1 .55,1.6 .25,1.2 .3,.4 .45,.05 .75,-.03 1.15,0",
    "u": "0,0 .2,.6 .45,1.02 .6,.7 .6,.25 .85,0 1.2,.3 1.5,.85 1.3,1.1 1.08,.8 1.15,.2 1.45,-.02 1.85,0",
    "v": "0,0 .15,.45 .42,1.02 .65,.8 .75,.3 .95,.02 1.2,.4 1.2,.95 1.05,1.02 1.2,.75 1.6,.72 1.9,.35 2.1,0",
    "w": "0,0 .15,.45 .38,1.02 .56,.8 .55,.3 .8,-.02 1.1,.35 1.28,.9 1.2,1.05 "
    "1.1,.8 1.15,.25 1.42,-.02 1.75,.4 1.75,.95 1.6,1.02 1.75,.75 2.1,.72 2.4,.35 2.6,0",
    "x": "0,0 .1,.5 .3,1 .6,.7 1,.1 1.3,.1 1.38,.6 1.15,1 .85,.8 .5,.2 .35,-.05 .7,-.1 1.6,0",
    "y": "0,0 .2,.6 .45,1.02 .6,.7 .6,.25 .85,0 1.2,.3 1.5,.85 "
    "1.32,1.08 1.15,.8 1.28,0 1.15,-.75 .85,-1.02 .68,-.7 1.05,-.25 1.7,0",
    "z": "0,0 .15,.6 .45,1.03 .85,.85 .75,.5 .45,.4 .42,.18 .72,.15 .92,-.15 .8,-.7 .5,-.95 .28,-.75 .55,-.3 1.3,0",
}


def written(text: str, height: float) -> FloatArray:
    """Points along a word, shape (n, 2) [m], on a cubic spline through its letters, whose small x is `height` high.

    Raises
    ------
    ValueError
        An empty text, or characters other than the letters a to z and spaces between them.
    """
    from scipy.interpolate import CubicSpline

    if not isinstance(text, str) or not text.strip():
        raise ValueError(f"text must be a word, got {text!r}")
    missing = sorted(set(text) - set(LETTERS))
    if missing:
        raise ValueError(f"text must be of the letters a to z and spaces, got {''.join(missing)!r} in {text!r}")
    passed, at = [np.zeros((1, 2))], 0.0
    for letter in text.strip():
        points = np.array([pair.split(",") for pair in LETTERS[letter].split()], dtype=float)
        passed.append(points[1:] + np.array([at, 0.0]))
        at += float(points[-1, 0])
    points = np.concatenate(passed)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    # Straight at its ends, as a free end is. Centripetal: between near points the curve makes no loops of its own.
    parameter = np.concatenate([[0.0], np.cumsum(np.sqrt(steps))])
    fine = np.linspace(0.0, parameter[-1], int(_SAMPLES_PER_HEIGHT * steps.sum()) + 2)
    return np.asarray(height * CubicSpline(parameter, points, bc_type="natural")(fine))
