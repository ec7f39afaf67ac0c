"""Off-screen rendering on this machine.

Rendering needs a graphics library that wheels do not contain. Without it VTK may end the process, so a subprocess tests
the first render. The test runs while this process imports PyVista. Its result is not stored in a file: a display, a
driver or a device may be gone when the next process starts, and a wrong answer would end that process.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

__all__ = ["begin_probe", "probe_rendering", "render_window"]

# A sphere drawn by VTK alone, which starts in a quarter of the time of PyVista.
_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import (
    vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter
)
sphere, mapper, actor = vtkSphereSource(), vtkPolyDataMapper(), vtkActor()
mapper.SetInputConnection(sphere.GetOutputPort())
actor.SetMapper(mapper)
renderer, window, pixels = vtkRenderer(), vtkRenderWindow(), vtkWindowToImageFilter()
renderer.AddActor(actor)
window.SetOffScreenRendering(1)
window.SetSize(64, 64)
window.AddRenderer(renderer)
window.Render()
pixels.SetInput(window)
pixels.ReadFrontBufferOff()
pixels.Update()
darkest, brightest = pixels.GetOutput().GetScalarRange()
raise SystemExit(0 if darkest < brightest else 3)
"""
_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"


def begin_probe() -> None:
    """Begin to look for a way to render off-screen, unless one is known. `probe_rendering` waits for the result."""
    _searched()


@cache
def _searched() -> Future[str]:
    """Return the result to come of the one search, which runs in a thread."""
    pool = ThreadPoolExecutor(1, thread_name_prefix="withe-probe")
    try:
        return pool.submit(_find_window)
    finally:
        pool.shutdown(wait=False)


@cache
def probe_rendering() -> str:
    """Find a way to render off-screen, in a subprocess, once in a process.

    Returns
    -------
    str
        The render window of VTK that works; empty for its own choice.

    Raises
    ------
    RuntimeError
        No way works; the message names the package to install. The next call tries again.
    """
    try:
        return _searched().result()
    except RuntimeError:
        _searched.cache_clear()
        raise


def _find_window() -> str:
    """Return the first render window that works, as in `probe_rendering`."""
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
