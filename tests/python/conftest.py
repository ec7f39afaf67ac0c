"""Fixtures of the Python tests."""

import signal

import pytest


def pytest_configure():
    """Where a script started the tests in the background, Ctrl-C is ignored; some tests press it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def renderer():
    """Skips with a reason where nothing can be rendered."""
    pytest.importorskip("pyvista")
    from withe.view.graphics import probe_rendering

    try:
        probe_rendering()
    except RuntimeError as error:
        pytest.skip(str(error))
