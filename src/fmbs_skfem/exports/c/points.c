/* Body NUMBER: @POINTS@ points in @MODES@ modes, u = offset + sum_r x_r L_r of @ROWS@ position gradients a point. */
#define POINTS_NUMBER @POINTS@
#define ROWS_NUMBER @ROWS@
#define MODES_NUMBER @MODES@
#define FIRST_NUMBER @FIRST@

static void read_NUMBER(const NAME_memory *m, const double *x, const double *offset, double *u)
{
    (void)m;
    for (int i = 0; i < ROWS_NUMBER * POINTS_NUMBER; i++)
        u[i] = offset ? offset[i] : 0.0;
    add_rows(MODES_OF_NUMBER, x + FIRST_NUMBER, MODES_NUMBER, u, ROWS_NUMBER * POINTS_NUMBER);
}

static void force_NUMBER(NAME_memory *m)
{
    double *u = m->room[0], *rates = m->room[1], *S = m->room[2];
    read_NUMBER(m, m->trial_x, OFFSET_NUMBER, u);
    if (BETA_NUMBER > 0.0)
        read_NUMBER(m, m->trial_v, 0, rates);
    LAW_stress(POINTS_NUMBER, u, rates, SECTION_NUMBER, BETA_NUMBER, S);
    add_sums(MODES_OF_NUMBER, S, MODES_NUMBER, m->rhs + FIRST_NUMBER, ROWS_NUMBER * POINTS_NUMBER);
}

/* W += L^T D L, with the axial strains of the accepted state where these are held. */
static void tangent_NUMBER(NAME_memory *m, int held)
{
    double *u = m->room[0], *before = m->room[1], *D = m->moduli, *T = m->room[2];
    read_NUMBER(m, m->trial_x, OFFSET_NUMBER, u);
    if (held && HOLDS_NUMBER)
        read_NUMBER(m, m->now.x, OFFSET_NUMBER, before);
    LAW_modulus(POINTS_NUMBER, u, held && HOLDS_NUMBER ? before : u, SECTION_NUMBER, m->gh * BETA_NUMBER, D);
    for (int r = 0; r < MODES_NUMBER; r++) {
        const double *row = MODES_OF_NUMBER + r * (ROWS_NUMBER * POINTS_NUMBER);
        for (int i = 0; i < ROWS_NUMBER; i++) {
            double *restrict target = T + i * POINTS_NUMBER;
            for (int p = 0; p < POINTS_NUMBER; p++)
                target[p] = 0.0;
            for (int j = 0; j < ROWS_NUMBER; j++) {
                const double *restrict d = D + (i > j ? i * (i + 1) / 2 + j : j * (j + 1) / 2 + i) * POINTS_NUMBER;
                const double *restrict l = row + j * POINTS_NUMBER;
                for (int p = 0; p < POINTS_NUMBER; p++)
                    target[p] += d[p] * l[p];
            }
        }
        double found[MODES_NUMBER] = {0.0};
        add_sums(MODES_OF_NUMBER, T, r + 1, found, ROWS_NUMBER * POINTS_NUMBER);
        for (int s = 0; s <= r; s++) {
            m->W[PLACE_NUMBER + r * SIZE_NUMBER + s] += found[s];
            if (s < r)
                m->W[PLACE_NUMBER + s * SIZE_NUMBER + r] += found[s];
        }
    }
}

static double energy_NUMBER(NAME_memory *m)
{
    read_NUMBER(m, m->now.x, OFFSET_NUMBER, m->room[0]);
    return LAW_energy(POINTS_NUMBER, m->room[0], SECTION_NUMBER);
}
