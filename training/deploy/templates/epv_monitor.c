/* Monitor of an electro-pneumatic protection valve: see controllers/monitor.py. C99, no heap.
 * Call epv_monitor_reset once, then epv_monitor_update once a control period. */
#include "epv_monitor.h"

#include <limits.h>
#include <math.h>
#include <string.h>

/* R: the return, which has no shift of its own. */
enum { N = EPV_FEATURES, H = EPV_SHIFTS, R = H - 1, L = EPV_LINEAR, I0 = $before, LENGTH = EPV_ROWS };

static const double CENTRE[$conditions] = $centre, SCALE[$conditions] = $scale;
static const double WHITEN[N][N] = $whiten;
static const double EXPECTED[N][$terms] = $expected;
static const double KINKS[$kink_count] = $kinks;
static const double OFFSET[N] = $offset;
static const double SHIFT[R][N][L] = $shifts;
static const double WEIGHT[H] = $weights, LATER[R] = $later;
static const int EFFECT[H] = $effect;

static double least(double a, double b) { return a < b ? a : b; }
static double most(double a, double b) { return a > b ? a : b; }

/* log(exp(a) + exp(b)) */
static double sum_log(double a, double b) { return most(a, b) + log1p(exp(-fabs(a - b))); }

/* off = -1: what came before the command is not known. */
void epv_monitor_pause(epv_monitor *m) { m->on = 0, m->off = -1; }

static double later(const epv_monitor *m, int h) { return h == R ? m->returns : LATER[h]; }

/* Learn the state from here on. before: time in which an earlier change may be hidden [h]. */
static void refer(epv_monitor *m, double before) {
    memset(m->learnt, 0, sizeof m->learnt);
    m->last = m->periods * $period;
    m->alarms = 0;
    for (int h = 0; h < H; h++) {
        m->log[h] = log(most(h == R ? 0.0 : before * (1.0 - LATER[h]), $least));
        m->since[h] = m->changes ? m->last : 0.0;
    }
}

static void restart(epv_monitor *m) {
    memset(m->mean, 0, sizeof m->mean);
    memset(m->before, 0, sizeof m->before);
    memset(m->reference, 0, sizeof m->reference);
    memset(m->back, 0, sizeof m->back);
    m->returns = m->next = 0;
    for (int k = 0; k < N; k++) m->variance[k] = OFFSET[k];
    refer(m, $before_start);
}

void epv_monitor_reset(epv_monitor *m, double false_alarms_per_hour) {
    memset(m, 0, sizeof *m);
    m->rate = false_alarms_per_hour;
    epv_monitor_pause(m);
    restart(m);
}

static int sound(const epv_monitor *m) {
    double sum = 0.0;
    for (int k = 0; k < N; k++) sum += fabs(m->mean[k]) + fabs(m->variance[k]);
    for (int h = 0; h < H; h++) {
        sum += fabs(m->log[h]) + fabs(m->since[h]);
        for (int k = 0; k < N; k++) sum += fabs(m->learnt[h][k]);
    }
    return isfinite(sum);
}

