"""Many simulations on workers of Dask, here those of a cluster on this machine."""

import numpy as np
import pytest

import withe
from simple_scenes import cantilever, same_state

distributed = pytest.importorskip("distributed")

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(scope="module")
def client():
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        yield client


def test_a_cluster_gives_the_records_and_states_of_single_runs(client):
    simulations = [cantilever(nodes=6 + i)[2] for i in range(3)]
    singles = [simulation.copy() for simulation in simulations]

    def lead(simulation):
        simulation.set("arm", natural_curvature=(0.0, 10.0 * simulation.time))

    options = {"record_every": 0.02, "before_step": lead, "progress": False}
    records = withe.run_many(simulations, 0.1, client=client, **options)
    for record, simulation, single in zip(records, simulations, singles, strict=True):
        expected = single.run(0.1, **options)
        np.testing.assert_array_equal(record.positions(), expected.positions())
        assert same_state(simulation, single)
        simulation.step()


def test_errors_of_a_cluster_are_raised_or_take_the_place_of_records(client):
    scene, arm, _ = cantilever(nodes=4)
    scene.add_force(arm.end, lambda t: (0, 0, 0 if t < 0.02 else 1 / 0), name="bad")
    simulations = [cantilever(nodes=4)[2], scene.build()]
    good, bad = withe.run_many(simulations, 0.1, client=client, errors="return", progress=False)
    assert isinstance(good, withe.Record)
    assert isinstance(bad, ZeroDivisionError)
    assert simulations[0].time == pytest.approx(0.1)
    assert simulations[1].time == 0.0
    with pytest.raises(ZeroDivisionError):
        withe.run_many(simulations[1:], 0.1, client=client, progress=False)
    assert withe.run_many([], 0.1, client=client) == []


def test_what_is_no_client_is_refused(client):
    simulation = cantilever(nodes=4)[2]
    with pytest.raises(ValueError, match=r"client must be a dask\.distributed\.Client, got str"):
        withe.run_many([simulation], 0.1, client="tcp://scheduler:8786")
    with pytest.raises(ValueError, match="workers are threads of this process"):
        withe.run_many([simulation], 0.1, client=client, workers=2)
