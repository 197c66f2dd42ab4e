"""The public benchmark of a pressure relief valve with impacts: accuracy first, then speed.

python -m tests.benchmarks.relief_valve [--quick] [--json PATH]
"""

from tests.benchmarks.command_line import run
from tests.benchmarks.relief_valve.benchmark import benchmark

if __name__ == "__main__":
    run(__doc__, benchmark)
