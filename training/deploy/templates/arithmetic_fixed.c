enum { PERIOD = EPV_FIXED_PERIOD_US, LONGEST = $longest_us };

/* Of the observation's entries, in Pa, uA, us and 1/1000: the centre, the reach to either side, and what
 * makes 32767 of the reach when shifted right. */
static const int32_t CENTRE[EPV_FIXED_INPUTS] = {$centre};
static const int32_t REACH[EPV_FIXED_INPUTS] = {$reach};
static const uint32_t FACTOR[EPV_FIXED_INPUTS] = {$factor};
enum { FACTOR_SHIFT = $factor_shift };

typedef struct {
    const int8_t *weight; /* row after row */
    const uint32_t *factor; /* of each row's sum, before the shift */
    const int32_t *bias;
    int inputs;
    int outputs;
    int shift;
} layer;

/* 32767 tanh(i / 32) */
static const int16_t TANGENT[257] = {$tangent};

/* value factor / 2^shift, halves away from zero. Only an unsigned number is shifted: every compiler agrees. */
static int32_t scaled(int32_t value, uint32_t factor, int shift)
{
    const uint64_t size = (uint64_t)(value < 0 ? -(int64_t)value : (int64_t)value);
    const int32_t rounded = (int32_t)((size * factor + ((uint64_t)1 << (shift - 1))) >> shift);
    return value < 0 ? -rounded : rounded;
}

static int32_t limited(int64_t value, int32_t limit)
{
    return value > limit ? limit : value < -limit ? -limit : (int32_t)value;
}

/* Entry i of the observation from its value in its unit. */
static int16_t entry(int64_t value, int i)
{
    return (int16_t)scaled(limited(value - CENTRE[i], REACH[i]), FACTOR[i], FACTOR_SHIFT);
}

/* From the table, linear between its points. */
static int16_t hyperbolic_tangent(int32_t x)
{
    const uint32_t size = x < 0 ? 0u - (uint32_t)x : (uint32_t)x;
    const uint32_t i = size >> 11, part = size & 2047u;
    int32_t tangent = 32767;
    if (i < 256) {
        const uint32_t rise = (uint32_t)(TANGENT[i + 1] - TANGENT[i]);
        tangent = TANGENT[i] + (int32_t)((rise * part + 1024u) >> 11);
    }
    return (int16_t)(x < 0 ? -tangent : tangent);
}

static int32_t row(const layer *l, int j, const int16_t *signal)
{
    const int8_t *weight = l->weight + j * l->inputs;
    int32_t sum = 0;
    int i;
    for (i = 0; i < l->inputs; i++)
        sum += (int32_t)weight[i] * signal[i];
    return scaled(sum, l->factor[j], l->shift) + l->bias[j];
}
