"""Files of robots: from a path to a compiled model of MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from withe.common.extras import require

__all__ = ["CompiledRobot", "compiled"]

_IGNORED = ("transmission", "gazebo", "safety_controller", "calibration")
"""Elements of URDF that neither MuJoCo nor the scene reads."""


@dataclass(frozen=True)
class CompiledRobot:
    """A model of MuJoCo, and the content of the file that the model lacks.

    Attributes
    ----------
    name : str
    model : mujoco.MjModel
    ignored : tuple of str
        Content that MuJoCo does not read.
    has_gravity : bool
        True if the format of the file states gravity.
    velocities : mapping of str to float
        Greatest rates of joints of URDF [rad/s] or [m/s], which MuJoCo does not read.
    """

    name: str
    model: Any
    ignored: tuple[str, ...]
    has_gravity: bool
    velocities: Mapping[str, float]


def compiled(path: Path) -> CompiledRobot:
    """Read and compile a file.

    Raises
    ------
    ValueError
        A suffix other than .urdf and .xml, a file that MuJoCo refuses, or macros that are not expanded.
    FileNotFoundError
        The file, or a mesh of it, does not exist.
    ImportError
        MuJoCo is not installed.
    """
    if path.suffix.lower() not in (".urdf", ".xml"):
        advice = ". Expand macros first: xacro robot.xacro > robot.urdf" if path.suffix == ".xacro" else ""
        raise ValueError(
            f"file of the robot must end in .urdf, .xml (MJCF), .usd, .usda, .usdc or .usdz, got {str(path)!r}{advice}"
        )
    if not path.is_file():
        raise FileNotFoundError(f"file of the robot does not exist: {path}")
    mujoco = require("mujoco", "robots")
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is not XML: {error}") from None
    if root.tag not in ("robot", "mujoco"):
        raise ValueError(f"{path} must have the root element robot (URDF) or mujoco (MJCF), got {root.tag!r:.80}")
    ignored: tuple[str, ...] = ()
    try:
        if root.tag == "robot":
            _prepare_urdf(root, path)
            ignored = _ignored(root)
            spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
        else:
            spec = mujoco.MjSpec.from_file(str(path))
        spec.compiler.fusestatic = False  # fixed bodies keep their names
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        message = " ".join(str(error).split())
        if "opening file" in message or "resource not found" in message.lower():
            raise FileNotFoundError(f"{path}: a mesh or another file is missing: {message}") from None
        raise ValueError(f"{path}: MuJoCo cannot read the robot: {message}") from None
    name = root.get("name") or root.get("model") or path.stem
    return CompiledRobot(name, model, ignored, root.tag == "mujoco", _velocities(root))


def _prepare_urdf(root: ElementTree.Element, path: Path) -> None:
    """Write absolute paths of meshes, and the options by which MuJoCo keeps fixed links and visual shapes."""
    if any("www.ros.org/wiki/xacro" in element.tag for element in root.iter()):
        raise ValueError(f"{path} has macros: expand them first, for example xacro robot.xacro > robot.urdf")
    _check_tree(root, path)
    for mesh in root.iter("mesh"):
        mesh.set("filename", str(_mesh_file(mesh.get("filename", ""), path)))
    extension = root.find("mujoco")
    extension = ElementTree.SubElement(root, "mujoco") if extension is None else extension
    compiler = extension.find("compiler")
    compiler = ElementTree.SubElement(extension, "compiler") if compiler is None else compiler
    for word in ("fusestatic", "discardvisual", "strippath"):
        compiler.set(word, "false")
    compiler.attrib.pop("meshdir", None)


def _check_tree(root: ElementTree.Element, path: Path) -> None:
    """Refuse joints that connect links to a cycle."""
    parents: dict[str, str] = {}
    for joint in root.findall("joint"):
        ends = [joint.find(word) for word in ("parent", "child")]
        above, below = ("" if end is None else end.get("link", "") for end in ends)
        if below in parents:
            raise ValueError(
                f"{path}: link {below!r} must have one parent, got {parents[below]!r} and {above!r}: remove a joint"
            )
        parents[below] = above
    for link in parents:
        way = [link]
        while (above := parents.get(way[-1], "")) and above not in way:
            way.append(above)
        if above:
            cycle = ", ".join(map(repr, way[way.index(above) :]))
            raise ValueError(f"{path}: joints connect links {cycle} to a cycle: remove one of the joints")


def _mesh_file(name: str, path: Path) -> Path:
    """Return the absolute path of a mesh. A package is a folder above the file, or beside one above it."""
    folders = [path.resolve().parent, *path.resolve().parents[1:]]
    if name.startswith("package://"):
        package, _, rest = name.removeprefix("package://").partition("/")
        tried = [folder / package / rest for folder in folders]
        tried += [folder / rest for folder in folders if folder.name == package]
        tried += [folder / rest for folder in folders[:2]]
    else:
        tried = [folders[0] / name.removeprefix("file://")]
    found = next((file for file in tried if file.is_file()), None)
    if found is None:
        raise FileNotFoundError(f"{path}: mesh {name!r} is missing; looked for {tried[0]}")
    if found.suffix.lower() not in (".stl", ".obj", ".msh"):
        raise ValueError(f"{path}: mesh {name!r} must be a file .stl or .obj: convert it and change its name")
    return found


def _ignored(root: ElementTree.Element) -> tuple[str, ...]:
    """Return the elements of URDF that MuJoCo does not read, with the number of each."""
    found = []
    for tag in _IGNORED:
        number = len(list(root.iter(tag)))
        if number:
            found.append(f"elements <{tag}> ({number})")
    return tuple(found)


def _velocities(root: ElementTree.Element) -> dict[str, float]:
    """Return the greatest rates of the joints of URDF. Zero, and 1000 and more, stand for no limit."""
    found = {}
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        try:
            rate = 0.0 if limit is None else float(limit.get("velocity", "0"))
        except ValueError:
            continue
        if 0.0 < rate < 1e3:
            found[joint.get("name", "")] = rate
    return found
