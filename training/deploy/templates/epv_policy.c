/* $title
 *
 * Written by training/export.py: change the policy and export it again, not this file.
 * $source
 *
 * $numbers_in_words
 */
#include "epv_${variant}.h"

enum { LAYERS = $layers, WIDEST = $widest, CELLS = $cells, LONGEST_WAIT = $longest_wait };

$arrays
$arithmetic
static const layer NETWORK[LAYERS] = {
$network};

static void remember(epv_${variant}_memory *m, const epv_${variant}_readings *now)
{
    int i;
    if (!m->begun) {
        for (i = 0; i < EPV_${capital}_HISTORY; i++) {
            m->p2[i] = now->p2;
            m->p3[i] = now->p3;
        }
        m->waited = LONGEST_WAIT;
        m->newest = 0;
        m->begun = 1;
    } else {
        m->newest = (uint8_t)((m->newest + 1) % EPV_${capital}_HISTORY);
        m->p2[m->newest] = now->p2;
        m->p3[m->newest] = now->p3;
        if (now->coil != m->coil)
            m->waited = 1;
        else if (m->waited < LONGEST_WAIT)
            m->waited++;
    }
    m->coil = now->coil;
}

static $difference change(const $reading *ring, int newest, int lag)
{
    return ($difference)ring[newest] - ring[(newest + EPV_${capital}_HISTORY - lag) % EPV_${capital}_HISTORY];
}

void epv_${variant}_observe(epv_${variant}_memory *m, const epv_${variant}_readings *now,
                       $signal observation[EPV_${capital}_INPUTS])
{
    $difference value[EPV_${capital}_INPUTS];
    $reading since;
    int i;
    remember(m, now);
    since = ($reading)m->waited * PERIOD;
    if (since > LONGEST)
        since = LONGEST;
$values
    for (i = 0; i < EPV_${capital}_INPUTS; i++)
        observation[i] = entry(value[i], i);
}

$cell_functions/* What the layers see: the observation, and the cells after it. */
static void see(epv_${variant}_memory *m, const $signal *observation, $signal *seen)
{
    int i;
    for (i = 0; i < EPV_${capital}_INPUTS; i++)
        seen[i] = observation[i];
    $next_cells
}

void epv_${variant}_logits(epv_${variant}_memory *m, const $signal observation[EPV_${capital}_INPUTS],
                      $sum logits[2])
{
    $signal seen[EPV_${capital}_INPUTS + CELLS], buffers[2][WIDEST];
    const $signal *signal = seen;
    int k, j;
    see(m, observation, seen);
    for (k = 0; k < LAYERS - 1; k++) {
        $signal *out = buffers[k % 2];
        for (j = 0; j < NETWORK[k].outputs; j++)
            out[j] = hyperbolic_tangent(row(&NETWORK[k], j, signal));
        signal = out;
    }
    for (j = 0; j < 2; j++)
        logits[j] = row(&NETWORK[LAYERS - 1], j, signal);
}

int epv_${variant}_decide(epv_${variant}_memory *m, const $signal observation[EPV_${capital}_INPUTS])
{
    $sum logits[2];
    epv_${variant}_logits(m, observation, logits);
    return logits[0] >= logits[1] ? 0 : 1;$tie_in_words
}

int epv_${variant}_step(epv_${variant}_memory *m, const epv_${variant}_readings *now)
{
    $signal observation[EPV_${capital}_INPUTS];
    epv_${variant}_observe(m, now, observation);
    return epv_${variant}_decide(m, observation);
}
