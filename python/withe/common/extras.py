"""Optional packages, imported on first use."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["require"]


def _how(extra: str) -> str:
    """Return the command that installs an extra from a clone, because the package is on no index."""
    return f'in a clone of withe, run pip install ".[{extra}]"' + (" or make view" if extra == "view" else "")


def require(module: str, extra: str) -> Any:
    """Import a package of one of the extras.

    Parameters
    ----------
    module : str
        Module to import, such as "matplotlib.pyplot".
    extra : str
        Extra that installs it, such as "view".

    Returns
    -------
    module

    Raises
    ------
    ImportError
        The package is not installed; the message says how to install the extra from a clone of withe.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = module.split(".")[0]
        if error.name is None or error.name.split(".")[0] != package:
            raise
        raise ImportError(
            f"this function needs the package {package}, which is not installed: {_how(extra)}", name=package
        ) from error
