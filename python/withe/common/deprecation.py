"""Old words of the public API: each works for one version and warns with `DeprecationWarning`, which names the new one.

Old words are translated in this module only: `renamed` for arguments, `moved_into` for arguments that became fields of
one value, `old_names` for names of a module, `old_word` for all else.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import Any, TypeVar

from withe.common.keywords import keyword_hints
from withe.common.user_warnings import warn

__all__ = ["moved_into", "old_names", "old_word", "renamed"]

T = TypeVar("T", bound=Callable[..., Any])


def old_word(old: str, new: str) -> None:
    """Warn at the user's line that a word is deprecated.

    Parameters
    ----------
    old : str
        The deprecated word, as the user wrote it.
    new : str
        The word to use instead.

    Warns
    -----
    DeprecationWarning
        Always.
    """
    warn(f"{old} is deprecated and will be removed in the next version; use {new}", DeprecationWarning, cause=old)


def renamed(**words: str) -> Callable[[T], T]:
    """Accept old keywords of a function, and pass their values on under the new keywords.

    The decorated function also has the hints of `keyword_hints`.

    Parameters
    ----------
    **words : str
        The new keyword of each old one.

    Returns
    -------
    callable
        The decorator. The decorated function raises `TypeError` if a call gives an old and its new keyword together.

    Examples
    --------
    >>> import warnings
    >>> @renamed(floor="friction")
    ... def laid(*, friction):
    ...     return friction
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", DeprecationWarning)
    ...     laid(floor=0.4)
    0.4
    """

    def decorate(function: T) -> T:
        hinted = keyword_hints(function)

        @wraps(function)
        def call(*arguments: Any, **keywords: Any) -> Any:
            for old in [word for word in words if word in keywords]:
                new = words[old]
                if new in keywords:
                    raise TypeError(f"{function.__name__}() got {old}= and {new}=, which is its new name: give one")
                old_word(f"{old}= of {function.__name__}()", f"{new}=")
                keywords[new] = keywords.pop(old)
            return hinted(*arguments, **keywords)

        return call  # type: ignore[return-value]

    return decorate


def moved_into(word: str, kind: type, **fields: str) -> Callable[[T], T]:
    """Accept old keywords of a function, and pass their values on as fields of one value.

    The decorated function also has the hints of `keyword_hints`.

    Parameters
    ----------
    word : str
        The new keyword.
    kind : type
        Class of its value, whose arguments are keywords.
    **fields : str
        The field of `kind` for each old keyword. If `word` is among the old keywords, its old values are strings.

    Returns
    -------
    callable
        The decorator. The decorated function raises `TypeError` if a call gives an old keyword and a value of `kind`.

    Examples
    --------
    >>> import warnings
    >>> from withe import Solver
    >>> @moved_into("solver", Solver, max_iterations="max_iterations")
    ... def built(*, solver):
    ...     return solver.max_iterations
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", DeprecationWarning)
    ...     built(max_iterations=7)
    7
    """

    def decorate(function: T) -> T:
        hinted = keyword_hints(function)

        @wraps(function)
        def call(*arguments: Any, **keywords: Any) -> Any:
            old = [each for each in fields if each in keywords and (each != word or isinstance(keywords[each], str))]
            if old:
                shown = ", ".join(f"{each}=" for each in old)
                values = {fields[each]: keywords.pop(each) for each in old}
                if word in keywords:
                    raise TypeError(
                        f"{function.__name__}() got {shown} and {word}=, of which they are fields: give {word}= only"
                    )
                new = ", ".join(f"{name}={value!r}" for name, value in values.items())
                old_word(f"{shown} of {function.__name__}()", f"{word}=withe.{kind.__name__}({new})")
                keywords[word] = kind(**values)
            return hinted(*arguments, **keywords)

        return call  # type: ignore[return-value]

    return decorate


def old_names(module: str, **places: str) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a module from which names have moved.

    Parameters
    ----------
    module : str
        Full name of the module.
    **places : str
        The new full name of each old name, such as ``Plan="withe.folding.FoldPlan"``.

    Returns
    -------
    callable
        Function that returns the object of an old name and warns with `DeprecationWarning`. For any other name it
        raises `AttributeError`.
    """

    def find(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        old_word(f"{module}.{name}", places[name])
        home, _, new = places[name].rpartition(".")
        return getattr(import_module(home), new)

    return find
