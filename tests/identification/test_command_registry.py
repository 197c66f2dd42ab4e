"""Every command is complete and registered; what a new one lacks is named."""

import argparse
from dataclasses import replace
from pathlib import Path

import pytest

import identification.commands
from identification.__main__ import parse
from identification.commands.command import Command
from identification.commands.registry import COMMANDS

FOLDER = Path(identification.commands.__file__).parent
SHARED = {"__init__", "command", "registry", "options", "campaign_options"}
"""Files of the folder that define no command."""


def parser_of(command):
    parser = argparse.ArgumentParser()
    command.add_options(parser)
    return parser


def lacking(command):
    """What an entry of the registry lacks, a sentence each."""
    actions = parser_of(command)._actions
    sentences = [
        f"command {command.name!r} has no {field}: give one sentence"
        for field in ("name", "help", "run")
        if not getattr(command, field)
    ]
    if not any("--out" in action.option_strings for action in actions):
        sentences.append(f"command {command.name!r} has no --out: call options.add_out")
    sentences += [
        f"command {command.name!r}: option {action.dest} has no help: say what it sets"
        for action in actions
        if not action.help
    ]
    if command.guide and not (FOLDER.parents[1] / command.guide).exists():
        sentences.append(f"command {command.name!r}: the page {command.guide} does not exist")
    return sentences


def unregistered(folder, commands):
    """Files of the folder that define no registered command, a sentence each."""
    owners = {command.run.__module__.rpartition(".")[2] for command in commands}
    return [
        f"{name}.py has no command in the registry: add its Command to registry.COMMANDS"
        for name in sorted({path.stem for path in folder.glob("*.py")} - SHARED - owners)
    ]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_a_command_is_complete(command):
    assert lacking(command) == []


def test_every_file_of_the_folder_has_a_registered_command():
    assert unregistered(FOLDER, COMMANDS) == []


def test_names_are_given_once():
    names = [command.name for command in COMMANDS]
    assert len(set(names)) == len(names)


def test_what_a_new_command_lacks_is_named(tmp_path):
    bare = replace(COMMANDS[0], help="", add_options=lambda parser: None, guide="docs/none.md")
    named = lacking(bare)
    assert any("has no help" in sentence for sentence in named)
    assert any("has no --out" in sentence for sentence in named)
    assert any("docs/none.md does not exist" in sentence for sentence in named)
    (tmp_path / "export.py").touch()
    assert unregistered(tmp_path, COMMANDS) == [
        "export.py has no command in the registry: add its Command to registry.COMMANDS"
    ]


def test_a_forgotten_field_is_named():
    with pytest.raises(TypeError, match="'add_options' and 'run'"):
        Command(name="export", help="write the plant in another form")  # type: ignore[call-arg]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_the_help_of_a_command_is_printed(command, capsys):
    with pytest.raises(SystemExit) as end:
        parse([command.name, "--help"])
    assert end.value.code == 0
    assert command.help in " ".join(capsys.readouterr().out.split())


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_counts_and_seeds_are_checked_where_the_options_stand(command, capsys):
    for action in parser_of(command)._actions:
        if action.dest in ("starts", "campaigns", "trials", "workers", "seed"):
            with pytest.raises(SystemExit):
                parser_of(command).parse_args([action.option_strings[0], "-1"])
            assert f"{action.option_strings[0]} must" in capsys.readouterr().err
