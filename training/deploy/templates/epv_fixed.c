/* $title
 *
 * Written by training/export.py: change the policy and export it again, not this file.
 * $source
 *
 * Observations and activations: int16_t, 32767 stands for the reach of an entry or for 1.
 * Weights: int8_t, one scale for each row. Sums: int32_t, they cannot overflow (the export checks it).
 * What tanh is taken of, and the logits: int32_t, 65536 stands for 1.
 */
#include "epv_fixed.h"

enum { LAYERS = $layers, WIDEST = $widest, CELLS = $cells, LONGEST_WAIT = $longest_wait };
enum { PERIOD_US = EPV_FIXED_PERIOD_US, LONGEST_US = $longest_us };

/* Of the observation's entries, in Pa, uA, us and 1/1000: the centre, the reach to either side, and what
 * makes 32767 of the reach when shifted right. */
static const int32_t CENTRE[EPV_FIXED_INPUTS] = {$centre};
static const int32_t REACH[EPV_FIXED_INPUTS] = {$reach};
static const uint32_t FACTOR[EPV_FIXED_INPUTS] = {$factor};
enum { FACTOR_SHIFT = $factor_shift };

$arrays
typedef struct {
    const int8_t *weight; /* row after row */
    const uint32_t *factor; /* of each row's sum, before the shift */
    const int32_t *bias;
    int inputs;
    int outputs;
    int shift;
} layer;

static const layer NETWORK[LAYERS] = {
$network};

/* 32767 tanh(i / 32) */
static const int16_t TANGENT[257] = {$tangent};

/* value factor / 2^shift, halves away from zero. Only an unsigned number is shifted: every compiler agrees. */
static int32_t scaled(int32_t value, uint32_t factor, int shift)
{
    const uint64_t size = (uint64_t)(value < 0 ? -(int64_t)value : (int64_t)value);
    const int32_t rounded = (int32_t)((size * factor + ((uint64_t)1 << (shift - 1))) >> shift);
    return value < 0 ? -rounded : rounded;
}

static int32_t limited(int64_t value, int32_t limit)
{
    return value > limit ? limit : value < -limit ? -limit : (int32_t)value;
}

$remember
static int64_t change(const int32_t *ring, int newest, int lag)
{
    return (int64_t)ring[newest] - ring[(newest + EPV_FIXED_HISTORY - lag) % EPV_FIXED_HISTORY];
}

void epv_fixed_observe(epv_fixed_memory *m, const epv_fixed_readings *now,
                       int16_t observation[EPV_FIXED_INPUTS])
{
    int64_t value[EPV_FIXED_INPUTS];
    int32_t since;
    int i;
    remember(m, now);
    since = (int32_t)m->waited * PERIOD_US;
    if (since > LONGEST_US)
        since = LONGEST_US;
$values
    for (i = 0; i < EPV_FIXED_INPUTS; i++)
        observation[i] = (int16_t)scaled(limited(value[i] - CENTRE[i], REACH[i]), FACTOR[i], FACTOR_SHIFT);
}

/* From the table, linear between its points. */
static int16_t hyperbolic_tangent(int32_t x)
{
    const uint32_t size = x < 0 ? 0u - (uint32_t)x : (uint32_t)x;
    const uint32_t i = size >> 11, part = size & 2047u;
    int32_t tangent = 32767;
    if (i < 256) {
        const uint32_t rise = (uint32_t)(TANGENT[i + 1] - TANGENT[i]);
        tangent = TANGENT[i] + (int32_t)((rise * part + 1024u) >> 11);
    }
    return (int16_t)(x < 0 ? -tangent : tangent);
}

static int32_t row(const layer *l, int j, const int16_t *signal)
{
    const int8_t *weight = l->weight + j * l->inputs;
    int32_t sum = 0;
    int i;
    for (i = 0; i < l->inputs; i++)
        sum += (int32_t)weight[i] * signal[i];
    return scaled(sum, l->factor[j], l->shift) + l->bias[j];
}

$see
void epv_fixed_logits(epv_fixed_memory *m, const int16_t observation[EPV_FIXED_INPUTS], int32_t logits[2])
{
    int16_t seen[EPV_FIXED_INPUTS + CELLS], buffers[2][WIDEST];
    const int16_t *signal = seen;
    int k, j;
    see(m, observation, seen);
    for (k = 0; k < LAYERS - 1; k++) {
        int16_t *out = buffers[k % 2];
        for (j = 0; j < NETWORK[k].outputs; j++)
            out[j] = hyperbolic_tangent(row(&NETWORK[k], j, signal));
        signal = out;
    }
    for (j = 0; j < 2; j++)
        logits[j] = row(&NETWORK[LAYERS - 1], j, signal);
}

int epv_fixed_decide(epv_fixed_memory *m, const int16_t observation[EPV_FIXED_INPUTS])
{
    int32_t logits[2];
    epv_fixed_logits(m, observation, logits);
    return logits[0] >= logits[1] ? 0 : 1;
}

int epv_fixed_step(epv_fixed_memory *m, const epv_fixed_readings *now)
{
    int16_t observation[EPV_FIXED_INPUTS];
    epv_fixed_observe(m, now, observation);
    return epv_fixed_decide(m, observation);
}
