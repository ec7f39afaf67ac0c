"""Names and fixtures of all tests in Python."""

import linecache
import signal
import types

import numpy as np
import pytest

from cases import Recorder

NAMED = (bool, int, float, complex, np.number, type(None))


def pytest_addoption(parser):
    parser.addoption(
        "--cases", metavar="FILE", help="add errors of the cases of the validation page to FILE; - prints them"
    )


def pytest_configure(config):
    if config.getoption("cases"):
        config.pluginmanager.register(Recorder(config), "cases")
    # Ctrl-C is ignored in tests that a script starts in the background; some tests press it.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_collection_modifyitems(config, items):
    """Give each worker a share of the files with slow tests first, so that all workers end with quick tests, together.

    A worker begins with a run of successive tests, and takes tests from the end of another run when its own is over.
    """
    workers = getattr(config, "workerinput", {}).get("workercount", 1)
    if workers > 1:
        slow = {item.path for item in items if item.get_closest_marker("slow")}
        files = sorted(dict.fromkeys(item.path for item in items), key=lambda path: path not in slow)
        place = {path: (number % workers, number) for number, path in enumerate(files)}
        items.sort(key=lambda item: place[item.path])


# --- names of parameters ----------------------------------------------------------------------------------------------


def pytest_make_parametrize_id(config, val, argname):
    """Name values other than text by their argument, functions by what they do: `radius=0.01`, `rod(radius=0)`.

    pytest appends numbers to names that are equal.
    """
    text = text_of(val)
    if text is None or not 0 < len(text) <= 60 or not (text.isascii() and text.isprintable()):
        return None
    return text if callable(val) or isinstance(val, dict) else f"{argname}={text}"


def text_of(value):
    if isinstance(value, NAMED):
        return str(value)
    if isinstance(value, np.ndarray) and value.size > 4:
        return "x".join(map(str, value.shape))
    if isinstance(value, tuple | list | np.ndarray):
        texts = [text_within(part) for part in value]
        return None if None in texts else f"({','.join(texts)})"
    if isinstance(value, dict):
        texts = [text_within(part) for part in value.values()]
        return ",".join(f"{key}={text}" if text else str(key) for key, text in zip(value, texts, strict=True))
    if isinstance(value, types.FunctionType) and value.__name__ == "<lambda>":
        return body_of(value)
    return getattr(value, "__name__", None)


def text_within(value):
    return value if isinstance(value, str) else text_of(value)


def body_of(function):
    """The source of a lambda after its colon, where that stands on one line."""
    places = [place for place in function.__code__.co_positions() if None not in place]
    places = [place for place in places if place[3] > 0]
    if len({line for place in places for line in place[:2]}) != 1:
        return None
    line = linecache.getline(function.__code__.co_filename, places[0][0]).encode()
    return line[min(place[2] for place in places) : max(place[3] for place in places)].decode()


@pytest.fixture
def renderer():
    """Skips with a reason where nothing can be rendered."""
    pytest.importorskip("pyvista")
    from withe.view.graphics import probe_rendering

    try:
        probe_rendering()
    except RuntimeError as error:
        pytest.skip(str(error))
