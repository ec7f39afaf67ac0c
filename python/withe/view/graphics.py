"""Off-screen rendering on this machine.

Rendering needs a graphics library that wheels do not contain. Without it VTK may end the process, so a subprocess tests
the first render.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache

__all__ = ["probe_rendering", "render_window"]

_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(64, 64))
plotter.add_mesh(pyvista.Sphere())
image = plotter.screenshot(return_img=True)
raise SystemExit(0 if image.min() < image.max() else 3)
"""
_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"


@cache
def probe_rendering() -> str:
    """Find a way to render off-screen, in a subprocess, once.

    Returns
    -------
    str
        The render window of VTK that works; empty for its own choice.

    Raises
    ------
    RuntimeError
        No way works; the message names the package to install.
    """
    windows = ["vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow"] if sys.platform == "linux" else []
    if sys.platform != "linux" or os.environ.get("DISPLAY") or os.environ.get(_WINDOW):
        windows.insert(0, "")
    output = ""
    for window in windows:
        environment = {**os.environ, _WINDOW: window} if window else dict(os.environ)
        try:
            result = subprocess.run(
                [sys.executable, "-c", _PROBE], env=environment, capture_output=True, text=True, timeout=180
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            output += str(error)
            continue
        if result.returncode == 0:
            return window
        output += result.stderr
    raise RuntimeError(_advice(output))


def _advice(output: str) -> str:
    """Return advice on what to install, from the output of the failed render."""
    message = "cannot render off-screen: "
    if sys.platform != "linux":
        last = output.strip().splitlines()[-1:] or ["no reason given"]
        return message + last[0]
    for library, package in (
        ("libGL.so", "libgl1"),
        ("libXrender.so", "libxrender1"),
        ("libX11.so", "libx11-6"),
        ("libSM.so", "libsm6"),
    ):
        if f"{library}" in output and "ImportError" in output:
            return message + f"{library} is missing; install it with: apt install {package}"
    return message + "no working EGL library was found; install it with: apt install libegl1 libgl1-mesa-dri"


@contextlib.contextmanager
def render_window(off_screen: bool) -> Iterator[None]:
    """Select the render window that the probe found, and restore the environment afterwards."""
    if not off_screen:
        yield
        return
    window = probe_rendering()
    before = os.environ.get(_WINDOW)
    if window:
        os.environ[_WINDOW] = window
    try:
        yield
    finally:
        if window and before is None:
            os.environ.pop(_WINDOW, None)
