"""Pictures of a record: figures by matplotlib; pictures, films and a viewer by PyVista.

Both are extras, imported when first used; ``make view`` or ``pip install ".[view]"`` in a clone of withe installs them.
"""

from withe.view import style
from withe.view.figures import plot
from withe.view.live import LiveView
from withe.view.pictures import animate, picture, view
from withe.view.sliders import Slider, SliderView

__all__ = ["LiveView", "Slider", "SliderView", "animate", "picture", "plot", "style", "view"]
