"""The robot of two soft limbs of the dissertation, section 6.4.2, what a camera saw of it, and what was published."""

from pathlib import Path

import numpy as np

import withe

DATA = Path(__file__).resolve().parent.parent / "data"
LOG = DATA / "soft_limb_data.csv"
LIMB = 0.075  # length of a limb [m]
GROUPS = [(1, 2, 3), (5, 6, 7)]  # tags 102-104 and 106-108
CONSTANT = [("upper", "natural_curvature", "constant"), ("lower", "natural_curvature", "constant")]


def published():
    """Target curvatures, and the whole natural turns that were found [rad]; both of shape (169, 2)."""
    table = np.loadtxt(DATA / "target_kappa_and_solved_phi.csv", delimiter=",", skiprows=1)
    return table[:, 1:3], np.radians(table[:, 3:5])


def robot(nodes=25, form="pairs", **build):
    """The limbs, level, as a simulation, and nine tags along them as pairs of a rod and a length."""
    scene = withe.Scene(gravity=(0, 0, -9.8))
    silicone = withe.Material(youngs_modulus=1.793e6, density=1240.0)
    options = {"nodes": nodes, "radius": 0.01, "material": silicone}
    upper = scene.add_rod(start=(0, 0, 0), end=(LIMB, 0, 0), name="upper", **options)
    lower = scene.add_rod(start=(LIMB, 0, 0), end=(2 * LIMB, 0, 0), name="lower", **options)
    scene.join(upper.end, lower.start, form=form)
    scene.clamp(upper.start, hold="edge")
    places = [("upper", LIMB * i / 4) for i in range(5)] + [("lower", LIMB * i / 4) for i in range(1, 5)]
    return scene.build(integrator="static", **build), places


def log():
    return withe.real2sim.read_log(LOG, tags=range(101, 110), skip=7)


def seen_curvatures(places):
    return withe.real2sim.Curvatures.from_pixels(log().pixels, places, GROUPS)
