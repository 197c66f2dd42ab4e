/* What the layers see: the observation. This policy remembers nothing but readings. */
static void see(epv_${variant}_memory *m, const ${signal} *observation, ${signal} *seen)
{
    int i;
    (void)m;
    for (i = 0; i < EPV_${capital}_INPUTS; i++)
        seen[i] = observation[i];
}
