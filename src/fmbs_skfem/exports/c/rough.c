static double value_NUMBER(NAME_memory *m, double t)
{
    (void)m;
    follow_inputs(m, t);
    LINES
    return VALUE;
}

/* First three derivatives of the cubic through its values at the ends and at two points inside of a step of the length h [s]. */
static void follow_NUMBER(NAME_memory *m, double t, double h, double *first, double *second, double *third)
{
    const double d = h / 3.0, a = value_NUMBER(m, t - d), b = value_NUMBER(m, t - 2.0 * d), c = value_NUMBER(m, t - 3.0 * d);
    const double u = value_NUMBER(m, t);
    *first = (11.0 * u - 18.0 * a + 9.0 * b - 2.0 * c) / (6.0 * d);
    *second = (2.0 * u - 5.0 * a + 4.0 * b - c) / (d * d);
    *third = (u - 3.0 * a + 3.0 * b - c) / (d * d * d);
}
