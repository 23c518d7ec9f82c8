"""One noun, one name: public signatures and docstrings, and the README, have no second word for a thing."""

import inspect
import re
from pathlib import Path

import pytest

import carom
from carom import io, models, theory
from carom.models import own

SECOND = {
    "eta": "packing_fraction", "phi": "packing_fraction", "packing_fractions": "packing_fraction",
    "rho": "density", "workers": "cores", "processes": "cores", "n_workers": "cores",
    "max_walltime": "walltime", "hours": "walltime", "seeds": "tries", "colour": "color", "periodic": "walls",
    "elastic_below": "impact", "filename": "path", "rng": "seed", "verbose": "progress", "temperature": "kT",
    "N": "n", "d": "dimension", "sigma": "diameter",
}  # fmt: skip
"""Names that arguments do not have, and the ones that they have."""

RIGHT = {
    "elastic_below": ("Restitution", "Rough", "Loss"),  # where it belongs
    "periodic": ("Frame",),  # a fact of a file, of which walls would say too much
}
"""Where one of them is right."""

FORBIDDEN = re.compile(r"\b(components?|colours?|neighbours?|centres?|max_walltime|workers)\b", re.IGNORECASE)
"""Words that the public docstrings and the README do not use: particle, color, neighbor, center, cores."""


def public():
    """Yield name and object of all that users see: of five modules, with methods that users call."""
    seen = set()
    for module in (carom, models, own, theory, io):
        for name in dir(module):
            thing = getattr(module, name)
            if name.startswith("_") or inspect.ismodule(thing) or id(thing) in seen:
                continue
            seen.add(id(thing))
            yield f"{module.__name__}.{name}", thing
            if inspect.isclass(thing):
                for part, value in vars(thing).items():
                    if not part.startswith("_") and (callable(value) or isinstance(value, property)):
                        yield f"{module.__name__}.{name}.{part}", value


PUBLIC = sorted(public(), key=lambda each: each[0])


def test_the_walk_sees_the_face():
    names = {name for name, _ in PUBLIC}
    assert {
        "carom.Scene",
        "carom.Simulation.measure",
        "carom.models.Rough",
        "carom.models.own.jump",
    } - names == {"carom.models.own.jump"}
    assert len(names) > 200


def test_no_argument_has_a_second_name():
    found = []
    for name, thing in PUBLIC:
        # What obstacles answer to the engine is no call of a user.
        if name.count(".") > 2 and ".models." in name:
            continue
        try:
            arguments = inspect.signature(thing).parameters
        except (TypeError, ValueError):
            continue
        owner = name.split(".")[2 if ".models." in name else 1]
        found += [
            f"{name}({word}=): {SECOND[word]}"
            for word in arguments
            if word in SECOND and owner not in RIGHT.get(word, ())
        ]
    assert not found


@pytest.mark.parametrize("of", ["docstrings", "README"])
def test_no_text_has_a_second_word(of):
    if of == "README":
        texts = {"README": Path(__file__).parents[2].joinpath("README.md").read_text(encoding="utf-8")}
    else:
        texts = {name: inspect.getdoc(thing) or "" for name, thing in PUBLIC}
    assert not {name: words for name, text in texts.items() if (words := FORBIDDEN.findall(text))}
