"""Solids: shapes of rigid bodies with mass, centre and inertia, and shapes of obstacles.

Give a body's solid to `Scene.add_body`, with a density, and a `Tube` or `Field` to `Scene.add_obstacle`:

>>> import withe
>>> plug = withe.solids.Box((0.04, 0.02, 0.02))
>>> round(plug.volume * 1e6, 6)
16.0
"""

from withe.solids.bodies import Box, Capsule, Cylinder, Hull, Mesh, Sphere
from withe.solids.bodies import Solid as Solid
from withe.solids.field import Field
from withe.solids.tube import Tube

__all__ = ["Box", "Capsule", "Cylinder", "Field", "Hull", "Mesh", "Sphere", "Tube"]
