static void remember(epv_${variant}_memory *m, const epv_${variant}_readings *now)
{
    int i;
    if (!m->begun) {
        for (i = 0; i < EPV_${capital}_HISTORY; i++) {
            m->p2[i] = now->p2;
            m->p3[i] = now->p3;
        }
        m->waited = LONGEST_WAIT;
        m->newest = 0;
        m->begun = 1;
    } else {
        m->newest = (uint8_t)((m->newest + 1) % EPV_${capital}_HISTORY);
        m->p2[m->newest] = now->p2;
        m->p3[m->newest] = now->p3;
        if (now->coil != m->coil)
            m->waited = 1;
        else if (m->waited < LONGEST_WAIT)
            m->waited++;
    }
    m->coil = now->coil;
}
