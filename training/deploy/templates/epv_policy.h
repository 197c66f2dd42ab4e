/* $title
 *
 * $arithmetic_in_words
 * Plain C99: no library, no heap, no global that changes.$same_everywhere
 * $source
 *
 * Once every control period, right after the sensors were read:
 *
 *     static epv_${variant}_memory memory;                  // zeros: nothing remembered yet
 *     epv_${variant}_readings now = {p1, p2, p3, current, target, coil};
 *     coil = epv_${variant}_step(&memory, &now);            // 1: energise for the coming period
 */
#ifndef EPV_${capital}_H
#define EPV_${capital}_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define EPV_${capital}_INPUTS $inputs
#define EPV_${capital}_HISTORY $history
#define EPV_${capital}_PERIOD_US $period_us

/* What the control unit knows at the end of a period. */
typedef struct {
    $reading p1; /* reservoir pressure, $pressure_unit absolute */
    $reading p2; /* circuit pressure, $pressure_unit absolute */
    $reading p3; /* control pressure, $pressure_unit absolute */
    $reading current; /* of the solenoid, $current_unit */
    $reading target; /* wanted circuit pressure, $pressure_unit absolute */
    uint8_t coil; /* 1: the coil was energised in the period that has just ended, 0: it was not */
} epv_${variant}_readings;

/* What one valve's controller remembers. Keep one for each valve; set to zero, it begins anew and
 * takes the first readings for its past. */
typedef struct {
    $reading p2[EPV_${capital}_HISTORY]; /* rings of the latest readings, $pressure_unit */
    $reading p3[EPV_${capital}_HISTORY];
${cell_member}    uint16_t waited; /* periods since the coil was switched, saturating */
    uint8_t newest; /* place of the newest readings in the rings */
    uint8_t coil;
    uint8_t begun;
} epv_${variant}_memory;

/* One period: remember the readings, return what the coil shall do next (0 off, 1 on). */
int epv_${variant}_step(epv_${variant}_memory *memory, const epv_${variant}_readings *now);

/* Its two halves: readings to observation (contract.json has the order), observation to decision.
 * $observation_in_words */
void epv_${variant}_observe(epv_${variant}_memory *memory, const epv_${variant}_readings *now,
                       $signal observation[EPV_${capital}_INPUTS]);
int epv_${variant}_decide(epv_${variant}_memory *memory, const $signal observation[EPV_${capital}_INPUTS]);

/* What the decision compares: {off, on}$logit_scale. A policy that remembers more than readings
 * goes one period on with each call: call this or epv_${variant}_decide, not both. */
void epv_${variant}_logits(epv_${variant}_memory *memory, const $signal observation[EPV_${capital}_INPUTS],
                      $sum logits[2]);

#ifdef __cplusplus
}
#endif

#endif
