#define GIVEN (INPUTS + CONTROLLED + LATCHED) /* inputs of the caller, what controllers give, and what locks hold */
#define EACH(i, n) for (int i = 0; i < (n); i++)

/* An input at the time t, by its value and derivatives when it was given. */
static double input_at(const NAME_memory *m, int k, double t)
{
    const double time = t - m->told;
    return m->inputs[k] + time * (m->rates[0][k] + time / 2.0 * (m->rates[1][k] + time / 3.0 * m->rates[2][k]));
}

/* Inputs at the time t. Those that drive joints: the cubic through their values at the ends of the last four spans, and its derivatives. */
static void follow_inputs(NAME_memory *m, double t)
{
    EACH (k, GIVEN)
        m->acting[k] = input_at(m, k, t);
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

ROUGH
SEARCH
/* All functions of time at t; where joints read them with their derivatives, at the end of a step of a length h [s], or at the start (0). */
static void read_signals(NAME_memory *m, double t, double h, double *row)
{
    (void)m;
    (void)t;
    (void)h;
    (void)row;
READ
}

/* Numbers of the method that depend on the step h [s]: of whole steps, or of the parts of a step. */
static void set_method(NAME_memory *m, int k, double h)
{
    const double c = h * h * BETA;
    m->method_h[k] = h;
    m->method_c[k] = c;
    m->method_bh[k] = (1.0 - ALPHA_M) / (c * (1.0 - ALPHA_F));
    m->method_gh[k] = GAMMA / (h * BETA);
    m->method_sharp[k] = SHARP * c;
#if LOCATING
    const double length = m->method_h[0] / (FALLING * h);
    m->method_allowed[k] = most(LEAST, least(1.0, length * length * length * length));
#endif
}

/* Those of all parts of the span JOB. */
static long long set_parts(NAME_memory *m, long long unread)
{
    (void)unread;
    for (int k = 1; k < LENGTHS; k++)
        set_method(m, k, @levels_spans@[1] / (double)(1 << HALVINGS[k]));
    return 0;
}

#if WIDTH > 0
/* Signals at the ends of so many parts of the span NOW, or at its begin. */
static long long fill_signals(NAME_memory *m, long long count)
{
    const double begin = @levels_spans@[2], span = @levels_spans@[3];
    const int many = count > 0 ? (int)count : 1;
    EACH (k, many) {
        const double t = count > 0 ? begin + span * (k + 1) / (double)count : begin;
        follow_inputs(m, t);
        read_signals(m, t, span / many, @job_signals@ + k * WIDTH);
    }
    @levels_found@[0] = many;
    return 0;
}
#endif
