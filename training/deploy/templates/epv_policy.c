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

static const float CENTRE[EPV_POLICY_READINGS] = {$centre};
static const float SCALE[EPV_POLICY_READINGS] = {$scale};
static const float LIMIT[EPV_POLICY_READINGS] = {$limit};

/* Of p1, p2, p3, current, target: the ends of the sensors, and what is held before the first of them. */
enum { P2 = 1, TARGET = 4, GIVEN };
static const float LEAST[GIVEN] = {$least}, GREATEST[GIVEN] = {$greatest}, START[GIVEN] = {$start};

typedef struct {
    const float *weight; /* row after row */
    const float *bias;
    int inputs;
    int outputs;
} layer;

static const float ADVICE[2] = {$advice};

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

/* Put the last good readings in place of lost ones (controllers/held_readings.py); a bit for each lost.
 * p2 counts by its distance from the target: without a target it is lost, too. */
static int hold(epv_policy_memory *m, epv_policy_readings *now)
{
    float *const given[GIVEN] = {&now->p1, &now->p2, &now->p3, &now->current, &now->target};
    int i, lost = 0;
    for (i = 0; i < GIVEN; i++)
        if (!(*given[i] >= LEAST[i] && *given[i] <= GREATEST[i])) /* NaN, too */
            lost |= i == TARGET ? 1 << TARGET | 1 << P2 : 1 << i;
    for (i = 0; i < GIVEN; i++) {
        if (m->periods == 0)
            m->last[i] = START[i];
        if (!(lost >> i & 1))
            m->last[i] = *given[i];
        *given[i] = m->last[i];
    }
    m->lost = (uint8_t)(lost ? m->lost + (m->lost < 255) : 0);
    if (m->lost > $held)
        m->failed = 1;
    return lost;
}

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
                        float inputs[EPV_POLICY_INPUTS])
{
    float value[EPV_POLICY_READINGS];
    float since;
    int i;
    remember(m, now);
    since = (float)m->waited * PERIOD;
    if (since > LONGEST)
        since = LONGEST;
$values
    for (i = 0; i < EPV_POLICY_READINGS; i++)
        inputs[i] = entry(value[i], i);
}

/* An entry of the observation in its unit. */
static float seen(const float *inputs, int i)
{
    return inputs[i] * SCALE[i] + CENTRE[i];
}

/* Whether p3 stands still where the coil should move it (controllers/p3_check.py). */
static int implausible(const epv_policy_memory *m, const float *inputs)
{
    const float p3 = seen(inputs, $p3), moved = seen(inputs, $p3_change);
    const float remains = m->coil ? seen(inputs, $p1) - p3 : p3 - $ambient;
    const float known = lesser(seen(inputs, $since), (float)m->periods * PERIOD);
    return known > $wait && fabsf(moved) < $still && remains > $margin;
}

/* Two points with extrapolation (controllers/hysteresis.py), which does not read p3. */
static void hysteresis(epv_policy_memory *m, const float *inputs)
{
    const float error = seen(inputs, $p2_error), slope = seen(inputs, $p2_change) / $slope_time;
    if (m->fallback)
        m->fallback = !(error + $open_lookahead * slope < $open_below);
    else
        m->fallback = error + $shut_lookahead * slope > $shut_above;
}

int epv_policy_learn(epv_policy_memory *m, float inputs[EPV_POLICY_INPUTS])
{
    if (m->periods == 0) {
        fn_begin(&m->valve);
        m->fallback = 1;
    }
    if (m->periods < 65535)
        m->periods++;
    if (implausible(m, inputs))
        m->failed = 1;
    hysteresis(m, inputs);
    fn_observe(&m->valve, inputs, EPV_POLICY_READINGS, PERIOD, $filter_time, 0.0f);
    fn_plan(&m->valve, PERIOD);
$learnt
    return fn_cannot_raise(&m->valve) != 0.0f || fn_would_rise_too_far(&m->valve) != 0.0f;
}

void epv_policy_logits(const float inputs[EPV_POLICY_INPUTS], float logits[2])
{
    float buffers[2][WIDEST];
    const float *signal = inputs;
    int k, j;
    for (k = 0; k < LAYERS - 1; k++) {
        float *out = buffers[k % 2];
        for (j = 0; j < NETWORK[k].outputs; j++)
            out[j] = hyperbolic_tangent(row(&NETWORK[k], j, signal));
        signal = out;
    }
    for (j = 0; j < 2; j++)
        logits[j] = row(&NETWORK[LAYERS - 1], j, signal) + ADVICE[j] * inputs[EPV_POLICY_INPUTS - 1];
}

int epv_policy_step(epv_policy_memory *m, const epv_policy_readings *given)
{
    epv_policy_readings now = *given;
    float inputs[EPV_POLICY_INPUTS], logits[2];
    const int begun = m->begun, lost = hold(m, &now);
    float error;
    int must_shut;
    epv_policy_observe(m, &now, inputs);
    must_shut = epv_policy_learn(m, inputs);
    error = seen(inputs, $p2_error);
    m->begun = begun || !lost || m->lost > $held;
    if (!m->begun || (m->failed && (lost >> P2 & 1)))
        return 1; /* there is nothing to decide by: shut */
    if (fn_above_band(error) != 0.0f) /* shield 3: whoever decides */
        return 1;
    if (m->failed)
        return m->fallback;
    if (must_shut || fn_below_band(&m->valve, error) != 0.0f)
        return must_shut;
    epv_policy_logits(inputs, logits);
    return !(logits[0] >= logits[1]);
}
