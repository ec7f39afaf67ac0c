"""The format of scene files: which table of the TOML file stands for which method of `Scene`.

The keys of a table are the arguments of its method. A new method that describes a scene needs a row here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

__all__ = ["METHODS", "SECTIONS", "VERSION", "Section"]

VERSION = 1
"""Version of the format. It grows when a file of a new version means something else to an older withe."""


@dataclass(frozen=True)
class Section:
    """An array of tables of the file, such as [[rods]].

    Attributes
    ----------
    name : str
        Name of the array.
    methods : mapping of str to str
        Method of `Scene` for each value of the key "kind", which may be left out where the table has a
        key of that name. The key "" stands for sections without "kind".
    is_single : bool
        True for a table that may occur once, such as [contact].
    """

    name: str
    methods: Mapping[str, str] = field(default_factory=dict)
    is_single: bool = False


SECTIONS = (
    Section("rods", {"": "add_rod"}),
    Section("bodies", {"": "add_body"}),
    Section("joints", {"": "join"}),
    Section("supports", {"clamp": "clamp", "pin": "pin", "hand": "grasp"}),
    Section("loads", {"force": "add_force", "moment": "add_moment", "load": "add_load", "pressure": "add_pressure"}),
    Section("masses", {"": "add_mass"}),
    Section("springs", {"": "add_spring"}),
    Section("torsion_springs", {"": "add_torsion_spring"}),
    Section("tendons", {"": "add_tendon"}),
    Section("drags", {"": "add_drag"}),
    Section("fluid", {"": "add_fluid"}, is_single=True),
    Section(
        "obstacles",
        {
            "floor": "add_floor",
            "plane": "add_plane",
            "sphere": "add_sphere",
            "capsule": "add_capsule",
            "solid": "add_obstacle",
        },
    ),
    Section("contact", {"": "enable_contact"}, is_single=True),
    Section("contact_groups", {"": "set_contact_group"}),
    Section(
        "contact_pairs",
        {
            "friction": "set_friction",
            "restitution": "set_restitution",
            "stiffness": "set_contact_stiffness",
            "ignored": "ignore_contact",
        },
    ),
    Section("actuation", {"": "actuate"}),
)
"""Sections in the order in which a file is read and written: later ones name parts of earlier ones."""

METHODS = (*(method for section in SECTIONS for method in section.methods.values()), "add_custom_force")
"""Methods whose calls a scene keeps."""
