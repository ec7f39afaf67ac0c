"""Many simulations of one shape that go side by side: stepped in one call, read out into one array."""

from withe.batch.batch import Batch

__all__ = ["Batch"]
