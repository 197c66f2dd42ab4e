"""Readings that no sensor can give: the code stays within its arrays, its memory stays numbers, and it
decides as Python does."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from controllers.policy import TRAINED, load_policy
from controllers.sensor_check import HELD
from epv_env.observation import CENTRE, INDEX, LIMIT, P2_LAGS, P3_LAGS, SCALE, decode, scaled
from epv_env.plant.channels import CURRENT, P1, P2, P3
from epv_env.plant.plantfile import load_plant
from tests.training.exports import GOOD, sanitisers
from training.commands.export import prepared
from training.deploy.agreement import follow, visit
from training.deploy.c_code import sources
from training.deploy.compiled import CompiledPolicy, build, library

pytestmark = [
    pytest.mark.training,
    pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler (cc) here"),
]

DRIVE = """
#include <math.h>
#include <stdio.h>
#include "epv_policy.h"

static unsigned long long seed = 1;
static unsigned draw(unsigned n)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (unsigned)(seed >> 33) % n;
}

/* A crude valve under the code. Once in 100 periods channels fail, for one period or up to a minute. */
int main(void)
{
    static const float odd[] = {0.0f, -0.0f, -1.0f, 0.7403f, 16.2596f, 17.0f, 1e38f, -1e38f, 1e-42f,
                                INFINITY, -INFINITY, NAN, (float)1e308, 1.0f, 16.0f};
    static const unsigned lengths[] = {1, 2, HELD, HELD + 1, 40, 12000};
    static epv_policy_memory fresh;
    epv_policy_memory m = fresh;
    unsigned long decisions[2] = {0, 0}, failures = 0, blind = 0, again = 0;
    unsigned left = 0, mask = 0, kind = 0, gone = 0, k;
    float p2 = 7.6f, p3 = 12.0f;
    int coil = 1;
    for (k = 0; k < READINGS; k++) {
        float now[5];
        epv_policy_readings given;
        const float *learnt = (const float *)&m.valve;
        unsigned i;
        int lost = 0;
        p3 = coil ? p3 + (12.0f - p3) * 0.3f : p3 * 0.93f;
        p2 = fmaxf(fminf(p2 + (p3 < 6.0f ? 0.06f : 0.0f) - 0.005f, 12.0f), 1.0f);
        now[0] = 12.0f + 0.01f * draw(10), now[1] = p2 + 0.01f * draw(5);
        now[2] = p3 + 0.005f * draw(5), now[3] = coil ? 0.5f : 0.0f, now[4] = 8.0f;
        if (left == 0 && draw(100) == 0) {
            left = lengths[draw(100) ? draw(5) : 5], mask = draw(4) ? 1u << draw(5) : 1 + draw(31);
            kind = draw(sizeof odd / sizeof *odd), failures++;
        }
        for (i = 0; i < 5 && left; i++)
            if (mask >> i & 1)
                now[i] = odd[kind];
        left -= left > 0;
        given.p1 = now[0], given.p2 = now[1], given.p3 = now[2];
        given.current = now[3], given.target = now[4], given.coil = (uint8_t)coil;
        coil = epv_policy_step(&m, &given);
        lost = !(now[1] > 0.74f && now[1] < 16.26f && now[4] > 0.74f && now[4] < 16.26f);
        gone = lost ? gone + 1 : 0;
        if (coil != 0 && coil != 1)
            return 1;
        if (gone > HELD && coil != 1)
            return 2; /* without p2 or a target it must shut */
        blind += gone > HELD;
        for (i = 0; i < sizeof m.valve / sizeof *learnt; i++)
            if (!isfinite(learnt[i]))
                return 3;
        decisions[coil]++;
        if (AGE && k % 10000 == 1000) { /* as after a day, when singles no longer count by ones */
            m.senses.periods = m.senses.whole = AGE;
            *(coil ? &m.valve.on_periods : &m.valve.off_periods) = AGE;
        }
        if (m.senses.failed && left == 0 && draw(200) == 0)
            m = fresh, again++;
    }
    printf("%lu %lu %lu %lu %lu\\n", decisions[0], decisions[1], failures, blind, again);
    return 0;
}
"""


RANDOM = """
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "epv_policy.h"

static unsigned long long seed = 1;
static float between(float low, float high)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (float)((seed >> 33) / 2147483648.0);
}

/* Random readings in a row, p1 and p3 as a valve allows, each lost once in 50; what must hold after
 * each decision. */
