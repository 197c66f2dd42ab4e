/* The valve: events located as epv_env/plant/integrate.py locates them, Runge-Kutta steps between.
 *
 * equations.h holds the equations, translated from epv_env/plant; this file holds how they are solved.
 */
#ifndef MODEL_H
#define MODEL_H

#include <math.h>
#include <string.h>

#include "equations.h"
#include "variables.h"

#define LANDING $landing           /* nearer to a stop than this a mover has landed [m] */
#define STICK_SPEED $stick_speed   /* a slower rebound ends at the stop [m/s] */
#define MOST_RESTITUTION $most_restitution /* of the armature under a law [-] */
#define RELEASE_LOCATIONS $release_locations /* how often a release is located */
#define RELEASE_MARGIN $release_margin /* time by which a release is overstepped [s] */
#define SHORTEST_STEP $shortest_step   /* every step makes at least this much progress [s] */
#define NO_LIMIT 1e9               /* [s] */
enum { MOST_STEPS = $most_steps }; /* in one communication step, for each second of it begun */

/* The plant as one communication step sees it. */
typedef struct {
    Coefficients c;
    Effects effects;
    Inputs u;
    double longest_step; /* while a mover moves [s]; twice that while both are held */
    int extended; /* whether an effect or a force for diagnosis acts */
} conditions;

typedef struct {
    double value[VARIABLES];
    State q;
    conditions on;
    int effects_act;
    double acting_U;   /* voltage that still acts within the command delay [V] */
    double delay_left; /* of the command delay [s] */
    int begun;         /* whether acting_U means anything */
} model;

/* A step on trial, and each mover's force at its start, middle and end [N]. */
typedef struct {
    State end;
    double PV[3], MV[3];
} trial;

static int overruns(double x0, double v0, double x1, double v1, double h, double x_max)
{
    const double x = hermite(x0, v0, x1, v1, h, turning_point(v0, v1));
    return lesser(x, x1) < -LANDING || greater(x, x1) > x_max + LANDING;
}

static int passes(double x0, double x1, double kink)
{
    return fabs(x0 - kink) > LANDING && (x0 - kink) * (x1 - kink) < 0.0;
}

/* Position within the stops, and speed after a possible impact on one of them. */
static void land(double *x, double *v, double x_max, double restitution)
{
    const int low = *x <= LANDING && *v < 0.0;
    const int high = *x >= x_max - LANDING && *v > 0.0;
    *x = low ? 0.0 : high ? x_max : lesser(greater(*x, 0.0), x_max);
    if (low || high) {
        *v *= -restitution;
        if (fabs(*v) <= STICK_SPEED)
            *v = 0.0;
    }
}

/* Fraction of the step at which a mover runs into either stop, on its way or at its end. */
static double passing(double x0, double v0, double x1, double v1, double h, double x_max)
{
    const double instants[2] = {turning_point(v0, v1), 1.0};
    int k;
    for (k = 0; k < 2; k++) {
        const double x = hermite(x0, v0, x1, v1, h, instants[k]);
        if (x > x_max)
            return crossing(x0, v0, x1, v1, h, x_max, instants[k]);
        if (x < 0.0)
            return crossing(x0, v0, x1, v1, h, 0.0, instants[k]);
    }
    return 1.0;
}

/* Time to the first event of a step of h that met one [s]. */
static double locate(const State *q, const trial *t, double h, const Coefficients *c, int held_PV,
                     int held_MV)
{
    const State *end = &t->end;
    const double kinks[2] = {c->kink_in, c->kink_exh};
    double released = 1.0;
    double fraction = lesser(passing(q->xPV, q->vPV, end->xPV, end->vPV, h, c->xPVmax),
                             passing(q->xMV, q->vMV, end->xMV, end->vMV, h, c->xMVmax));
    int k;
    for (k = 0; k < 2; k++)
        if (fabs(q->xMV - kinks[k]) > LANDING)
            fraction = lesser(
                fraction, crossing(q->xMV, q->vMV, end->xMV, end->vMV, h, kinks[k], 1.0));
    if (held_PV)
        released = release(t->PV[0], t->PV[1], t->PV[2]);
    if (held_MV)
        released = lesser(released, release(t->MV[0], t->MV[1], t->MV[2]));
    return greater(lesser(fraction * h, released * h + RELEASE_MARGIN), SHORTEST_STEP);
}

/* Stages 2 to 4 of the classical Runge-Kutta method, and their sum; k1: rates at q. */
static trial runge_kutta(const State *q, const State *k1, const conditions *on, double free_PV,
                         double free_MV, double h)
{
    trial t;
    $rates k2, k3, k4;
    State at = moved(q, k1, 0.5 * h);
    k2 = derivative(&at, &on->u, &on->c, &on->effects, free_PV, free_MV, on->extended);
    at = moved(q, &k2.part0, 0.5 * h);
    k3 = derivative(&at, &on->u, &on->c, &on->effects, free_PV, free_MV, on->extended);
    at = moved(q, &k3.part0, h);
    k4 = derivative(&at, &on->u, &on->c, &on->effects, free_PV, free_MV, on->extended);
    at = moved(q, k1, h / 6.0);
    at = moved(&at, &k2.part0, h / 3.0);
    at = moved(&at, &k3.part0, h / 3.0);
    t.end = moved(&at, &k4.part0, h / 6.0);
    t.PV[1] = k3.part1;
    t.PV[2] = k4.part1;
    t.MV[1] = k3.part2;
    t.MV[2] = k4.part2;
    return t;
}

