"""Fits of simulations to camera data: logs, targets, fits and cameras.

>>> import withe
>>> log = withe.real2sim.read_log("log.csv", tags=range(101, 110))  # doctest: +SKIP
"""

from typing import TYPE_CHECKING

from withe.common.deprecation import old_names
from withe.real2sim.calibration import Calibration, calibrate
from withe.real2sim.centrelines import Centrelines, rest_shape
from withe.real2sim.fitting import fit
from withe.real2sim.logs import Log, read_log
from withe.real2sim.motions import fit_motion
from withe.real2sim.results import Fit, Outlier, Unobservable
from withe.real2sim.targets import Curvatures, Residual, Tags, Target

__all__ = [
    "Calibration",
    "Centrelines",
    "Curvatures",
    "Fit",
    "Log",
    "Outlier",
    "Residual",
    "Tags",
    "Target",
    "Unobservable",
    "calibrate",
    "fit",
    "fit_motion",
    "read_log",
    "rest_shape",
]

if not TYPE_CHECKING:  # an old name stays an error to type checkers
    __getattr__ = old_names(
        __name__, TagDetection="withe.perception.TagDetection", detect_tags="withe.perception.detect_tags"
    )
