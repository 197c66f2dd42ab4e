/* The state equations of the valve with all effects, translated from epv_env/plant function by function.
 *
 * Written by training/export_fmu.py: change the Python functions and export again, not this file.
 * docs/explanation/plant-model.md explains the symbols. SI units.
 */
#ifndef EQUATIONS_H
#define EQUATIONS_H

#include <math.h>

$helpers
$functions
#endif
