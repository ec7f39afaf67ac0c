"""Options of `Scene.build` that a scene keeps as its defaults."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, TypeVar

from withe.common.validation import meant
from withe.parts.options import BuildOptions

__all__ = ["checked_options", "with_build_options"]

T = TypeVar("T", bound=Callable[..., Any])


def checked_options(options: Mapping[str, Any], build: Callable[..., Any]) -> dict[str, Any]:
    """Return options of `build`, which is `Scene.build`, checked; see `Scene.build_options`."""
    if not isinstance(options, Mapping):
        raise ValueError(f"build_options must be a dictionary, got {type(options).__name__}")
    parameters = list(inspect.signature(build).parameters.values())[1:]
    defaults = {each.name: each.default for each in parameters}
    for name in options:
        if name not in defaults:
            hint = meant(str(name), defaults, f"it has {', '.join(defaults)}")
            raise ValueError(f"build has no option {name!r}; {hint}")
    BuildOptions(**{**defaults, **options}).checked()
    return dict(options)


def with_build_options(build: T) -> T:
    """Make `Scene.build` take the options of its scene where a call does not give them."""

    @wraps(build)
    def call(self: Any, *arguments: Any, **options: Any) -> Any:
        if arguments:  # an error, which `build` explains
            return build(self, *arguments, **options)
        return build(self, **{**self._build_options, **options})

    return call  # type: ignore[return-value]
