/* Does this compiler's code decide as the policy does? In the folder of the export:
 *
 *     cc -std=c99 -O2 parity.c epv_float.c epv_fixed.c -o parity && ./parity
 *
 * Exit status 0: on every state of states.csv the float code decides as the Python policy and the integer
 * code as it did where it was exported; and the float code's observations and logits are Python's but for
 * rounding, so that an error too small to turn one of these decisions is found too.
 */
#include <string.h>

#include "states.h"

static const float OBSERVATION_TOLERANCE = ${observation_tolerance}f;
static const float MARGIN_TOLERANCE = ${margin_tolerance}f;

static float larger(float worst, float error)
{
    return error > worst ? error : -error > worst ? -error : worst;
}

int main(void)
{
    int k, i, decided = 0, stepped = 0, repeated = 0, fixed = 0;
    float off = 0.0f, apart = 0.0f;
    epv_float_memory memory, given, copy; /* its own chain; Python's observations given */
    epv_fixed_memory fixed_memory;
    read_states("states.csv");
    for (k = 0; k < STATES; k++) {
        const state *s = &STATE[k];
        const epv_fixed_readings integers = in_integers(&s->readings);
        float observation[EPV_FLOAT_INPUTS], logits[2];
        int coil;
        if (k == 0 || s->episode != STATE[k - 1].episode) {
            memset(&memory, 0, sizeof memory);
            memset(&given, 0, sizeof given);
            memset(&fixed_memory, 0, sizeof fixed_memory);
        }
        epv_float_observe(&memory, &s->readings, observation);
        for (i = 0; i < EPV_FLOAT_INPUTS; i++)
            off = larger(off, observation[i] - s->observation[i]);
        copy = given;
        epv_float_logits(&copy, s->observation, logits);
        apart = larger(apart, logits[1] - logits[0] - s->margin);
        decided += epv_float_decide(&given, s->observation) == s->action;
        stepped += epv_float_decide(&memory, observation) == s->action;
        coil = epv_fixed_step(&fixed_memory, &integers);
        repeated += coil == s->fixed_action;
        fixed += coil == s->action;
    }
    printf("float: %d of %d decisions as the policy's, %d when it makes the observation itself\n",
           decided, STATES, stepped);
    printf("float: observations within %.2g of Python's (allowed %.2g), logits within %.2g (allowed %.2g)\n",
           off, OBSERVATION_TOLERANCE, apart, MARGIN_TOLERANCE);
    printf("fixed: %d of %d decisions as exported, %d as the policy's\n", repeated, STATES, fixed);
    return decided == STATES && repeated == STATES && off <= OBSERVATION_TOLERANCE
                   && apart <= MARGIN_TOLERANCE
               ? 0
               : 1;
}
