"""A cable that hangs between two grippers until one lets go, and a camera that sees it swing."""

import numpy as np
from scipy.spatial.transform import Rotation

import withe
from withe.real2sim import Centrelines

LENGTH = 0.4  # [m]
NOISE = 0.5  # of the camera [px]
PUBLISHED = {"pose [mm]": 6.0, "EI [%]": 2.0, "damping [%]": 20.0}  # the best that others report of cables
TRUTH = {"youngs_modulus": 5e6, "viscosity": 5e4}  # [Pa], [Pa s]
GUESS = {"youngs_modulus": 4e6, "viscosity": 3e4}
GRASP, TILT = (0.012, 0.0, -0.008), 0.12  # of the gripper that stays, off where it is thought to be [m], [rad]
UNKNOWNS = [
    ("cable", "youngs_modulus"),
    ("cable", "viscosity"),
    ("gripper", "position"),
    ("gripper", "rotation"),
    "delay",
]
DELAY = 0.017  # between the clocks of camera and gripper [s]
TIMES = np.arange(1, 46) / 30.0  # of the pictures [s]
CAMERA = withe.perception.Camera(
    [[1400.0, 0, 640], [0, 1400, 360], [0, 0, 1]],
    rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]],
    translation=(0.0, -0.15, 1.2),
)


def held(nodes, time_step, youngs_modulus, viscosity):
    """The cable between both grippers, at rest, and then let go."""
    scene = withe.Scene()
    rubber = withe.Material(youngs_modulus=youngs_modulus, density=1200.0, viscosity=viscosity)
    ends = {"start": (0, 0, 0), "end": (LENGTH, 0, 0)}
    cable = scene.add_rod(**ends, nodes=nodes, radius=4e-3, material=rubber, name="cable")
    scene.clamp(cable.start, name="gripper")
    simulation = scene.build(time_step=time_step, planar=True)
    lift(simulation)
    return simulation


def lift(simulation):
    """The other gripper takes the free end of what hangs, and lets go."""
    simulation.equilibrium()
    other = simulation.pin("cable.end")
    simulation.move(other, (0.28, 0.0, 0.02))
    simulation.equilibrium()
    simulation.release(other)


def shapes_at(simulation, times):
    """Nodes at some times after it was let go, (times, nodes, 3) [m]."""
    shapes = []
    for time in times:
        simulation.run(time - simulation.time, progress=False)
        shapes.append(simulation.positions("cable"))
    return np.array(shapes)


def true_shapes(times):
    """The true cable, by a finer mesh and shorter steps."""
    simulation = held(81, 1e-3, **TRUTH)
    simulation.move("gripper", GRASP, Rotation.from_rotvec([0.0, TILT, 0.0]))
    lift(simulation)
    return shapes_at(simulation, times)


def lines_seen(shapes, noise, seed):
    """Lines of points that the camera sees of shapes [px]."""
    rng = np.random.default_rng(seed)
    lines = [CAMERA.project(shape) for shape in shapes]
    lines = [line + rng.normal(0.0, noise, line.shape) for line in lines]
    return Centrelines(lines, "cable", CAMERA, samples=41, sigma=noise, times=TIMES)


def distances(shapes, truth):
    """Distances of nodes from their true positions, (times, nodes) [m]."""
    at, of = (np.linspace(0.0, 1.0, each.shape[1]) for each in (shapes, truth))
    true = np.array([[np.interp(at, of, column) for column in shape.T] for shape in truth]).transpose(0, 2, 1)
    return np.linalg.norm(shapes - true, axis=2)
