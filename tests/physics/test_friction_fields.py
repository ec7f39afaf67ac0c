"""Friction that varies over a floor or along a rod, against integrals and the statics of rigid rods."""

import pickle

import numpy as np
import pytest

import withe
from cases import measured

RUBBER = withe.Material(youngs_modulus=1e8, poisson_ratio=0.3, density=1200.0)
LENGTH, RADIUS, NODES = 0.2, 4e-3, 41
GRAVITY = 9.81
WEIGHTS = np.full(NODES, 1200.0 * np.pi * RADIUS**2 * LENGTH / (NODES - 1) * GRAVITY)
WEIGHTS[[0, -1]] *= 0.5


def step_and_ramp(points):
    """0.1, then 0.4 from x = 0.25 m on, then rising to 0.8 between 0.3 and 0.4 m."""
    x = points[:, 0]
    return np.where(x < 0.25, 0.1, 0.4) + np.clip((x - 0.3) / 0.1, 0.0, 1.0) * 0.4


def lying_rod(friction=0.0, friction_model="anchored", pulled="end", material=RUBBER, **contact):
    scene = withe.Scene(gravity=(0, 0, -GRAVITY))
    rod = scene.add_rod(
        start=(0, 0, RADIUS), end=(LENGTH, 0, RADIUS), nodes=NODES, radius=RADIUS, material=material, name="rod"
    )
    scene.add_floor(friction=friction, name="floor")
    scene.enable_contact(rods=False, friction_model=friction_model, **contact)
    if pulled:
        scene.pin(getattr(rod, pulled), free=(0, 0, 1), name="hand")
    return scene


@pytest.mark.case(
    "contact", "Pull of a rod over a floor with varying friction", source="integral of friction along the rod"
)
@pytest.mark.parametrize("friction_model", ["anchored", "implicit"])
def test_a_rod_is_pulled_over_a_step_and_a_ramp_by_the_integral_of_friction(friction_model):
    # On the centreline, so that friction has no arm about the hand, by which it would press the front harder.
    scene = lying_rod(step_and_ramp, friction_model, centreline_friction=True)
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    way, speed = 0.3, 0.1
    simulation.move("hand", position=(LENGTH + way, 0, RADIUS), over=way / speed)
    start = simulation.positions()
    forces, expected = [], []
    for _ in range(10):
        before = None
        for _ in range(150):
            before = simulation.positions()
            simulation.step()
        forces.append(simulation.reaction("hand").force[0])
        expected.append(WEIGHTS @ step_and_ramp(before))  # what acts in a step is taken from where it starts
    # Regularised friction lacks a tenth of a per mille where surfaces slip so much faster than its tolerance.
    np.testing.assert_allclose(forces[1:], expected[1:], rtol=0.01)
    x = start[:, 0, None] + np.linspace(0.0, way, 20001)
    mu = step_and_ramp(np.stack([x.ravel(), 0 * x.ravel(), 0 * x.ravel()], axis=1)).reshape(x.shape)
    work = WEIGHTS @ (0.5 * (mu[:, 1:] + mu[:, :-1])).mean(axis=1) * way
    assert simulation.energy().work == pytest.approx(work, rel=0.01)


