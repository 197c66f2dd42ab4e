/* One instance of the model behind either version of FMI: phases, values, time, messages.
 *
 * Everything is static: an importer may link several such units into one program.
 * A function that refuses something returns 0 and leaves a sentence in `message`.
 */
#ifndef COMPONENT_H
#define COMPONENT_H

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

typedef enum { CREATED, INITIALISING, RUNNING, ENDED, FAILED } phase;

static const char *const PHASE[] = {
    "before initialisation", "in initialisation", "while it runs", "after its end", "after a failed step",
};

/* What is saved and restored: plain numbers only, so that its bytes are its serial form. */
typedef struct {
    model model;
    phase phase;
    double time, stop; /* present and last allowed time [s] */
} snapshot;

typedef struct {
    snapshot now;
    char message[400];
} component;

static int refuse(component *c, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    vsnprintf(c->message, sizeof c->message, format, values);
    va_end(values);
    return 0;
}

static void component_reset(component *c)
{
    int i;
    memset(c, 0, sizeof *c);
    for (i = 0; i < VARIABLES; i++)
        c->now.model.value[i] = VARIABLE[i].start;
    c->now.phase = CREATED;
    c->now.stop = INFINITY;
}

/* Whether a call is allowed in the present phase; if not, says so. */
static int component_may(component *c, const char *call, unsigned phases)
{
    if ((1u << c->now.phase) & phases)
        return 1;
    return refuse(c, "%s is not allowed %s: reset the unit, or call it at another time", call,
                  PHASE[c->now.phase]);
}

/* The model's start from its parameters. */
static int component_begin(component *c)
{
    const char *fault = model_begin(&c->now.model);
    return fault == NULL ? 1 : refuse(c, "%s", fault);
}

static int component_set_one(component *c, unsigned reference, double value)
{
    const variable *v;
    if (reference >= VARIABLES)
        return refuse(c, "there is no variable with value reference %u: take one from "
                      "modelDescription.xml", reference);
    v = &VARIABLE[reference];
    if (v->kind != INPUT && v->kind != PARAMETER)
        return refuse(c, "%s is computed and cannot be set: set an input or a parameter", v->name);
    if (v->kind == PARAMETER && c->now.phase != CREATED && c->now.phase != INITIALISING &&
        value != c->now.model.value[reference])
        return refuse(c, "parameter %s cannot be set %s: set it before initialisation ends", v->name,
                      PHASE[c->now.phase]);
    if (!(value >= v->low && value <= v->high && isfinite(value)))
        return refuse(c, "%s = %g is outside [%g, %g]: give a value inside it", v->name, value, v->low,
                      v->high);
    c->now.model.value[reference] = value;
    return 1;
}

static int component_set(component *c, const unsigned *references, size_t n, const double *values)
{
    size_t k;
    for (k = 0; k < n; k++)
        if (!component_set_one(c, references[k], values[k]))
            return 0;
    return 1;
}

static int component_get(component *c, const unsigned *references, size_t n, double *values)
{
    size_t k;
    if (c->now.phase == INITIALISING && !component_begin(c))
        return 0;
    for (k = 0; k < n; k++) {
        if (references[k] >= VARIABLES)
            return refuse(c, "there is no variable with value reference %u: take one from "
                          "modelDescription.xml", references[k]);
        values[k] = VARIABLE[references[k]].kind == TIME ? c->now.time
                                                         : c->now.model.value[references[k]];
    }
    return 1;
}

static int component_initialise(component *c)
{
    if (!component_may(c, "entering initialisation", 1u << CREATED))
        return 0;
    c->now.phase = INITIALISING;
    return 1;
}

static int component_run(component *c)
{
    if (!component_may(c, "leaving initialisation", 1u << INITIALISING) || !component_begin(c))
        return 0;
    c->now.phase = RUNNING;
    return 1;
}

