"""Films: the moments of a record that they show, and the file from their pictures."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import numpy.typing as npt

__all__ = ["Film", "film_places"]

FloatArray = npt.NDArray[np.float64]


def film_places(times: FloatArray, interval: float) -> FloatArray:
    """Return the places of the pictures of a film in the record, as fractional frame numbers.

    Parameters
    ----------
    times : ndarray of shape (frames,) [s]
    interval : float
        Time of the simulation between two pictures [s].

    Returns
    -------
    ndarray of shape (pictures,)
        Frame numbers; the numbers of the frames themselves if time does not advance.
    """
    duration = float(times[-1] - times[0])
    if duration <= 0.0 or np.any(np.diff(times) <= 0.0):
        return np.arange(len(times), dtype=float)
    moments = times[0] + interval * np.arange(int(np.floor(duration / interval + 1e-9)) + 1)
    return np.asarray(np.interp(moments, times, np.arange(len(times))), float)


class Film:
    """Film, whose pictures are sent to ffmpeg one by one."""

    def __init__(self, encoder: str, path: Path, size: tuple[int, int], fps: float) -> None:
        source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:g}", "-i", "-"]
        if path.suffix.lower() == ".gif":
            filters = "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=none:diff_mode=rectangle"
            target = ["-filter_complex", filters, "-loop", "0"]
        else:
            target = [
                "-c:v",
                "libx264",
                "-preset",
                "veryfast",
                "-crf",
                "18",
                "-pix_fmt",
                "yuv420p",
                "-movflags",
                "+faststart",
            ]
        self._command = [encoder, "-y", "-loglevel", "error", *source, *target, os.fspath(path.absolute())]

    def __enter__(self) -> Film:
        self._process = subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        return self

    def write(self, image: npt.NDArray[np.uint8]) -> None:
        """Append one picture, shape (height, width, 3)."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(np.ascontiguousarray(image).tobytes())
        except BrokenPipeError:
            self._finish()

    def _finish(self) -> None:
        _, errors = self._process.communicate()
        if self._process.returncode != 0:
            words = errors.decode(errors="replace").strip()
            raise RuntimeError(f"ffmpeg failed, and no film was written: {words or 'it gave no reason'}")

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._finish()
        else:
            self._process.kill()
            self._process.communicate()
