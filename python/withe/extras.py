"""Packages that are installed on demand, imported when first used."""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["require"]


def require(module: str, extra: str) -> Any:
    """Import a package of one of the extras.

    Parameters
    ----------
    module : str
        What to import, such as "matplotlib.pyplot".
    extra : str
        The extra that installs it, such as "view".

    Returns
    -------
    module

    Raises
    ------
    ImportError
        The package is not installed; the message says which extra to install.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        package = module.split(".")[0]
        if error.name is None or error.name.split(".")[0] != package:
            raise
        raise ImportError(
            f'this needs {package}, which is not installed: pip install "withe[{extra}]"', name=package
        ) from error
