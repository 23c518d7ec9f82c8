"""Every kind of scene, and every observable of events, is in the language that is compiled."""

import pytest
from helpers import checkpoints

import carom
from carom.compiling.entry import Translated
from carom.engine import cycle
from carom.models import Gravity
from carom.observables import FreeFlights
from carom.simulation import run_loop


def translated(engine):
    """Translate both entry points of a run for an engine."""
    for function, last in ((cycle.schedule, (0, 1)), (cycle.run, (0, 0.0, 1, 1))):
        plain = getattr(function, "__wrapped__", function)
        assert "define" in Translated(plain, (*engine, *last), "tried").text


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize("name", checkpoints.SCENES)
def test_a_kind_of_scene_is_in_the_language(name):
    scene, settings = checkpoints.SCENES[name]()
    with carom.Simulation(scene, seed=1, **settings) as sim:
        translated(sim._state.engine)


OBSERVED = {
    "tensor": (carom.PressureTensor(), None, None),
    "tensor between walls": (carom.PressureTensor(), "y", None),
    "layers": (carom.PressureProfile(axis=1, bins=8), "y", None),
    "layers in a field": (carom.PressureProfile(axis=1, bins=8), "y", Gravity((0.0, -0.1))),
    "flights": (FreeFlights(), "y", None),
    "wall in a field": (carom.WallPressure("y_low"), "y", Gravity((0.0, -0.1))),
}


@pytest.mark.parametrize("name", OBSERVED)
def test_an_observable_of_events_is_in_the_language(name, monkeypatch):
    observable, walls, motion = OBSERVED[name]
    sim = carom.Simulation(carom.Scene.random(16, 0.2, 2, walls=walls, motion=motion, seed=1), seed=1)

    def stop(state, *rest, **named):
        translated(state.engine)
        raise InterruptedError

    monkeypatch.setattr(run_loop, "advance", stop)
    with pytest.raises(InterruptedError):
        sim.measure(observable, time=1.0)  # without a pilot, which nobody observes
