"""`python training/compare.py`: the command `epv compare`."""

import sys

from epv_env.common.commands import main_of

if __name__ == "__main__":
    sys.exit(main_of("training.commands.compare", program="python training/compare.py"))
