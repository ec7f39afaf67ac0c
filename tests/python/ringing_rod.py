"""A rod that rings when it is let go, and what is unknown of it."""

import withe

UNKNOWNS = [("arm", "youngs_modulus"), ("arm", "viscosity"), "delay"]


def ringing(modulus=1e6, viscosity=300.0, nodes=13, time_step=2.5e-3, **options):
    """A cantilever that was bent to the side and let go."""
    scene = withe.Scene(gravity=(0, 0, -9.81))
    rubber = withe.Material(youngs_modulus=modulus, density=1000.0, viscosity=viscosity)
    arm = scene.add_rod(start=(0, 0, 0), end=(0, 0, -0.2), nodes=nodes, radius=5e-3, material=rubber, name="arm")
    scene.clamp(arm.start, name="wall")
    scene.add_force(arm.end, (0.01, 0, 0))
    simulation = scene.build(time_step=time_step, planar=True, **options)
    let_go(simulation)
    return simulation


def let_go(simulation):
    """Bent by a force at the tip, which then vanishes."""
    simulation.set("force 1", force=(0.01, 0, 0))
    simulation.equilibrium()
    simulation.set("force 1", force=(0, 0, 0))
