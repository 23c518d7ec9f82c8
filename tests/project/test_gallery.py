"""The gallery of the pages runs examples, keeps what they made, and stops where one fails."""

import colorsys
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_extensions"))
from example_groups import GROUPS, IMAGES, SUFFIXES, THUMBNAILS, own_pictures
from execution import AT_FULL_SIZE, package_digest, result_of
from pictures import Failed, darkened
from thumbnails import PARTS, SIZE, bold, thumbnail

SCRIPT = '''"""Count the runs, and draw one point."""
import sys
from pathlib import Path

out = Path(sys.argv[sys.argv.index("--out") + 1])
out.mkdir()
runs = Path(COUNTER)
runs.write_text(runs.read_text() + "x")
from PIL import Image

Image.new("RGB", (1, 1)).save(out / "point.png")
Image.new("P", (1, 1)).save(out / "point.gif")
out.joinpath("table.csv").write_text("1,2")
print("--smoke" in sys.argv, out)
'''


@pytest.fixture
def script(tmp_path):
    tmp_path.joinpath("runs").write_text("")
    path = tmp_path / "a_point.py"
    path.write_text(SCRIPT.replace("COUNTER", repr(str(tmp_path / "runs"))))
    return path


def test_an_example_runs_once_until_it_or_carom_changes(script, tmp_path):
    kept, runs = tmp_path / "kept", script.parent / "runs"
    first = result_of(script, "one Carom", kept)
    assert [path.name for path in first.pictures] == ["a-point-point.gif", "a-point-point.png"]
    assert first.printed == "True results\n"
    assert result_of(script, "one Carom", kept) == first
    assert runs.read_text() == "x"
    second = result_of(script, "another Carom", kept)
    assert runs.read_text() == "xx"
    script.write_text(script.read_text() + "\n# changed\n")
    third = result_of(script, "another Carom", kept)
    assert runs.read_text() == "xxx"
    assert second.pictures != third.pictures
    assert len(list(kept.iterdir())) == 1, "results of what was before are kept no longer"


def test_a_rendered_example_runs_once_for_each_theme(script, tmp_path):
    ground = 'plt.rcParams["figure.facecolor"]'
    script = script.rename(script.with_name("crystal.py"))
    script.write_text(f"{script.read_text()}\nimport matplotlib.pyplot as plt\nprint({ground})\n")
    made = result_of(script, "one Carom", tmp_path / "kept")
    names = {f"crystal-point{ending}" for ending in (".gif", ".png", "-dark.png")}
    assert {path.name for path in made.pictures} == names
    assert made.printed.endswith("white\n")


def test_an_example_that_fails_leaves_nothing_that_looks_like_a_result(script, tmp_path):
    script.write_text(script.read_text() + "\nraise ValueError('on purpose')\n")
    for _ in range(2):
        with pytest.raises(Failed, match="on purpose"):
            result_of(script, "one Carom", tmp_path / "kept")
    assert script.parent.joinpath("runs").read_text() == "xx"


def test_the_digest_of_the_package_is_the_same_in_every_build():
    assert package_digest() == package_digest()


def test_examples_that_run_at_full_size_exist():
    examples = {path.stem for path in Path(__file__).parents[2].joinpath("examples").glob("*.py")}
    assert examples >= AT_FULL_SIZE


def test_every_example_has_a_place_a_title_and_a_picture():
    examples = sorted(path.stem for path in Path(__file__).parents[2].joinpath("examples").glob("*.py"))
    assert sorted(name for titles in GROUPS.values() for name in titles) == examples
    titles = [title for group in GROUPS.values() for title in group.values()]
    assert len(set(titles)) == len(titles)
    without = {name for name in examples if not own_pictures(name)}
    assert without == set(GROUPS["Recipes"])


def test_every_picture_has_a_dark_ground_in_the_dark_theme():
    images = {path for path in IMAGES.rglob("*") if path.suffix in SUFFIXES}
    dark = {path for path in images if path.stem.endswith("-dark")}
    for path in images - dark:
        own = path.with_name(f"{path.stem}-dark.png")
        shown = np.asarray(Image.open(own if own in dark else path).convert("L"))
        assert (shown > 230).mean() < 0.2, f"{path.name} is a white card"
        dark.discard(own)
    assert dark == set(), "dark pictures that no page shows"


def test_a_dark_figure_keeps_its_hues():
    paper = Image.new("RGB", (4, 1), "white")
    for k, ink in enumerate([(0, 0, 0), (192, 57, 43), (31, 78, 121)]):
        paper.putpixel((k + 1, 0), ink)
    ground, *inks = (darkened(paper).getpixel((k, 0)) for k in range(4))
    assert max(ground) < 30
    assert min(inks[0]) > 200, "black is light"
    for k, ink in enumerate(inks[1:]):
        before = colorsys.rgb_to_hls(*(part / 255 for part in paper.getpixel((k + 2, 0))))
        after = colorsys.rgb_to_hls(*(part / 255 for part in ink))
        assert abs(after[0] - before[0]) < 0.02, "a hue is another"
        assert after[1] > 0.45, "ink is hard to see"


def test_every_card_has_a_thumbnail_of_a_stored_picture_unless_its_picture_moves():
    first = {name: own_pictures(name)[:1] for titles in GROUPS.values() for name in titles}
    assert set(PARTS) == {name for name, found in first.items() if found and found[0].suffix != ".gif"}
    for name, part in PARTS.items():
        assert part.picture in {path.stem for path in own_pictures(name)}
        width, height = Image.open(IMAGES / f"{part.picture}.png").size
        assert part.box[2] <= width, name
        assert part.box[3] <= height, name
        assert Image.open(THUMBNAILS / f"{name.replace('_', '-')}.png").size == SIZE


def test_type_and_lines_of_a_thumbnail_show_when_it_is_a_card():
    shown = np.asarray(thumbnail(PARTS["haffs_law"]).resize((240, 150)).convert("L"))
    letters = np.flatnonzero((shown[-22:, 60:200] < 128).any(axis=1))
    assert letters[-1] - letters[0] >= 7, "a letter is lower than seven pixels"
    line = np.full((5, 5, 3), 255, np.uint8)
    line[2] = (0, 0, 200)
    line[2, 2] = (200, 0, 0)
    thick = bold(line)
    assert (thick[:, 0] < 255).any(axis=1).sum() == 3
    assert {tuple(pixel) for pixel in thick.reshape(-1, 3).tolist()} == {(255,) * 3, (0, 0, 200), (200, 0, 0)}
