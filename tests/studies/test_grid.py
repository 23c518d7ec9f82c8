"""What a study of a grid takes from ``[scene]``, and from its own section."""

import pytest

from carom.studies import EquationOfState, ShearFlow, StudySpec, Transport

MIXED = "species.a = { count = 30 }\nspecies.b = { count = 10, diameter = 0.5 }\n"


@pytest.mark.parametrize(
    ("scene", "own", "n", "packing_fraction", "more"),
    [
        ("n = 40\npacking_fraction = 0.2", "", (40,), (0.2,), {}),
        ("n = 40\npacking_fraction = 0.2", "n = 50", (50,), (0.2,), {}),
        ("n = 40\npacking_fraction = 0.2", "packing_fraction = [0.1, 0.3]", (40,), (0.1, 0.3), {}),
        ("density = 0.3", "", (4000,), (pytest.approx(0.3 * 0.5235987755982988),), {}),
        ("n = 30\nbox = [9.0, 9.0]", "", (30,), (pytest.approx(30 * 0.785398163397 / 81),), {"dimension": 2}),
        ("lattice = 'fcc'\ncells = 2\npacking_fraction = 0.3", "", (32,), (0.3,), {"lattice": "fcc"}),
        ("packing_fraction = 0.2\n" + MIXED, "", (40,), (0.2,), {}),
        ("mass = 2.0", "", (4000,), StudySpec.densities[3], {"scene": {"mass": 2.0}}),
    ],
)
def test_a_study_takes_from_the_scene_what_its_section_leaves_out(scene, own, n, packing_fraction, more):
    spec = StudySpec.from_toml(f"[scene]\n{scene}\n[study]\n{own}\n[run]\nkT = 3.0\n[code]\nn = 5\n")
    assert (spec.n, spec.packing_fraction, spec.kT) == (n, packing_fraction, 1.0)
    for name, value in more.items():
        assert getattr(spec, name) == value
    assert StudySpec.from_toml(spec.to_toml()) == spec


def test_the_counts_of_a_scene_are_the_fractions_of_a_study():
    spec = StudySpec.from_toml(f"[scene]\npacking_fraction = 0.2\n{MIXED}")
    assert [each["fraction"] for each in spec.scene["species"]] == [0.75, 0.25]
    assert [each["name"] for each in spec.scene["species"]] == ["a", "b"]


def test_the_words_of_a_task_are_those_from_which_its_stream_follows():
    (task,) = StudySpec((0.2,), n=(40,), replicas=1, kT=2.0, scene={"mass": 4.0}).tasks()
    assert task["scene"] == {
        "initial": "random", "n": 40, "packing_fraction": 0.2, "dimension": 3, "kT": 2.0, "mass": 4.0,
        "diameter": 1.0,
    }  # fmt: skip


def test_a_sheared_run_has_a_time_and_no_number_of_collisions():
    study = ShearFlow(ShearFlow.Spec(packing_fraction=(0.1,), n=(100,), rate=(0.5, 2.0), strains=10.0))
    assert study.first == "the first runs, of 2e+03 particles times time at most"


@pytest.mark.parametrize("kind", [EquationOfState, Transport])
def test_a_study_says_what_its_longest_run_costs_before_it_begins(kind):
    given = {"n": (40, 100), "collisions_per_particle": 100.0, "equilibration": 20.0}
    study = kind(kind.Spec(packing_fraction=(0.1,), **given))
    assert study.first == "the first runs, of 6e+03 collisions at most"
