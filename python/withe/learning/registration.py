"""Registration of the environments of withe in Gymnasium."""

from __future__ import annotations

from withe.common.extras import require
from withe.learning.arms import Follow, Obstacles2D, Obstacles3D, Reach
from withe.learning.environments import maker, vector_maker
from withe.learning.limbs import Crawl, Wrap

__all__ = ["register"]

_TASKS = {
    "Follow": Follow,
    "Reach": Reach,
    "Obstacles2D": Obstacles2D,
    "Obstacles3D": Obstacles3D,
    "Crawl": Crawl,
    "Wrap": Wrap,
}
globals().update({name: maker(task) for name, task in _TASKS.items()})
globals().update({f"{name}Vector": vector_maker(task) for name, task in _TASKS.items()})


def register() -> None:
    """Register the environments for `gymnasium.make` and `gymnasium.make_vec`, as withe/Follow-v0 and so on.

    Importing withe registers them if Gymnasium has been imported before.

    Raises
    ------
    ImportError
        Gymnasium is not installed.

    Examples
    --------
    >>> withe.learning.register()  # doctest: +SKIP
    >>> robots = gymnasium.make_vec("withe/Reach-v0", num_envs=64)  # doctest: +SKIP
    """
    registration = require("gymnasium.envs.registration", "learn")
    for name in _TASKS:
        if f"withe/{name}-v0" not in registration.registry:
            registration.register(
                f"withe/{name}-v0",
                entry_point=f"{__name__}:{name}",
                vector_entry_point=f"{__name__}:{name}Vector",
            )
