/* LAW: strains e_k = sum_t f_t u_i . u_j - e0_k of VECTORS vectors u, W = 1/2 sum C_kl e_k e_l; S = s_k A_k u, s = C e. */
static const int LAW_of[TERMS_][3] = {OF};
static const double LAW_factor[TERMS_] = {FACTORS};
static const int LAW_pair[PAIRS_][3] = {COUPLED};
static const double LAW_part[PAIRS_] = {PARTS};

/* e (k) += f u_i . v_j at point q. */
static void LAW_products(int n, int q, double share, const double *u, const double *v, double *e)
{
    for (int t = 0; t < TERMS_; t++) {
        const double *a = u + 3 * LAW_of[t][1] * n + q, *b = v + 3 * LAW_of[t][2] * n + q;
        e[LAW_of[t][0]] += share * LAW_factor[t] * (a[0] * b[0] + a[n] * b[n] + a[2 * n] * b[2 * n]);
    }
}

/* weight C e, and e itself less its reference, of the strains of gradients u at point q. */
static void LAW_forces(int n, int q, const double *s, const double *e, double *forces)
{
    const double weight = s[LAST_ * n + q];
    for (int k = 0; k < STRAINS_; k++)
        forces[k] = 0.0;
    for (int p = 0; p < PAIRS_; p++) {
        const int k = LAW_pair[p][0], l = LAW_pair[p][1];
        const double C = weight * LAW_part[p] * s[LAW_pair[p][2] * n + q];
        forces[k] += C * e[l];
        if (k != l)
            forces[l] += C * e[k];
    }
}

static void LAW_begin(int n, int q, const double *s, double *e)
{
    for (int k = 0; k < STRAINS_; k++)
        e[k] = -s[(FIRST_ + k) * n + q];
}

static double LAW_energy(int n, const double *restrict u, const double *restrict s)
{
    double total = 0.0, e[STRAINS_], forces[STRAINS_];
    for (int q = 0; q < n; q++) {
        LAW_begin(n, q, s, e);
        LAW_products(n, q, 1.0, u, u, e);
        LAW_forces(n, q, s, e, forces);
        total += 0.5 * dot(e, forces, STRAINS_);
    }
    return total;
}

static void LAW_stress(int n, const double *restrict u, const double *restrict v, const double *restrict s, double beta,
                       double *restrict S)
{
    double e[STRAINS_], forces[STRAINS_];
    for (int i = 0; i < 3 * VECTORS * n; i++)
        S[i] = 0.0;
    for (int q = 0; q < n; q++) {
        LAW_begin(n, q, s, e);
        LAW_products(n, q, 1.0, u, u, e);
        if (beta > 0.0) {
            LAW_products(n, q, beta, u, v, e);
            LAW_products(n, q, beta, v, u, e);
        }
        LAW_forces(n, q, s, e, forces);
        for (int t = 0; t < TERMS_; t++) {
            const double f = LAW_factor[t] * forces[LAW_of[t][0]];
            for (int c = 0; c < 3; c++) {
                const int i = (3 * LAW_of[t][1] + c) * n + q, j = (3 * LAW_of[t][2] + c) * n + q;
                S[i] += f * u[j];
                S[j] += f * u[i];
            }
        }
    }
}

/* D = sum_k s_k A_k of the held gradients + (1 + beta) sum_kl C_kl g_k g_l^T, g_k = A_k u, by its lower half. */
static void LAW_modulus(int n, const double *restrict u, const double *restrict held, const double *restrict s, double beta,
                        double *restrict D)
{
    double e[STRAINS_], forces[STRAINS_], g[STRAINS_][3 * VECTORS], Cg[STRAINS_][3 * VECTORS];
    for (int q = 0; q < n; q++) {
        const double weight = (1.0 + beta) * s[LAST_ * n + q];
        LAW_begin(n, q, s, e);
        LAW_products(n, q, 1.0, held, held, e);
        LAW_forces(n, q, s, e, forces);
        for (int k = 0; k < STRAINS_; k++)
            for (int i = 0; i < 3 * VECTORS; i++)
                g[k][i] = Cg[k][i] = 0.0;
        for (int t = 0; t < TERMS_; t++)
            for (int c = 0; c < 3; c++) {
                const int i = 3 * LAW_of[t][1] + c, j = 3 * LAW_of[t][2] + c;
                g[LAW_of[t][0]][i] += LAW_factor[t] * u[j * n + q];
                g[LAW_of[t][0]][j] += LAW_factor[t] * u[i * n + q];
            }
        for (int p = 0; p < PAIRS_; p++) {
            const int k = LAW_pair[p][0], l = LAW_pair[p][1];
            const double C = weight * LAW_part[p] * s[LAW_pair[p][2] * n + q];
            if (C == 0.0)
                continue;
            add_row(C, g[l], Cg[k], 3 * VECTORS);
            if (k != l)
                add_row(C, g[k], Cg[l], 3 * VECTORS);
        }
        for (int i = 0; i < 3 * VECTORS; i++)
            for (int j = 0; j <= i; j++) {
                double total = 0.0;
                for (int k = 0; k < STRAINS_; k++)
                    total += g[k][i] * Cg[k][j];
                D[(i * (i + 1) / 2 + j) * n + q] = total;
            }
        for (int t = 0; t < TERMS_; t++)
            for (int c = 0; c < 3; c++) {
                const int i = 3 * LAW_of[t][1] + c, j = 3 * LAW_of[t][2] + c, a = i > j ? i : j, b = i > j ? j : i;
                D[(a * (a + 1) / 2 + b) * n + q] += LAW_factor[t] * forces[LAW_of[t][0]] * (i == j ? 2.0 : 1.0);
            }
    }
}
