"""Fluids through the scene: what is refused, settings, snapshots, the plan."""

import pickle

import numpy as np
import pytest

import withe

RUBBER = withe.Material(youngs_modulus=1e6, density=1100.0)


def scene_with(radius=2e-3, **fluid):
    scene = withe.Scene()
    arm = scene.add_rod(start=(0, 0, 0), end=(0.2, 0, 0), nodes=16, radius=radius, material=RUBBER, name="arm")
    scene.clamp(arm.start)
    if fluid:
        scene.add_fluid(**fluid)
    return scene


@pytest.mark.parametrize("model", ["stokeslets", "resistive"])
def test_a_fluid_slows_a_falling_arm_and_its_work_is_dissipated(model):
    dry, wet = (s.build(time_step=2e-3) for s in (scene_with(), scene_with(viscosity=0.5, model=model)))
    for simulation in (dry, wet):
        simulation.step(50)
    assert wet.energy().kinetic < 0.5 * dry.energy().kinetic
    assert dry.energy().dissipated == 0.0
    assert wet.energy().dissipated > wet.energy().kinetic
    assert wet.energy().total + wet.energy().dissipated == pytest.approx(0.0, abs=1e-4 * wet.energy().dissipated)


def test_the_regularization_is_that_of_cylinders_unless_it_is_given():
    given = scene_with(viscosity=0.5, regularization=np.sqrt(np.e) * 2e-3).build(time_step=2e-3)
    default = scene_with(viscosity=0.5).build(time_step=2e-3)
    given.step(5)
    default.step(5)
    assert given.positions() == pytest.approx(default.positions(), rel=1e-12)


@pytest.mark.parametrize(
    ("fluid", "message"),
    [
        ({"viscosity": 0.0}, "viscosity of the fluid must be positive, got 0"),
        ({"viscosity": float("nan")}, "viscosity of the fluid must be finite"),
        ({"viscosity": 1.0, "model": "air"}, "model of the fluid must be 'stokeslets' or 'resistive', got 'air'"),
        ({"viscosity": 1.0, "regularization": -1.0}, "regularization of the fluid must be positive, got -1"),
        ({"viscosity": 1.0, "wavelength": 0.0}, "wavelength of the fluid must be positive, got 0"),
    ],
)
def test_numbers_out_of_range_are_named(fluid, message):
    with pytest.raises(ValueError, match=message):
        scene_with().add_fluid(**fluid)


def test_a_scene_has_one_fluid():
    scene = scene_with(viscosity=1.0, name="honey")
    with pytest.raises(ValueError, match="fluid must be the only one, but the scene already has 'honey'"):
        scene.add_fluid(viscosity=2.0)


@pytest.mark.parametrize(
    ("fluid", "message"),
    [
        ({"regularization": 0.05}, "regularization of the fluid must not exceed 3 edge lengths"),
        ({"model": "resistive", "wavelength": 5e-3}, "wavelength of the fluid must exceed 5.6 radii of every rod"),
    ],
)
def test_numbers_that_do_not_go_with_the_rods_are_refused_by_build(fluid, message):
    with pytest.raises(ValueError, match=message):
        scene_with(viscosity=1.0, **fluid).build()


def test_rods_of_several_radii_want_a_regularization():
    scene = scene_with(viscosity=1.0)
    scene.add_rod(start=(0, 1, 0), end=(0.2, 1, 0), nodes=8, radius=4e-3, material=RUBBER)
    with pytest.raises(ValueError, match="regularization of the fluid must be given when radii differ"):
        scene.build()


def test_steps_that_go_back_in_time_refuse_a_fluid():
    with pytest.raises(ValueError, match="does not support a fluid"):
        scene_with(viscosity=1.0).build(integrator="fourth_order")


def test_numbers_of_a_fluid_are_set_while_running_and_nothing_else_is():
    simulation = scene_with(viscosity=1.0, name="honey").build(time_step=2e-3)
    fluid = simulation.get("honey", "viscosity")
    assert fluid == 1.0
    simulation.set("honey", viscosity=2.0)
    assert simulation.get("honey", "viscosity") == 2.0
    with pytest.raises(ValueError, match="viscosity of 'honey' must be positive"):
        simulation.set("honey", viscosity=-1.0)
    with pytest.raises(ValueError, match="wavelength"):
        simulation.set("honey", wavelength=1e-3)
    simulation.reset()
    assert simulation.get("honey", "viscosity") == 1.0


@pytest.mark.parametrize("model", ["stokeslets", "resistive"])
def test_copies_pickles_and_snapshots_go_on_with_the_same_bits(model, tmp_path):
    simulation = scene_with(viscosity=0.5, model=model, name="honey").build(time_step=2e-3)
    simulation.step(7)
    simulation.set("honey", viscosity=0.3)
    state = simulation.snapshot()
    loaded = withe.Snapshot.load(state.save(tmp_path / "state.npz"))
    others = [simulation.copy(), pickle.loads(pickle.dumps(simulation))]
    simulation.step(7)
    for other in others:
        other.step(7)
        assert np.array_equal(other.positions(), simulation.positions())
    assert loaded == state
    simulation.restore(loaded)
    assert simulation.get("honey", "viscosity") == 0.3
    simulation.step(7)
    assert np.array_equal(others[0].positions(), simulation.positions())


def test_the_plan_tells_of_the_fluid():
    assert "no fluid" in str(scene_with().build().plan)
    assert "Stokeslet segments couple all 16 nodes" in str(scene_with(viscosity=1.0).build().plan)
    resistive = str(scene_with(viscosity=1.0, model="resistive").build().plan)
    assert "resistive-force theory, implicit" in resistive
    assert "unsymmetric Jacobian: resistive-force theory" in resistive


def test_a_regularization_set_while_running_is_that_of_a_fluid_drawn_with_it():
    drawn = scene_with(viscosity=0.5, regularization=8e-3).build(time_step=2e-3)
    simulation = scene_with(viscosity=0.5).build(time_step=2e-3)
    assert simulation.get("fluid 1", "regularization") == pytest.approx(np.sqrt(np.e) * 2e-3)
    simulation.set("fluid 1", regularization=8e-3)
    for each in (simulation, drawn):
        each.step(10)
    assert simulation.positions() == pytest.approx(drawn.positions(), rel=1e-12)
    # With others it goes on with the bits of a copy, a pickle and a snapshot.
    simulation.set("fluid 1", regularization=4e-3, viscosity=0.4)
    simulation.step(2)
    fresh = scene_with(viscosity=0.5).build(time_step=2e-3)
    fresh.restore(simulation.snapshot())
    copies = [simulation.copy(), pickle.loads(pickle.dumps(simulation)), fresh]
    for each in (simulation, *copies):
        each.step(5)
    for each in copies:
        assert np.array_equal(each.positions(), simulation.positions())
        assert each.get("fluid 1", "regularization") == 4e-3
    with pytest.raises(ValueError, match="regularization of the fluid must not exceed 3 edge lengths"):
        simulation.set("fluid 1", regularization=0.05)
    with pytest.raises(ValueError, match="regularization of 'fluid 1' must be positive, got -1"):
        simulation.set("fluid 1", regularization=-1.0)
    local = scene_with(viscosity=0.5, model="resistive").build(time_step=2e-3)
    with pytest.raises(ValueError, match="regularization of 'fluid 1' needs model='stokeslets', got model='resistive'"):
        local.set("fluid 1", regularization=4e-3)
    assert local.get("fluid 1", "regularization") is None
