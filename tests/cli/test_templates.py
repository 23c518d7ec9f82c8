"""The scene files of ``carom init``: each runs by its first line; and the schema for editors."""

import contextlib
import json
import math
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest
from helpers.marks import slow
from typer.testing import CliRunner

from carom import cli
from carom.cli import templates
from carom.declared import Declared, fields_of, schema_of
from carom.errors import InputError
from carom.models.declared_values import Value
from carom.scene_file.sections import SceneSpec

SMALL_RUN = ("--n", "30", "--equilibration", "1", "--frames", "2", "--no-pictures")
SMALL_STUDY = ("--n", "32", "--replicas", "1", "-c", "60", "--equilibration", "5", "--engine", "serial",
               "--no-pictures")  # fmt: skip
SMALL = {
    "fluid": (*SMALL_RUN, "-c", "10"),
    "mixture": (*SMALL_RUN, "-c", "10"),
    "walls": (*SMALL_RUN, "-c", "10"),
    "square-well": (*SMALL_RUN, "-c", "10"),
    "bed": (*SMALL_RUN, "--time", "1"),
    "rules": ("--time", "0.5", "--frames", "2", "--no-pictures"),
    "packing": ("--collisions", "300", "--no-pictures"),
    "study": (*SMALL_STUDY, "--eta", "0.1"),
    "transport": SMALL_STUDY,
    "shear": (*SMALL_STUDY[:4], "--strains", "10", *SMALL_STUDY[6:]),
    "code": ("--tries", "1", "--hops", "0", "--starts", "1", "--digits", "15"),
}
"""What makes each small."""

HEAVY = ("mixture", "walls", "square-well", "bed", "rules", "packing", "transport", "shear", "code")
"""Those with kernels of their own, a quarter of a minute each to compile."""


def typed(folder, *words):
    """Type a command in a folder."""
    with contextlib.chdir(folder):
        return CliRunner().invoke(cli.app, [*words])


@pytest.mark.parametrize("name", [slow(name) if name in HEAVY else name for name in templates.NAMES])
def test_a_template_runs_by_the_command_on_its_first_line(tmp_path, name):
    assert typed(tmp_path, "init", f"mine-{name}.toml", "--template", name).exit_code == 0
    first = (tmp_path / f"mine-{name}.toml").read_text().splitlines()[0]
    command = first.removeprefix("# ").partition(":")[0].split()
    assert command[0] == "carom"
    assert command[2] == f"mine-{name}.toml"
    done = typed(tmp_path, *command[1:], *SMALL[name])
    # 3: so few collisions leave a point of a study flagged.
    assert done.exit_code in ((0, 3) if name in ("study", "transport", "shear") else (0,)), done.output


@pytest.mark.parametrize("name", templates.NAMES)
def test_a_template_is_a_page_whose_comments_are_the_help_of_its_keys(name):
    text = templates.template(name)
    lines = text.splitlines()
    assert 10 <= len(lines) <= 40
    assert max(map(len, lines)) <= templates.LONGEST
    assert lines[1] == f"#:schema ./{templates.SCHEMA}"
    if name != "code":
        section = next(
            head for head in ("run", "study", "transport", "shear", "pack") if f"[{head}]" in lines
        )
        seed = fields_of(templates.SPECS[section])["seed"].opt.help.rstrip(".")
        assert "seed = 1" not in text or seed[1:] in text


@pytest.mark.parametrize("name", templates.NAMES)
def test_the_schema_accepts_a_template_also_with_every_line_switched_on_alone(name):
    schema = templates.schema()
    jsonschema.Draft7Validator.check_schema(schema)
    text = templates.template(name)
    jsonschema.validate(tomllib.loads(text), schema)
    for line in text.splitlines():
        if line.startswith("# ") and " = " in line and "`" not in line:
            jsonschema.validate(tomllib.loads(text.replace(line, line[2:])), schema)


@pytest.mark.parametrize(
    "text",
    [
        "[scen]", "[scene]\nnn = 3", "[scene]\nn = 0", "[scene]\nn = 'three'", "[scene]\nlattice = 'fc'",
        "[scene]\npacking_fraction = 1.5", "[scene]\nspecies.a = { color = 1 }",
        "[scene]\nobstacles.a = { radius = 1.0 }",
        "[scene]\nobstacles.a = { type = 'ball', radius = -1.0, center = [0, 0] }",
        "[scene]\nobstacles.a = { type = 'ball', radius = 1.0, center = [0, 0], impact = { power = 9.0 } }",
        "[scene]\nwalls.x_low = { kT = -1.0 }", "[scene]\nwalls.x_low = { shake = { amplitude = 1.0 } }",
        "[scene]\ninteraction = { type = 'square-well', range = 0.5 }",
        "[scene]\ninteraction = { type = 'bonds', outer = 1.1 }",
        "[scene]\ninteraction = { type = 'steps', distances = [1.0] }",
        "[scene]\nmotion = { type = 'gravity' }",
        "[scene]\ndrive = { type = 'andersen', kT = 1.0, rate = -1.0 }",
        "[scene]\nimpact = { restitution = 2.0 }", "[scene]\nimpact = 0", "[run]\nwrite = ['pdb']",
        "[run]\nevent_log = 1", "[study]\nn = []", "[transport]\nblocks = 1", "[pack]\ncollisions = 0",
        "[plan]\ntarget = 1",
    ],
)  # fmt: skip
def test_the_schema_refuses_what_carom_refuses(text):
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads(text), templates.schema())


