"""The logger of the package, which is silent unless the user adds a handler."""

from __future__ import annotations

import logging

__all__ = ["logger", "logs_debug", "logs_info"]

logger = logging.getLogger("withe")
logger.addHandler(logging.NullHandler())


def logs_debug() -> bool:
    """Return True if somebody reads details: subdivided steps, equilibria and files."""
    return logger.isEnabledFor(logging.DEBUG)


def logs_info() -> bool:
    """Return True if somebody reads decisions of builds and summaries of runs."""
    return logger.isEnabledFor(logging.INFO)
