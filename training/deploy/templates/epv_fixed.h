/* $title
 *
 * The policy in integers alone, from the readings to the decision: for units without floating point.
 * Plain C99: no library, no heap, no global that changes. The same decisions on every machine.
 * $source
 *
 * Once every control period, right after the sensors were read:
 *
 *     static epv_fixed_memory memory;                  // zeros: nothing remembered yet
 *     epv_fixed_readings now = {p1, p2, p3, current, target, coil};
 *     coil = epv_fixed_step(&memory, &now);            // 1: energise for the coming period
 */
#ifndef EPV_FIXED_H
#define EPV_FIXED_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define EPV_FIXED_INPUTS $inputs
#define EPV_FIXED_HISTORY $history
#define EPV_FIXED_PERIOD_US $period_us

/* What the control unit knows at the end of a period. */
typedef struct {
    int32_t p1;      /* reservoir pressure, Pa absolute */
    int32_t p2;      /* circuit pressure, Pa absolute */
    int32_t p3;      /* control pressure, Pa absolute */
    int32_t current; /* of the solenoid, uA */
    int32_t target;  /* wanted circuit pressure, Pa absolute */
    uint8_t coil;    /* 1: the coil was energised in the period that has just ended, 0: it was not */
} epv_fixed_readings;

/* What one valve's controller remembers. Keep one for each valve; set to zero, it begins anew and
 * takes the first readings for its past. */
typedef struct {
    int32_t p2[EPV_FIXED_HISTORY]; /* rings of the latest readings, Pa */
    int32_t p3[EPV_FIXED_HISTORY];
${cell_member}    uint16_t waited; /* periods since the coil was switched, saturating */
    uint8_t newest;  /* place of the newest readings in the rings */
    uint8_t coil;
    uint8_t begun;
} epv_fixed_memory;

/* One period: remember the readings, return what the coil shall do next (0 off, 1 on). */
int epv_fixed_step(epv_fixed_memory *memory, const epv_fixed_readings *now);

/* Its two halves: readings to observation, observation to decision. 32767 stands for the reach of an
 * entry (contract.json); beyond its reach an entry saturates. */
void epv_fixed_observe(epv_fixed_memory *memory, const epv_fixed_readings *now,
                       int16_t observation[EPV_FIXED_INPUTS]);
int epv_fixed_decide(epv_fixed_memory *memory, const int16_t observation[EPV_FIXED_INPUTS]);

/* What the decision compares: {off, on}, 65536 stands for 1. A policy that remembers more than
 * readings goes one period on with each call: call this or epv_fixed_decide, not both. */
void epv_fixed_logits(epv_fixed_memory *memory, const int16_t observation[EPV_FIXED_INPUTS],
                      int32_t logits[2]);

#ifdef __cplusplus
}
#endif

#endif
