"""withe: soft robots made of slender rods, simulated implicitly, fast and accurately.

A scene is described rod by rod (`Scene`), built into a `Simulation`, stepped or run, and what happened is
kept in a `Record`. SI units, angles in radians. Pictures need packages that are installed on demand; see
`withe.view`.

The engine picks the fastest instructions of the machine when it is loaded. The environment variable WITHE_SIMD, set
before Python starts, asks for others: "baseline" (SSE2 or NEON, what every machine has) or "avx2". Results then differ
by rounding, so set it to "baseline" everywhere to find the same bits on unlike machines; "kernels" in
``print(simulation.plan)`` says which are in use.
"""

from withe import deployment, folding, knots, learning, perception, real2sim, shapes, solids, view
from withe._core import __version__
from withe.batch import Batch
from withe.batch.records import BatchRecord, Equilibria
from withe.common.frames import EnergyHistory
from withe.common.outlines import BodyOutline, ObstacleOutline, RodOutline, SpringOutline, TendonOutline
from withe.common.progress import track
from withe.errors import (
    BranchChangedWarning,
    CoarseMeshWarning,
    CoarseStepWarning,
    ConvergenceError,
    EnergyDriftWarning,
    LostCableWarning,
    OutOfPlaneWarning,
    PlausibilityWarning,
    PoorMaskWarning,
    RingLeftWarning,
    RodCrossingWarning,
    SqueezedRodWarning,
    UnsupportedRobotWarning,
)
from withe.parts.friction_fields import FrictionMap
from withe.parts.handles import (
    Body,
    BodyPoint,
    CustomForce,
    Drag,
    EdgeHandle,
    Fluid,
    Hand,
    Joint,
    Load,
    Mass,
    NodeHandle,
    Obstacle,
    Rod,
    Spring,
    Support,
    Tendon,
)
from withe.parts.materials import Circle, Material, Rectangle, Stiffness, Tube
from withe.parts.options import Solver
from withe.parts.sections import SectionProperties
from withe.parts.torsion_springs import TorsionSpring
from withe.recording.record import Record
from withe.scene.robots import Robot
from withe.scene.scene import Scene
from withe.simulation.hands import Deflection, HeldPose, Passage, RunningHand
from withe.simulation.linearisation import Linearisation
from withe.simulation.paths import EquilibriumPath
from withe.simulation.readouts import Energy, Equilibrium, Momentum, Plan, Reaction, RodEnergy, Statistics
from withe.simulation.running import run_many
from withe.simulation.simulation import Simulation
from withe.simulation.snapshots import Snapshot

__all__ = [
    "Batch",
    "BatchRecord",
    "Body",
    "BodyOutline",
    "BodyPoint",
    "BranchChangedWarning",
    "Circle",
    "CoarseMeshWarning",
    "CoarseStepWarning",
    "ConvergenceError",
    "CustomForce",
    "Deflection",
    "Drag",
    "EdgeHandle",
    "Energy",
    "EnergyDriftWarning",
    "EnergyHistory",
    "Equilibria",
    "Equilibrium",
    "EquilibriumPath",
    "Fluid",
    "FrictionMap",
    "Hand",
    "HeldPose",
    "Joint",
    "Linearisation",
    "Load",
    "LostCableWarning",
    "Mass",
    "Material",
    "Momentum",
    "NodeHandle",
    "Obstacle",
    "ObstacleOutline",
    "OutOfPlaneWarning",
    "Passage",
    "Plan",
    "PlausibilityWarning",
    "PoorMaskWarning",
    "Reaction",
    "Record",
    "Rectangle",
    "RingLeftWarning",
    "Robot",
    "Rod",
    "RodCrossingWarning",
    "RodEnergy",
    "RodOutline",
    "RunningHand",
    "Scene",
    "SectionProperties",
    "Simulation",
    "Snapshot",
    "Solver",
    "Spring",
    "SpringOutline",
    "SqueezedRodWarning",
    "Statistics",
    "Stiffness",
    "Support",
    "Tendon",
    "TendonOutline",
    "TorsionSpring",
    "Tube",
    "UnsupportedRobotWarning",
    "__version__",
    "deployment",
    "folding",
    "knots",
    "learning",
    "perception",
    "real2sim",
    "run_many",
    "shapes",
    "solids",
    "track",
    "view",
]
