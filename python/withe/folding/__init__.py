"""Paper that is lifted from a table and folded over.

Lengths here are in units of the gravito-bending length Lgb = (E h^2 / (24 rho g))^(1/3), and forces in w Lgb, where w
is the weight of the sheet per length. One solution therefore serves every paper.

>>> import withe
>>> pose = withe.folding.elastica(3.0, 2.25)
>>> print(f"{pose.angle:.4f} rad, {pose.suspended:.4f} Lgb lifted, ratio of forces {pose.force_ratio:.4f}")
2.3762 rad, 3.4000 Lgb lifted, ratio of forces 0.3837
"""

from typing import TYPE_CHECKING

from withe.common.deprecation import old_names
from withe.folding.closed_loop import fold
from withe.folding.endings import plan
from withe.folding.hanging_strip import Measured, droop, measure
from withe.folding.jaw import Jaw
from withe.folding.manifold import elastica
from withe.folding.network_training import train
from withe.folding.noise import Noise
from withe.folding.paper import Paper
from withe.folding.planning import replan
from withe.folding.plans import FoldPlan
from withe.folding.plunging import plunge
from withe.folding.seeing import SeenEdge, find_edge, overhead_camera
from withe.folding.sheet_network import SheetNetwork
from withe.folding.sheets import Elastica
from withe.folding.simulated_sheet import Fold, Held, SimulatedSheet
from withe.folding.trials import Outcome, Trial, run_trials
from withe.folding.wide_sheet import WideFold, WideSheet

__all__ = [
    "Elastica",
    "Fold",
    "FoldPlan",
    "Held",
    "Jaw",
    "Measured",
    "Noise",
    "Outcome",
    "Paper",
    "SeenEdge",
    "SheetNetwork",
    "SimulatedSheet",
    "Trial",
    "WideFold",
    "WideSheet",
    "droop",
    "elastica",
    "find_edge",
    "fold",
    "measure",
    "overhead_camera",
    "plan",
    "plunge",
    "replan",
    "run_trials",
    "train",
]

if not TYPE_CHECKING:  # an old name stays an error to type checkers
    __getattr__ = old_names(__name__, Plan="withe.folding.FoldPlan")
