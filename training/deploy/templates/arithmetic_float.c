static const float PERIOD = $period;
static const float LONGEST = $longest;

static const float CENTRE[EPV_FLOAT_INPUTS] = {$centre};
static const float SCALE[EPV_FLOAT_INPUTS] = {$scale};
static const float LIMIT[EPV_FLOAT_INPUTS] = {$limit};

typedef struct {
    const float *weight; /* row after row */
    const float *bias;
    int inputs;
    int outputs;
} layer;

static float limited(float value, float limit)
{
    return value > limit ? limit : value < -limit ? -limit : value;
}

/* Entry i of the observation from its value in its unit. */
static float entry(float value, int i)
{
    return limited((value - CENTRE[i]) / SCALE[i], LIMIT[i]);
}

/* Hyperbolic tangent to 7 units in the last place: Lambert's continued fraction, broken off after
 * six terms, gives n/d = tanh(x/2); tanh(x) = 2 (n/d) / (1 + (n/d)^2). No term is subtracted. */
static float hyperbolic_tangent(float x)
{
    const float y = 0.5f * x, s = y * y;
    const float n = y * ((21.0f * s + 1260.0f) * s + 10395.0f);
    const float d = ((s + 210.0f) * s + 4725.0f) * s + 10395.0f;
    if (x > 9.02f)
        return 1.0f;
    if (x < -9.02f)
        return -1.0f;
    return 2.0f * n * d / (n * n + d * d);
}

static float row(const layer *l, int j, const float *signal)
{
    const float *weight = l->weight + j * l->inputs;
    float sum = l->bias[j];
    int i;
    for (i = 0; i < l->inputs; i++)
        sum += weight[i] * signal[i];
    return sum;
}
