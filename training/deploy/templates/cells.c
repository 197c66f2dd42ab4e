/* The gated recurrent unit's layers, of the new observation and of the old cells: rows of the reset gate,
 * of the update gate and of the candidate. */
static const layer NEW = $NEW;
static const layer OLD = $OLD;

$cell_arithmetic
