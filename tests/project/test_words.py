"""One noun, one name: public signatures and docstrings, and the README, have no second word for a thing."""

import importlib
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
    "seeds": ("packings",),  # each is a result; of tries there is one, the best
}
"""Where one of them is right."""

FORBIDDEN = re.compile(r"\b(components?|colours?|neighbours?|centres?|max_walltime|workers)\b", re.IGNORECASE)
"""Words that the public docstrings and the README do not use: particle, color, neighbor, center, cores."""

ROOT = Path(__file__).parents[2]

OF_DEVELOPERS = ("algorithm.md", "architecture.md", "benchmarks.md", "layouts.md", "release.md")
"""Pages of the developers, with the words of the article: there, what moves is a component."""


FACE = (carom, models, own, theory, io)


def on_pages():
    """Return the modules that the pages of the interface show."""
    asked = re.compile(r"^\{\{ api ([\w.]+)", re.MULTILINE)
    pages = [page.read_text(encoding="utf-8") for page in ROOT.glob("docs/api/*.md")]
    shown = {name for page in pages for name in asked.findall(page)}
    # Of an executor, workers are what its processes are called by Python.
    return map(importlib.import_module, sorted(shown - {"carom.studies.executors"}))


def public(modules):
    """Yield name and object of all that users see of modules, with methods that users call."""
    seen = set()
    for module in modules:
        of_its_own = [n for n, x in vars(module).items() if getattr(x, "__module__", "") == module.__name__]
        for name in dir(module) if module in FACE else getattr(module, "__all__", of_its_own):
            thing = getattr(module, name)
            if name.startswith("_") or inspect.ismodule(thing) or id(thing) in seen:
                continue
            seen.add(id(thing))
            yield f"{module.__name__}.{name}", thing
            if inspect.isclass(thing):
                for part, value in vars(thing).items():
                    if not part.startswith("_") and (callable(value) or isinstance(value, property)):
                        yield f"{module.__name__}.{name}.{part}", value


PUBLIC = sorted(public(FACE), key=lambda each: each[0])


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
        texts = {"README": ROOT.joinpath("README.md").read_text(encoding="utf-8")}
    else:
        texts = {name: inspect.getdoc(thing) or "" for name, thing in public((*FACE, *on_pages()))}
        assert len(texts) > 600
    assert not {name: words for name, text in texts.items() if (words := FORBIDDEN.findall(text))}


def test_pages_say_particle():
    pages = [page for page in ROOT.glob("docs/*.md") if page.name not in OF_DEVELOPERS]
    assert len(pages) > 18
    second = re.compile(r"\b(components?|colours?|neighbours?|centres?)\b", re.IGNORECASE)
    texts = {page.name: page.read_text(encoding="utf-8") for page in pages if page.name != "notation.md"}
    assert not {name: words for name, text in texts.items() if (words := second.findall(text))}
