"""Many simulations of one shape in parallel: stepped in one call, read into one array."""

from withe.batch.batch import Batch

__all__ = ["Batch"]
