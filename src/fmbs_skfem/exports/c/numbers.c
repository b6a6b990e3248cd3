/* P (t,): products of Lagrange polynomials of all parameters; the last parameter changes first. */
static void weigh(const NAME_memory *m, int order, double *weights)
{
    int count = 1;
    weights[0] = 1.0;
    for (int p = 0; p < PARAMETERS; p++) {
        const int degree = ORDER[order][p], logarithmic = ORDER[order][PARAMETERS + p];
        const double *node = NODE + p * NODES;
        const double x = logarithmic ? math_log(m->acting_parameters[p]) : m->acting_parameters[p];
        if (degree == 0)
            continue;
        for (int k = count - 1; k >= 0; k--)
            for (int j = degree; j >= 0; j--) {
                const double own = logarithmic ? math_log(node[j]) : node[j];
                double value = weights[k];
                for (int i = 0; i <= degree; i++) {
                    const double other = logarithmic ? math_log(node[i]) : node[i];
                    if (i != j)
                        value *= (x - other) / (own - other);
                }
                weights[k * (degree + 1) + j] = value;
            }
        count *= degree + 1;
    }
}

/* a += sum_q (sum_t P_t mixture_tq) a_q. */
static void mix(const double *weights, int t, int q, int n, const double *changes, const double *mixture, double *a)
{
    for (int k = 0; k < q; k++) {
        double weight = 0.0;
        for (int j = 0; j < t; j++)
            weight += weights[j] * mixture[j * q + k];
        add_row(weight, changes + k * n, a, n);
    }
}

static void set_numbers(NAME_memory *m, int starting)
{
    double weights[LONGEST];
    (void)starting;
    LINES
}