/* Take one step, or only learn how long it may be. Returns the time gone by [s]; hint: of the next step;
   located: how often the event that it ends at has been located. */
static double step(State *q, const conditions *on, double remaining, double *hint, int *located)
{
    const Coefficients *c = &on->c;
    const $rates first = derivative(q, &on->u, c, &on->effects, 1.0, 1.0, on->extended);
    const int held_PV = is_held(q->xPV, q->vPV, c->xPVmax, first.part1);
    const int held_MV = is_held(q->xMV, q->vMV, c->xMVmax, first.part2);
    const double free_PV = held_PV ? 0.0 : 1.0, free_MV = held_MV ? 0.0 : 1.0;
    const State k1 = held_still(&first.part0, free_PV, free_MV);
    double h = lesser((held_PV && held_MV ? 2.0 : 1.0) * on->longest_step, lesser(*hint, remaining));
    double restitution_MV;
    trial t;
    State *end = &t.end;
    int event;
    if (on->extended)
        h = lesser(h, longest_step(on->u.U, q, &on->effects, free_PV, free_MV));
    t = runge_kutta(q, &k1, on, free_PV, free_MV, h);
    t.PV[0] = first.part1;
    t.MV[0] = first.part2;
    event = overruns(q->xPV, q->vPV, end->xPV, end->vPV, h, c->xPVmax) ||
            overruns(q->xMV, q->vMV, end->xMV, end->vMV, h, c->xMVmax);
    if (*located == 0)
        event = event || passes(q->xMV, end->xMV, c->kink_in) || passes(q->xMV, end->xMV, c->kink_exh);
    if (*located < RELEASE_LOCATIONS)
        event = event || (held_PV && t.PV[0] * t.PV[2] < 0.0) || (held_MV && t.MV[0] * t.MV[2] < 0.0);
    if (event) {
        *hint = locate(q, &t, h, c, held_PV, held_MV);
        *located += 1;
        return 0.0;
    }
    land(&end->xPV, &end->vPV, c->xPVmax, c->ePV);
    end->I_coil = end->I;
    restitution_MV = 0.0;
    if (on->extended) {
        const Effects acting = with_laws(end, &on->effects, on->extended);
        restitution_MV = lesser(acting.restitution_MV, MOST_RESTITUTION);
        end->I_coil = coil_current(on->u.U, end->I, c->R, end->coil_heat, &acting);
    }
    land(&end->xMV, &end->vMV, c->xMVmax, restitution_MV);
    *q = *end;
    *hint = NO_LIMIT;
    *located = 0;
    return h;
}

static int finite(const State *q)
{
    const double *number = (const double *)q;
    size_t k;
    for (k = 0; k < sizeof *q / sizeof *number; k++)
        if (!isfinite(number[k]))
            return 0;
    return 1;
}

/* Apply the conditions for a time [s]. Returns whether the state is still physical. */
static int advance(State *q, const conditions *on, double remaining)
{
    double hint = NO_LIMIT, steps = MOST_STEPS * ceil(remaining);
    int located = 0;
    while (remaining > 0.0) {
        if (steps-- < 1.0)
            return 0;
        remaining -= step(q, on, remaining, &hint, &located);
    }
    return finite(q) && q->p1 > 0.0 && q->p2 > 0.0 && q->p2 + q->far_pressure > 0.0 && q->p3 > 0.0;
}

static void publish(model *m)
{
    const State *q = &m->q;
    double *value = m->value;
$publish
}

/* The parameters' constants and the state at the start. Returns a fault or NULL. */
static const char *model_begin(model *m)
{
    const double *value = m->value;
    Coefficients *c = &m->on.c;
    Effects *effects = &m->on.effects;
$coefficients
$effects
    m->on.longest_step = value[V_longest_step];
    m->effects_act = $effects_act;
    memset(&m->q, 0, sizeof m->q);
$start
    m->begun = 0;
    m->delay_left = 0.0;
    if (m->q.xPV > c->xPVmax)
        return "xPV_start is beyond the piston's stop: give at most xPVmax";
    publish(m);
    return NULL;
}

/* Whether all numbers of a state from outside are finite. */
static int model_is_sound(const model *m)
{
    return finite(&m->q) && isfinite(m->acting_U) && m->delay_left >= 0.0 && isfinite(m->delay_left);
}

/* Apply the inputs for a time [s]; the coil follows its voltage after the command delay. */
static const char *model_advance(model *m, double h)
{
    const double *value = m->value;
    Inputs *u = &m->on.u;
    double commanded, before;
    int physical;
$inputs
    m->on.extended = m->effects_act || $forced;
    commanded = u->U;
    if (!m->begun)
        m->acting_U = commanded;
    m->begun = 1;
    if (commanded == m->acting_U)
        m->delay_left = 0.0;
    else if (m->delay_left <= 0.0)
        m->delay_left = commanded > $off_voltage ? $delay_on : $delay_off;
    before = lesser(m->delay_left, h);
    m->delay_left -= before;
    u->U = m->acting_U;
    physical = advance(&m->q, &m->on, before);
    u->U = commanded;
    physical = physical && advance(&m->q, &m->on, h - before);
    if (m->delay_left <= 0.0)
        m->acting_U = commanded;
    publish(m);
    return physical ? NULL : "the plant could not be integrated: check that the inputs are physical (an "
                             "empty circuit cannot be consumed from)";
}

#endif
