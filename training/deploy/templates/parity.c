/* Does this compiler's code decide as the policy does? In the folder of the export:
 *
 *     cc -std=c99 -O2 parity.c epv_policy.c -lm -o parity && ./parity
 *
 * Exit status 0: on the states of states.csv the code decides as the Python controller, but for at most
 * $allowed_decisions of $states where numbers meet a threshold within rounding; its observations are Python's
 * but for rounding, and so are the network's logits for Python's inputs.
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
    int k, i, agreed = 0;
    float off = 0.0f, apart = 0.0f;
    epv_policy_memory memory;
    read_states("states.csv");
    for (k = 0; k < STATES; k++) {
        const state *s = &STATE[k];
        epv_policy_memory copy;
        float inputs[EPV_POLICY_INPUTS], logits[2];
        if (k == 0 || s->episode != STATE[k - 1].episode)
            memset(&memory, 0, sizeof memory);
        copy = memory;
        epv_policy_observe(&copy, &s->readings, inputs);
        for (i = 0; i < EPV_POLICY_READINGS; i++)
            off = larger(off, inputs[i] - s->inputs[i]);
        epv_policy_logits(s->inputs, logits);
        apart = larger(apart, logits[1] - logits[0] - s->margin);
        agreed += epv_policy_step(&memory, &s->readings) == s->action;
    }
    printf("%d of %d decisions as the controller's\n", agreed, STATES);
    printf("observations within %.2g of Python's (allowed %.2g), logits within %.2g (allowed %.2g)\n",
           off, OBSERVATION_TOLERANCE, apart, MARGIN_TOLERANCE);
    return agreed >= STATES - $allowed_decisions && off <= OBSERVATION_TOLERANCE
                   && apart <= MARGIN_TOLERANCE
               ? 0
               : 1;
}
