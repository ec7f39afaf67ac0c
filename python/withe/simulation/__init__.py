"""Simulations: stepping, read-outs, changes during a run, snapshots."""

from withe.simulation.simulation import Simulation

__all__ = ["Simulation"]
