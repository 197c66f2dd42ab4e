"""All benchmarks in one table, on this machine and in one run.

python -m tests.benchmarks [--quick] [--json PATH] [--against COMMIT]
"""

from tests.benchmarks import environment, fmu, identification, plant
from tests.benchmarks.command_line import run
from tests.benchmarks.relief_valve import benchmark as relief_valve

if __name__ == "__main__":
    run(
        __doc__,
        environment.benchmark,
        plant.benchmark,
        relief_valve.benchmark,
        fmu.benchmark,
        identification.benchmark,
    )