/* Conditions and features of the opening whose command went off at row i and on at row j of r. */
static int features(const double (*r)[6], int rows, double *x, double *z) {
    const int i = I0, j = rows - $after, n = i + $shut;
    double supply = 0, rest = 0, slope = 0, mean = 0, level = 0, low = r[i][4], high = low, rise[LENGTH];
    int at;
    for (int k = 0; k < rows; k++) for (int l = 0; l < 6; l++) if (!isfinite(r[k][l])) return 0;
    if (r[i - 1][1] <= 0.0) return 0;
    for (int k = 0; k < i; k++) supply += r[k][2] / i;
    for (int k = i - 4; k <= i; k++) rest += r[k][4] / 5;
    for (int k = i - 4; k <= i; k++) low = least(low, r[k][4]), high = most(high, r[k][4]);
    for (int k = i - 2; k <= i; k++) level += r[k][5] / 3;
    for (int k = i + 1; k < j; k++) if (r[k][4] <= 0.0) return 0;
    if (fabs(rest - supply) > $rest || high - low > $flat) return 0;
    for (int k = 0; k < n; k++) {
        slope += (k - (n - 1) / 2.0) * r[k][3] / (n * (n * n - 1) / 12.0);
        mean += r[k][3] / n;
    }
    for (int k = 0; k < rows; k++) rise[k] = r[k][3] - mean - slope * (k - (n - 1) / 2.0);
    for (at = n; at <= j + 2; at++) if (rise[at] > $rise && rise[at + 1] > $rise) break;
    if (at > j + 2) at = n;
    if (!(rise[at] > $rise && rise[at + 1] > $rise) || rise[at - 1] > $rise) return 0;
    const double part = ($rise - rise[at - 1]) / (rise[at] - rise[at - 1]), opens = at - 1 + part;
    const double U = r[i - 1][1];
    const double all[N] = {
        r[i + 1][5] / U, r[i + 2][5] / U, r[j + 1][5] / U, r[j + 2][5] / U,
        r[j + 3][5] / U, rest - supply, log(r[i + 1][4] / rest), log(r[i + 2][4] / rest),
        log(r[i + 5][4] / r[i + 2][4]), log(r[i + 9][4] / r[i + 5][4]),
        r[at - 1][4] + part * (r[at][4] - r[at - 1][4]), opens - i, rise[j], rise[j + 1], rise[j + 2],
        (rise[j + 3] + rise[j + 4]) / 2, r[j + 1][4] - r[j][4], r[j + 2][4] - r[j + 1][4],
        r[j + 4][4] - r[j + 2][4]};
    const double c[$conditions] = {supply, mean + slope * (i - (n - 1) / 2.0), j - opens, U, level / U,
                                     slope};
    memcpy(z, all, sizeof all);
    x[0] = 1.0;
    int next = 1 + $conditions;
    for (int k = 0; k < $conditions; k++) x[1 + k] = (c[k] - CENTRE[k]) / SCALE[k];
    for (int a = 1; a <= $quadratic; a++) for (int b = a; b <= $quadratic; b++) x[next++] = x[a] * x[b];
    for (int k = 0; k < $kink_count; k++) x[next++] = most(j - opens - KINKS[k], 0.0);
    return 1;
}

static double total(const epv_monitor *m) {
    double sum = m->log[0] + log(WEIGHT[0]);
    for (int h = 1; h < H; h++) sum = sum_log(sum, m->log[h] + log(WEIGHT[h]));
    return sum;
}

static double dot(const double *a, const double *b, int n) {
    double sum = 0.0;
    for (int k = 0; k < n; k++) sum += a[k] * b[k];
    return sum;
}

/* Median of the departures of feature k from the reference, over the openings of a settled alarm. */
static double median(const epv_monitor *m, int k) {
    double sorted[EPV_SETTLING];
    for (int i = 0; i < EPV_SETTLING; i++) {
        const double value = m->recent[i][k] - dot(m->reference[k], m->conditions[i], L);
        int j = i;
        for (; j > 0 && sorted[j - 1] > value; j--) sorted[j] = sorted[j - 1];
        sorted[j] = value;
    }
    return (sorted[(EPV_SETTLING - 1) / 2] + sorted[EPV_SETTLING / 2]) / 2;
}

/* The present state becomes the reference; the latest change can be taken back from now on. */
static void settle(epv_monitor *m) {
    const double sum = total(m);
    int best = 0;
    m->onset = epv_monitor_causes(m, m->share);
    for (int h = 1; h < H; h++) if (WEIGHT[h] * exp(m->log[h] - sum) > WEIGHT[best] * exp(m->log[best] - sum)) best = h;
    for (int k = 0; k < N; k++) {
        m->before[k] = m->mean[k];
        for (int h = 0; h < H; h++) m->before[k] -= WEIGHT[h] * exp(m->log[h] - sum) * m->learnt[h][k];
        for (int l = 0; l < L; l++) {
            m->back[k][l] = best == R ? -m->back[k][l] : SHIFT[best][k][l];
            m->reference[k][l] += m->back[k][l];
        }
        m->mean[k] = median(m, k);
        m->variance[k] = $relearnt;
    }
    m->returns = 1;
    m->changes += m->changes < UINT_MAX;
    refer(m, 0.0);
}

