/* The variables of $title by value reference. Written by training/export_fmu.py. */
#ifndef VARIABLES_H
#define VARIABLES_H

#define TOKEN "$token"

typedef enum { INPUT, PARAMETER, OUTPUT, LOCAL, TIME } kind;

typedef struct {
    const char *name;
    kind kind;
    double low, high; /* what may be set */
    double start;
} variable;

enum {
$references
    VARIABLES
};

static const variable VARIABLE[VARIABLES] = {
$table
};

#endif
