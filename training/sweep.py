"""`python training/sweep.py`: the command `epv sweep`."""

import sys

from epv_env.common.commands import main_of

if __name__ == "__main__":
    sys.exit(main_of("training.commands.sweep", program="python training/sweep.py"))
