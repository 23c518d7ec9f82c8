"""What ``dir`` shows of the package and of its values is Carom's, public and documented."""

import inspect

import pytest

import carom
from carom.models import own


@pytest.fixture(scope="module")
def values():
    scene = carom.Scene.random(64, 0.3, 2, seed=1)
    sim = carom.Simulation(scene, seed=1)
    pressure, g = sim.measure(carom.Pressure(), carom.RDF(rmax=2.0), collisions_per_particle=20, blocks=16)
    return {"scene": scene, "sim": sim, "frame": sim.frame(), "pressure": pressure, "g": g, "Z": pressure.Z}


@pytest.mark.parametrize(
    "module", [carom, carom.models, own, carom.io, carom.observables, carom.theory], ids=lambda x: x.__name__
)
def test_a_module_shows_its_own_names(module):
    others = {name for name in dir(module) if not name.startswith("_")} - {*module.__all__, "annotations"}
    # A module that was imported once is a name of its package.
    assert all(getattr(getattr(module, name), "__name__", "").startswith("carom.") for name in others)
    for name in module.__all__:
        thing = getattr(module, name)
        where = thing.__name__ if inspect.ismodule(thing) else getattr(thing, "__module__", None) or "carom"
        # Aliases of types, such as own.Time, are those of typing.
        assert where.split(".")[0] in ("carom", "typing", "collections"), name
        if inspect.isclass(thing) or inspect.isfunction(thing):
            assert inspect.getdoc(thing), name


@pytest.mark.parametrize("name", ["scene", "sim", "frame", "pressure", "g", "Z"])
def test_all_that_a_value_shows_is_explained(values, name):
    value = values[name]
    kind = type(value)
    for key in (key for key in dir(value) if not key.startswith("_")):
        held = inspect.getattr_static(kind, key, None)
        if isinstance(held, property) or callable(getattr(kind, key, None)):
            assert inspect.getdoc(getattr(kind, key)), key
        else:  # a field, of which the class tells
            assert any(key in (inspect.getdoc(each) or "") for each in kind.__mro__), key
