"""What the three commands have in common: inputs that cannot be read, quantities with units."""

import click
import pytest
from click.testing import CliRunner

import beltconverter.cli
import beltsim.cli
import partconverter.cli
from beltsim.console import Quantity

COMMANDS = {
    "beltsim run": (beltsim.cli.main, ["run"], ["-q"]),
    "beltsim view": (beltsim.cli.main, ["view"], ["-o", "picture.png"]),
    "beltconvert": (beltconverter.cli.main, [], []),
    "partconvert": (partconverter.cli.main, [], []),
}


def call(name, *inputs):
    command, first, last = COMMANDS[name]
    return CliRunner().invoke(command, [*first, *inputs, *last])


@pytest.mark.parametrize("name", COMMANDS)
def test_an_input_that_is_not_there_or_is_a_folder_is_invalid_input_for_every_command(
    name, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.inp").mkdir()
    for given in ("missing.inp", "folder.inp"):
        result = call(name, given)
        assert result.exit_code == 3
        assert result.stderr.startswith(f"{given}: ")
        assert "Traceback" not in result.stderr
    assert not (tmp_path / "picture.png").exists()


def test_the_end_of_a_run_takes_a_unit():
    kind = Quantity("time")
    assert kind.convert("2", None, None) == 2.0
    assert kind.convert("0.5 min", None, None) == 30.0
    for wrong in ("2 h", "-1", "0", "soon"):
        with pytest.raises(click.BadParameter):
            kind.convert(wrong, None, None)
    assert CliRunner().invoke(beltsim.cli.main, ["run", "case.inp", "--until", "2 h"]).exit_code == 2
