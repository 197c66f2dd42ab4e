/* An exported policy: it decides at its start and every $period_us us, and holds the coil in between.
 *
 * epv_policy.c is the file that the export wrote and compared with the policy.
 */
#ifndef MODEL_H
#define MODEL_H

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "epv_policy.c"
#include "variables.h"

#define PERIOD_S (1e-6 * EPV_POLICY_PERIOD_US)

typedef struct {
    double value[VARIABLES];
    epv_policy_memory memory;
    double elapsed; /* since the start [s] */
    double lost;    /* rounding of that sum, which Kahan's method puts back [s] */
    double decisions; /* so far */
} model;

static void decide(model *m)
{
    double *value = m->value;
    epv_policy_readings now;
    now.p1 = (float)(value[V_p1] / 1e5);
    now.p2 = (float)(value[V_p2] / 1e5);
    now.p3 = (float)(value[V_p3] / 1e5);
    now.target = (float)(value[V_p2_target] / 1e5);
    now.current = (float)value[V_I];
    now.coil = (uint8_t)(value[V_coil] > 0.5);
    value[V_coil] = epv_policy_step(&m->memory, &now);
    value[V_U] = value[V_coil] * value[V_U_on];
    m->decisions += 1.0;
}

/* Forget everything and decide for the first time. Returns a fault or NULL. */
static const char *model_begin(model *m)
{
    memset(&m->memory, 0, sizeof m->memory);
    m->elapsed = m->lost = m->decisions = 0.0;
    m->value[V_coil] = 1.0;
    decide(m);
    return NULL;
}

/* Whether the memory of a state from outside holds numbers, and its clock goes on from here. */
static int model_is_sound(const model *m)
{
    const float *remembered = (const float *)&m->memory;
    size_t k;
    for (k = 0; k < offsetof(epv_policy_memory, waited) / sizeof *remembered; k++)
        if (isnan(remembered[k]))
            return 0;
    return m->elapsed >= 0.0 && isfinite(m->elapsed) && isfinite(m->lost) &&
           m->decisions * PERIOD_S >= m->elapsed - PERIOD_S;
}

/* Decide at each period's start that lies in the coming h [s], on the inputs as they are. */
static const char *model_advance(model *m, double h)
{
    const double corrected = h - m->lost, sum = m->elapsed + corrected;
    m->lost = (sum - m->elapsed) - corrected;
    m->elapsed = sum;
    while (m->decisions * PERIOD_S < m->elapsed - 1e-9)
        decide(m);
    return NULL;
}

#endif
