"""Every kind of scene, and every observable of events, is in the language that is compiled."""

import llvmlite.binding as llvm
import pytest
from helpers import checkpoints

import carom
from carom.compiling import machine
from carom.compiling.entry import Translated
from carom.engine import cycle
from carom.models import Arc, Ball, Gravity, Sine
from carom.observables import FreeFlights
from carom.simulation import run_loop


def translated(engine):
    """Return the texts of both entry points of a run for an engine."""
    texts = []
    for function, last in ((cycle.schedule, (0, 1)), (cycle.run, (0, 0.0, 1, 1))):
        plain = getattr(function, "__wrapped__", function)
        texts.append(Translated(plain, (*engine, *last), "tried").text)
        assert "define" in texts[-1]
    return texts


@pytest.mark.parametrize("name", checkpoints.SCENES)
def test_a_kind_of_scene_is_in_the_language(unscheduled, name):
    scene, settings = checkpoints.SCENES[name]()
    with carom.Simulation(scene, seed=1, **settings) as sim:
        translated(sim._state.engine)


ELSEWHERE = {
    "aarch64-unknown-linux-gnu": b"\x7fELF",
    "arm64-apple-darwin23.0.0": b"\xcf\xfa\xed\xfe",
    "x86_64-apple-darwin23.0.0": b"\xcf\xfa\xed\xfe",
    "x86_64-pc-windows-msvc": b"\x64\x86",
}
"""Triples of machines that the tests do not run on, and how their files of machine code begin."""


@pytest.mark.parametrize("triple", ELSEWHERE)
def test_machine_code_is_made_for_other_processors_and_systems(unscheduled, triple, monkeypatch):
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(triple).create_target_machine(
        opt=machine.LEVEL, reloc="default", codemodel="jitdefault", jit=True
    )
    monkeypatch.setattr(machine, "_machine", lambda: (target, None))
    monkeypatch.setattr(llvm, "get_process_triple", lambda: triple)
    sim = carom.Simulation(carom.Scene.random(16, 0.2, 2, seed=1), seed=1)
    code = machine.machine_code(translated(sim._state.engine)[1])
    assert code.startswith(ELSEWHERE[triple])
    assert b"tried" in code


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


@pytest.mark.parametrize(
    ("kind", "how"), [(Arc, {}), (Ball, {"shake": Sine(0.2, period=1.0), "direction": (1.0, 0.0)})]
)
def test_further_obstacles_of_one_kind_add_next_to_nothing_to_the_text(unscheduled, kind, how):
    # Arcs added three fifths each, where their nine images in the plane were written out, and balls a tenth:
    # twelve took ten seconds. What remains are longer numbers of words.
    sizes = []
    for count in (1, 12):
        given = [kind((2.0 + 3.0 * (k % 4), 2.0 + 3.0 * (k // 4)), 1.0, **how) for k in range(count)]
        scene = carom.Scene(
            [[2.0, 0.2]], (13.0, 10.0), diameter=0.2, velocities=[[1.0, 0.3]], obstacles=given
        )
        sizes.append(sum(map(len, translated(carom.Simulation(scene, seed=1)._state.engine))))
    assert sizes[1] < 1.1 * sizes[0]
