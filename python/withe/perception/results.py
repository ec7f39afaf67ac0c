"""Results of tracing an image."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from withe.perception.camera import Camera
from withe.perception.mask_quality import MaskQuality
from withe.perception.triangulation import CableInSpace, triangulate

__all__ = ["Ambiguity", "Crossing", "Joint", "MadeMask", "MaskMethod", "Tracing"]

Array = NDArray[np.float64]
MadeMask = Literal["ground", "both", "learned"]
MaskMethod = Literal[MadeMask, "given"]

FORMAT_VERSION = 1


@dataclass(eq=False)
class Crossing:
    """One strand over another.

    Attributes
    ----------
    point : ndarray of shape (2,) [px]
    over, under : (int, int)
        Cable, and row of its centreline. Both name the same cable if it crosses itself.
    confidence : float [-]
        Confidence in the order, from 0 (unknown, as from a mask alone) to 1.
    """

    point: Array
    over: tuple[int, int]
    under: tuple[int, int]
    confidence: float


@dataclass(eq=False)
class Joint:
    """The end of a cable on the flank of another, half a width from its centreline.

    Attributes
    ----------
    point : ndarray of shape (2,) [px]
        End of the cable that ends.
    end, through : (int, int)
        Cable and row of the cable that ends, and of the cable that continues.
    """

    point: Array
    end: tuple[int, int]
    through: tuple[int, int]


@dataclass(eq=False)
class Ambiguity:
    """A place where another interpretation of the picture is almost as good.

    Attributes
    ----------
    point : ndarray of shape (2,) [px]
    reason : str
        One of these:

        - "similar energies": another way to pair the branches bends the cables hardly more
        - "parallel strands": cables lie side by side
        - "different colors": a cable continues in a clearly different colour
        - "ends on itself": a cable with a curl seems to end at its own flank
    """

    point: Array
    reason: str


@dataclass(eq=False)
class Tracing:
    """Every cable of an image, in order.

    Pixels are x to the right, y downwards; (0, 0) is the centre of the first pixel.

    Attributes
    ----------
    centrelines : list of ndarray of shape (n, 2) [px]
        x, y of each cable from end to end, with rows at most 2 px apart.
    widths : list of ndarray of shape (n,) [px]
    closed : list of bool
        True for a ring; its first row is not repeated at the end.
    labels : ndarray of int32, shape (height, width)
        Label of each pixel: 0 for background, i + 1 for cable i.
    crossings : list of Crossing
        Crossings of pairs of strands; three cables at one point have three crossings.
    joints : list of Joint
    ambiguous : list of Ambiguity
    mask_quality : MaskQuality or None
        Measures of the mask. ``mask_quality.is_good`` is False where the mask does not look like cables; then `trace`
        warns with `PoorMaskWarning`. None for a tracing from `from_dict`.
    mask_method : {"ground", "both", "learned", "given"}
        Origin of the mask: "ground" from the difference from a plain ground, "learned" from the shipped network,
        "both" from either of them, "given" from the argument `mask`.
    timings : dict of str to float [s]
        Time by step.
    """

    centrelines: list[Array] = field(default_factory=list)
    widths: list[Array] = field(default_factory=list)
    closed: list[bool] = field(default_factory=list)
    labels: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 0), np.int32))
    crossings: list[Crossing] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    ambiguous: list[Ambiguity] = field(default_factory=list)
    mask_quality: MaskQuality | None = None
    mask_method: MaskMethod = "given"
    timings: dict[str, float] = field(default_factory=dict)

    def points(self, cable: int, camera: Camera, height: float = 0.0, radius: float | None = None) -> Array:
        """Return the centreline of a cable in metres, for ``Scene.add_rod(points=...)``.

        Parameters
        ----------
        cable : int
            Index of the cable.
        camera : Camera
        height : float [m]
            z of the plane of the centrelines.
        radius : float, optional [m]
            Radius of the cables. With a radius, upper strands are lifted over lower ones by 2.1 radii, towards the
            camera, so that rods do not start inside each other. For a camera that is calibrated on the plane only, the
            effect of this height on the picture is neglected.

        Returns
        -------
        ndarray of shape (n, 3) [m]

        Raises
        ------
        ValueError
            A missing cable, a radius that is not positive, or pixels that do not see the plane.
        """
        if not -len(self) <= cable < len(self):
            raise ValueError(f"cable must be from 0 to {len(self) - 1}, got {cable}")
        if radius is None:
            return camera.to_plane(self.centrelines[cable], height)
        if not radius > 0:
            raise ValueError(f"radius must be positive, got {radius}")
        line, lift = self.centrelines[cable], lifts(self, camera, height, radius)[cable]
        lift *= camera.looks_from(line)
        if not camera.flat:
            return camera.to_plane(line, height + lift)
        points = camera.to_plane(line, height)
        points[:, 2] += lift
        return points

    def triangulate(
        self,
        camera: Camera,
        other: Tracing,
        other_camera: Camera,
        cable: int = 0,
        other_cable: int = 0,
        nodes: int = 101,
    ) -> CableInSpace:
        """Return the centreline of a cable in space, from this tracing and the tracing of a second view.

        Parameters
        ----------
        camera, other_camera : Camera
            Cameras of this tracing and of the other one, with matrices and poses in one world.
        other : Tracing
            Tracing of the second view.
        cable, other_cable : int
            Index of the cable in this tracing, and of the same cable in the other one.
        nodes : int
            Number of points.

        Returns
        -------
        CableInSpace

        Raises
        ------
        ValueError
            A missing cable, a ring, or bad input as in `withe.perception.triangulate`.
        """
        lines = []
        for tracing, index, name in ((self, cable, "cable"), (other, other_cable, "other_cable")):
            if not isinstance(tracing, Tracing):
                raise ValueError(f"other must be a Tracing, got {type(tracing).__name__}")
            if not -len(tracing) <= index < len(tracing):
                raise ValueError(f"{name} must be from 0 to {len(tracing) - 1}, got {index}")
            if tracing.closed[index]:
                raise ValueError(f"{name} must be a cable with two ends, got a ring: cut the ring in the masks")
            lines.append(tracing.centrelines[index])
        return triangulate(lines, (camera, other_camera), nodes=nodes)

    def to_dict(self) -> dict[str, Any]:
        """Return all fields as plain Python objects for JSON; labels as runs (label, length) row by row.

        Returns
        -------
        dict
            Format, version and all fields.
        """
        flat = self.labels.ravel()
        starts = np.flatnonzero(np.diff(flat, prepend=-1)) if len(flat) else np.zeros(0, int)
        lengths = np.diff(np.append(starts, len(flat)))
        return {
            "format": "withe tracing",
            "version": FORMAT_VERSION,
            "shape": list(self.labels.shape),
            "cables": [
                {"centreline": line.tolist(), "widths": np.asarray(widths).tolist(), "closed": bool(closed)}
                for line, widths, closed in zip(self.centrelines, self.widths, self.closed, strict=True)
            ],
            "crossings": [
                {"point": c.point.tolist(), "over": list(c.over), "under": list(c.under), "confidence": c.confidence}
                for c in self.crossings
            ],
            "joints": [
                {"point": j.point.tolist(), "end": list(j.end), "through": list(j.through)} for j in self.joints
            ],
            "ambiguous": [{"point": a.point.tolist(), "reason": a.reason} for a in self.ambiguous],
            "mask_method": self.mask_method,
            "timings": dict(self.timings),
            "label_runs": [[int(flat[s]), int(n)] for s, n in zip(starts, lengths, strict=True)],
        }

    @classmethod
    def from_dict(cls, fields: dict[str, Any]) -> Tracing:
        """Return a tracing from the fields of `to_dict`.

        Parameters
        ----------
        fields : dict
            Fields, as `to_dict` returns them.

        Returns
        -------
        Tracing

        Raises
        ------
        ValueError
            Another format, or an unknown version.
        """
        if fields.get("format") != "withe tracing" or fields.get("version") != FORMAT_VERSION:
            raise ValueError(
                f"fields must be a withe tracing of version {FORMAT_VERSION}, "
                f"got {fields.get('format')!r} of version {fields.get('version')!r}"
            )
        runs = np.array(fields["label_runs"], np.int64).reshape(-1, 2)
        return cls(
            centrelines=[np.array(c["centreline"], float).reshape(-1, 2) for c in fields["cables"]],
            widths=[np.array(c["widths"], float) for c in fields["cables"]],
            closed=[c["closed"] for c in fields["cables"]],
            labels=np.repeat(runs[:, 0], runs[:, 1]).astype(np.int32).reshape(fields["shape"]),
            crossings=[
                Crossing(np.array(c["point"]), tuple(c["over"]), tuple(c["under"]), c["confidence"])
                for c in fields["crossings"]
            ],
            joints=[Joint(np.array(j["point"]), tuple(j["end"]), tuple(j["through"])) for j in fields["joints"]],
            ambiguous=[Ambiguity(np.array(a["point"]), a["reason"]) for a in fields["ambiguous"]],
            mask_method=fields.get("mask_method", "given"),
            timings=fields["timings"],
        )

    def __len__(self) -> int:
        return len(self.centrelines)

    def __repr__(self) -> str:
        counts = {"cable": len(self), "crossing": len(self.crossings), "joint": len(self.joints)}
        words = [f"{count} {word}" + ("" if count == 1 else "s") for word, count in counts.items()]
        return f"<Tracing: {', '.join(words)}>"


def lifts(tracing: Tracing, camera: Camera, height: float, radius: float) -> list[Array]:
    """Return the lift of every row of every cable, by which upper strands clear lower ones [m].

    At a crossing the upper strand lies 2.1 radii above the lower one, over the length in which their outlines overlap.
    It comes down over the same length on both sides. A strand that crosses several others is lifted over the highest.
    """
    lines = [camera.to_plane(line, height)[:, :2] for line in tracing.centrelines]
    result = [np.zeros(len(line)) for line in lines]
    bumps = []
    for crossing in tracing.crossings:
        (over, row), (under, other) = crossing.over, crossing.under
        closed = tracing.closed[over]
        directions = []
        for cable, at in (crossing.over, crossing.under):
            line = lines[cable]
            rows = (
                [(at - 3) % len(line), (at + 3) % len(line)]
                if tracing.closed[cable]
                else [
                    max(at - 3, 0),
                    min(at + 3, len(line) - 1),
                ]
            )
            way = line[rows[1]] - line[rows[0]]
            directions.append(way / max(np.hypot(*way), 1e-300))
        sine = abs(directions[0][0] * directions[1][1] - directions[0][1] * directions[1][0])
        reach = 2.2 * radius / max(sine, 0.15)
        steps = np.hypot(*np.diff(np.vstack([lines[over], lines[over][:1]]) if closed else lines[over], axis=0).T)
        arc = np.concatenate([[0.0], np.cumsum(steps)])
        apart = np.abs(arc[: len(lines[over])] - arc[row])
        if closed:
            apart = np.minimum(apart, arc[-1] - apart)
        fall = np.clip((apart - reach) / (2 * reach), 0, 1)
        bumps.append((over, row, under, other, 0.5 + 0.5 * np.cos(np.pi * fall)))
    for _ in range(len(bumps) + 1):
        changed = False
        for over, row, under, other, shape in bumps:
            wanted = result[under][other] + 2.1 * radius
            if result[over][row] < wanted - 1e-12:
                result[over] = np.maximum(result[over], wanted * shape)
                changed = True
        if not changed:
            break
    return result