@pytest.mark.case("contact", "Force that turns a rod with uneven friction", source="statics of a rigid rod")
def test_a_rod_with_less_friction_behind_turns_about_the_point_that_statics_say():
    # Pulled across at its start, a rigid rod turns about c: half of the moment of friction about the start lies on
    # either side, and the force is what is left of both.
    first, last = 0.6, 0.2
    half, w = 0.5 * LENGTH, 1200.0 * np.pi * RADIUS**2 * GRAVITY
    moment = 0.5 * first * half**2 + 0.5 * last * (LENGTH**2 - half**2)
    c = np.sqrt(half**2 + (moment - first * half**2) / last)
    force = w * (first * half + last * (c - half) - last * (LENGTH - c))
    steel = withe.Material(youngs_modulus=2e11, poisson_ratio=0.3, density=1200.0)
    scene = lying_rod(pulled="start", material=steel, centreline_friction=True)
    scene.set_friction("rod", "floor", np.repeat([first, last], (NODES - 1) // 2))
    simulation = scene.build(integrator="backward_euler", time_step=5e-3)
    simulation.move("hand", position=(0, 4e-3, RADIUS), over=0.4)
    simulation.run(duration=0.4, progress=False)
    moved = simulation.velocities()[:, 1]
    s = np.linspace(0.0, LENGTH, NODES)
    assert moved[0] > 0.0 > moved[-1]
    k = int(np.argmax(moved < 0.0))
    zero = s[k - 1] + (s[k] - s[k - 1]) * moved[k - 1] / (moved[k - 1] - moved[k])
    assert zero == pytest.approx(c, abs=0.6 * LENGTH / (NODES - 1))
    measured(simulation.reaction("hand").force[1] / force - 1.0)
    assert simulation.reaction("hand").force[1] == pytest.approx(force, rel=0.03)


@pytest.mark.parametrize("friction_model", ["anchored", "implicit", "lagged"])
def test_a_field_that_is_the_same_everywhere_is_a_coefficient(friction_model):
    places = []
    for friction in (0.3, lambda points: np.full(len(points), 0.3), withe.FrictionMap([[0.3]], (0, 1, 0, 1))):
        simulation = lying_rod(friction, friction_model).build(integrator="backward_euler", time_step=2e-3)
        simulation.move("hand", position=(LENGTH + 0.02, 0.01, RADIUS), over=0.1)
        simulation.run(duration=0.1, progress=False)
        places.append(simulation.positions())
    np.testing.assert_allclose(places[1], places[0], atol=1e-9)
    np.testing.assert_allclose(places[2], places[0], atol=1e-9)


def test_friction_of_any_kind_is_set_while_running():
    simulation = lying_rod(0.2).build(integrator="backward_euler", time_step=2e-3)
    simulation.move("hand", path=lambda t: (LENGTH + 0.05 * t, 0, RADIUS))

    def pull():
        simulation.step(40)
        return simulation.reaction("hand").force[0] / WEIGHTS.sum()

    assert pull() == pytest.approx(0.2, rel=0.01)
    simulation.set("floor", friction=lambda points: np.where(points[:, 1] > -1.0, 0.5, 9.0))
    assert pull() == pytest.approx(0.5, rel=0.01)
    assert callable(simulation.get("floor", "friction"))
    simulation.set(("rod", "floor"), friction=np.linspace(0.1, 0.3, NODES - 1))
    assert pull() == pytest.approx(0.2, rel=0.01)
    other = pickle.loads(pickle.dumps(lying_rod(0.2).build(time_step=1e-3)))
    assert other.get("floor", "friction") == 0.2
    simulation.set(("rod", "floor"), friction=0.4)
    assert pull() == pytest.approx(0.4, rel=0.01)


def test_a_field_moves_with_its_floor_and_lives_in_copies_and_snapshots():
    field = withe.FrictionMap([[0.1, 0.1, 0.5, 0.5]], (-1.0, 1.0, -1.0, 1.0))
    simulation = lying_rod(field, pulled=None).build(integrator="backward_euler", time_step=2e-3)
    simulation.move("floor", path=lambda t: (0.5 * t, 0, 0))
    copy, loaded, state = simulation.copy(), pickle.loads(pickle.dumps(lying_rod(field).build())), simulation.snapshot()
    simulation.run(duration=0.1, progress=False)
    copy.run(duration=0.1, progress=False)
    np.testing.assert_array_equal(simulation.positions(), copy.positions())
    np.testing.assert_array_equal(loaded.get("floor", "friction").image, field.image)
    end = simulation.positions()
    simulation.restore(state)
    simulation.run(duration=0.1, progress=False)
    np.testing.assert_array_equal(simulation.positions(), end)


@pytest.mark.parametrize(
    ("friction", "message"),
    [
        (lambda points: -points[:, 0] - 1.0, "friction of 'floor' must be finite and not negative, got -1"),
        (lambda points: np.full(len(points), np.nan), "friction of 'floor' must be finite and not negative, got nan"),
        (lambda points: np.zeros(3), r"friction of 'floor' must return one number per point"),
        (lambda points: "much", r"friction of 'floor' must return numbers, got 'much'"),
    ],
)
def test_a_field_that_is_negative_or_not_finite_is_refused(friction, message):
    with pytest.raises(ValueError, match=message):
        lying_rod(friction).build()
    simulation = lying_rod(0.1).build()
    with pytest.raises(ValueError, match=message):
        simulation.set("floor", friction=friction)


def test_a_field_that_becomes_negative_on_the_way_stops_the_run_and_says_where():
    scene = lying_rod(lambda points: 0.25 - points[:, 0])
    simulation = scene.build(integrator="backward_euler", time_step=2e-3)
    simulation.move("hand", position=(LENGTH + 0.1, 0, RADIUS), over=0.1)
    with pytest.raises(ValueError, match=r"friction of 'floor' must be finite and not negative, got -.* at \(0\.2"):
        simulation.run(duration=0.1, progress=False)


@pytest.mark.parametrize(
    ("image", "extent", "message"),
    [
        ([[-0.1]], (0, 1, 0, 1), "image of friction must be finite and not negative"),
        ([0.1], (0, 1, 0, 1), "image of friction must have shape"),
        ([[0.1]], (1, 0, 0, 1), "extent of friction must be left < right"),
    ],
)
def test_an_image_of_friction_that_is_none_is_refused(image, extent, message):
    with pytest.raises(ValueError, match=message):
        withe.FrictionMap(image, extent)


def test_edges_want_one_number_each_and_rods_among_themselves_one():
    scene = lying_rod()
    for bad, message in [
        (np.full(7, 0.1), "friction of 'rod' and 'floor' must have shape"),
        (
            np.r_[np.full(NODES - 2, 0.1), -0.1],
            "friction of 'rod' and 'floor' must not be negative, got -0.1",
        ),
    ]:
        with pytest.raises(ValueError, match=message):
            scene.set_friction("rod", "floor", bad)
    with pytest.raises(ValueError, match="friction of 'rod' and 'rod' must be"):
        scene.set_friction("rod", "rod", np.full(NODES - 1, 0.1))


def test_an_image_is_read_as_it_is_shown():
    field = withe.FrictionMap([[0.1, 0.2], [0.3, 0.4]], extent=(0, 2, 0, 2))
    points = [(0.5, 1.5, 0), (1.5, 1.5, 0), (0.5, 0.5, 0), (1.0, 1.0, 0), (-5.0, 9.0, 0)]
    np.testing.assert_allclose(field(points), [0.1, 0.2, 0.3, 0.25, 0.1])


def test_friction_may_be_chosen_without_contact_of_rods():
    scene = withe.Scene()
    for y in (-1.0, 1.0):  # they cross in each other
        scene.add_rod(
            start=(0, 0.05 * y, RADIUS), end=(0.1, -0.05 * y, RADIUS), nodes=9, radius=RADIUS, material=RUBBER
        )
    scene.add_floor(friction=0.4)
    scene.enable_contact(rods=False, friction_model="implicit", slip_tolerance=1e-4)
    simulation = scene.build(time_step=1e-3)
    simulation.step(5)
    assert {tuple(pair)[1] for pair in simulation.contacts()["pair"]} == {"floor 1"}
