"""Find every rope or cable in an image, in order, and which one lies on top."""

from withe.perception.results import Ambiguity, Crossing, Joint, Tracing
from withe.perception.tracing import trace_mask

__all__ = ["Ambiguity", "Crossing", "Joint", "Tracing", "trace_mask"]
