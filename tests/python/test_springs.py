"""Springs as users meet them: what is refused, set, read, kept and drawn."""

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, density=1000.0)


def pair(joined=False):
    """Two rods side by side, the first one clamped."""
    scene = withe.Scene()
    parts = {"nodes": 6, "radius": 5e-3, "material": RUBBER}
    scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), name="a", **parts)
    scene.add_rod(start=(0.2, 0, 0) if joined else (0, 0, -0.1), end=(0.2, 0, -0.1), name="b", **parts)
    scene.clamp("a.start")
    return scene


def running(**build):
    scene = pair()
    scene.add_spring("a.start", "b.start", stiffness=50.0, damping=0.2, name="near")
    scene.add_spring("a.end", "b.end", stiffness=20.0, rest_length=0.05, name="far")
    return scene.build(**({"time_step": 2e-3} | build))


def test_a_spring_has_a_handle_a_name_and_the_drawn_length():
    scene = pair()
    spring = scene.add_spring(scene["a.end"], "b.end", stiffness=10)
    assert isinstance(spring, withe.Spring)
    assert scene["spring 1"] == spring
    simulation = scene.build()
    assert simulation.get(spring, "rest_length") == pytest.approx(0.1, abs=1e-15)
    assert simulation.get(spring, "stiffness") == 10.0
    assert simulation.get(spring, "damping") == 0.0
    assert simulation.spring_tension(spring) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"b": "a.end"}, "must act between two nodes, got 'a.end' and 'a.end', which is one node"),
        ({"b": "a"}, "second node of the spring must be a node of a rod, such as arm.end"),
        ({"b": "c.end"}, "second node of the spring 'c.end' is not in the scene"),
        ({"stiffness": -1.0}, "stiffness of spring 'spring 1' must"),
        ({"stiffness": float("nan")}, "stiffness of spring 'spring 1' must"),
        ({"stiffness": "stiff"}, "stiffness of spring 'spring 1' must"),
        ({"rest_length": -0.1}, "rest_length of spring 'spring 1' must"),
        ({"rest_length": float("inf")}, "rest_length of spring 'spring 1' must"),
        ({"damping": -0.1}, "damping of spring 'spring 1' must"),
        ({"name": "a"}, "name of the spring must be new: 'a' is already the name of a rod"),
    ],
)
def test_what_cannot_be_a_spring_is_refused(arguments, message):
    scene = pair()
    with pytest.raises(ValueError, match=message):
        scene.add_spring(**({"a": "a.end", "b": "b.end", "stiffness": 1.0} | arguments))


def test_nodes_that_coincide_take_no_rest_length_and_joined_ones_no_spring():
    scene = pair(joined=True)
    with pytest.raises(
        ValueError, match="rest_length of spring 'spring 1' must be 0, because the nodes of the spring coincide"
    ):
        scene.add_spring("a.end", "b.start", stiffness=1.0, rest_length=0.1)
    scene.add_spring("a.end", "b.start", stiffness=1.0)
    assert scene.build().get("spring 1", "rest_length") == 0.0
    scene.join("a.end", "b.start")
    with pytest.raises(ValueError, match=r"'a\.end' and 'b\.start', which are joined to one node"):
        scene.build()
    with pytest.raises(ValueError, match="which are joined to one node"):
        scene.add_spring("a.end", "b.start", stiffness=1.0)


def test_set_changes_all_or_nothing_and_books_its_work():
    simulation = running(integrator="energy_momentum")
    simulation.step(20)

    def balance():
        energy = simulation.energy()
        return energy.total - energy.work + energy.dissipated

    before = balance()
    simulation.set("far", stiffness=60.0, rest_length=0.12)
    simulation.set("near", damping=0.0)
    assert (simulation.get("far", "stiffness"), simulation.get("far", "rest_length")) == (60.0, 0.12)
    assert balance() == pytest.approx(before, abs=1e-14)
    simulation.step(50)
    assert balance() == pytest.approx(before, abs=1e-8 * abs(simulation.energy().spring))
    for values, message in (
        ({"stiffness": 1.0, "damping": -1.0}, "damping of spring 'far' must"),
        ({"length": 1.0}, "spring 'far' has no 'length' to set; it has stiffness, rest_length, damping"),
    ):
        with pytest.raises(ValueError, match=message):
            simulation.set("far", **values)
    assert simulation.get("far", "stiffness") == 60.0
    with pytest.raises(ValueError, match="'far' has no 'length'; it has stiffness, rest_length, damping"):
        simulation.get("far", "length")
    with pytest.raises(ValueError, match="spring must be a spring, got the rod 'a'"):
        simulation.spring_tension("a")


def test_fourth_order_takes_no_dampers():
    with pytest.raises(ValueError, match="does not support damping of springs"):
        running(integrator="fourth_order")
    scene = pair()
    scene.add_spring("a.end", "b.end", stiffness=20.0, name="spring")
    simulation = scene.build(integrator="fourth_order")
    with pytest.raises(ValueError, match="does not support damping of springs"):
        simulation.set("spring", damping=1.0)
    assert simulation.get("spring", "damping") == 0.0


def test_a_snapshot_of_other_springs_is_refused():
    kept = running().snapshot()
    with pytest.raises(ValueError, match="another scene"):
        pair().build(time_step=2e-3).restore(kept)


def test_the_plan_names_springs_and_scenes_without_have_none():
    assert "2 spring(s)" in str(running().plan)
    assert "spring" not in str(pair().build().plan)
    assert pair().build().energy().spring == 0.0


def test_what_is_set_acts_at_once_in_every_scheme():
    for integrator in ("backward_euler", "implicit_midpoint", "energy_momentum", "verlet", "static"):
        simulation = running(integrator=integrator, time_step=2e-5 if integrator == "verlet" else 2e-3)
        other = running(integrator=integrator, time_step=2e-5 if integrator == "verlet" else 2e-3)
        simulation.step(1)
        other.step(1)
        simulation.set("far", stiffness=2000.0)
        for each in (simulation, other):
            each.step(2)
        assert np.abs(simulation.positions() - other.positions()).max() > 1e-12


def test_records_know_springs_and_their_energy(tmp_path):
    simulation = running()
    record = simulation.run(duration=0.02, record_every=0.01)
    assert [spring.name for spring in record.springs] == ["near", "far"]
    assert [spring.rows for spring in record.springs] == [(0, 6), (5, 11)]
    assert record.energy().spring[-1] == simulation.energy().spring
    loaded = withe.Record.load(record.save(tmp_path / "record.npz"))
    assert loaded.springs == record.springs
    np.testing.assert_array_equal(loaded.energy().spring, record.energy().spring)


def test_figures_draw_springs_as_lines_between_their_nodes():
    pytest.importorskip("matplotlib").use("Agg")
    record = running().run(duration=0.02, record_every=0.02)
    axes = record.plot(shapes=1).axes[0]
    springs = [line for line in axes.lines if len(line.get_xdata()) > 6]
    assert len(springs) == 2
    x = record.positions()[0]
    np.testing.assert_allclose(np.array(springs[0].get_data())[:, [0, -1]].T, x[[0, 6]][:, [0, 2]] * 1e3, atol=1e-9)
