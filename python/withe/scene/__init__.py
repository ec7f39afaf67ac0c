"""Scenes that a user describes: rods, joints, supports, loads, contact, fluid."""

from withe.scene.scene import Scene

__all__ = ["Scene"]
