/* Reads states.csv for parity.c and bench.c. */
#ifndef STATES_H
#define STATES_H

#include <stdio.h>
#include <stdlib.h>

#include "epv_fixed.h"
#include "epv_float.h"

enum { STATES = $states };

typedef struct {
    int episode;
    epv_float_readings readings;
    float observation[EPV_FLOAT_INPUTS]; /* as the Python environment encodes it */
    int action;                          /* of the Python policy */
    float margin;                        /* its logit of on minus that of off */
    int fixed_action;                    /* of epv_fixed where it was exported */
} state;

static state STATE[STATES];

static int32_t whole(double value)
{
    return (int32_t)(value < 0 ? value - 0.5 : value + 0.5);
}

/* The readings as epv_fixed takes them: Pa and uA. */
static epv_fixed_readings in_integers(const epv_float_readings *r)
{
    epv_fixed_readings whole_numbers;
    whole_numbers.p1 = whole(r->p1 * 1e5);
    whole_numbers.p2 = whole(r->p2 * 1e5);
    whole_numbers.p3 = whole(r->p3 * 1e5);
    whole_numbers.current = whole(r->current * 1e6);
    whole_numbers.target = whole(r->target * 1e5);
    whole_numbers.coil = r->coil;
    return whole_numbers;
}

static float number(FILE *file)
{
    float value;
    if (fscanf(file, "%f%*1[,\n]", &value) != 1) {
        fprintf(stderr, "error: states.csv is damaged: export the policy again\n");
        exit(2);
    }
    return value;
}

static void read_states(const char *path)
{
    FILE *file = fopen(path, "r");
    int k, i;
    if (file == NULL) {
        fprintf(stderr, "error: cannot read %s: run this in the folder of the export\n", path);
        exit(2);
    }
    if (fscanf(file, "%*[^\n]") == EOF) /* the headings */
        exit(2);
    for (k = 0; k < STATES; k++) {
        state *s = &STATE[k];
        s->episode = (int)number(file);
        s->readings.p1 = number(file);
        s->readings.p2 = number(file);
        s->readings.p3 = number(file);
        s->readings.current = number(file);
        s->readings.target = number(file);
        s->readings.coil = (uint8_t)number(file);
        for (i = 0; i < EPV_FLOAT_INPUTS; i++)
            s->observation[i] = number(file);
        s->action = (int)number(file);
        s->margin = number(file);
        s->fixed_action = (int)number(file);
    }
    fclose(file);
}

#endif
