"""The command line's door."""

import argparse

import pytest

from identification.__main__ import main
from identification.commands import blind as command
from identification.report.page import Section
from identification.studies.blind.settings import DEFAULTS, STRONG


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
    arguments += ["--forms", "strong"]
    with pytest.raises(ValueError, match="stop here"):
        command.run(parsed(*arguments))
    assert seen == {
        "out": tmp_path, "trials": 3, "seed": 5, "workers": 2, "diagnosis": command.diagnose_campaign,
        "images": None, "settings": STRONG,
    }  # fmt: skip


def test_no_trial_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["blind", "--out", str(tmp_path), "--trials", "0"])
    assert "--trials must be from 1" in capsys.readouterr().err


def test_disturbances_are_passed_one_after_another(monkeypatch, tmp_path, capsys):
    seen = []

    def check(out, disturbance, **chosen):
        seen.append((out, disturbance, chosen["trials"], chosen["seed"], chosen["settings"]))
        return Section(title=f"under {disturbance}", verdicts=[], blocks=[])

    monkeypatch.setattr(command, "robustness_check", check)
    arguments = ["--out", str(tmp_path), "--trials", "60", "--seed", "5"]
    command.run(parsed(*arguments, "--disturb", "ripple", "--disturb", "sigma=3"))
    assert seen == [(tmp_path, name, 60, 5, DEFAULTS) for name in ("ripple", "sigma=3")]
    assert f"{tmp_path}/robustness-sigma=3.json" in capsys.readouterr().out


def test_an_unknown_disturbance_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        parsed("--out", str(tmp_path), "--disturb", "storm")
    assert "choose from" in capsys.readouterr().err


def test_forms_are_usual_or_strong(tmp_path, capsys):
    assert parsed("--out", str(tmp_path)).forms == "usual"
    with pytest.raises(SystemExit):
        parsed("--out", str(tmp_path), "--forms", "weak")
    assert "choose from" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        parsed("--help")
    assert "strong 20 to 50 %" in " ".join(capsys.readouterr().out.split())
