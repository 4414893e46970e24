"""The script for a shell names every verb and option that there is."""

import argparse
import os
import subprocess

import pytest

from navapp.cli.main import _parser, run

SHELLS = ("bash", "zsh", "fish")


def parsers(parser, verb=""):
    """Words of the verb -> parser, of all verbs."""
    yield verb, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, inner in action.choices.items():
                yield from parsers(inner, f"{verb} {name}".strip())


ALL = dict(parsers(_parser()))


def script_of(shell, capsys):
    assert run(["completion", shell]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("shell", SHELLS)
def test_every_verb_and_option_is_named(shell, capsys):
    script = script_of(shell, capsys)
    assert {"run", "calibrate stereo", "rig convert", "completion"} <= set(ALL)
    for verb, parser in ALL.items():
        assert verb.rpartition(" ")[2] in script
        for action in parser._actions:
            for option in action.option_strings:
                assert name_of(option, shell) in script, (verb, option)


def name_of(option, shell):
    """How a script writes an option."""
    if shell != "fish":
        return option
    return f"-l {option[2:]}" if option.startswith("--") else f"-s {option[1:]}"


def complete_in_bash(script, *words):
    """What bash offers for the last word."""
    asked = " ".join(f"'{word}'" for word in words)
    text = (
        f"{script}\nCOMP_WORDS=({asked}); COMP_CWORD={len(words) - 1}\n"
        '_shtab_navapp; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = subprocess.run(
        ["bash", "-c", text], capture_output=True, text=True, check=True, env=os.environ
    )
    return {word.strip() for word in done.stdout.splitlines()}


def test_bash_completes_verbs_options_and_choices(capsys):
    script = script_of("bash", capsys)
    assert complete_in_bash(script, "navapp", "re") == {"replay", "register"}
    assert "--headless" in complete_in_bash(script, "navapp", "run", "--he")
    assert complete_in_bash(script, "navapp", "calibrate", "st") == {"stereo"}
    assert complete_in_bash(script, "navapp", "run", "--pictures", "s") == {"sixel"}


def test_bash_completes_files_where_files_are_asked_for(capsys, tmp_path, monkeypatch):
    (tmp_path / "rig.yml").touch()
    monkeypatch.chdir(tmp_path)
    script = script_of("bash", capsys)
    assert "rig.yml" in complete_in_bash(script, "navapp", "run", "--rig", "ri")


def test_another_shell_is_refused(capsys):
    assert run(["completion", "csh"]) == 2
    assert "invalid choice: 'csh'" in capsys.readouterr().err
