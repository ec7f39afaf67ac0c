"""Scenes in TOML files: what is saved is loaded to the last bit, and errors name the line."""

import json
import subprocess
import sys
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import withe
from random_scenes import add_tree_of_bodies, draw_scene
from withe.__main__ import main

ROOT = Path(__file__).resolve().parent.parent.parent
TOOL = str(ROOT / "tools/scene_schema.py")
SCENES = sorted((ROOT / "examples/scenes").glob("*.toml"))
RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0, viscosity=100.0)
ROD = """\
[materials.rubber]
youngs_modulus = 1e6
density = 1000.0

[[rods]]
name = "arm"
start = [0, 0, 0]
end = [0.3, 0, 0]
nodes = 11
radius = 0.005
material = "rubber"
"""


def outcome(scene):
    """Return the plan of a scene and its state after some steps, or the error."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            simulation = scene.build()
            simulation.step(3)
        except (ValueError, withe.ConvergenceError) as error:
            return str(error)
    parts = [simulation.positions(), simulation.velocities(), *map(simulation.directors, simulation.rods)]
    return repr(simulation.plan), b"".join(array.tobytes() for array in parts)


def check_round_trip(scene, folder):
    path = scene.save(folder / "scene.toml")
    loaded = withe.Scene.load(path)
    assert loaded.save(folder / "again.toml").read_text() == path.read_text()
    assert set(loaded._directory.parts) == set(scene._directory.parts)
    assert outcome(loaded) == outcome(scene)
    return path.read_text()


def arm_scene(**options):
    scene = withe.Scene()
    return scene, scene.add_rod(
        start=(0, 0, 0), end=(0.3, 0, 0), nodes=11, **({"radius": 5e-3, "material": RUBBER} | options), name="arm"
    )


@pytest.mark.parametrize("number", range(40))
def test_a_random_scene_is_the_same_to_the_last_bit(number, tmp_path):
    scene, options = draw_scene(number)
    scene.build_options = options
    functions = [part.name for part in scene._directory.parts.values() if getattr(part, "function", None) is not None]
    if functions:
        with pytest.raises(ValueError, match="Python function, which a scene file cannot have"):
            scene.save(tmp_path / "scene.toml")
        return
    check_round_trip(scene, tmp_path)


@pytest.mark.parametrize("number", range(24))
def test_a_random_scene_with_bodies_is_the_same_to_the_last_bit(number, tmp_path):
    scene, options = draw_scene(number, varying=False)
    scene.build_options = {word: value for word, value in options.items() if word != "planar"}
    add_tree_of_bodies(scene, number)
    check_round_trip(scene, tmp_path)


def test_the_order_of_calls_does_not_change_the_rows_of_bodies(tmp_path):
    scenes = []
    for joins_first in (True, False):
        scene, arm = arm_scene()
        body = scene.add_body(withe.solids.Box((0.02, 0.03, 0.04)), density=900.0, position=(0.31, 0, 0))
        calls = [
            lambda s=scene, a=arm, b=body: s.join(a.end, b),
            lambda s=scene, b=body: s.add_force(b, (0, 0, -0.1), at=(0.32, 0, 0.01)),
            lambda s=scene, b=body: s.add_force(b, (0, 0.1, 0), at=(0.31, 0.01, 0)),
        ]
        for call in calls if joins_first else calls[::-1]:
            call()
        scenes.append(scene)
    first, second = (scene.build().positions() for scene in scenes)
    np.testing.assert_array_equal(first, second)
    check_round_trip(scenes[1], tmp_path)


SOLIDS = {
    "sphere": withe.solids.Sphere(0.02),
    "box": withe.solids.Box((0.02, 0.03, 0.05), rounding=1e-4),
    "hull": withe.solids.Hull([(0, 0, 0), (0.02, 0, 0), (0, 0.03, 0), (0, 0, 0.05), (0.02, 0.03, 0.05)]),
    "cylinder": withe.solids.Cylinder(0.01, 0.04),
    "capsule": withe.solids.Capsule(0.01, 0.03),
    "mesh": withe.solids.Mesh(
        [[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0], [0, 0, 0.04]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
    ),
}


@pytest.mark.parametrize("kind", SOLIDS)
def test_each_solid_is_a_table_with_its_kind(kind, tmp_path):
    scene = withe.Scene()
    scene.add_body(SOLIDS[kind], density=500.0, position=(0, 0.1, 0), rotation=(0.5, 0.5, -0.5, 0.5), name="block")
    text = check_round_trip(scene, tmp_path)
    assert f'solid = {{ kind = "{kind}", ' in text
    assert kind in [name.lower() for name in withe.solids.__all__]
    assert len(SOLIDS) + 2 == len(withe.solids.__all__)  # tubes and fields are obstacles


BODY = '[[bodies]]\nname = "plug"\nposition = [0.3, 0, 0]\ndensity = 900.0\n'


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        (
            BODY + 'solid = { kind = "bx", size = [1, 1, 1] }',
            5,
            "kind of solid is unknown, got 'bx'; did you mean 'box'",
        ),
        (BODY + 'solid = { kind = "box", sise = [1, 1, 1] }', 5, "solid has no key 'sise'; did you mean 'size'"),
        (BODY + 'solid = { kind = "ball", radius = 1 }', 5, "it is one of box, capsule, cylinder, field, hull"),
        (BODY + "solid = { radius = 0.1 }", 5, "solid must be a table with kind, one of box"),
        (BODY + 'solid = "box"', 5, "solid must be a table with kind"),
        (BODY + 'solid = { kind = "sphere" }', 5, "radius"),
        (BODY + 'solid = { kind = "box", size = [1, 1, -1] }', 5, "size of the box must be positive"),
        (BODY.replace("density", "densty"), 4, "has no key 'densty'; did you mean 'density'"),
        (BODY.replace("900.0", '"900 kg/m^3"'), 4, "density must be a number in kg/m\\^3 without its unit"),
        (BODY.replace("[[bodies]]", "[[bodys]]"), 1, "did you mean 'bodies'"),
        (BODY + "mass = 1.0\ninertia = [1, 1, 5]", 4, "density of body 'plug' needs a solid"),
        (BODY.replace("density = 900.0", "mass = 1.0\ninertia = [1, 1, 5]"), 5, "inertia of body 'plug'"),
        (
            BODY + 'solid = { kind = "sphere", radius = 0.1 }\n[[joints]]\nnodes = ["plugg", "arm.end"]',
            7,
            "did you mean 'plug'",
        ),
    ],
)
def test_errors_of_bodies_name_file_line_and_the_word_that_is_meant(text, line, message, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as error:
        withe.Scene.load(path)
    assert f"{path}, line {line}: " in str(error.value)


def test_each_method_of_a_scene_is_saved(tmp_path):
    scene, arm = arm_scene()
    stiff = withe.Stiffness(stretch=100.0, bend=(2e-3, 1e-3), twist=1e-3)
    points = [(0, 0.1, 0), (0.1, 0.1, 0), (0.2, 0.1, 0)]
    table = scene.add_rod(points=points, line_density=0.1, stiffness=stiff, radius=0.01)
    hoop = scene.add_rod(points=np.add(withe.shapes.circle(0.1, 12), (0, 0, 1)), closed=True, material=RUBBER,
                         section=withe.Rectangle(width=0.01, height=np.full(12, 2e-3)), natural="straight")  # fmt: skip
    legs = [
        scene.add_rod(
            start=(0.3, 0, 0),
            end=tip,
            nodes=5,
            section=withe.Tube(outer_radius=4e-3, inner_radius=3e-3),
            material=withe.Material(youngs_modulus=2e6, density=900.0),
        )
        for tip in ((0.4, 0.05, 0), (0.4, -0.05, 0), (0.4, 0, 0.06))
    ]
    scene.join(arm.end, *(leg.start for leg in legs), name="knee")
    scene.join(legs[0].end, scene.add_rod(start=(0.4, 0.05, 0), end=(0.4, 0.1, 0), nodes=4, radius=3e-3,
               material=RUBBER).start, "revolute", axis=(0, 0, 2.0), stiffness=0.3, damping=1e-3)  # fmt: skip
    scene.clamp(arm.start, free=(1, 0, 0))
    scene.pin(table.node(1))
    pose = np.array([0.1, 0.0, 1.0]), Rotation.from_rotvec([0.0, 0.0, 0.1])
    scene.grasp(hoop, 0.1, 0.05, pose=pose, stiffness=(1e3, [1.0, 2.0, 3.0]), force_limit=20.0)
    scene.add_force(arm.node(4), np.array([0, 0, 0.01]), follower=True, name="tip force")
    scene.add_moment("arm.end", (0, 1e-4, 0))
    scene.add_load(arm, (0, 0.01, 0))
    scene.add_pressure(hoop, 0.1)
    scene.add_mass(arm.node(2), 2e-3)
    scene.add_spring(arm.node(3), table.node(2), stiffness=3.0)
    scene.add_torsion_spring(arm.edge(2), table.edge(0), axis=(0, 0, 1), stiffness=0.01)
    scene.add_tendon(iter([arm.start, arm.edge(3), arm.end]), offset=(2e-3, 0), tension=0.1)
    scene.add_drag(0.1, rods=(leg for leg in legs))
    scene.add_fluid(0.1, model="resistive")
    floor = scene.add_floor(-0.5, friction=withe.FrictionMap([[0.1, 0.5]], extent=(-1, 1, -1, 1)))
    scene.add_plane((0, 0, -0.6), (0, 0.1, 1), friction=(0.1, 0.2, 0.3))
    scene.add_sphere((0.1, 0.3, -0.4), 0.05)
    post = scene.add_capsule((0, -0.3, 0), (0, -0.3, 0.2), 0.02, restitution=0.5)
    scene.enable_contact(friction=0.9)
    scene.enable_contact(friction=0.2)
    scene.set_contact_group(arm, "left")
    scene.set_contact_group(legs[1], "left")
    scene.set_friction(arm, post, np.linspace(0.1, 0.5, 10))
    scene.set_friction(table, floor, [0.1, 0.2])
    scene.set_restitution(arm, floor, 0.3)
    scene.set_contact_stiffness(arm, legs[0], 300.0)
    scene.ignore_contact(hoop, post)
    scene.actuate(arm, at=0.01, over=0.1, natural_curvature=np.array([1.0, 2.0]))
    scene.actuate((arm, post), friction=0.7)
    scene.actuate(gravity=(0, 0, -1.0), at=0.005)
    text = check_round_trip(scene, tmp_path)
    assert text.count("[[joints]]") == 4
    assert text.count("[contact]") == 1


def test_names_of_materials_and_build_options_are_kept(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(
        ROD + '[build]\nintegrator = "backward_euler"\ntime_step = 0.002\nsolver = { max_iterations = 7 }\n'
    )
    scene = withe.Scene.load(path)
    assert scene.build().time_step == 0.002
    assert scene.build(time_step=0.004).time_step == 0.004
    assert scene.build_options["solver"].max_iterations == 7
    assert "[materials.rubber]" in check_round_trip(scene, tmp_path)


def test_a_change_of_an_array_after_the_call_is_not_saved(tmp_path):
    points = np.array([(0.0, 0, 0), (0.1, 0, 0), (0.2, 0, 0)])
    scene = withe.Scene()
    scene.add_rod(points=points, radius=5e-3, material=RUBBER)
    points += 1.0
    assert "0.1, 0.0, 0.0" in check_round_trip(scene, tmp_path)


def test_points_come_from_csv_files_and_shapes(tmp_path):
    (tmp_path / "line.csv").write_text("t,z,y,x\n0,0,0,0\n0,0,0,0.1\n0,0.05,0,0.2\n")
    (tmp_path / "plain.csv").write_text("0, 1, 0\n0.1, 1, 0\n0.2, 1, 0.05\n")
    path = tmp_path / "scene.toml"
    path.write_text(
        ROD
        + '[[rods]]\npoints = "line.csv"\nradius = 0.004\nmaterial = "rubber"\n'
        + '[[rods]]\npoints = "plain.csv"\nradius = 0.004\nmaterial = "rubber"\n'
        + "[[rods]]\npoints = { shape = 'helix', radius = 0.02, pitch = 0.05, length = 0.5, nodes = 50 }\n"
        + "radius = 0.001\nmaterial = { youngs_modulus = 1e7, density = 1200 }\n"
    )
    simulation = withe.Scene.load(path).build()
    np.testing.assert_array_equal(simulation.positions("rod 1"), [(0, 0, 0), (0.1, 0, 0), (0.2, 0, 0.05)])
    np.testing.assert_array_equal(simulation.positions("rod 2")[:, 1], 1.0)
    np.testing.assert_array_equal(simulation.positions("rod 3"), withe.shapes.helix(0.02, 0.05, 0.5, 50))


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("robots = 1\n" + ROD, 1, "a scene file has no 'robots'; did you mean 'rods'"),
        ("version = 2\n" + ROD, 1, "this withe reads version 1: install a newer withe"),
        ("gravity = 9.81\n" + ROD, 1, "gravity must have shape"),
        (ROD.replace("radius", "raduis"), 10, r"\[\[rods\]\] has no key 'raduis'; did you mean 'radius'"),
        (ROD.replace("0.005", '"5 mm"'), 10, "radius must be a number in m without its unit, got '5 mm'"),
        (ROD.replace("0.005", "-0.005"), 10, "radius of rod 'arm' must be positive"),
        (ROD.replace("nodes = 11", "nodes = 1.5"), 9, "nodes of rod 'arm' must be"),
        (ROD.replace('= "rubber"', '= "ruber"'), 11, "did you mean 'rubber'"),
        (ROD.replace("density = 1000.0", ""), 1, "material 'rubber'.*density"),
        (ROD.replace("density", "densty"), 1, "material 'rubber'.*density"),
        (ROD + '[[joints]]\nnodes = ["arm.end", "leg.start"]\n', 13, "it has no rod 'leg'"),
        (ROD + '[[joints]]\na = "arm.end"\n', 13, r"\[\[joints\]\] has no key 'a'"),
        (ROD + "[[joints]]\n", 12, r"\[\[joints\]\] needs the key 'nodes'"),
        (ROD + '[[supports]]\nnode = "arm.start"\n', 12, "needs the key 'kind', one of clamp, pin, hand"),
        (ROD + '[[supports]]\nkind = "clmp"\nnode = "arm.start"\n', 13, "did you mean 'clamp'"),
        (ROD + "[[springs]]\na = 'arm.start'\n", 12, "needs the key 'b'"),
        (ROD + "[contact]\nfrictoin = 0.3\n", 13, "did you mean 'friction'"),
        (ROD + "[[contact]]\nfriction = 0.3\n", 12, r"must be written as tables \[contact\]"),
        (ROD + "[rods.arm]\n", 12, r"\[\[rods\]\] has no key 'arm'"),
        (ROD + "[rods\n", None, "is not TOML: .*line 12"),
        (ROD + "[build]\ntime_stp = 0.3\n", 13, "did you mean 'time_step'"),
        (ROD + "[build]\ntime_step = -1\n", 13, "time_step must be positive"),
        (ROD + '[[actuation]]\ntarget = "leg"\ntension = 1.0\n', 13, "'leg' is not in the scene"),
        (
            ROD + '[[actuation]]\ntarget = "arm"\nnatural_twst = 1.0\n',
            14,
            "rod 'arm' has no 'natural_twst' to set; did you",
        ),
        (ROD + '[[actuation]]\ntarget = "arm"\nover = 1.0\nviscosity = 1.0\n', 14, "over must be 0 for viscosity"),
        (ROD.replace("[0, 0, 0]", "(0, 0, 0)"), None, "Lists are written with brackets"),
        (ROD + '[[rods]]\npoints = { shape = "helx" }\n', 13, "did you mean 'helix'"),
        (ROD + '[[rods]]\npoints = [[0, 0, 0], # [\n [1, 0, 0]]\nmaterial = "x"\n', 15, "material 'x'"),
        ("rods = 3\n", 1, r"must be written as tables \[\[rods\]\]"),
    ],
)
def test_errors_name_file_line_and_the_word_that_is_meant(text, line, message, tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(text)
    place = "" if line is None else f", line {line}: "
    with pytest.raises(ValueError, match=rf"robot.toml{place}.*{message}"):
        withe.Scene.load(path)


def test_files_that_are_not_there_raise(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"robot\.toml"):
        withe.Scene.load(tmp_path / "robot.toml")
    (tmp_path / "robot.toml").write_text('[[rods]]\npoints = "line.csv"\n')
    with pytest.raises(FileNotFoundError, match=r"robot\.toml, line 2.*line\.csv"):
        withe.Scene.load(tmp_path / "robot.toml")
    with pytest.raises(ValueError, match=r"must end in \.toml"):
        withe.Scene().save(tmp_path / "robot.txt")


# The schema and the command line


def test_the_schema_is_current():
    found = subprocess.run([sys.executable, TOOL, "--check"], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scene_files_of_the_examples_fit_the_schema_and_run(path):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((Path(withe.__file__).parent / "scene/scene.schema.json").read_text())
    content = tomllib.loads(path.read_text())
    jsonschema.validate(content, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(content | {"robots": 1}, schema)
    simulation = withe.Scene.load(path).build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.step(2)


def test_the_command_line_runs_plans_and_draws(tmp_path, capsys, monkeypatch):
    pytest.importorskip("matplotlib").use("Agg")
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(ROD + '[[supports]]\nkind = "clamp"\nnode = "arm.start"\n')
    assert main(["run", "arm.toml", "--duration", "0.02"]) == 0
    assert "last node of 'arm' at 0.02 s: (0.29999" in capsys.readouterr().out
    assert main(["run", "arm.toml", "--duration", "0.02", "--record", "arm.npz", "--plot", "arm.png"]) == 0
    assert withe.Record.load("arm.npz").times[-1] == 0.02
    assert Path("arm.png").stat().st_size > 1000
    assert main(["plan", "arm.toml"]) == 0
    assert "0.3 m of rod" in capsys.readouterr().out
    assert main(["run", "arm.toml", "--film", "films/arm.mp4"]) == 2
    assert "folder of --film does not exist: films" in capsys.readouterr().err
    assert main(["run", "leg.toml"]) == 2
    assert capsys.readouterr().err == "withe: No such file or directory: 'leg.toml'\n"
    Path("leg.toml").write_text(ROD.replace("radius", "raduis"))
    assert main(["view", "leg.toml"]) == 2
    assert "withe: leg.toml, line 10: [[rods]] has no key 'raduis'" in capsys.readouterr().err


# Actuation over time


def test_actuation_acts_at_its_time_and_again_after_a_reset():
    scene, arm = arm_scene()
    scene.clamp(arm.start)
    force = scene.add_force(arm.end, (0, 0, 0))
    scene.actuate(force, at=0.02, force=(0, 0, 0.01))
    scene.actuate(arm, at=0.03, over=0.02, natural_curvature=(4.0, 0.0))
    by_hand = scene.build()
    by_hand._session.scene.actuations = ()
    simulation = scene.build()
    for _ in range(2):
        simulation.run(0.0625, progress=False, record_every=0.0125)  # its frames are no whole numbers of time steps
        simulation.reset()
    simulation.step(15)
    by_hand.reset()
    by_hand.step(4)
    by_hand.set(force, force=(0, 0, 0.01))
    by_hand.step(2)
    by_hand.set(arm, natural_curvature=(4.0, 0.0), over=0.02)
    by_hand.step(9)
    np.testing.assert_array_equal(simulation.positions(), by_hand.positions())
    assert simulation.get(arm, "natural_curvature")[0].tolist() == [4.0, 0.0]


def test_a_copy_and_a_snapshot_go_on_with_the_actuation(tmp_path):
    scene, arm = arm_scene()
    scene.actuate(arm, at=0.02, natural_twist=1.0)
    scene.actuate(arm, at=0.04, natural_twist=2.0)
    simulation = scene.build()
    simulation.step(6)
    simulation.set(arm, natural_twist=5.0)  # must last until the second actuation
    simulation.snapshot().save(tmp_path / "state.npz")
    others = [simulation.copy(), scene.build()]
    others[1].restore(withe.Snapshot.load(tmp_path / "state.npz"))
    for each in (simulation, *others):
        each.step(1)
        assert each.get(arm, "natural_twist")[0] == 5.0
        each.step(2)
        assert each.get(arm, "natural_twist")[0] == 2.0


def test_wrong_actuation_is_refused():
    scene, arm = arm_scene()
    with pytest.raises(ValueError, match="actuate needs at least one parameter"):
        scene.actuate(arm)
    with pytest.raises(ValueError, match="at must not be negative"):
        scene.actuate(arm, at=-1.0, natural_twist=1.0)
    with pytest.raises(ValueError, match=r"rod 'arm' has no 'natural_twst' to set; did you mean 'natural_twist'"):
        scene.actuate(arm, at=0.5, natural_twst=1.0)
    scene.actuate(arm, at=0.5, natural_twist=[1.0, 2.0])
    with pytest.raises(ValueError, match=r"actuation at 0\.5 s: natural_twist of rod 'arm' must have shape"):
        scene.build()
    with pytest.raises(ValueError, match="build_batch does not support actuate"):
        scene.build_batch(2)
