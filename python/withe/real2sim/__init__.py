"""Simulations that look like what a camera saw: logs, targets, fits and cameras.

>>> import withe
>>> log = withe.real2sim.read_log("log.csv", tags=range(101, 110))  # doctest: +SKIP
"""

from withe.perception.tags import TagDetection, detect_tags
from withe.real2sim.calibration import Calibration, calibrate
from withe.real2sim.centrelines import Centrelines, rest_shape
from withe.real2sim.fitting import fit
from withe.real2sim.logs import Log, read_log
from withe.real2sim.motions import fit_motion
from withe.real2sim.results import Fit, Outlier, Unobservable
from withe.real2sim.targets import Curvatures, Tags

__all__ = [
    "Calibration",
    "Centrelines",
    "Curvatures",
    "Fit",
    "Log",
    "Outlier",
    "TagDetection",
    "Tags",
    "Unobservable",
    "calibrate",
    "detect_tags",
    "fit",
    "fit_motion",
    "read_log",
    "rest_shape",
]
