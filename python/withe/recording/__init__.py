"""What a run leaves behind: records, and what takes their frames."""

from withe.recording.record import EnergyHistory, Record

__all__ = ["EnergyHistory", "Record"]
