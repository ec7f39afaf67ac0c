"""What runs a scene: stepping, read-outs, what may be changed meanwhile, snapshots."""

from withe.simulation.simulation import Simulation

__all__ = ["Simulation"]
