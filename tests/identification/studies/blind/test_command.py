"""The command line's door."""

import argparse

import pytest

from identification.__main__ import main
from identification.commands import blind as command


def parsed(*arguments):
    parser = argparse.ArgumentParser()
    command.add_options(parser)
    return parser.parse_args(arguments)


def test_the_command_passes_what_is_chosen(monkeypatch, tmp_path):
    seen = {}

    def check(out, **chosen):
        seen.update(chosen, out=out)
        raise ValueError("stop here")

    monkeypatch.setattr(command, "blind_check", check)
    arguments = ["--out", str(tmp_path), "--trials", "3", "--seed", "5", "--workers", "2"]
    with pytest.raises(ValueError, match="stop here"):
        command.run(parsed(*arguments))
    assert seen == {
        "out": tmp_path, "trials": 3, "seed": 5, "workers": 2, "diagnosis": command.diagnose_campaign,
        "images": None,
    }  # fmt: skip


def test_no_trial_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["blind", "--out", str(tmp_path), "--trials", "0"])
    assert "--trials must be at least 1" in capsys.readouterr().err
