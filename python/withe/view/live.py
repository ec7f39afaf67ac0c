"""A view of a simulation while it runs."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType

import numpy as np
import numpy.typing as npt

from withe.common.frames import Frames
from withe.common.keywords import keyword_hints
from withe.view.bodies import body_points
from withe.view.colors import ColorBy
from withe.view.pinhole import Pinhole
from withe.view.rendering import Stage
from withe.view.screens import LiveScreen, live_screen, place_to_show

__all__ = ["LiveView"]

_RATE = 30.0  # greatest number of pictures per second [1/s]
_SLICE = 1e-3  # least time to sleep [s]
_LAG = 0.2  # delay that a run may catch up by going faster than its speed [s]


@keyword_hints
class LiveView:
    """A view that follows the steps of a simulation. `Simulation.view` with ``live=True`` returns it.

    Parameters
    ----------
    present : callable
        Returns the present scene as a record of one frame.
    watchers : list of callable
        Functions that the simulation calls after each time step.
    time_now : callable
        Returns the time of the simulation [s].
    speed : float [-]
        Greatest speed of the run: seconds of the simulation per second. Infinity for no limit.
    size, color_by, camera, ground
        As in `withe.view.picture`. The camera moves back if rods or bodies leave the picture. The scale of colours is
        that of the first scene, so `color_by` needs a scene that is loaded.

    Attributes
    ----------
    redraws : int
        Number of pictures drawn.

    Raises
    ------
    ValueError
        A speed that is not positive, or an option out of range.
    ImportError
        PyVista is not installed.

    Examples
    --------
    >>> with simulation.view(live=True):  # doctest: +SKIP
    ...     simulation.run(2.0)
    """

    def __init__(
        self,
        present: Callable[[], Frames],
        watchers: list[Callable[[], None]],
        time_now: Callable[[], float],
        *,
        speed: float = 1.0,
        size: Sequence[int] = (1024, 640),
        color_by: ColorBy = "rod",
        camera: Pinhole | str | npt.ArrayLike | None = None,
        ground: float | None = None,
    ) -> None:
        if not speed > 0.0:
            raise ValueError(f"speed must be positive, got {speed!r}")
        self._present, self._watchers, self._time_now = present, watchers, time_now
        self._speed = float(speed)
        self._place = place_to_show("view(live=True)", "see the run", interactive=False)
        self._stage = Stage(
            present(),
            size=size,
            color_by=color_by,
            camera=camera,
            ground=ground,
            off_screen=self._place != "window",
            supersampling=1,
            multisampling=self._place == "window",
            live=True,
        )
        self._moves_camera = not isinstance(camera, Pinhole)
        self._thread = threading.get_ident()
        self._waits = self._place != "memory" and self._speed < math.inf
        self._interval, self._next = 1.0 / _RATE, 0.0
        self._shown, self._due = time_now(), 0.0  # time of the simulation, and when the clock reaches it
        self._screen: LiveScreen | None = None
        self.redraws: int = 0

    def __enter__(self) -> LiveView:
        self._screen = live_screen(self._place, self._stage.plotter)
        self._watchers.append(self._watch)
        self.update()
        self._shown, self._due = self._time_now(), time.monotonic()
        self._next = self._due + self._interval  # the first picture takes longer than others
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._watch in self._watchers:
            self._watchers.remove(self._watch)
        if self._screen is None or self._screen.is_closed:
            return
        self.update()
        if kind is None:
            self._screen.finish()

    def _watch(self) -> None:
        """Wait and redraw after a time step, as the clock says. Other threads cannot draw."""
        if threading.get_ident() != self._thread:
            return
        if self._waits:
            self._wait()
        if time.monotonic() >= self._next:
            self.update()

    def _wait(self) -> None:
        """Let the clock reach the time of the simulation. The window answers meanwhile."""
        time_now = self._time_now()
        self._due = max(self._due + (time_now - self._shown) / self._speed, time.monotonic() - _LAG)
        self._shown = time_now
        while self._screen is not None and not self._screen.is_closed:
            now = time.monotonic()
            if now >= self._due:
                return
            time.sleep(min(self._due - now, max(self._next - now, _SLICE)))
            if time.monotonic() >= self._next:
                self.update()

    def update(self) -> None:
        """Draw the present scene."""
        if self._screen is None or self._screen.is_closed:
            return
        began = time.monotonic()
        record = self._present()
        if self._moves_camera:
            self._stage.keep_in_view(np.concatenate([record.positions()[0], body_points(record, [0])]))
        self._stage.show_present(record)
        self._stage.label(f"t = {record.times[0]:.3f} s")
        self._screen.refresh()
        self.redraws += 1
        now = time.monotonic()
        # The run has at least half of the time, however slow the graphics are.
        self._next = now + max(self._interval - (now - began), now - began)

    def image(self) -> npt.NDArray[np.uint8]:
        """Return the present picture.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
        """
        return self._stage.image()

    def close(self) -> None:
        """Close the view. The simulation runs on without it."""
        if self._watch in self._watchers:
            self._watchers.remove(self._watch)
        self._screen = None
        self._stage.close()

    def __repr__(self) -> str:
        return f"LiveView({self.redraws} pictures drawn)"
