static float logistic(float x)
{
    return 0.5f + 0.5f * hyperbolic_tangent(0.5f * x);
}

static float next_cell(const float *observation, const float *cell, int j)
{
    const int update_row = CELLS + j, candidate_row = 2 * CELLS + j;
    const float reset = logistic(row(&NEW, j, observation) + row(&OLD, j, cell));
    const float update = logistic(row(&NEW, update_row, observation) + row(&OLD, update_row, cell));
    const float candidate = hyperbolic_tangent(row(&NEW, candidate_row, observation)
                                               + reset * row(&OLD, candidate_row, cell));
    return (1.0f - update) * candidate + update * cell[j];
}

/* Takes the cells one period on. A cell that would not be a number, as when an entry of the observation is
 * none, stays as it was: or it would never be one again. */
static void next_cells(epv_float_memory *m, const float *observation, float *cell)
{
    int j;
    for (j = 0; j < CELLS; j++) {
        const float next = next_cell(observation, m->cell, j);
        cell[j] = next == next ? next : m->cell[j];
    }
    for (j = 0; j < CELLS; j++)
        m->cell[j] = cell[j];
}
