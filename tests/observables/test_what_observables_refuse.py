"""What each observable refuses, and the words that say why; test_every_observable.py has what all refuse."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.frames import at_rest, frame_of

import carom
from carom import BondOrder, DensityProfile, Dynamics, PressureProfile, PressureTensor, StructureFactor
from carom.errors import InputError
from carom.models import Gravity, Shear
from carom.models.drives import Andersen
from carom.observables import RDF, Crystallinity

TWO = frame_of([[0.5, 0.5], [2.5, 2.5]], (5.0, 8.0))
CLOSE = frame_of([[6.0, 6.0], [0.5, 0.5], [0.9, 0.5], [3.0, 3.0], [3.0, 3.6]], (8.0, 8.0))
THREE = dataclasses.replace(
    frame_of([[1.0, 1.0], [3.0, 1.0], [5.0, 5.0]], (7.0, 7.0), [1.0, 0.5, 0.5], species=np.array([0, 1, 1])),
    species_names=("a", "b"),
)
GAS = frame_of(np.random.default_rng(1).uniform(0.0, 10.0, (200, 2)), (10.0, 10.0), 1e-9)
MOVED = [dataclasses.replace(GAS, time=t, images=np.zeros((200, 2), np.int32)) for t in (0.0, 1.0, 3.0)]
FIVE = at_rest(carom.Scene.random(5, 0.1, seed=1), periodic=(False,) * 3)


def with_(frame, **changes):
    return [dataclasses.replace(frame, **changes)]


REFUSED = [
    (RDF, {"rmax": 2.6}, [TWO], "half of the shortest box edge"),
    (RDF, {"rmax": 1.0}, [TWO], "must exceed"),
    (RDF, {"rmax": math.nan}, [TWO], "rmax must be finite"),
    (RDF, {"rmax": "a"}, [TWO], "rmax must be a number"),
    (RDF, {"bins": 10, "width": 0.1, "rmax": 2.0}, [TWO], "give two"),
    (RDF, {"bins": 0}, [TWO], "positive integer"),
    (RDF, {"width": -0.1}, [TWO], "positive length"),
    (RDF, {"width": "a"}, [TWO], "width must be a number"),
    (RDF, {"width": 1e-300}, [TWO], "more than 10000000 bins"),
    (RDF, {"width": 1e-8}, [TWO], "more than 10000000 bins"),
    (RDF, {"bins": 10**8}, [TWO], "more than 10000000 bins"),
    (RDF, {"bins": 40, "width": 0.1}, [TWO], "half of the shortest box edge"),
    (RDF, {}, [frame_of([[0.5, 0.5]], (5.0, 8.0))], "two or more"),
    (RDF, {}, [frame_of([[0.0, 0.0], [0.9, 0.9]], (1.8, 1.8))], "must exceed"),
    (RDF, {}, [CLOSE], "Particles 1 and 2 overlap"),
    (RDF, {"rmax": 2.5}, [TWO, *with_(TWO, box=(4.0, 9.0))], r"2\.5, beyond half of the shortest box edge"),
    (RDF, {}, with_(TWO, diameters=np.array([1.0, 0.5])), r"from 0\.5 to 1"),
    (RDF, {}, [TWO, *with_(TWO, diameters=np.array([0.5, 0.5]))], "other diameters"),
    (RDF, {}, [THREE], r"or two species: pair=\(0, 1\)"),
    (RDF, {"pair": (0, 2)}, [THREE], "no species 2"),
    (RDF, {"pair": ("a", "c")}, [THREE], "no species 'c'; known are a, b"),
    (RDF, {"pair": 0}, [THREE], "expected two species"),
    (RDF, {"pair": "ab"}, [THREE], "expected two species"),
    (RDF, {"pair": (0, 0)}, [THREE], "too few components"),
    (RDF, {"pair": (0, 1), "contact": -1.0}, [THREE], "positive length"),
    (RDF, {"contact": 1.0}, [THREE], "no pair is given"),
    (RDF, {"pair": (0, 1)}, [TWO], "no species"),
    (RDF, {"pair": (0, 1)}, with_(THREE, diameters=np.array([1.0, 0.5, 0.6])), "of species 1 differ"),
    # Not particles 1 and 2, which are nearer and of one species; and by their numbers among all.
    (RDF, {"pair": (0, 1)}, with_(CLOSE, species=np.array([2, 0, 0, 0, 1])), "3 and 4 overlap .*contact 1"),
    (RDF, {}, with_(TWO, periodic=(True, False)), "Axis 1 of the box has walls"),
    (StructureFactor, {"shells": 3, "kmax": 2.0}, [GAS], "one of them"),
    (StructureFactor, {"shells": 0}, [GAS], "shells"),
    (StructureFactor, {"kmax": 0.1}, [GAS], "shortest wave vector"),
    (StructureFactor, {"kmax": 1e5}, [GAS], "more than"),
    (StructureFactor, {"pair": (0, 1)}, [GAS], "no species"),
    (BondOrder, {"nearest": 6, "reach": 1.5}, [GAS], "one of them"),
    (BondOrder, {"rmax": 5.1}, [GAS], "half of the shortest edge"),
    (BondOrder, {"species": 1}, [GAS], "none of them"),
    (BondOrder, {"l": 0}, [GAS], "l must"),
    (Crystallinity, {"connections": 0}, [FIVE], "connections"),
    (Crystallinity, {"likeness": 2.0}, [FIVE], "likeness"),
    (Crystallinity, {"nearest": 3, "reach": 1.0}, [FIVE], "one of them"),
    (Crystallinity, {}, [GAS], "three dimensions"),
    (Crystallinity, {}, [FIVE], "12 neighbors"),
    (Dynamics, {}, MOVED, "equal spacing"),
    (Dynamics, {}, [GAS], "image counts"),
    (Dynamics, {"species": 1}, MOVED, "species"),
    (Dynamics, {"conserved": (False,) * 3}, MOVED, "conserved has 3 values, and a frame has 2 axes"),
    (DensityProfile, {"axis": 2}, [GAS], "axis"),
    (DensityProfile, {"species": 2}, [THREE], "species is 2; known are 0, 1"),
]


@pytest.mark.parametrize(("kind", "given", "frames", "says"), REFUSED)
def test_what_an_observable_cannot_measure_is_said(kind, given, frames, says):
    with pytest.raises(InputError, match=says):
        kind(**given).over(frames)


FALLING, HEATED = Gravity((0.0, -1.0)), Andersen(1.0, rate=1.0)


@pytest.mark.usefixtures("unscheduled")
@pytest.mark.parametrize(
    ("observable", "change", "growth", "says"),
    [
        (PressureTensor(), {"pinned": [0]}, 0.0, "pinned"),
        (PressureTensor(), {"motion": FALLING}, 0.0, "momentum"),
        (PressureTensor(), {"drive": HEATED}, 0.0, "drive"),
        (PressureTensor(), {}, 0.1, "do not grow"),
        (PressureProfile(), {"pinned": [0]}, 0.0, "pinned"),
        (PressureProfile(), {"motion": Shear(1.0)}, 0.0, "motion Shear"),
        (PressureProfile(), {"motion": FALLING}, 0.0, "fall for ever"),
        (PressureProfile(), {"drive": HEATED}, 0.0, "drive"),
        (PressureProfile(), {}, 0.1, "do not grow"),
        (PressureProfile(axis=2), {}, 0.0, "axis is 2"),
    ],
)
def test_a_pressure_that_events_do_not_tell_is_refused_before_the_run(observable, change, growth, says):
    scene = carom.Scene([[2.0, 5.0], [6.0, 5.0]], (8.0, 8.0)).replace(**change)
    with pytest.raises(InputError, match=says):
        carom.Simulation(scene, growth=growth).measure(observable, time=1.0)
