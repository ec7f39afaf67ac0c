"""withe: soft robots made of slender rods, simulated implicitly, fast and accurately.

A scene is described rod by rod (`Scene`), built into a `Simulation`, stepped or run, and what happened is
kept in a `Record`. SI units, angles in radians.
"""

from withe import perception, shapes
from withe._core import __version__
from withe.errors import CoarseMeshWarning, ConvergenceError
from withe.handles import CustomForce, Drag, EdgeHandle, Fluid, Joint, Load, Mass, NodeHandle, Obstacle, Rod, Support
from withe.materials import Circle, Material, Rectangle, Stiffness, Tube
from withe.readouts import Energy, Equilibrium, Linearisation, Plan, Reaction, Statistics
from withe.recording import Record
from withe.running import run_many
from withe.scene import Scene
from withe.simulation import Simulation
from withe.snapshots import Snapshot

__all__ = [
    "Circle",
    "CoarseMeshWarning",
    "ConvergenceError",
    "CustomForce",
    "Drag",
    "EdgeHandle",
    "Energy",
    "Equilibrium",
    "Fluid",
    "Joint",
    "Linearisation",
    "Load",
    "Mass",
    "Material",
    "NodeHandle",
    "Obstacle",
    "Plan",
    "Reaction",
    "Record",
    "Rectangle",
    "Rod",
    "Scene",
    "Simulation",
    "Snapshot",
    "Statistics",
    "Stiffness",
    "Support",
    "Tube",
    "__version__",
    "perception",
    "run_many",
    "shapes",
]
