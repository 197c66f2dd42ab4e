/* Does this compiler's code decide as the policy does? In the folder of the export:
 *
 *     cc -std=c99 -O2 parity.c epv_policy.c -o parity && ./parity
 *
 * Exit status 0: on every state of states.csv the code decides as the Python policy, and its observations and
 * logits are Python's but for rounding, so that an error too small to turn a decision is found too.
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
    int k, i, decided = 0, stepped = 0;
    float off = 0.0f, apart = 0.0f;
    epv_policy_memory memory;
    read_states("states.csv");
    for (k = 0; k < STATES; k++) {
        const state *s = &STATE[k];
        float observation[EPV_POLICY_INPUTS], logits[2];
        if (k == 0 || s->episode != STATE[k - 1].episode)
            memset(&memory, 0, sizeof memory);
        epv_policy_observe(&memory, &s->readings, observation);
        for (i = 0; i < EPV_POLICY_INPUTS; i++)
            off = larger(off, observation[i] - s->observation[i]);
        epv_policy_logits(s->observation, logits);
        apart = larger(apart, logits[1] - logits[0] - s->margin);
        decided += epv_policy_decide(s->observation) == s->action;
        stepped += epv_policy_decide(observation) == s->action;
    }
    printf("%d of %d decisions as the policy's, %d when it makes the observation itself\n",
           decided, STATES, stepped);
    printf("observations within %.2g of Python's (allowed %.2g), logits within %.2g (allowed %.2g)\n",
           off, OBSERVATION_TOLERANCE, apart, MARGIN_TOLERANCE);
    return decided == STATES && off <= OBSERVATION_TOLERANCE
                   && apart <= MARGIN_TOLERANCE
               ? 0
               : 1;
}
