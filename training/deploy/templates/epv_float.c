/* $title
 *
 * Written by training/export.py: change the policy and export it again, not this file.
 * $source
 */
#include "epv_float.h"

enum { LAYERS = $layers, WIDEST = $widest, CELLS = $cells, LONGEST_WAIT = $longest_wait };

static const float PERIOD = $period;
static const float LONGEST = $longest;

static const float CENTRE[EPV_FLOAT_INPUTS] = {$centre};
static const float SCALE[EPV_FLOAT_INPUTS] = {$scale};
static const float LIMIT[EPV_FLOAT_INPUTS] = {$limit};

$arrays
typedef struct {
    const float *weight; /* row after row */
    const float *bias;
    int inputs;
    int outputs;
} layer;

static const layer NETWORK[LAYERS] = {
$network};

static float limited(float value, float limit)
{
    return value > limit ? limit : value < -limit ? -limit : value;
}

$remember
static float change(const float *ring, int newest, int lag)
{
    return ring[newest] - ring[(newest + EPV_FLOAT_HISTORY - lag) % EPV_FLOAT_HISTORY];
}

void epv_float_observe(epv_float_memory *m, const epv_float_readings *now,
                       float observation[EPV_FLOAT_INPUTS])
{
    float value[EPV_FLOAT_INPUTS], since;
    int i;
    remember(m, now);
    since = (float)m->waited * PERIOD;
    if (since > LONGEST)
        since = LONGEST;
$values
    for (i = 0; i < EPV_FLOAT_INPUTS; i++)
        observation[i] = limited((value[i] - CENTRE[i]) / SCALE[i], LIMIT[i]);
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

$see
void epv_float_logits(epv_float_memory *m, const float observation[EPV_FLOAT_INPUTS], float logits[2])
{
    float seen[EPV_FLOAT_INPUTS + CELLS], buffers[2][WIDEST];
    const float *signal = seen;
    int k, j;
    see(m, observation, seen);
    for (k = 0; k < LAYERS - 1; k++) {
        float *out = buffers[k % 2];
        for (j = 0; j < NETWORK[k].outputs; j++)
            out[j] = hyperbolic_tangent(row(&NETWORK[k], j, signal));
        signal = out;
    }
    for (j = 0; j < 2; j++)
        logits[j] = row(&NETWORK[LAYERS - 1], j, signal);
}

int epv_float_decide(epv_float_memory *m, const float observation[EPV_FLOAT_INPUTS])
{
    float logits[2];
    epv_float_logits(m, observation, logits);
    return logits[0] >= logits[1] ? 0 : 1; /* not-a-number compares false: 1, shut */
}

int epv_float_step(epv_float_memory *m, const epv_float_readings *now)
{
    float observation[EPV_FLOAT_INPUTS];
    epv_float_observe(m, now, observation);
    return epv_float_decide(m, observation);
}
