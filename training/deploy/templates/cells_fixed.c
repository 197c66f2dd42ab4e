/* The logistic function of x, 1 to 32768, which stands for 1. */
static uint16_t gate(int32_t x)
{
    return (uint16_t)((uint32_t)(32769 + hyperbolic_tangent(x / 2)) >> 1);
}

/* Its two summands cannot leave 32767 * 32768 together: they are parts of it. */
static int32_t next_cell(const int16_t *observation, const int16_t *old, int32_t cell, int j)
{
    const int update_row = CELLS + j, candidate_row = 2 * CELLS + j;
    const uint16_t reset = gate(row(&NEW, j, observation) + row(&OLD, j, old));
    const uint16_t update = gate(row(&NEW, update_row, observation) + row(&OLD, update_row, old));
    const int32_t kept = scaled(row(&OLD, candidate_row, old), reset, 15);
    const int32_t candidate = hyperbolic_tangent(row(&NEW, candidate_row, observation) + kept);
    return (32768 - update) * candidate + scaled(cell, update, 15);
}

/* Takes the cells one period on. Cells: int32_t, 32767 * 32768 stands for 1; rounded to int16_t where
 * weights multiply them. */
static void next_cells(epv_fixed_memory *m, const int16_t *observation, int16_t *cell)
{
    int16_t old[CELLS];
    int j;
    for (j = 0; j < CELLS; j++)
        old[j] = (int16_t)scaled(m->cell[j], 1, 15);
    for (j = 0; j < CELLS; j++) {
        m->cell[j] = next_cell(observation, old, m->cell[j], j);
        cell[j] = (int16_t)scaled(m->cell[j], 1, 15);
    }
}
