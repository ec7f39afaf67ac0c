"""Fixtures of the Python tests."""

import pytest


@pytest.fixture
def renderer():
    """Skips, and says so, where nothing can be rendered."""
    pytest.importorskip("pyvista")
    from withe.rendering import probe_rendering

    try:
        probe_rendering()
    except RuntimeError as error:
        pytest.skip(str(error))