int main(void)
{
    static epv_policy_memory fresh;
    epv_policy_memory m = fresh, other;
    unsigned long k, above = 0, below = 0, lost = 0;
    float p1 = 0, p3 = 0;
    for (k = 0; k < READINGS; k++) {
        epv_policy_readings now, held;
        float *const given[] = {&now.p1, &now.p2, &now.p3, &now.current, &now.target};
        float *const good[] = {&held.p1, &held.p2, &held.p3, &held.current, &held.target};
        int i, gone = 0, coil, error_lost;
        float error;
        if (k % 20 == 0)
            m = fresh, p1 = between(6, 15.5f), p3 = p1;
        p3 = fmaxf(fminf(p3 + between(-0.5f, 0.5f), p1), 1);
        now.p1 = p1 + between(-0.2f, 0.2f), now.p2 = between(1, 16), now.current = between(-1, 1);
        now.p3 = p3;
        now.target = now.p2 + between(-2, 2), now.coil = between(0, 1) < 0.5f;
        held = now;
        for (i = 0; i < 5; i++)
            if (between(0, 50) < 1) {
                const float odd[] = {NAN, INFINITY, -INFINITY, -9.0f, 17.0f};
                *given[i] = odd[(int)between(0, 5)], gone |= 1 << i;
                *good[i] = m.senses.last[i];
                if (i == 1 || i == 4)
                    held.p2 = m.senses.last[1];
            } else if (!(*given[i] > (i == 3 ? -1.0f : 1.0f) && *given[i] < (i == 3 ? 1.0f : 16.0f)))
                gone |= 32; /* near an end: not judged */
        other = m;
        coil = epv_policy_step(&m, &now);
        error_lost = gone & 2 || gone & 16;
        error = now.p2 - now.target;
        if (gone & 32)
            continue;
        if (!error_lost && error >= 0.5f && ++above && !coil)
            return 1;
        if (!gone && error <= -0.5f && now.coil && now.p1 - now.p2 > 1.001f &&
            now.p1 - now.p3 < 0.499f && m.senses.failed == 0 && m.senses.whole > 0 &&
            !(m.valve.after_period_early > 0)) {
            below++;
            if (coil)
                return 2;
        }
        if (gone && other.senses.begun > 0 && m.senses.failed == 0) { /* by the last good ones */
            lost++;
            epv_policy_step(&other, &held);
            if (m.senses.fallback != other.senses.fallback)
                return 3;
            if (m.senses.last[1] - m.senses.last[4] < 0.499f && coil != (int)m.senses.fallback)
                return 4;
        }
    }
    printf("%lu %lu %lu\\n", above, below, lost);
    return 0;
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The C files of the package's policy."""
    made = tmp_path_factory.mktemp("hostile")
    for name, text in sources(prepared(TRAINED, load_plant(None))).items():
        (made / name).write_text(text)
    return made


@pytest.mark.parametrize(
    ("readings", "age"), [(400_000, 0), pytest.param(1_000_000, 2**24, marks=pytest.mark.slow)]
)
def test_hostile_readings_stay_within_arrays_and_numbers(folder, readings, age):
    (folder / "drive.c").write_text(DRIVE)
    defined = (f"-DHELD={HELD}", f"-DREADINGS={readings}u", f"-DAGE={age}")
    program = build(
        ["cc"], folder, *sanitisers(folder), *defined, "drive.c", "epv_policy.c", "-lm", output="drive"
    )
    done = subprocess.run([program], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    off, on, failures, blind, again = map(int, done.stdout.split())
    assert off + on == readings
    assert min(off, on) > readings / 20  # both decisions were taken
    assert min(failures, blind, again) > 100


def test_no_reading_opens_above_the_band_nor_keeps_shut_below_it_nor_a_lost_one_anything(folder):
    (folder / "random.c").write_text(RANDOM)
    readings = 1_000_000
    program = build(
        ["cc"], folder, f"-DREADINGS={readings}u", "random.c", "epv_policy.c", "-lm", output="random"
    )
    done = subprocess.run([program], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert min(map(int, done.stdout.split())) > readings / 1000


def damaged(observations, rng):
    """Observations (episodes, periods, entries), in each episode two failures of some channels."""
    wide = observations.astype(float)
    rails = [each.sensor.constants()[3:] for each in (P1, P2, P3, CURRENT)]
    p1, error, p3, current, target = (decode(wide, n) for n in ("p1", "p2_error", "p3", "I", "target"))
    read = [p1, error + target, p3, current, target]
    with np.errstate(all="ignore"):
        for episode in range(len(wide)):
            for begins in rng.integers(1, wide.shape[1] - 50, 2):
                lasts = rng.choice([1, 2, HELD, HELD + 1, 40])
                channels = rng.permutation(5)[: rng.choice([1, 1, 3, 5])]
                for channel in channels:
                    odd = [0.0, np.nan, np.inf, -np.inf, 1e308, 1e-42, *rails[channel % 4]]
                    read[channel][episode, begins : begins + lasts] = rng.choice(odd)
        p1, p2, p3, current, target = read
        values = {"p1": p1, "p2_error": p2 - target, "p3": p3, "I": current, "target": target}
        for name, lags, ring in (("p2", P2_LAGS, p2), ("p3", P3_LAGS, p3)):
            for lag in lags:
                before = np.concatenate([np.repeat(ring[:, :1], lag, axis=1), ring[:, :-lag]], axis=1)
                values[f"{name}_change_{lag}"] = ring - before
        for name, value in values.items():
            i = INDEX[name]
            wide[..., i] = scaled(value, CENTRE[i], SCALE[i], LIMIT[i])
    return wide.astype(np.float32)


def test_python_and_c_decide_alike_on_lost_readings(folder, tmp_path):
    code = library(["cc"], folder)
    along = visit(GOOD, first_seed=5, episodes=60, periods=150)
    states = replace(along, observations=damaged(along.observations, np.random.default_rng(0)))
    controller = load_policy()
    wanted = follow(controller, states)
    assert 0.1 < np.mean(controller.failed) < 0.9
    assert 0.05 < np.mean(wanted) < 0.95
    assert np.mean(follow(CompiledPolicy(code=code), states) == wanted) >= 0.999
