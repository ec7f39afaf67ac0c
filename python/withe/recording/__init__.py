"""Records of runs, and recorders that take their frames."""

from withe.recording.record import EnergyHistory, Record

__all__ = ["EnergyHistory", "Record"]
