"""`python training/train_ppo.py`: the command `epv train`."""

import sys

from epv_env.common.commands import main_of

if __name__ == "__main__":
    sys.exit(main_of("training.commands.train", program="python training/train_ppo.py"))
