"""What a command cannot use is refused in one sentence, and nothing is written."""

import shlex

import pytest

pytest.importorskip("stable_baselines3")
from epv_env.common.commands import main
from training.epv import PACKAGES

pytestmark = pytest.mark.training
REFUSED = [
    ("bench --set R=abc", "give SYMBOL=VALUE with a number"),
    ("bench --set R", "give SYMBOL=VALUE with a number"),
    ("bench --set Q=3", "unknown parameter 'Q'"),
    ("bench --set R=1", "outside its domain"),
    ("bench --effect gremlins=1", "unknown effect; known are"),
    ("bench --effect local_gas_speed=0.1", "sized by a1, a2"),
    ("bench --effect circuit_leak=x", "--effect circuit_leak=x: give NAME=SIZE with a"),
    ("bench --effect circuit_leak=1", "outside its domain"),
    ("bench --rate 100", "sampling rate 100"),
    ("bench --plant /no/plant.json", "cannot read plant file"),
    ("bench --suite none", "argument --suite: invalid choice: 'none'"),
    ("run /no/campaign", "cannot read"),
    ("run campaign --stage none", "argument --stage: invalid choice: 'none'"),
    ("gap campaign --controller PPO", "--controller is of `epv gap LOGS --logs`"),
    ("train --quick --scenario flood", "unknown consumption scenario 'flood'"),
    ("train --quick --plant nowhere.json", "cannot read plant file nowhere.json"),
    ("train --quick --parameters diagnosis", "has no alternatives to draw from"),
    ("train --quick --timesteps 0", "--timesteps"),
    ("train --quick --switching-price -1", "must be a number from 0 to 1000"),
    ("train --quick --resume", "nothing to resume"),
    ("compare --controllers nobody", "no controller 'nobody': give PPO, hysteresis"),
    ("compare --scenarios flood", "no scenario 'flood'"),
    ("compare --against nobody", "--against 'nobody' takes no part"),
    ("compare --plant nowhere.json", "cannot read plant file nowhere.json"),
    ("compare --seed 999999 --episodes 8", "give one up to 999992"),
    ("compare --device cuda", "needs an NVIDIA accelerator"),
    ("sweep --factors luck", "no factor 'luck' in the designs"),
    ("sweep --scenario flood", "unknown consumption scenario 'flood'"),
    ("sweep --device cuda", "needs an NVIDIA accelerator"),
    ("log --controller PWM", "'PWM' cannot have written a log"),
    ("log --controller 'informed pulse'", "'informed pulse' cannot have written a log"),
    ("log --effect gremlins", "unknown effect; known are"),
    ("log --drives 2 --effect command_delay --from-drive 3", "--from-drive 3 comes after the last of 2"),
    ("log --scenario flood", "unknown consumption scenario 'flood'"),
    ("watch nobody", "no controller 'nobody': give PPO, hysteresis, "),
    ("watch 'pulse, informed'", "no controller 'pulse, informed': give PPO, hysteresis, "),
    ("watch --file film.mp4", "film.mp4: films are animated GIFs: give a name in .gif"),
    ("export plant --plant missing.json", "cannot read plant file missing.json"),
    ("export missing", "cannot read a policy from missing"),
    ("sim-to-real --quick --effect gremlins=3", "unknown effect"),
]


@pytest.mark.parametrize(("line", "words"), REFUSED)
def test_wrong_input_gets_one_sentence_and_leaves_nothing(line, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    out = [] if line.startswith("watch") else ["--out", "out"]
    try:
        status = main(PACKAGES, program="epv", arguments=[*shlex.split(line), *out])
    except SystemExit as refusal:  # argparse's, after the usage
        status = refusal.code
    assert status == 2
    assert words in capsys.readouterr().err.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []
