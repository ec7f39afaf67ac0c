"""Learning with robots made of rods: runs as torch functions, environments for reinforcement learning, controllers.

>>> import withe
>>> x = withe.learning.rollout(simulation, {(arm, "youngs_modulus"): E}, duration=2.0)  # doctest: +SKIP
>>> x[-1, -1, 2].backward()  # doctest: +SKIP
>>> robots = gymnasium.make_vec("withe/Follow-v0", num_envs=64)  # doctest: +SKIP

Torch, Gymnasium and Stable-Baselines3 are imported on first use (``pip install ".[learn]"`` in a clone of withe). A
`Task` describes what a robot should do, and needs none of them. `Environment` and `VectorEnvironment` make Gymnasium
environments of a task. ``gymnasium.make`` and ``gymnasium.make_vec`` know ``withe/Follow-v0``, ``Reach-v0``,
``Obstacles2D-v0``, ``Obstacles3D-v0``, ``Crawl-v0`` and ``Wrap-v0`` if Gymnasium is imported before withe, or after a
call of `register`.
"""

import sys
from typing import Any

from withe.learning.arms import Arm, Follow, Obstacles2D, Obstacles3D, Reach
from withe.learning.environments import environment_class
from withe.learning.functions import equilibrium, rollout
from withe.learning.limbs import Crawl, Wrap
from withe.learning.network_training import Alternating, Cosine, train_network
from withe.learning.networks import Network, Training
from withe.learning.registration import register
from withe.learning.task import Task
from withe.learning.training import train_policy

__all__ = [
    "Alternating",
    "Arm",
    "Cosine",
    "Crawl",
    "Environment",
    "Follow",
    "Network",
    "Obstacles2D",
    "Obstacles3D",
    "Reach",
    "Task",
    "Training",
    "VectorEnvironment",
    "Wrap",
    "equilibrium",
    "register",
    "rollout",
    "train_network",
    "train_policy",
]


def __getattr__(name: str) -> Any:
    """Return `Environment` and `VectorEnvironment`, subclasses of Gymnasium's, which are created on first use."""
    if name in ("Environment", "VectorEnvironment"):
        return environment_class(name)
    raise AttributeError(f"module 'withe.learning' has no attribute {name!r}")


if "gymnasium" in sys.modules:
    register()
