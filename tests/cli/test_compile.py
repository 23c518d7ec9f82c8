"""``carom compile``: afterwards a run of the same kind of scene compiles nothing."""

from typer.testing import CliRunner

from carom import cli


def test_a_run_after_it_compiles_nothing(tmp_path):
    scene = tmp_path / "gas.toml"
    scene.write_text("[scene]\nn = 200\ndimension = 2\npacking_fraction = 0.2\n")
    done = CliRunner().invoke(cli.app, ["compile", str(scene)])
    assert done.exit_code == 0
    assert done.stdout == "Compiled: gas.toml.\n"
    assert [path.name for path in tmp_path.iterdir()] == ["gas.toml"]
    small = ["--n", "100", "--collisions-per-particle", "5", "--frames", "2"]
    after = CliRunner().invoke(cli.app, ["run", str(scene), *small, "--out", str(tmp_path / "run")])
    assert after.exit_code == 0
    assert "new here" not in after.stderr
