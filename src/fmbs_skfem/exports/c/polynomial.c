/* Body NUMBER: the energy as a polynomial of degree 4 in @MODES@ unknowns, W = sum T_abcd z_a z_b z_c z_d, z = (1, x), a <= b <= c <= d.
 * With y_ab = z_a z_b the coefficients of a pair (c, d) are a row B_cd over the pairs (a, b), b <= c:  g = dW/dy. */
#define PAIRS_NUMBER @PAIRS@
#define MODES_NUMBER @MODES@
#define FIRST_NUMBER @FIRST@

static void pairs_NUMBER(const NAME_memory *m, const double *x, double *z, double *y, double *g)
{
    const double *row = COEFFICIENTS_NUMBER;
    int k = 0;
    (void)m;
    z[0] = 1.0;
    for (int i = 0; i < MODES_NUMBER; i++)
        z[i + 1] = x[FIRST_NUMBER + i];
    for (int b = 0; b <= MODES_NUMBER; b++)
        for (int a = 0; a <= b; a++, k++) {
            y[k] = z[a] * z[b];
            g[k] = 0.0;
        }
    for (int c = 0; c <= MODES_NUMBER; c++) {
        const int size = (c + 1) * (c + 2) / 2;
        for (int d = c; d <= MODES_NUMBER; d++, row += size) {
            g[d * (d + 1) / 2 + c] += dot(row, y, size);
            add_row(z[c] * z[d], row, g, size);
        }
    }
}

/* h = d(row y)/dz of the pairs up to c. */
static void slope_NUMBER(const double *row, const double *z, int c, double *h)
{
    for (int b = 0; b <= c; row += ++b) {
        double total = 0.0;
        for (int a = 0; a < b; a++) {
            total += row[a] * z[a];
            h[a] += row[a] * z[b];
        }
        h[b] = total + 2.0 * row[b] * z[b];
    }
}

static void force_NUMBER(NAME_memory *m)
{
    double *z = m->room[0], *h = m->room[0] + MODES_NUMBER + 1;
    pairs_NUMBER(m, m->trial_x, z, m->room[1], m->room[2]);
    slope_NUMBER(m->room[2], z, MODES_NUMBER, h);
    for (int i = 0; i < MODES_NUMBER; i++)
        m->rhs[FIRST_NUMBER + i] += h[i + 1];
}

/* W += factor (e_i h^T + h e_i^T). */
static void row_NUMBER(NAME_memory *m, int i, const double *h, double factor, int count)
{
    double *W = m->W + PLACE_NUMBER;
    for (int a = 1; i > 0 && a < count; a++) {
        W[(i - 1) * SIZE_NUMBER + a - 1] += factor * h[a];
        W[(a - 1) * SIZE_NUMBER + i - 1] += factor * h[a];
    }
}

static void tangent_NUMBER(NAME_memory *m, int held)
{
    double *z = m->room[0], *h = m->room[0] + MODES_NUMBER + 1, *g = m->room[2], *W = m->W + PLACE_NUMBER;
    const double *row = COEFFICIENTS_NUMBER;
    (void)held;
    pairs_NUMBER(m, m->trial_x, z, m->room[1], g);
    for (int c = 0; c <= MODES_NUMBER; c++)
        for (int d = c; d <= MODES_NUMBER; d++, row += (c + 1) * (c + 2) / 2) {
            slope_NUMBER(row, z, c, h);
            row_NUMBER(m, c, h, z[d], c + 1);
            row_NUMBER(m, d, h, z[c], c + 1);
        }
    for (int b = 1; b <= MODES_NUMBER; b++) {
        const double *of = g + b * (b + 1) / 2;
        for (int a = 1; a < b; a++) {
            W[(b - 1) * SIZE_NUMBER + a - 1] += of[a];
            W[(a - 1) * SIZE_NUMBER + b - 1] += of[a];
        }
        W[(b - 1) * (SIZE_NUMBER + 1)] += 2.0 * of[b];
    }
}

static double energy_NUMBER(NAME_memory *m)
{
    pairs_NUMBER(m, m->now.x, m->room[0], m->room[1], m->room[2]);
    return 0.5 * dot(m->room[1], m->room[2], PAIRS_NUMBER);
}