static void observe(epv_monitor *m, const double *x, const double *z) {
    const double time = m->periods * $period, elapsed = (time - m->last) / 3600.0;
    double departure[N], found[N], spread[N];
    for (int k = 0; k < N; k++) {
        spread[k] = 1.0 + m->variance[k];
        departure[k] = dot(WHITEN[k], z, N) - dot(EXPECTED[k], x, $terms);
        if (!isfinite(departure[k])) return; /* a reading was absurd: the opening does not count */
        found[k] = departure[k] - dot(m->reference[k], x, L) - m->mean[k];
    }
    for (int h = 0; h < H; h++) {
        const double hours = later(m, h) * elapsed, prior = sum_log(m->log[h], log(most(hours, $least)));
        const double begun = hours * exp(-prior);
        double ratio = 0.0;
        for (int k = 0; k < N; k++) {
            const double shift = h == R ? m->returns * (m->before[k] - dot(m->back[k], x, L) - m->mean[k])
                                        : dot(SHIFT[h][k], x, L) - m->learnt[h][k];
            const double limit = $clipped * sqrt(spread[k]), far = found[k] - shift;
            ratio += (least(found[k] * found[k], limit * limit) - least(far * far, limit * limit)) / spread[k];
            m->learnt[h][k] = m->learnt[h][k] * (1.0 - begun)
                            + m->variance[k] / spread[k] * most(-limit, least(limit, shift));
        }
        m->since[h] += begun * (time - m->since[h]);
        m->log[h] = prior + ratio / 2;
    }
    for (int k = 0; k < N; k++) {
        const double limit = $clipped * sqrt(spread[k]);
        m->mean[k] += m->variance[k] / spread[k] * most(-limit, least(limit, found[k]));
        m->variance[k] = most(m->variance[k] / spread[k], 1.0 / $memory);
    }
    m->last = time;
    if (!sound(m)) {
        m->restarts += m->restarts < UINT_MAX;
        restart(m);
    }
    memcpy(m->recent[m->next], departure, sizeof departure);
    memcpy(m->conditions[m->next], x, sizeof m->conditions[0]);
    m->next = (m->next + 1) % EPV_SETTLING;
    m->alarms = total(m) + log(m->rate) > 0.0 ? m->alarms + 1 : 0;
    if (m->alarms == EPV_SETTLING) settle(m);
}

void epv_monitor_update(epv_monitor *m, int coil, double U, double p1, double p2, double p3, double I) {
    const double row[6] = {coil, U, p1, p2, p3, I};
    m->periods += 1.0;
    memmove(m->rows[0], m->rows[1], sizeof m->rows - sizeof m->rows[0]);
    memcpy(m->rows[LENGTH - 1], row, sizeof row);
    if (!coil) {
        if (m->on) m->off = m->on >= I0 ? 0 : -1;
        m->on = 0;
        m->off += m->off >= 0 && m->off < LENGTH;
        return;
    }
    m->on += m->on < LENGTH;
    if (m->on == $after && m->off >= $shortest && m->off <= $longest) {
        double x[$terms], z[N];
        const int rows = I0 + m->off + $after;
        if (features((const double (*)[6])m->rows + LENGTH - rows, rows, x, z)) observe(m, x, z);
    }
}

double epv_monitor_probability(const epv_monitor *m) {
    return 1.0 / (1.0 + exp(-log(m->rate) - total(m)));
}

double epv_monitor_causes(const epv_monitor *m, double *share) {
    const double sum = total(m);
    double onset = 0.0;
    for (int e = 0; e < EPV_EFFECTS; e++) share[e] = 0.0;
    for (int h = 0; h < H; h++) {
        const double own = WEIGHT[h] * exp(m->log[h] - sum);
        onset += own * m->since[h];
        share[EFFECT[h]] += own;
    }
    return onset;
}
