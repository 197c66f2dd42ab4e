/* Monitor of an electro-pneumatic protection valve: has it changed, when, and what. */
#ifndef EPV_MONITOR_H
#define EPV_MONITOR_H

enum {
    EPV_FEATURES = $features, EPV_SHIFTS = $count, EPV_ROWS = $rows, EPV_EFFECTS = $causes,
    EPV_LINEAR = $linear, EPV_SETTLING = $settling
};

typedef struct {
    double rows[EPV_ROWS][6], mean[EPV_FEATURES], variance[EPV_FEATURES];
    double learnt[EPV_SHIFTS][EPV_FEATURES], log[EPV_SHIFTS], since[EPV_SHIFTS], last;
    double reference[EPV_FEATURES][EPV_LINEAR], back[EPV_FEATURES][EPV_LINEAR], before[EPV_FEATURES];
    double recent[EPV_SETTLING][EPV_FEATURES], conditions[EPV_SETTLING][EPV_LINEAR];
    double share[EPV_EFFECTS], onset; /* of the latest settled change: see epv_monitor_causes */
    double rate; /* false alarms per hour */
    double periods; /* counts 2^53 of them exactly */
    int on, off; /* saturating */
    int alarms, next, returns;
    unsigned changes; /* how many have settled and become the reference; saturating */
    unsigned restarts; /* how often it began anew because its state was not finite; saturating */
} epv_monitor;

/* Before the first period: believe that nothing has changed. */
void epv_monitor_reset(epv_monitor *m, double false_alarms_per_hour);
/* After a stretch without readings. */
void epv_monitor_pause(epv_monitor *m);
/* Once a control period. U: voltage of the energised coil [V]; pressures [bar absolute]; I [A]. */
void epv_monitor_update(epv_monitor *m, int coil, double U, double p1, double p2, double p3, double I);
/* That something has changed since the reference was learnt [-]; an alarm above 0.5 at two
 * openings in a row: one alone may lack a row. An alarm that lasts becomes the reference: m->changes counts these. */
double epv_monitor_probability(const epv_monitor *m);
/* If something has changed: the probability of each effect into share[EPV_EFFECTS], and when [s].
 * contract.json names the effects in this order. */
double epv_monitor_causes(const epv_monitor *m, double *share);

#endif
