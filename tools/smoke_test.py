"""Smoke test of an installed withe, run from outside the checkout.

It imports the package, looks for its data, bends a beam, and gives bad input.
"""

from pathlib import Path

import withe

DATA = (
    "py.typed",
    "_core.pyi",
    "scene/scene.schema.json",
    "perception/mask.onnx",
    "deployment/small.pt",
    "folding/small.pt",
)


def tip_sag() -> tuple[float, float]:
    """Sag of a stiff cantilever under its own weight, simulated and by linear beam theory [m]."""
    length, radius, modulus, density = 1.0, 0.01, 1e9, 1000.0
    scene = withe.Scene()
    material = withe.Material(youngs_modulus=modulus, poisson_ratio=0.5, density=density)
    beam = scene.add_rod(start=(0, 0, 0), end=(length, 0, 0), nodes=41, radius=radius, material=material)
    scene.clamp(beam.start)
    simulation = scene.build(integrator="static")
    simulation.equilibrium()
    # w L^4 / (8 EI) with w = rho g pi r^2 and I = pi r^4 / 4.
    theory = density * 9.81 * length**4 / (2 * modulus * radius**2)
    return -float(simulation.positions(beam)[-1, 2]), theory


def main() -> None:
    """Fail unless everything holds."""
    folder = Path(withe.__file__).parent
    if missing := [name for name in DATA if not (folder / name).is_file()]:
        raise SystemExit(f"the package lacks {', '.join(missing)}")
    sag, theory = tip_sag()
    if abs(sag / theory - 1) > 5e-3:
        raise SystemExit(f"tip sag {sag} m, linear theory {theory} m")
    try:
        withe.Scene().add_rod(start=(0, 0, 0), end=(1, 0, 0), nodes=5, radius=-1.0)
    except (ValueError, TypeError) as error:
        refusal = str(error)
    else:
        raise SystemExit("a negative radius was not refused")
    libraries = {line.split()[-1] for line in Path("/proc/self/maps").read_text().splitlines() if "libklu" in line}
    print(f"smoke test: withe {withe.__version__} from {folder}")
    print(f"smoke test: tip sag {sag:.6f} m, theory {theory:.6f} m; refused: {refusal}")
    print("smoke test: KLU from", *libraries)


if __name__ == "__main__":
    main()
