"""The README's sessions, run as they stand: every command works and prints what the README shows."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import click
import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
COMMANDS = ("beltconvert", "partconvert", "beltsim")


def sessions() -> list[tuple[str, list[str]]]:
    """Each command of the README's console blocks, with the lines printed below it."""
    found: list[tuple[str, list[str]]] = []
    for block in re.findall(r"```console\n(.*?)```", README, re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:].split("#")[0].strip(), []))
            elif line.strip():
                found[-1][1].append(line)
    return found


@pytest.mark.slow
def test_the_sessions_print_what_the_readme_shows(tmp_path):
    """In an empty folder that holds the samples; `make` is what calls this test."""
    shutil.copytree(ROOT / "samples", tmp_path / "samples")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    commands = [(command, lines) for command, lines in sessions() if not command.startswith("make ")]
    assert len(commands) >= 4
    for command, lines in commands:
        done = subprocess.run(
            command,
            shell=True,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env={**os.environ, "PATH": path},
        )
        assert done.returncode == 0, f"{command}\n{done.stderr}"
        printed = done.stdout + done.stderr
        for line in lines:
            assert line == "..." or line in printed, f"{command} did not print: {line}\nbut:\n{printed}"


def test_the_readme_names_only_files_that_are_there():
    links = re.findall(r"\]\(([^)#:]+)\)", README)
    assert len(links) > 5
    missing = [link for link in links if not (ROOT / link).exists()]
    assert not missing


def options_of(command: click.Command, context: click.Context):
    """All options of a command and of its subcommands, each with the command's name."""
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            yield from options_of(command.get_command(context, name), context)
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            yield command.name, parameter


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_help(name):
    module = {"beltsim": "beltsim", "beltconvert": "beltconverter", "partconvert": "partconverter"}[name]
    command = __import__(f"{module}.cli", fromlist=["main"]).main
    options = list(options_of(command, click.Context(command)))
    assert len(options) > 5
    assert not [f"{where} {option.opts[0]}" for where, option in options if not option.help]


@pytest.mark.parametrize("name", COMMANDS)
def test_help_imports_nothing_heavy(name):
    """numba alone takes 0.9 s to import; --help has to answer at once."""
    module = {"beltsim": "beltsim", "beltconvert": "beltconverter", "partconvert": "partconverter"}[name]
    script = (
        f"import sys\nfrom {module}.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "heavy = {'numba', 'h5py', 'scipy', 'trimesh', 'embreex', 'PIL', 'meshio'} & set(sys.modules)\n"
        "sys.exit(f'imported {sorted(heavy)}' if heavy else 0)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
