"""The next study, of what `own` gives: g(r) at contact against density."""

from dataclasses import dataclass
from typing import Annotated

import pytest

import carom
from carom import theory
from carom.studies import own
from carom.studies.info import info


@dataclass(frozen=True)
class ContactSpec(own.Spec):
    study = "contact value"
    about = "Measure g(r) at contact against the packing fraction."
    grid = ("packing_fraction",)

    packing_fraction: Annotated[
        tuple[float, ...], own.several(own.number(low=0.0, high=0.49, open_low=True)),
        own.Opt("Packing fractions.", read=own.numbers_of("--packing-fraction")),
    ] = (0.1, 0.2, 0.3)  # fmt: skip
    time: Annotated[float, own.number(low=0.0, open_low=True), own.Opt("Measured time.")] = 10.0
    seed: Annotated[int, own.integer(low=0), own.Opt("Seed of all random numbers.")] = 1

    def tasks(self):
        shared = {**self.settings(), "time": self.time}
        return [{**shared, "packing_fraction": each} for each in self.packing_fraction]


def measure(task, look):
    scene = carom.Scene.crystal(32, task["packing_fraction"])
    sim = carom.Simulation(scene, seed=task["seed"])
    sim.run(time=task["time"], progress=look)
    found = sim.measure(carom.Pressure(), time=task["time"], blocks=32).contact_value
    return {"g": [found.mean, found.error]}


@dataclass(frozen=True)
class Row:
    packing_fraction: Annotated[float, own.Column("η", "g")]
    g: Annotated[float, own.Column("g(σ+)", own.error("g_error", told=True))]
    g_error: float
    theory: Annotated[float, own.Column("theory", ".4f")]
    deviation: Annotated[float, own.Column("dev.", "+.1f")]


def row(eta, g, error):
    known = float(theory.contact_value(theory.best(3)(eta), eta, 3))
    return Row(eta, g, error, known, (g - known) / error)


@dataclass(frozen=True, repr=False)
class Contacts(own.Study[ContactSpec]):
    Spec = ContactSpec
    name = "contact"
    axes = "packing_fraction", "g"
    measure = staticmethod(measure)

    @property
    def table(self):
        rows = [row(each["task"]["packing_fraction"], *each["result"]["g"]) for each in self.records]
        return own.Table(Row, rows, flagged=lambda each: abs(each.deviation) > 5.0)


@dataclass
class InTwoParts(own.Job):
    parts: int = 0

    @classmethod
    def begin(cls, task):
        return cls(task, carom.Simulation(carom.Scene.crystal(32, 0.3), seed=1))

    def step(self, look):
        if self.parts and not hasattr(look, "again"):
            raise RuntimeError("the machine was switched off")
        self.sim.run(time=0.5)
        self.parts += 1
        return self.parts < 2

    def result(self):
        return {"g": [self.sim.time, 1.0]}


@dataclass(frozen=True, repr=False)
class Long(Contacts):
    measure = InTwoParts.measure


def test_a_long_task_goes_on_where_it_kept_its_state(plain, tmp_path, monkeypatch):
    monkeypatch.setattr("carom.studies.job.EVERY", 0.0)
    monkeypatch.setattr("carom.studies.job.PART", 0.0)
    study = Long(ContactSpec(packing_fraction=(0.3,)))
    with pytest.warns(carom.CaromWarning, match="switched off"):
        study.run(executor="serial", out=tmp_path)
    assert len(list(tmp_path.glob("tasks/*.h5"))) == 1
    monkeypatch.setattr(own.Look, "again", True, raising=False)
    assert study.run(executor="serial", out=tmp_path).records[0]["result"]["g"][0] == 1.0
    assert not list(tmp_path.glob("tasks/*.h5"))


@pytest.mark.filterwarnings("ignore::carom.CaromWarning")
def test_a_study_in_sixty_lines_has_folder_resume_table_picture_and_page(plain, tmp_path):
    first = Contacts(ContactSpec(packing_fraction=(0.1,), time=1.0)).run(executor="serial", out=tmp_path)
    remnant = tmp_path / ".contact.1.tmp.csv"
    remnant.touch()
    both = Contacts(ContactSpec(packing_fraction=(0.1, 0.3), time=1.0))
    study = both.run(executor="serial", out=tmp_path)
    assert study.records[0] == first.records[0]  # it did not run again
    assert not remnant.exists()
    # The box of 32 lowers g by a few percent, within the error of so short a run.
    assert all(abs(each.deviation) < 5.0 for each in study.table)
    assert study.table[1].g > study.table[0].g
    study.save(tmp_path / "contact.csv")
    study.save(tmp_path / "contact.png")
    study.report(tmp_path / "report.html")
    assert "data:image/svg" in (tmp_path / "report.html").read_text()
    assert carom.load(tmp_path).records == study.records == carom.resume(tmp_path).records
    assert info(tmp_path).state == "finished"
