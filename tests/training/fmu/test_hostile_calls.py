"""Calls that no importer should make of the plant's FMU, in any order, over many instances at once."""

import shutil
import subprocess

import pytest

from epv_env.plant.plantfile import Plant
from tests.training.exports import sanitisers
from training.deploy.compiled import build
from training.deploy.fmu.archive import fmu_sources
from training.deploy.fmu.models import plant_model

DRIVE = """
#include "fmi2.c"

enum { UNITS = 20 };
static unsigned draw(unsigned n)
{
    static unsigned long long seed = 1;
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (unsigned)(seed >> 33) % n;
}

static double odd(void)
{
    static const double values[] = {-0.0, -1.0, 1e-320, 1e-9, 24.0, 1e5, 1e155, -1e308, INFINITY, NAN};
    return values[draw(sizeof values / sizeof *values)];
}

/* A state of which bytes are changed, its checksum right again: refused, or as good as any. */
static int swapped(fmi2Component u, fmi2FMUstate *state)
{
    static char bytes[sizeof TOKEN + sizeof(snapshot) + sizeof(uint64_t)];
    const size_t size = component_serial_size();
    char *at = bytes + sizeof TOKEN - 1;
    const double value = odd();
    uint64_t sum;
    if (fmi2GetFMUstate(u, state) != fmi2OK || fmi2SerializeFMUstate(u, *state, bytes, size) != fmi2OK)
        return 0;
    if (draw(2))
        memcpy(at + 8 * draw(sizeof(snapshot) / 8), &value, 8);
    sum = checksum(at, sizeof(snapshot)), memcpy(at + sizeof(snapshot), &sum, sizeof sum);
    return fmi2DeSerializeFMUstate(u, bytes, size - (draw(20) == 0), state) == fmi2OK
           && fmi2SetFMUstate(u, *state) == fmi2OK;
}

/* A step of a unit that has begun; what it gives when it is done must be numbers. */
static int stepped(fmi2Component u)
{
    const instance *one = u;
    const double length = odd();
    unsigned i;
    double value;
    if (one->c.now.phase != RUNNING)
        fmi2Reset(u), fmi2SetupExperiment(u, 0, 0.0, draw(20) ? 0.0 : odd(), draw(20) == 0, odd()),
            fmi2EnterInitializationMode(u), fmi2ExitInitializationMode(u);
    value = draw(50) ? one->c.now.time : odd();
    if (fmi2DoStep(u, value, draw(4) || length == 24.0 ? 1e-4 : length, 1) != fmi2OK)
        return 0;
    for (i = 0; i < VARIABLES; i++)
        if (fmi2GetReal(u, &i, 1, &value) == fmi2OK && isnan(value))
            exit(1);
    return 1;
}

int main(void)
{
    static fmi2Component units[UNITS];
    fmi2FMUstate state = NULL;
    unsigned long k, done[2] = {0, 0}, states[2] = {0, 0};
    for (k = 0; k < CALLS; k++) {
        fmi2Component *u = &units[draw(UNITS)];
        double value = odd();
        unsigned ref = draw(100) ? draw(VARIABLES) : draw(3000000000u);
        if (*u == NULL)
            *u = fmi2Instantiate("unit", fmi2CoSimulation, TOKEN, NULL, NULL, 0, 0);
        switch (draw(16)) {
        case 0: fmi2Reset(*u); break;
        case 1: fmi2EnterInitializationMode(*u); break;
        case 2: fmi2ExitInitializationMode(*u); break;
        case 3: if (draw(10) == 0) fmi2Terminate(*u); break;
        case 4: if (draw(10) == 0) fmi2FreeInstance(*u), *u = NULL; break;
        case 5: states[swapped(*u, &state)]++; break;
        case 6: fmi2GetReal(*u, &ref, 1, &value); break;
        case 7: fmi2SetReal(*u, &ref, 1, &value); break;
        case 8: ref = 0, value = 24.0 * draw(2), fmi2SetReal(*u, &ref, 1, &value); break;
        default: done[stepped(*u)]++;
        }
    }
    for (k = 0; k < UNITS; k++)
        fmi2FreeInstance(units[k]);
    fmi2FreeFMUstate(NULL, &state);
    printf("%lu %lu %lu %lu\\n", done[0], done[1], states[0], states[1]);
    return 0;
}
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here")
@pytest.mark.parametrize("calls", [10_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_hostile_calls_stay_within_memory_and_numbers(calls, tmp_path):
    for name, text in fmu_sources(plant_model(Plant.calibrated())).items():
        limit = "MOST_STEPS = 2000000"  # a stiff one would take seconds until it is given up
        (tmp_path / name).write_text(text.replace(limit, "MOST_STEPS = 2000"))
    (tmp_path / "drive.c").write_text(DRIVE)
    options = (*sanitisers(tmp_path), "-O1", f"-DCALLS={calls}u")
    program = build(["cc"], tmp_path, *options, "drive.c", "-lm", output="drive")
    done = subprocess.run([program], capture_output=True, text=True, timeout=3600, check=False)
    assert done.returncode == 0, done.stderr
    assert min(map(int, done.stdout.split())) > calls / 1000
