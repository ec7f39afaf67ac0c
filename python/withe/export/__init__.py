"""Files of a motion for other programs: glTF, USD, VTK and tables."""

from withe.export.writing import export

__all__ = ["export"]
