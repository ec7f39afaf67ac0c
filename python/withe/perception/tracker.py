"""Tracking of cables in a film: names, ends and arc length from frame to frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from withe import _core
from withe.common import validation
from withe.common.keywords import keyword_hints
from withe.common.short_repr import ShortRepr
from withe.common.user_warnings import warn
from withe.errors import LostCableWarning
from withe.perception.camera import Camera
from withe.perception.chain import resample
from withe.perception.images import check_image
from withe.perception.masks import MaskFunction, ground_filter
from withe.perception.plane import Plane
from withe.perception.rod_prior import RodPrior
from withe.perception.tracing import check_mask, trace_mask
from withe.perception.tracked import Tracked, sample_points

__all__ = ["TrackedCable", "Tracker"]

Array = NDArray[np.float64]

_SHORTEST = 40.0  # least length of a cable in the first frame [px]
_LENGTH_OFF = 0.1  # greatest relative error of the length of a rod in the first frame
_FOUND_AGAIN = 0.15  # the same for a cable that is found again by tracing


@dataclass(frozen=True, eq=False, repr=False)
class TrackedCable(ShortRepr):
    """A cable in one frame of a film.

    Attributes
    ----------
    name : str
    nodes : ndarray of shape (nodes, 2) [px]
        Points of the centreline at equal distances along the cable. The first node is at the same end in every frame.
    visible : ndarray of bool, shape (nodes,)
        True for nodes that the mask shows. The prior alone determines the other nodes.
    points : ndarray of shape (nodes, 3) [m], or None
        Positions in the world, on the plane z = 0. None without a camera.
    residual : float [px]
        Root mean square distance of the cable from the middle of the mask, where the cable is visible. NaN if no node
        is visible.
    """

    name: str
    nodes: Array
    visible: NDArray[np.bool_]
    points: Array | None
    residual: float


class Tracker:
    """Follow cables through a film, also where they are hidden and where they cross.

    The first frame that shows cables is traced. Afterwards, each cable is a chain of nodes at constant distances that
    moves with the mask. A prior moves the nodes that the mask does not show:

    - With `rod`, the prior is an elastic rod with weight and inertia in the plane z = 0 of the camera.
    - Without `rod`, the prior is the shape in which each part of the cable was last seen, with damped inertia.

    Parameters
    ----------
    camera : Camera, optional
        Camera, for positions in metres. `rod` needs it.
    rod : RodPrior, or sequence of RodPrior, optional
        Mechanical description of every cable, or of each.
    nodes : int
        Number of nodes of each cable.
    mask : callable, optional
        Function from a picture to the mask of cables, by default `ground_filter`.
    names : sequence of str, optional
        Names of the cables, longest first; it also fixes their number. By default "cable 0", "cable 1" and so on.
    frame_rate : float [1/s]
        Frames per second, for frames without a time.
    reach : float [px]
        Greatest distance of a cable from its prediction at which it is found.

    Raises
    ------
    ValueError
        Fewer than 5 or more than 1000 nodes, a rod without a camera, names that occur twice, or a rate or reach that is
        not positive.

    Notes
    -----
    The prior is two-dimensional: it neglects motion out of the plane, twist, and friction on the table. For a cable
    that friction holds in its shape, leave out `rod`.

    The tracker minimises the incremental potential of the implicit Euler method in each frame [Martin et al. 2011,
    Example-based elastic materials]: elastic energy, weight, and inertia about the predicted positions. Springs pull
    the chain to the middles of cross-sections of the mask. The tracker searches for cross-sections along normals of the
    chain [Harris and Stennett 1990, RAPID]. A cross-section wider than the cable has a second cable beside it. It
    counts with the border that agrees with the prediction.

    Two cables that lie on each other along their whole length cannot be told apart. An end that something covers
    slowly looks like a cable that slides; `hidden` of `update` prevents that.

    Examples
    --------
    >>> import numpy as np
    >>> tracker = Tracker(nodes=21)
    >>> for shift in range(5):
    ...     mask = np.zeros((80, 200), bool)
    ...     mask[30 + shift : 38 + shift, 20:180] = True
    ...     (cable,) = tracker.update(mask=mask)
    >>> bool(abs(cable.nodes[:, 1] - 37.5).mean() < 0.5)
    True
    """

    @keyword_hints
    def __init__(
        self,
        camera: Camera | None = None,
        rod: RodPrior | Sequence[RodPrior] | None = None,
        *,
        nodes: int = 41,
        mask: MaskFunction | None = None,
        names: Sequence[str] | None = None,
        frame_rate: float = 30.0,
        reach: float = 24.0,
    ) -> None:
        if camera is not None and not isinstance(camera, Camera):
            raise ValueError(f"camera must be a withe.perception.Camera, got {type(camera).__name__}")
        rods = [] if rod is None else list(rod) if isinstance(rod, Sequence) else [rod]
        if not all(isinstance(each, RodPrior) for each in rods):
            raise ValueError(f"rod must be a RodPrior or a sequence of RodPrior, got {rod!r}")
        if rods and camera is None:
            raise ValueError("rod needs a camera, because its lengths are in metres: pass camera= as well")
        self._rods = rods
        self._count = validation.integer(nodes, "nodes", 5, 1000)
        self._filter = ground_filter if mask is None else validation.function(mask, "mask")
        self._names = None if names is None else [str(name) for name in names]
        if self._names is not None and len(set(self._names)) < max(len(self._names), 1):
            raise ValueError(f"names must be different names, one a cable, got {self._names}")
        self._step = 1.0 / validation.positive(frame_rate, "frame_rate")
        self._reach = max(4, round(validation.positive(reach, "reach")))
        self._plane = Plane(camera)
        self._cables: list[Tracked] = []
        self._shape: tuple[int, int] | None = None
        self._time: float | None = None
        self._seen = False
        self._warned = False

    @property
    def seen(self) -> bool:
        """Return True if the last frame showed at least one cable."""
        return self._seen

    @property
    def time(self) -> float | None:
        """Return the time of the last frame [s], or None before the first one."""
        return self._time

    @property
    def cables(self) -> list[TrackedCable]:
        """Return the cables as of the last frame."""
        found = []
        for cable in self._cables:
            metric = None if self._plane.camera is None else self._plane.points(cable.x)
            nodes = self._plane.pixels(cable.x)
            found.append(TrackedCable(cable.name, nodes, cable.visible.copy(), metric, cable.residual))
        return found

    @keyword_hints
    def update(
        self,
        image: ArrayLike | None = None,
        *,
        mask: ArrayLike | None = None,
        hidden: ArrayLike | None = None,
        time: float | None = None,
    ) -> list[TrackedCable]:
        """Move the cables to the next frame.

        Parameters
        ----------
        image : array_like of shape (height, width, 3), uint8, optional
            Red, green and blue; grey and alpha are accepted. Not used where `mask` is given.
        mask : array_like of shape (height, width), optional
            Pixels of cables: booleans or numbers.
        hidden : array_like of shape (height, width), optional
            Pixels where something may cover a cable, such as a gripper; all False if nothing does. The mask is not used
            there, and ends at its border are not taken for ends of a cable. All other ends are then ends of a cable.
            Without `hidden`, each end of the mask may be the border of something that covers the cable.
        time : float, optional [s]
            Time of the frame, by default one frame period after the last frame.

        Returns
        -------
        list of TrackedCable
            The cables. The list is empty until a frame shows a cable.

        Raises
        ------
        ValueError
            Neither a picture nor a mask, a frame of another size than the first one, or a time that does not increase.
            A first frame with another number of cables than names or rods, with a ring, or with a cable whose length
            differs from its rod by more than 10 %.

        Warns
        -----
        LostCableWarning
            A frame shows no cable. The tracker then keeps its last state, and `seen` is False. The warning is given
            once per tracker.
        """
        pixels = self._checked_mask(image, mask)
        covered = None if hidden is None else self._checked_size(check_mask(hidden, "hidden"), "hidden")
        step = self._advanced(time)
        if self._shape is None:
            self._shape = (pixels.shape[0], pixels.shape[1])
        if covered is not None:
            pixels = np.where(covered != 0, np.uint8(0), pixels)
        if not self._cables:
            self._begin(pixels)
            self._seen = bool(self._cables)
        else:
            self._follow(pixels, covered, step)
        if not self._seen and not self._warned:
            self._warned = True
            warn(
                "the frame shows no cable, so the tracker keeps its last state: check the mask. "
                "Tracker.seen is False for each such frame",
                LostCableWarning,
            )
        return self.cables

    def _checked_mask(self, image: ArrayLike | None, mask: ArrayLike | None) -> NDArray[np.uint8]:
        if image is None and mask is None:
            raise ValueError("update needs a picture or a mask, got neither: pass image or mask=")
        if mask is not None:
            return self._checked_size(check_mask(mask), "mask")
        assert image is not None
        picture = check_image(image)
        self._checked_size(picture[..., 0], "image")
        return check_mask(self._filter(picture))

    def _checked_size(self, pixels: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
        if self._shape is not None and pixels.shape != self._shape:
            raise ValueError(
                f"{name} must have {self._shape[0]} rows and {self._shape[1]} columns as the first frame, got "
                f"{pixels.shape[0]} and {pixels.shape[1]}: make a new Tracker for another film"
            )
        if 0 in pixels.shape:
            raise ValueError(f"{name} must hold a pixel, got shape {pixels.shape}")
        return pixels

    def _advanced(self, time: float | None) -> float:
        """Set the time of this frame and return the time since the last frame [s]."""
        if time is None:
            time = 0.0 if self._time is None else self._time + self._step
        now = validation.number(time, "time")
        if self._time is not None and now <= self._time:
            raise ValueError(
                f"time must increase from frame to frame, got {now:g} s after {self._time:g} s: sort the frames"
            )
        step = self._step if self._time is None else now - self._time
        self._time = now
        return step

    def _begin(self, pixels: NDArray[np.uint8]) -> None:
        """Trace the first frame."""
        tracing = trace_mask(pixels)
        lines = [self._plane.coordinates(line) for line in tracing.centrelines]
        sizes = np.array([_length(line) for line in tracing.centrelines])
        order = [int(i) for i in np.argsort(-sizes, kind="stable") if sizes[i] >= _SHORTEST]
        if not order:
            return
        wanted = len(self._names) if self._names is not None else len(self._rods) if len(self._rods) > 1 else None
        if wanted is not None and len(order) < wanted:
            raise ValueError(
                f"first frame must show {wanted} cables of at least {_SHORTEST:g} px, got {len(order)}: begin with a "
                "frame in which they do not touch"
            )
        order = order[:wanted]
        ring = next((i for i in order if tracing.closed[i]), None)
        if ring is not None:
            x, y = tracing.centrelines[ring].mean(axis=0)
            raise ValueError(f"first frame must show open cables, got a ring about ({x:.0f}, {y:.0f}): mask it out")
        names = self._names or [f"cable {i}" for i in range(len(order))]
        if len(self._rods) not in (0, 1, len(order)):
            raise ValueError(f"rod must be one description, or one for each of {len(order)} cables")
        self._plane.set_scale(tracing.centrelines[order[0]])
        lines = [self._plane.coordinates(line) for line in tracing.centrelines]
        for k, i in enumerate(order):
            rod = self._rods[min(k, len(self._rods) - 1)] if self._rods else None
            length = _length(lines[i])
            if rod is not None:
                true = rod.length * self._plane.scale
                if abs(length / true - 1.0) > _LENGTH_OFF:
                    raise ValueError(
                        f"first frame must show the whole of {names[k]!r}, {rod.length:g} m long, got "
                        f"{length / self._plane.scale:.3g} m: check the length of the rod and the scale of the camera, "
                        "or begin with a frame in which nothing hides it"
                    )
                length = true
            width = float(np.median(tracing.widths[i]))
            self._cables.append(
                Tracked(names[k], resample(lines[i], self._count), length, width, rod, self._plane, self._step)
            )
        shown = [sample_points(cable.predicted_pixels) for cable in self._cables]
        for k, cable in enumerate(self._cables):
            cable.settle(pixels, shown[:k] + shown[k + 1 :], self._reach, self._step)

    def _follow(self, pixels: NDArray[np.uint8], covered: NDArray[np.uint8] | None, step: float) -> None:
        """Move every cable by one step; if none is seen, keep them."""
        before = [(cable.x, cable.velocity) for cable in self._cables]
        for cable in self._cables:
            cable.predict(step)
        expected = [sample_points(cable.predicted_pixels) for cable in self._cables]
        for i, cable in enumerate(self._cables):
            others = [points for j, points in enumerate(expected) if j != i]
            cable.match(pixels, covered, others, self._reach, step)
        if not any(cable.visible.any() for cable in self._cables):
            for cable, (x, _) in zip(self._cables, before, strict=True):
                cable.hold(x)
        lost = [cable for cable in self._cables if not cable.visible.any()]
        if lost and pixels.any():
            self._find_again(pixels, lost)
        self._seen = any(cable.visible.any() for cable in self._cables)

    def _find_again(self, pixels: NDArray[np.uint8], lost: list[Tracked]) -> None:
        """Trace the frame, and set cables that no node is seen of to traces of their length."""
        taken = [self._plane.pixels(cable.x) for cable in self._cables if cable not in lost]
        found = _core.trace_lines(pixels, None, "withe")  # without the warnings of trace_mask, frame by frame
        for line, closed in zip(found["centrelines"], found["closed"], strict=True):
            middle = line[len(line) // 2]
            if not lost or closed or any(_passes(points, middle, lost[0].width) for points in taken):
                continue
            traced = self._plane.coordinates(line)
            fitting = [c for c in lost if abs(_length(traced) / c.length - 1.0) < _FOUND_AGAIN]
            if fitting:
                nearest = min(fitting, key=lambda c: float(np.hypot(*(c.x.mean(axis=0) - traced.mean(axis=0)))))
                nearest.restart(resample(traced, self._count))
                lost.remove(nearest)


def _passes(nodes: Array, point: Array, width: float) -> bool:
    """Return True if a cable passes a point within two widths."""
    return bool(np.hypot(*(nodes - point).T).min() < 2.0 * width)


def _length(line: Array) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
