"""What a scene is made of: parts, their names and numbers, and how the engine is told of them."""

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
