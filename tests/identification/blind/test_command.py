"""The command line's door."""

import argparse

import pytest

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

    monkeypatch.setattr(command, "blind_scores", check)
    arguments = ["--out", str(tmp_path), "--trials", "3", "--seed", "5", "--workers", "2"]
    with pytest.raises(ValueError, match="stop here"):
        command.run(parsed(*arguments, "--forms", "strong"))
    assert seen == {
        "out": tmp_path, "trials": 3, "seed": 5, "workers": 2, "diagnosis": command.diagnose_campaign,
        "forms": "strong",
    }  # fmt: skip


@pytest.mark.parametrize("wrong", [["--trials", "0"], ["--forms", "weak"]])
def test_a_wrong_option_is_refused(tmp_path, wrong):
    with pytest.raises(SystemExit):
        parsed("--out", str(tmp_path), *wrong)
