/* How long does a decision take, from the readings to the action? In the folder of the export:
 *
 *     cc -std=c99 -O2 bench.c epv_policy.c -lm -o bench && ./bench
 *
 * Each state is decided REPEATS times. `slowest_state` is the longest over the states of each state's
 * shortest time: what the code needs. `slowest_call` is the longest of all: it holds what interrupts and
 * a hypervisor took. The clock is the processor time of this program (POSIX); reading it is included.
 */
#define _POSIX_C_SOURCE 199309L
#include <string.h>
#include <time.h>

#include "states.h"

enum { REPEATS = 10 };

static double best[STATES];
static volatile int sink; /* so that no call can be left out */

static double now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(void)
{
    epv_policy_memory memory, copy;
    double slowest = 0.0;
    int k, n;
    read_states("states.csv");
    for (k = 0; k < STATES; k++) {
        const state *s = &STATE[k];
        if (k == 0 || s->episode != STATE[k - 1].episode)
            memset(&memory, 0, sizeof memory);
        best[k] = 1e9;
        for (n = 0; n < REPEATS; n++) {
            double begun, taken;
            copy = memory; /* as its episode has left it */
            begun = now_us();
            sink = epv_policy_step(&copy, &s->readings);
            taken = now_us() - begun;
            best[k] = taken < best[k] ? taken : best[k];
            slowest = taken > slowest ? taken : slowest;
        }
        memory = copy;
    }
    qsort(best, STATES, sizeof best[0], ascending);
    printf("median_us,slowest_state_us,slowest_call_us\n");
    printf("%.3f,%.3f,%.3f\n", best[STATES / 2], best[STATES - 1], slowest);
    return 0;
}
