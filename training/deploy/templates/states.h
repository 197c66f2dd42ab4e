/* Reads states.csv for parity.c and bench.c. */
#ifndef STATES_H
#define STATES_H

#include <stdio.h>
#include <stdlib.h>

#include "epv_policy.h"

enum { STATES = $states };

typedef struct {
    int episode;
    epv_policy_readings readings;
    float inputs[EPV_POLICY_INPUTS]; /* observation and learnt quantities, as Python has them */
    int action;                          /* of the Python controller */
    float margin;                        /* the network's logit of on minus that of off */
} state;

static state STATE[STATES];

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
        for (i = 0; i < EPV_POLICY_INPUTS; i++)
            s->inputs[i] = number(file);
        s->action = (int)number(file);
        s->margin = number(file);
    }
    fclose(file);
}

#endif
