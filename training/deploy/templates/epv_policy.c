/* $title
 *
 * Written by `epv export`: change the policy and export it again, not this file.
 * $source
 *
 * All numbers are float, in the units of the readings and of the observation.
 */
#include "epv_policy.h"

enum { LAYERS = $layers, WIDEST = $widest, LONGEST_WAIT = $longest_wait };

static const float PERIOD = $period;
static const float LONGEST = $longest;

static const float CENTRE[EPV_POLICY_INPUTS] = {$centre};
static const float SCALE[EPV_POLICY_INPUTS] = {$scale};
static const float LIMIT[EPV_POLICY_INPUTS] = {$limit};

typedef struct {
    const float *weight; /* row after row */
    const float *bias;
    int inputs;
    int outputs;
} layer;

$arrays
static float limited(float value, float limit)
{
    return value > limit ? limit : value < -limit ? -limit : value;
}

/* Entry i of the observation from its value in its unit. */
static float entry(float value, int i)
{
    return limited((value - CENTRE[i]) / SCALE[i], LIMIT[i]);
}

/* Hyperbolic tangent to 7 units in the last place: Lambert's continued fraction, broken off after
 * six terms, gives n/d = tanh(x/2); tanh(x) = 2 (n/d) / (1 + (n/d)^2). No term is subtracted. */
static float hyperbolic_tangent(float x)
{
    const float y = 0.5f * x, s = y * y;
    const float n = y * ((21.0f * s + 1260.0f) * s + 10395.0f);
    const float d = ((s + 210.0f) * s + 4725.0f) * s + 10395.0f;
    if (x > 9.02f)
        return 1.0f;
    if (x < -9.02f)
        return -1.0f;
    return 2.0f * n * d / (n * n + d * d);
}

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

static void remember(epv_policy_memory *m, const epv_policy_readings *now)
{
    int i;
    if (!m->begun) {
        for (i = 0; i < EPV_POLICY_HISTORY; i++) {
            m->p2[i] = now->p2;
            m->p3[i] = now->p3;
        }
        m->waited = LONGEST_WAIT;
        m->newest = 0;
        m->begun = 1;
    } else {
        m->newest = (uint8_t)((m->newest + 1) % EPV_POLICY_HISTORY);
        m->p2[m->newest] = now->p2;
        m->p3[m->newest] = now->p3;
        if (now->coil != m->coil)
            m->waited = 1;
        else if (m->waited < LONGEST_WAIT)
            m->waited++;
    }
    m->coil = now->coil;
}

static float change(const float *ring, int newest, int lag)
{
    return (float)ring[newest] - ring[(newest + EPV_POLICY_HISTORY - lag) % EPV_POLICY_HISTORY];
}

void epv_policy_observe(epv_policy_memory *m, const epv_policy_readings *now,
                       float observation[EPV_POLICY_INPUTS])
{
    float value[EPV_POLICY_INPUTS];
    float since;
    int i;
    remember(m, now);
    since = (float)m->waited * PERIOD;
    if (since > LONGEST)
        since = LONGEST;
$values
    for (i = 0; i < EPV_POLICY_INPUTS; i++)
        observation[i] = entry(value[i], i);
}

void epv_policy_logits(const float observation[EPV_POLICY_INPUTS], float logits[2])
{
    float buffers[2][WIDEST];
    const float *signal = observation;
    int k, j;
    for (k = 0; k < LAYERS - 1; k++) {
        float *out = buffers[k % 2];
        for (j = 0; j < NETWORK[k].outputs; j++)
            out[j] = hyperbolic_tangent(row(&NETWORK[k], j, signal));
        signal = out;
    }
    for (j = 0; j < 2; j++)
        logits[j] = row(&NETWORK[LAYERS - 1], j, signal);
}

int epv_policy_decide(const float observation[EPV_POLICY_INPUTS])
{
    float logits[2];
    epv_policy_logits(observation, logits);
    return logits[0] >= logits[1] ? 0 : 1; /* not-a-number compares false: 1, shut */
}

int epv_policy_step(epv_policy_memory *m, const epv_policy_readings *now)
{
    float observation[EPV_POLICY_INPUTS];
    epv_policy_observe(m, now, observation);
    return epv_policy_decide(observation);
}
