"""Cables that are laid down along a pattern.

Lengths here are in units of the gravito-bending length Lgb = (EI / 2w)^(1/3), and forces in w Lgb, where w is the
weight of the rod per length. Quantities of a particular cable are in m and N.

>>> import withe
>>> found = withe.deployment.grasp(5.0, 0.25)
>>> print(found.position.round(3), found.force.round(3))
[ 2.505 -0.784  3.444] [0.    0.2   1.493]
"""

from typing import TYPE_CHECKING

from withe.common.deprecation import old_names
from withe.deployment.cable import Cable, MeasuredCable, measure
from withe.deployment.deploying import Deployment, deploy, hang, place, trial_cable
from withe.deployment.feasibility import Feasibility, Slip
from withe.deployment.grasp_network import GraspNetwork
from withe.deployment.grasping import Grasp, grasp
from withe.deployment.hanging import MeasuredCurvature, measure_curvature
from withe.deployment.motion import Phase
from withe.deployment.network_training import train
from withe.deployment.pattern import Pattern
from withe.deployment.placing import posts_along
from withe.deployment.planning import LayPlan, plan
from withe.deployment.posts import Post
from withe.deployment.straight import StraightLine, StraightPose
from withe.deployment.tying import Move, Tying, tie

__all__ = [
    "Cable",
    "Deployment",
    "Feasibility",
    "Grasp",
    "GraspNetwork",
    "LayPlan",
    "MeasuredCable",
    "MeasuredCurvature",
    "Move",
    "Pattern",
    "Phase",
    "Post",
    "Slip",
    "StraightLine",
    "StraightPose",
    "Tying",
    "deploy",
    "grasp",
    "hang",
    "measure",
    "measure_curvature",
    "place",
    "plan",
    "posts_along",
    "tie",
    "train",
    "trial_cable",
]

if not TYPE_CHECKING:  # an old name stays an error to type checkers
    __getattr__ = old_names(__name__, Plan="withe.deployment.LayPlan")
