/* $title
 *
 * Written by `epv export`: change the policy and export it again, not this file.
 * $source
 *
 * All numbers are float, in the units of the readings and of the observation.
 */
#include <math.h>

#include "epv_policy.h"
#include "epv_learner.h"

enum { LAYERS = $layers, WIDEST = $widest, LONGEST_WAIT = $longest_wait };

static const float PERIOD = $period;
static const float LONGEST = $longest;

typedef struct {
    const float *weight; /* row after row */
    const float *bias;
    int inputs;
    int outputs;
} layer;

static const float ADVICE[2] = {$advice};

$arrays
static float row(const layer *l, int j, const float *signal)
{
    const float *weight = l->weight + j * l->inputs;
    float sum = l->bias[j];
    int i;
    for (i = 0; i < l->inputs; i++)
        sum += weight[i] * signal[i];
    return sum;
}

static const layer NETWORK[LAYERS] = {
$network};

void epv_policy_observe(epv_policy_memory *m, const epv_policy_readings *now,
                        float inputs[EPV_POLICY_INPUTS])
{
    epv_readings r;
    if (m->senses.periods == 0.0f)
        m->waited = LONGEST_WAIT;
    else if (now->coil != m->coil)
        m->waited = 1;
    else if (m->waited < LONGEST_WAIT)
        m->waited++;
    m->coil = now->coil;
    r.p1 = now->p1;
    r.p2 = now->p2;
    r.p3 = now->p3;
    r.current = now->current;
    r.target = now->target;
    r.coil = (float)now->coil;
    r.waited = lesser((float)m->waited * PERIOD, LONGEST);
    fn_hold(&m->senses, &r, PERIOD);
    fn_remember(&m->senses);
    fn_show(&m->senses, &r, inputs);
}

int epv_policy_learn(epv_policy_memory *m, float inputs[EPV_POLICY_INPUTS])
{
    epv_readings r;
    fn_read(&r, inputs);
    fn_watch(&m->senses, &r, PERIOD);
    fn_observe(&m->valve, &r, PERIOD, $filter_time, 0.0f);
    fn_plan(&m->valve, PERIOD);
    fn_show_learnt(&m->valve, inputs);
    return (int)fn_forced(&m->valve, r.error);
}

void epv_policy_logits(const float inputs[EPV_POLICY_INPUTS], float logits[2])
{
    float buffers[2][WIDEST];
    const float *signal = inputs;
    int k, j;
    for (k = 0; k < LAYERS - 1; k++) {
        float *out = buffers[k % 2];
        for (j = 0; j < NETWORK[k].outputs; j++)
            out[j] = fn_tangent(row(&NETWORK[k], j, signal));
        signal = out;
    }
    for (j = 0; j < 2; j++)
        logits[j] = row(&NETWORK[LAYERS - 1], j, signal) + ADVICE[j] * inputs[EPV_POLICY_INPUTS - 1];
}

int epv_policy_step(epv_policy_memory *m, const epv_policy_readings *now)
{
    float inputs[EPV_POLICY_INPUTS], logits[2];
    int force, off;
    epv_policy_observe(m, now, inputs);
    force = epv_policy_learn(m, inputs);
    epv_policy_logits(inputs, logits);
    off = force < 0 || (force == 0 && logits[0] >= logits[1]);
    if (force > 1)
        return 1;
    return fn_overruled(&m->senses, off ? 0.0f : 1.0f) != 0.0f;
}
