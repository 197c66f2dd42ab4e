/* $title
 *
 * The policy in single precision, from the readings to the decision.
 * C99 and expf, logf, sqrtf of its mathematical library; no heap, no global that changes.
 * $source
 *
 * Once every control period, right after the sensors were read:
 *
 *     static epv_policy_memory memory;                  // zeros: nothing remembered yet
 *     epv_policy_readings now = {p1, p2, p3, current, target, coil};
 *     coil = epv_policy_step(&memory, &now);            // 1: energise for the coming period
 *
 * The period is EPV_POLICY_PERIOD_US. Time counts in calls: called every 2 ms in place of 5 ms, waits end
 * 2.5 times too early and the rates that are learnt are 2.5 times too slow. A late or early call shifts
 * its readings by as much; the next calls must keep to the clock, not follow the late one.
 */
#ifndef EPV_POLICY_H
#define EPV_POLICY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define EPV_POLICY_READINGS $entries
#define EPV_POLICY_INPUTS $inputs
#define EPV_POLICY_PERIOD_US $period_us

/* What the control unit knows at the end of a period. */
typedef struct {
    float p1; /* reservoir pressure, bar absolute */
    float p2; /* circuit pressure, bar absolute */
    float p3; /* control pressure, bar absolute */
    float current; /* of the solenoid, A */
    float target; /* wanted circuit pressure, bar absolute */
    uint8_t coil; /* 1: the coil was energised in the period that has just ended, 0: it was not */
} epv_policy_readings;

/* What is remembered and learnt of one valve; controllers/sensor_check.py and valve_learner.py say what
 * each entry means. */
$records
/* What one valve's controller remembers. Keep one for each valve; set to zero, it begins anew and
 * takes the first readings for its past. */
typedef struct {
    epv_senses senses;
    epv_valve valve;
    uint16_t waited; /* periods since the coil was switched, saturating */
    uint8_t coil;
} epv_policy_memory;

/* One period: remember the readings, return what the coil shall do next (0 off, 1 on). */
int epv_policy_step(epv_policy_memory *memory, const epv_policy_readings *now);

/* Its parts: the readings as the observation (the first EPV_POLICY_READINGS inputs), what is learnt
 * and advised (the inputs behind them; returns 1 if a rule keeps the coil on, 2 if a shield does so
 * whatever decides, -1 if a shield switches it off, else 0), and the network's {off, on}. */
void epv_policy_observe(epv_policy_memory *memory, const epv_policy_readings *now,
                        float inputs[EPV_POLICY_INPUTS]);
int epv_policy_learn(epv_policy_memory *memory, float inputs[EPV_POLICY_INPUTS]);
void epv_policy_logits(const float inputs[EPV_POLICY_INPUTS], float logits[2]);

#ifdef __cplusplus
}
#endif

#endif
