#define EACH(i, n) for (int i = 0; i < (n); i++)

/* Inputs that drive joints at the time t: the cubic through their values at the ends of the last four spans, and its derivatives. */
static void follow_inputs(NAME_memory *m, double t)
{
    const double h = m->given_span, s = (t - m->given_end) / h;
    EACH (i, DRIVEN) {
        const double u = m->given[0][i], d = u - m->given[1][i], e = u - 2.0 * m->given[1][i] + m->given[2][i];
        const double f = u - 3.0 * (m->given[1][i] - m->given[2][i]) - m->given[3][i];
        m->smooth[0][i] = u + s * (d + (s + 1.0) / 2.0 * (e + (s + 2.0) / 3.0 * f));
        m->smooth[1][i] = (d + (s + 0.5) * e + (0.5 * s * s + s + 1.0 / 3.0) * f) / h;
        m->smooth[2][i] = (e + (s + 1.0) * f) / (h * h);
        m->smooth[3][i] = f / (h * h * h);
    }
}

/* All functions of time at t; where joints read them with their derivatives. */
static void read_signals(NAME_memory *m, double t, double *row)
{
    (void)m;
    (void)t;
    (void)row;
READ
}

#if WIDTH > 0
/* Signals at the ends of so many parts of a step that is divided. */
static long long fill_signals(NAME_memory *m, long long parts)
{
    const int count = (int)parts;
    EACH (k, count) {
        const double t = k == count - 1 ? m->end : m->begin + (m->end - m->begin) * (k + 1) / count;
        follow_inputs(m, t);
        read_signals(m, t, @job_signals@ + k * WIDTH);
    }
    @levels_found@[0] = count;
    return 0;
}
#endif
