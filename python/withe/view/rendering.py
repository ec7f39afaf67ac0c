"""Rods as tubes, rigid bodies and obstacles on a light ground, rendered by PyVista.

This is the stage that pictures, films and the viewer share.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from withe.common.extras import require
from withe.common.frames import Frames
from withe.common.outlines import ObstacleOutline
from withe.view import scenery
from withe.view.bodies import BodySurfaces, Pose, body_points, mixed_rotations, shaded_mesh
from withe.view.colors import (
    BARS,
    SOLID_COLOR,
    ColorBy,
    color_limits,
    nice_limits,
    nodal_values,
    rod_color,
)
from withe.view.floors import BACKGROUND, Floor, add_faded_patch
from withe.view.ghosts import stands_out
from withe.view.graphics import begin_probe, render_window
from withe.view.pinhole import Pinhole, check_pinhole, look_through, towards
from withe.view.springs import SpringLines
from withe.view.surfaces import Surface
from withe.view.tendons import TendonLines, tendon_points

__all__ = ["Stage", "fine_supersampling", "mean_of_blocks"]

FloatArray = npt.NDArray[np.float64]
_DIRECTIONS = {
    "front": (0.0, -1.0, 0.12),
    "side": (1.0, 0.0, 0.12),
    "top": (0.0, 0.0, 1.0),
    "oblique": (0.6, -1.0, 0.55),
}
_VIEW_ANGLE = 24.0  # [degrees]
_BAR_SHARE = 0.16
_INK = "#33383d"
_SEE_THROUGH = 0.35  # opacity of tubes and fields
_PATCH = 1.3  # half a side of the patch of a slope or wall, over the diagonal of the scene
_MAX_FINE_PIXELS = 38_000_000  # rendered pixels of a picture with smooth edges: about 0.5 GB
_MAX_SAMPLES = 6000  # rings of all rods together
_SHADOW_CELLS, _LIVE_SHADOW_CELLS = 320, 96
_PIXELS_OF_CELL = 3  # height of a picture over the cells of its shadow: the blur is wider than a cell
_FIRST_RENDERS, _SLOW = 3, 1.0 / 30.0  # renders that compile shaders; time of a render [s]
_STEP_BACK = 0.5  # further beyond the region in view, over the way of a node that left it


class Stage:
    """The rods of a record in front of a camera that sees all their frames.

    Parameters
    ----------
    record : Record
    size : pair of int [px]
    color_by : {"rod", "tension", "curvature", "twist", "speed"}
    camera : str, array_like of shape (3,) or Camera, optional
        Direction of view: "front", "side", "top", "oblique" or a vector; or a camera of given pose and matrix. By
        default along the normal of a planar motion, and oblique otherwise.
    frame : int
        First frame to show.
    frames : sequence of int, optional
        Frames that the camera has in view; all frames by default.
    ghosts : sequence of int
        Frames drawn faintly behind `frame`, each behind the next one, where they differ from it.
    ground : float, optional [m]
        Height of a level floor, on which shadows fall. By default that of a level plane near the rods; without such a
        plane there is neither a floor nor a shadow.
    off_screen : bool
        True to render into memory, False into a window.
    supersampling : int
        Rendered pixels per shown pixel, along each side.
    multisampling : bool
        True to smooth edges without supersampling too, by several samples a pixel.
    live : bool
        True to draw faster, for scenes that change many times a second: a coarser shadow, and no smooth edges beyond
        those of `multisampling`.
    left : float
        Share of the picture on the left that is kept free, for sliders.

    Raises
    ------
    ValueError
        A record without frames, or an argument out of range.
    RuntimeError
        Off-screen rendering is not possible here.
    """

    def __init__(
        self,
        record: Frames,
        *,
        size: Sequence[int] = (1280, 720),
        color_by: ColorBy = "rod",
        camera: Pinhole | str | npt.ArrayLike | None = None,
        frame: int = 0,
        frames: Sequence[int] | None = None,
        ghosts: Sequence[int] = (),
        ground: float | None = None,
        off_screen: bool = True,
        supersampling: int = 2,
        multisampling: bool = True,
        live: bool = False,
        left: float = 0.0,
    ) -> None:
        if len(record) == 0:
            raise ValueError("record has no frames to show")
        if color_by != "rod" and color_by not in BARS:
            raise ValueError(f"color_by must be one of 'rod', {str(list(BARS))[1:-1]}, got {color_by!r}")
        if color_by != "rod" and not record.rods:
            raise ValueError(f"color_by must be 'rod' for a record without rods, got {color_by!r}")
        self.size: tuple[int, int] = _checked_size(size)
        self._margins = left, 0.0 if color_by == "rod" else _BAR_SHARE
        self._read(record, color_by)
        in_view = self._positions if frames is None else self._positions[list(frames)]
        seen = body_points(record, None if frames is None else list(frames))
        nodes = np.concatenate([in_view.reshape(-1, 3), seen])
        around = [
            scenery.framing(obstacle, places if frames is None else places[list(frames)], nodes)
            for obstacle, places in zip(record.obstacles, self._places, strict=True)
        ]
        direction = _direction(camera, in_view)
        if ground is not None and not np.isfinite(ground):
            raise ValueError(f"ground must be a height in metres, got {ground!r}")

        pyvista = _pyvista(off_screen)
        self._fineness, self._off_screen, self._initialised = supersampling, off_screen, False
        self._pixels = require("vtkmodules.vtkCommonCore", "view").vtkUnsignedCharArray()
        window = [side * self._fineness for side in self.size]
        with render_window(off_screen):
            self.plotter: Any = pyvista.Plotter(off_screen=off_screen, window_size=window, lighting="none")
        if supersampling > 1 or not multisampling:
            self.plotter.render_window.SetMultiSamples(0)  # several samples a pixel take a software renderer longer
        self.plotter.set_background(BACKGROUND)
        # Few surfaces are translucent. Blending them in any order takes two passes with pixels of 16 bytes.
        self.plotter.renderer.SetUseOIT(False)
        self._floor: Floor | None = None
        self._floor_plane = self._level_plane(nodes) if ground is None else None
        if self._floor_plane is not None:
            ground = float(self._places[self._floor_plane][0, 2])
        self._ground: float | None = ground
        self._around = np.concatenate([nodes[:0], *around])
        self._frame_camera(direction, nodes)
        if isinstance(camera, Pinhole):
            look_through(self.plotter.camera, camera, self.size, nodes)
        self._add_lights(pyvista, direction)
        if self._ground is not None:
            cells = min(max(self.size[1] // _PIXELS_OF_CELL, _LIVE_SHADOW_CELLS), _SHADOW_CELLS)
            self._floor = Floor(pyvista, self.plotter, _LIVE_SHADOW_CELLS if live else cells)
            self._floor.place(np.concatenate([nodes, self._around]), self._ground, self._extent)
        self._add_obstacles(pyvista, np.concatenate([nodes, self._around]))
        before = set(self.plotter.actors)
        self._add_rods(pyvista, color_by)
        self._bodies = BodySurfaces(pyvista, self.plotter, record)
        line = self._fineness * max(1.5, self.size[1] / 300.0)  # [px]
        self._springs = SpringLines(pyvista, self.plotter, record, direction, line)
        self._tendons = TendonLines(pyvista, self.plotter, record, line)
        self._present = [actor for name, actor in self.plotter.actors.items() if name not in before]
        self._ghosts: list[tuple[FloatArray, FloatArray]] = []
        self._layers = [self._add_ghost(pyvista, [*ghosts, frame], place) for place in range(len(ghosts))]
        if supersampling == 1 and not live:
            self.plotter.enable_anti_aliasing("ssaa")
        self._label: Any = None
        self._shown = 0
        self.show(frame)

    def _read(self, record: Frames, color_by: ColorBy) -> None:
        """Motions, and the surfaces of rods."""
        self._record = record
        self.times: FloatArray = record.times
        self._positions = record.positions()
        self._directors = [record.directors(rod)[:, :, 0] for rod in record.rods]
        samples = max(1, min(6, _MAX_SAMPLES // max(1, sum(len(rod.rows) for rod in record.rods))))
        self._surfaces = [Surface(rod, self._positions[0, rod.rows], samples) for rod in record.rods]
        self._footprints = [
            surface.footprint(self._positions[0, rod.rows])
            for surface, rod in zip(self._surfaces, record.rods, strict=True)
        ]
        self._color_by = color_by
        self._values = None if color_by == "rod" else [nodal_values(record, rod, color_by) for rod in record.rods]
        self._footprints_of_obstacles: list[FloatArray] = []
        self._places = [record.obstacle_position(obstacle) for obstacle in record.obstacles]

    def show(self, frame: float) -> None:
        """Move the rods to a frame; fractional frames are interpolated."""
        before = min(int(frame), len(self.times) - 1)
        after = min(before + 1, len(self.times) - 1)

        def mixed(motions: list[FloatArray]) -> list[FloatArray]:
            return [(1.0 - share) * motion[before] + share * motion[after] for motion in motions]

        share = frame - before
        values = None if self._values is None else mixed(self._values)
        (positions,) = mixed([self._positions])
        turns = [mixed_rotations(turn[before], turn[after], share) for turn in self._bodies.rotations]
        poses = list(zip(mixed(self._bodies.positions), turns, strict=True))
        self._move(positions, mixed(self._directors), mixed(self._places), mixed(self._tendons.motions), poses, values)

    def show_present(self, record: Frames) -> None:
        """Move the rods to the first frame of another record of the same scene."""
        self._shown += 1
        if self._shown > _FIRST_RENDERS and self.plotter.renderer.GetLastRenderTimeInSeconds() > _SLOW:
            self.plotter.render_window.SetMultiSamples(0)  # without a graphics card, smooth edges take most of the time
        self._move(
            record.positions()[0],
            [record.directors(rod)[0, :, 0] for rod in record.rods],
            [record.obstacle_position(obstacle)[0] for obstacle in record.obstacles],
            [tendon_points(record, tendon)[0] for tendon in record.tendons],
            [(record.body_position(body)[0], record.body_rotation(body)[0]) for body in record.bodies],
            None if self._color_by == "rod" else [nodal_values(record, rod, self._color_by)[0] for rod in record.rods],
        )

    def _move(
        self,
        positions: FloatArray,
        directors: list[FloatArray],
        places: list[FloatArray],
        tendons: list[FloatArray],
        bodies: list[Pose],
        values: list[FloatArray] | None,
    ) -> None:
        """Move all parts in place: nodes, and of each part its directors, place, guides, pose and colours."""
        self._obstacle_points = []
        for actor, index, normal, surface in self._obstacles:
            way = places[index] - self._places[index][0]
            if normal is not None:
                way = normal * (normal @ way)  # along itself a plane looks the same
            actor.position = way
            self._obstacle_points += [surface + way] if surface is not None else []
        self._springs.show(positions)
        self._tendons.show(tendons)
        self._bodies.show(bodies)
        meshed, areas = [], []
        for index, rod in enumerate(self._record.rods):
            points, normals = self._surfaces[index].mesh(positions[rod.rows], directors[index])
            mesh = self._meshes[index]
            mesh.points = points
            mesh.point_data["Normals"] = normals
            if values is not None:
                mesh.point_data["value"] = self._surfaces[index].on_surface(values[index])
            if self._floor is not None:
                meshed.append(self._surfaces[index].spread(points))
                areas.append(self._footprints[index] * self._surfaces[index].level_share(positions[rod.rows]))
        if self._floor is not None:
            if self._floor_plane is not None:
                self._floor.lift(float(places[self._floor_plane][2]))
            casting = [*meshed, *self._obstacle_points, *(points for points, _ in self._ghosts)]
            areas += [*self._footprints_of_obstacles, *(area for _, area in self._ghosts)]
            casting += [points for points, _ in self._bodies.casting]
            areas += [area for _, area in self._bodies.casting]
            self._floor.cast(np.concatenate(casting), np.concatenate(areas))

    def keep_in_view(self, positions: FloatArray) -> None:
        """Move the camera back if points, shape (points, 3) [m], leave the region in view; its direction stays."""
        low, high = self._seen.min(axis=0), self._seen.max(axis=0)
        if np.all(positions >= low - 1e-9 * self._extent) and np.all(positions <= high + 1e-9 * self._extent):
            return
        beyond = positions + _STEP_BACK * (positions - np.clip(positions, low, high))
        camera = self.plotter.camera
        direction = np.array(camera.position) - np.array(camera.focal_point)
        self._frame_camera(direction / np.linalg.norm(direction), np.concatenate([self._seen, positions, beyond]))

    def label(self, text: str, lines: int = 55) -> None:
        """Write text in the lower left corner, in place of the previous one. `lines` of text fill the picture."""
        if self._label is None:
            size = max(7, self.size[1] * self._fineness // lines)
            self._label = self.plotter.add_text(text, position=(0.03, 0.04), viewport=True, color=_INK, font_size=size)
        else:
            self._label.input = text

    def image(self) -> npt.NDArray[np.uint8]:
        """Return the image of the camera, shape (height, width, 3)."""
        return mean_of_blocks(self._layered() if any(self._layers) else self._rendered(), self._fineness)

    def _rendered(self) -> npt.NDArray[np.uint8]:
        """Return the rendered pixels, shape (height, width, 3 or 4), of which three are colours.

        The next call overwrites them.
        """
        self.plotter.render()
        if not (self._off_screen and self._initialised and self._fineness > 1):
            self._initialised = True
            return np.asarray(self.plotter.screenshot(return_img=True), np.uint8)
        # A screenshot copies pixels several times. Four bytes a pixel are as the graphics library stores them.
        window = self.plotter.render_window
        width, height = window.GetSize()
        window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, self._pixels)
        pixels = require("pyvista", "view").convert_array(self._pixels)
        return np.asarray(pixels.reshape(height, width, 4)[::-1], np.uint8)

    def _layered(self) -> npt.NDArray[np.uint8]:
        """Return pixels in which each pose is in front of all earlier ones, wherever they are.

        Poses overlap where rods have moved little: a pale surface in front would hide the present rods in part.
        """
        layers = [*self._layers, self._present]

        def rendered(shown: list[Any]) -> npt.NDArray[np.uint8]:
            for actor in itertools.chain(*layers):
                actor.SetVisibility(any(actor is each for each in shown))
            return self._rendered()

        self._rendered()  # the first pixels are those of a screenshot, without a fourth byte
        bare = rendered([]).copy()
        pixels = bare.copy()
        for layer in layers:
            if layer:
                image = rendered(layer)
                covered = (image != bare).any(axis=2)
                pixels[covered] = image[covered]
        for actor in itertools.chain(*layers):
            actor.SetVisibility(True)
        return pixels

    def close(self) -> None:
        """Close the window."""
        self.plotter.close()

    def _level_plane(self, points: FloatArray) -> int | None:
        """Return the index of the horizontal plane near rods that receives their shadow; None without such a plane."""
        level = [
            (float(places[0, 2]), index)
            for index, (obstacle, places) in enumerate(zip(self._record.obstacles, self._places, strict=True))
            if self._is_level(obstacle, places) and len(scenery.framing(obstacle, places[:1], points))
        ]
        return max(level)[1] if level else None

    @staticmethod
    def _is_level(obstacle: ObstacleOutline, places: FloatArray) -> bool:
        """True for a horizontal plane at rest, whose upper side is free."""
        return bool(
            obstacle.kind == "plane"
            and obstacle.axis[2] > (1.0 - 1e-9) * np.linalg.norm(obstacle.axis)
            and np.ptp(places[:, 2]) == 0.0
        )

    def _frame_camera(self, direction: FloatArray, points: FloatArray) -> None:
        """Look from a direction at the middle of all points, from the least distance at which all are in view.

        The surroundings of the rods are in view too. Shares of the picture are for sliders on the left and for the
        scale on the right.
        """
        left, right_share = self._margins
        around = self._around
        self._seen = points
        rods = self._record.rods
        reach = max(
            (float(rod.radii.max() if rod.widths is None else 0.5 * rod.widths.max()) for rod in rods), default=0.0
        )
        everything = np.concatenate([points, around])
        low, high = everything.min(axis=0), everything.max(axis=0)
        extent = float(np.linalg.norm(high - low)) + 2.0 * reach
        self._extent = extent
        seen = np.concatenate([points + reach * sign * axis for axis in np.eye(3) for sign in (-1.0, 1.0)] + [around])
        if self._ground is not None:
            seen = np.concatenate([seen, np.column_stack([points[:, :2], np.full(len(points), self._ground)])])
            if self._floor is not None:
                self._floor.place(everything, self._ground, extent)
        up = np.array([0.0, 1.0, 0.0]) if abs(direction[2]) > 0.99 else np.array([0.0, 0.0, 1.0])
        right = np.cross(up, direction)
        right /= np.linalg.norm(right)
        up = np.cross(direction, right)
        across, height = seen @ right, seen @ up
        focus = 0.5 * (across.max() + across.min()) * right + 0.5 * (height.max() + height.min()) * up
        focus += (seen @ direction).mean() * direction
        slope = np.tan(np.radians(0.5 * _VIEW_ANGLE))
        local = seen - focus
        needed = np.maximum(
            np.abs(local @ up) / (0.82 * slope),
            np.abs(local @ right) / ((0.86 - left - right_share) * slope * self.size[0] / self.size[1]),
        )
        distance = float((needed + local @ direction).max())
        view = self.plotter.camera
        view.view_angle = _VIEW_ANGLE
        view.SetWindowCenter(right_share - left, 0.0)
        view.focal_point, view.position, view.up = focus, focus + distance * direction, up
        view.clipping_range = (0.05 * distance, 10.0 * (distance + extent))

    def _add_lights(self, pyvista: Any, direction: FloatArray) -> None:
        focus = np.array(self.plotter.camera.focal_point)
        right, up = np.cross(self.plotter.camera.up, direction), np.array(self.plotter.camera.up)
        for offset, strength in (
            (1.2 * direction - 0.7 * right + 0.9 * up, 0.9),
            (0.9 * direction + 1.1 * right + 0.1 * up, 0.45),
            (-0.8 * direction + 0.2 * right + 0.9 * up, 0.35),
        ):
            position = focus + 20.0 * self._extent * offset
            self.plotter.add_light(pyvista.Light(position=position, focal_point=focus, intensity=strength))

    def _add_rods(self, pyvista: Any, color_by: ColorBy) -> None:
        self._meshes = [_empty_mesh(pyvista, surface) for surface in self._surfaces]
        options: dict[str, Any] = {"ambient": 0.35, "diffuse": 0.8, "specular": 0.3, "specular_power": 30.0}
        if self._values is not None:
            title, colours = BARS[color_by]
            low, high, labels, digits = nice_limits(*color_limits(self._values))
            if low == -high:
                colours = "coolwarm"
            options |= {
                "scalars": "value",
                "cmap": colours,
                "clim": (low, high),
                "scalar_bar_args": {
                    "title": f"{title}\n",
                    "color": _INK,
                    "vertical": True,
                    "position_x": 0.98 - 0.5 * (0.05 + 0.0132 * len(title) * self.size[1] / self.size[0]),
                    "position_y": 0.25,
                    "width": 0.05,
                    "height": 0.5,
                    "title_font_size": self.size[1] * self._fineness // 42,
                    "label_font_size": self.size[1] * self._fineness // 48,
                    "fmt": digits,
                    "n_labels": labels,
                },
            }
        for index, mesh in enumerate(self._meshes):
            if self._values is None:
                options["color"] = rod_color(index)
            else:
                mesh.point_data["value"] = np.zeros(mesh.n_points)
            actor = self.plotter.add_mesh(mesh, reset_camera=False, **options)
            actor.prop.interpolation = "Phong"

    def _add_obstacles(self, pyvista: Any, nodes: FloatArray) -> None:
        """Add planes, spheres and capsules: actor, index, normal of a plane, and points that cast a shadow."""
        self._obstacles: list[tuple[Any, int, FloatArray | None, FloatArray | None]] = []
        for index, (obstacle, places) in enumerate(zip(self._record.obstacles, self._places, strict=True)):
            if obstacle.kind == "plane":
                if index == self._floor_plane:
                    continue  # the floor is there already
                normal = obstacle.axis / np.linalg.norm(obstacle.axis)
                actor = add_faded_patch(pyvista, self.plotter, scenery.patch(obstacle, places[0], nodes, _PATCH))
                self._obstacles.append((actor, index, normal, None))
                continue
            if obstacle.kind == "shape":  # rods are seen through it, and it casts no shadow
                mesh = shaded_mesh(pyvista, obstacle)
                mesh.points += places[0]
                actor = self.plotter.add_mesh(mesh, color=SOLID_COLOR, opacity=_SEE_THROUGH, reset_camera=False)
                actor.prop.interpolation = "Phong"
                self._obstacles.append((actor, index, None, None))
                continue
            start, end = scenery.ends(obstacle, places[0])
            length = float(np.linalg.norm(end - start))
            if length <= 1e-9 * obstacle.radius:
                mesh = pyvista.Sphere(radius=obstacle.radius, center=start, theta_resolution=64, phi_resolution=48)
            else:
                mesh = pyvista.Capsule(
                    center=0.5 * (start + end),
                    direction=(end - start) / length,
                    radius=obstacle.radius,
                    cylinder_length=length,
                    resolution=64,
                )
            actor = self.plotter.add_mesh(
                mesh,
                color=SOLID_COLOR,
                ambient=0.35,
                diffuse=0.75,
                specular=0.1,
                smooth_shading=True,
                reset_camera=False,
            )
            area = np.pi * obstacle.radius**2 + 2.0 * obstacle.radius * length
            points = scenery.cloud(obstacle, places[0])
            self._obstacles.append((actor, index, None, points))
            self._footprints_of_obstacles.append(np.full(len(points), area / len(points)))

    def _add_ghost(self, pyvista: Any, frames: list[int], place: int) -> list[Any]:
        """Add the rods and bodies of one frame in pale colours, at rest, where they differ from those of later frames.

        The points of their surfaces are stored, with the areas that cast shadows. Returns the actors.
        """
        strength = 0.2 + 0.3 * place / max(1, len(frames) - 2)
        actors = self._bodies.add_ghost(frames[place], frames[place + 1 :], strength)
        for index, rod in enumerate(self._record.rods):
            surface, pose = self._surfaces[index], self._positions[frames[place], rod.rows]
            away = stands_out(rod, pose, [self._positions[frame, rod.rows] for frame in frames[place + 1 :]])
            if not away.any():
                continue
            points, normals = surface.mesh(pose, self._directors[index][frames[place]])
            share = surface.on_surface(away.astype(float))
            there = share > 0.5
            # Up to the first node that is at its place: what is too much lies behind the later pose.
            mesh = _empty_mesh(pyvista, surface, surface.faces[(share > 0.0)[surface.faces].any(axis=1)])
            mesh.points = points
            mesh.point_data["Normals"] = normals
            paint = rod_color(index) if self._values is None else np.array([0.5, 0.53, 0.56])
            pale = strength * paint + (1.0 - strength) * np.array([0.93, 0.94, 0.95])
            actor = self.plotter.add_mesh(mesh, color=pale, ambient=0.5, diffuse=0.6, reset_camera=False)
            actor.prop.interpolation = "Phong"
            self._ghosts.append((surface.spread(points), there * self._footprints[index]))
            actors.append(actor)
        return actors


def _pyvista(off_screen: bool) -> Any:
    """Import PyVista while another process tests the first render, for which `render_window` waits."""
    if not off_screen:
        return require("pyvista", "view")
    begin_probe()
    pyvista = require("pyvista", "view")
    with contextlib.suppress(ImportError):  # of a graphics library, which the probe names
        require("pyvista.plotting", "view")
    return pyvista


def fine_supersampling(size: Sequence[int]) -> int:
    """Return the supersampling for smooth edges: 3 by 3 samples a pixel, and 2 by 2 in pictures above 4 megapixels."""
    width, height = _checked_size(size)
    return 3 if 9 * width * height <= _MAX_FINE_PIXELS else 2


def mean_of_blocks(fine: npt.NDArray[np.uint8], step: int) -> npt.NDArray[np.uint8]:
    """Return the mean of each block of pixels.

    Parameters
    ----------
    fine : ndarray of uint8, shape (step * height, step * width, 3 or 4)
        Three colours, and a byte that is not read.
    step : int
        Pixels along the sides of a block, 1 to 16.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
    """
    if step == 1:
        return fine[..., :3]
    if fine.shape[2] == 3:
        fine = np.concatenate([fine, fine[..., :1]], axis=2)
    # Sums of 16 bits of four colours are one number of 64 bits, since none exceeds 255 * 16^2.
    rows = np.add(fine[::step], fine[1::step], dtype=np.uint16)
    for row in range(2, step):
        rows += fine[row::step]
    packed = rows.view(np.uint64)[..., 0]
    sums = packed[:, ::step] + packed[:, 1::step]
    for column in range(2, step):
        sums += packed[:, column::step]
    colours = sums.view(np.uint16).reshape(*sums.shape, 4)[..., :3]
    return np.asarray((colours + np.uint16(step**2 // 2)) // np.uint16(step**2), np.uint8)


def _empty_mesh(pyvista: Any, surface: Surface, shown: npt.NDArray[np.int64] | None = None) -> Any:
    """Points to be moved to their places, and faces between them, all or some."""
    shown = surface.faces if shown is None else shown
    faces = np.column_stack([np.full(len(shown), 4), shown])
    mesh = pyvista.PolyData(np.zeros((int(surface.faces.max()) + 1, 3)), faces.ravel())
    mesh.point_data.active_normals = np.zeros((mesh.n_points, 3))
    return mesh


def _checked_size(size: Sequence[int]) -> tuple[int, int]:
    try:
        width, height = (int(side) for side in size)
    except (TypeError, ValueError):
        raise ValueError(f"size must be two integers, width and height in pixels, got {size!r}") from None
    if not (16 <= width <= 8192 and 16 <= height <= 8192):
        raise ValueError(f"size must lie between 16 and 8192 pixels, got {size!r}")
    return width, height


def _direction(camera: Pinhole | str | npt.ArrayLike | None, positions: FloatArray) -> FloatArray:
    """Unit vector from the rods to the camera."""
    if camera is None:
        direction = _facing(positions)
    elif isinstance(camera, Pinhole):
        check_pinhole(camera)
        direction = towards(camera)
    elif isinstance(camera, str):
        if camera not in _DIRECTIONS:
            raise ValueError(f"camera must be one of {str(list(_DIRECTIONS))[1:-1]} or a direction, got {camera!r}")
        direction = np.array(_DIRECTIONS[camera])
    else:
        direction = np.asarray(camera, float)
        if direction.shape != (3,) or not np.all(np.isfinite(direction)) or not np.any(direction):
            raise ValueError(f"camera must be a direction of shape (3,), not zero, got {camera!r}")
    return direction / np.linalg.norm(direction)


def _facing(positions: FloatArray) -> FloatArray:
    """Along the normal of a planar motion, a little from above; obliquely at any other."""
    points = positions.reshape(-1, 3) - positions.reshape(-1, 3).mean(axis=0)
    spread, axes = np.linalg.eigh(points.T @ points)
    if spread[0] > 1e-4 * spread[2] or spread[1] <= 1e-4 * spread[2]:
        return np.array(_DIRECTIONS["oblique"])
    normal = axes[:, 0]
    if abs(normal[2]) > 0.9:
        return np.array([0.0, -0.6, 1.0])
    if normal @ np.array([0.3, -1.0, 0.0]) < 0.0:
        normal = -normal
    level = normal[:2] / np.linalg.norm(normal[:2])
    return np.array([level[0], level[1], 0.2])
