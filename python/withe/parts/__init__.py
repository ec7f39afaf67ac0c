"""Parts of a scene, their names and numbers, and their description for the engine."""

from withe.parts.kinds import (
    ContactModel,
    FluidModel,
    FrictionModel,
    JoinKind,
    JointForm,
    LoadKind,
    Overlap,
    SupportKind,
)

__all__ = [
    "ContactModel",
    "FluidModel",
    "FrictionModel",
    "JoinKind",
    "JointForm",
    "LoadKind",
    "Overlap",
    "SupportKind",
]
