"""All benchmarks in one table, on this machine and in one run.

python -m tests.benchmarks [--quick] [--json PATH] [--against COMMIT]
"""

from tests.benchmarks import environment, fmu, identification, plant
from tests.benchmarks.command_line import run

if __name__ == "__main__":
    run(__doc__, environment.benchmark, plant.benchmark, fmu.benchmark, identification.benchmark)