static int component_step(component *c, double time, double step)
{
    const char *fault;
    if (!component_may(c, "a step", 1u << RUNNING))
        return 0;
    if (!(step > 0.0 && step <= 3600.0))
        return refuse(c, "the step is %g s: give a positive length of at most an hour", step);
    if (!(fabs(time - c->now.time) <= 1e-9 * (1.0 + fabs(c->now.time)) + 1e-3 * step))
        return refuse(c, "the step begins at %g s but the unit is at %g s: continue where the last "
                      "step ended", time, c->now.time);
    if (time + step > c->now.stop + 1e-9 * (1.0 + fabs(c->now.stop)))
        return refuse(c, "the step ends at %g s, after the stop time %g s: end the run there", time + step,
                      c->now.stop);
    fault = model_advance(&c->now.model, step);
    if (fault != NULL) {
        c->now.phase = FAILED;
        return refuse(c, "at %g s: %s", c->now.time, fault);
    }
    c->now.time = time + step;
    return 1;
}

static int component_end(component *c)
{
    if (!component_may(c, "the end", 1u << RUNNING | 1u << FAILED))
        return 0;
    c->now.phase = ENDED;
    return 1;
}

static int component_save(component *c, void **saved)
{
    if (*saved == NULL)
        *saved = malloc(sizeof(snapshot));
    if (*saved == NULL)
        return refuse(c, "there is no memory for a saved state: free others");
    memcpy(*saved, &c->now, sizeof(snapshot));
    return 1;
}

static int component_restore(component *c, const void *saved)
{
    if (saved == NULL)
        return refuse(c, "no saved state is given: save one first");
    memcpy(&c->now, saved, sizeof(snapshot));
    return 1;
}

/* FNV-1a: any single flipped bit changes it. */
static uint64_t checksum(const void *bytes, size_t size)
{
    uint64_t sum = 14695981039346656037u;
    size_t k;
    for (k = 0; k < size; k++)
        sum = (sum ^ ((const unsigned char *)bytes)[k]) * 1099511628211u;
    return sum;
}

/* Whether a state from outside may be gone on from: nothing in it leads beyond an array or a range. */
static int sound(const snapshot *s)
{
    int i;
    if ((unsigned)s->phase > FAILED || !isfinite(s->time) || isnan(s->stop))
        return 0;
    for (i = 0; i < VARIABLES; i++)
        if (!(s->model.value[i] >= VARIABLE[i].low && s->model.value[i] <= VARIABLE[i].high))
            return 0;
    return model_is_sound(&s->model);
}

static size_t component_serial_size(void)
{
    return sizeof TOKEN - 1 + sizeof(snapshot) + sizeof(uint64_t);
}

/* A saved state as bytes: the model's token, the numbers as this machine holds them, their checksum. */
static int component_serialise(component *c, const void *saved, void *bytes, size_t size)
{
    char *at = (char *)bytes + sizeof TOKEN - 1;
    const uint64_t sum = saved == NULL ? 0 : checksum(saved, sizeof(snapshot));
    if (saved == NULL || size != component_serial_size())
        return refuse(c, "a serial state has %zu bytes, not %zu: ask for the size first",
                      component_serial_size(), size);
    memcpy(bytes, TOKEN, sizeof TOKEN - 1);
    memcpy(at, saved, sizeof(snapshot));
    memcpy(at + sizeof(snapshot), &sum, sizeof sum);
    return 1;
}

static int component_deserialise(component *c, const void *bytes, size_t size, void **saved)
{
    const char *at = (const char *)bytes + sizeof TOKEN - 1;
    snapshot found;
    uint64_t sum;
    if (size != component_serial_size() || memcmp(bytes, TOKEN, sizeof TOKEN - 1) != 0)
        return refuse(c, "these bytes are not a state of this unit: give those that it wrote");
    memcpy(&found, at, sizeof found);
    memcpy(&sum, at + sizeof found, sizeof sum);
    if (sum != checksum(at, sizeof found) || !sound(&found))
        return refuse(c, "these bytes are a damaged state: give those that the unit wrote");
    if (*saved == NULL)
        *saved = malloc(sizeof(snapshot));
    if (*saved == NULL)
        return refuse(c, "there is no memory for a saved state: free others");
    memcpy(*saved, at, sizeof(snapshot));
    return 1;
}

#endif