@pytest.mark.parametrize(
    "text",
    [
        "obstacles.a = { type = 'ball', radius = 1, center = [0, 0], shake = { amplitude = 1, period = 1 } }",
        "walls.x_low = { kT = 1.0 }\nwalls.x_high = { impact = 0.9, offset = 0.0 }",
        "interaction = { type = 'steps', distances = [1.0, 1.5], energies = [inf, -1.0] }",
        "interaction = { type = 'bonds', pairs = [[0, 1]], outer = 1.1, others = { type = 'square-well' } }",
        "impact = { restitution = 0.8, elastic_below = 0.1, at_speed = 1.0 }",
        "interaction = { type = 'ranges', file = 'a.py', rule = 'f', kinds = [{ name = 'a', circles = [1]}]}",
    ],
)
def test_the_schema_accepts_what_carom_reads(text):
    jsonschema.validate(tomllib.loads("[scene]\n" + text), templates.schema())
    SceneSpec.from_toml("[scene]\n" + text)


def test_the_schema_says_of_each_key_what_its_option_says():
    properties = templates.schema()["properties"]
    for name, kind in templates.SPECS.items():
        for key, field in fields_of(kind).items():
            if key not in kind.tables:
                assert properties[name]["properties"][key]["description"] == field.opt.help


def test_the_list_has_a_line_for_each_template(tmp_path):
    shown = typed(tmp_path, "init", "--list").output.splitlines()
    assert [line.split()[0] for line in shown] == [*templates.NAMES]
    assert all(len(line.split()) > 3 for line in shown)
    assert {path.stem for path in Path(templates.__file__).parents[1].glob("templates/*.toml")} == {
        *templates.NAMES
    }


def test_the_printed_schema_is_that_of_this_version(tmp_path):
    assert json.loads(typed(tmp_path, "init", "--schema").output) == templates.schema()


NEEDED = {"code": "n = 5", "shear": "rate = 1.0", "plan": "target = 'Z=0.5'"}


def test_one_file_serves_every_command():
    seeded = {name: kind for name, kind in templates.SPECS.items() if "seed" in fields_of(kind)}
    one = "\n".join(f"[{name}]\nseed = 7\n{NEEDED.get(name, '')}" for name in seeded)
    for kind in seeded.values():
        assert kind.from_toml(f"{one}\n[scene]\nn = 32\npacking_fraction = 0.1\n").seed == 7


def test_the_page_of_the_command_line_has_the_keys_of_every_section():
    page = (Path(__file__).parents[2] / "docs" / "keys.md").read_text(encoding="utf-8")
    assert re.findall(r"^{{ keys (\w+) }}$", page, re.MULTILINE) == list(templates.SPECS)
    assert "| `packing_fraction` | Fraction of the volume that particles fill |  |" in templates.table(
        "scene"
    )


def kinds_of(base):
    """Return all kinds of Carom that are declared below a base."""
    below = {kind for each in base.__subclasses__() for kind in (each, *kinds_of(each))}
    return {kind for kind in below if kind.__module__.startswith("carom.")}


def at_limits(schema):
    """Yield what is at a limit that a schema names, or just beyond it, and whether it is accepted."""
    for word, way in (("minimum", -1), ("maximum", 1), ("minLength", -1), ("maxLength", 1)):
        if word in schema:
            limit = schema[word]
            whole = schema["type"] != "number"
            beyond = limit + way if whole else math.nextafter(limit, way * math.inf)
            for value, right in ((limit, True), (beyond, False)):
                yield value * "a" if schema["type"] == "string" else value, right
    if "exclusiveMinimum" in schema:
        yield schema["exclusiveMinimum"], False


def test_what_the_schema_says_at_its_limits_is_what_carom_does():
    templates.schema()  # with it all kinds are there
    tried = set()
    for kind in kinds_of(Declared) | kinds_of(Value):
        for name, field in fields_of(kind).items():
            schema = schema_of(field.check)
            for value, right in at_limits(schema.get("anyOf", [schema])[0]):
                with contextlib.nullcontext() if right else pytest.raises(InputError):
                    field.check(value, f"{name} of {kind.__name__}")
                tried.add((kind, name))
    assert len(tried) > 150
