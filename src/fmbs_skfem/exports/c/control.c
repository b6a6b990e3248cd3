
/* Steps between two samples of a controller. */
static const int EVERY[CONTROLLED] = {EVERY_SAMPLE};

/* When a controller acts next: at a multiple of its sample time. */
static double next_sample(const NAME_memory *m, int k)
{
    return (double)(m->samples[k] * EVERY[k]) * NAME_STEP;
}

static int is_due(const NAME_memory *m, int k)
{
    return m->time > next_sample(m, k) - 1e-6 * NAME_STEP;
}

/* What a controller gives, up to its next sample; whether it is another value than before. */
static int give(NAME_memory *m, int k, double value)
{
    const int changed = value != m->inputs[INPUTS + k];
    m->inputs[INPUTS + k] = value;
    m->samples[k]++;
    return changed;
}

/* Let those controllers act whose instant it is. */
static NAME_status act(NAME_memory *m, int *changed)
{
    double found;
    ACT
    return NAME_OK;
}
