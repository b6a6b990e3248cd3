/* Numbers of the method that depend on the step h [s]. */
static void set_step(NAME_memory *m, double h)
{
    m->h = h;
    m->c = h * h * BETA;
    m->bh = (1.0 - ALPHA_M) / (m->c * (1.0 - ALPHA_F));
    m->gh = GAMMA / (h * BETA);
    m->sharp = SHARP * m->c;
}

/* a1 of q1'', q0'' and a0. */
static double algorithmic(double now, double before, double a)
{
    return ((1.0 - ALPHA_F) * now + ALPHA_F * before - ALPHA_M * a) * (1.0 / (1.0 - ALPHA_M));
}

static double guess_of(const double *latest, const double *before, const double *first, int order, int i)
{
    if (order <= 0)
        return latest[i];
    return order == 1 ? 2.0 * latest[i] - before[i] : 3.0 * (latest[i] - before[i]) + first[i];
}

/* The trial state from extrapolated q'' and multipliers. */
static void predict(NAME_memory *m)
{
    const int order = m->now.order < m->now.known - 1 ? m->now.order : m->now.known - 1;
    const double h = m->h;
    EACH (i, UNKNOWNS) {
        const double acceleration = guess_of(m->now.history[0], m->now.history[1], m->now.history[2], order, i);
        const double a1 = algorithmic(acceleration, m->now.acceleration[i], m->now.a[i]);
        m->trial_acceleration[i] = acceleration;
        m->trial_x[i] = m->now.x[i] + h * m->now.v[i] + h * h * ((0.5 - BETA) * m->now.a[i] + BETA * a1);
        m->trial_v[i] = m->now.v[i] + h * ((1.0 - GAMMA) * m->now.a[i] + GAMMA * a1);
    }
    EACH (k, EQUATIONS)
        m->trial_multipliers[k] = guess_of(m->now.past[0], m->now.past[1], m->now.past[2], order, k);
    m->pull = HUGE_NUMBER;
}

/* y += A x of a symmetric A, block by block of unknowns that only joints couple. */
static void add_blocks(const double *A, const double *x, double *y)
{
    EACH (b, BLOCKS) {
        const int first = BLOCK[b], size = BLOCK[b + 1] - first;
        add_rows(A, x + first, size, y + first, size);
        A += size * size;
    }
}

/* y = P x, or with the offset y0, of the rows that joints and loads read. */
static void read_rows(const NAME_memory *m, const double *x, int with_offset, double *y)
{
    (void)m;
    EACH (j, PROBES) {
        const int first = PROBE_FIRST[j], size = PROBE_FIRST[j + 1] - first;
        y[j] = (with_offset ? PROBE_OFFSET[j] : 0.0) + dot(PROBE_ROWS + first, x + PROBE_BEGIN[j], size);
    }
}

/* x += factor P^T g. */
static void add_transposed(const NAME_memory *m, double factor, const double *g, double *x)
{
    (void)m;
    EACH (j, PROBES) {
        const int first = PROBE_FIRST[j], size = PROBE_FIRST[j + 1] - first;
        const double value = factor * g[j];
        const double *row = PROBE_ROWS + first;
        double *part = x + PROBE_BEGIN[j];
        if (value != 0.0)
            EACH (i, size)
                part[i] += row[i] * value;
    }
}

/* Phi and dPhi/dy of the joints, sums of terms coefficient s(t) y_i y_j. */
static void constrain(NAME_memory *m, double *phi)
{
    EACH (k, EQUATIONS) {
        phi[k] = 0.0;
        EACH (j, PROBES)
            m->Jy[k][j] = 0.0;
    }
    EACH (t, TERMS) {
        const int k = TERM[t][0], s = TERM[t][1], i = TERM[t][2], j = TERM[t][3];
        const double value = TERM_VALUE[t] * (s < 0 ? 1.0 : m->signals[s]);
        if (i < 0) {
            phi[k] += value;
        } else if (j < 0) {
            phi[k] += value * m->y[i];
            m->Jy[k][i] += value;
        } else {
            phi[k] += value * m->y[i] * m->y[j];
            m->Jy[k][i] += value * m->y[j];
            m->Jy[k][j] += value * m->y[i];
        }
    }
}

/* rhs = (R, Phi) of the equations above at the trial state. */
static void find_residual(NAME_memory *m)
{
    double *f = m->rhs;
    EACH (i, UNKNOWNS)
        f[i] = 0.0;
    elastic_forces(m);
    add_blocks(MASS, m->trial_acceleration, f);
    if (HAS_DAMPING)
        add_blocks(DAMPING, m->trial_v, f);
    if (HAS_SPRINGS)
        add_blocks(SPRINGS, m->trial_x, f);
    EACH (i, UNKNOWNS)
        f[i] = m->c * (f[i] - LOAD[i]);
    if (PROBES == 0)
        return;
    read_rows(m, m->trial_x, 1, m->y);
    if (READS_RATES)
        read_rows(m, m->trial_v, 0, m->rates);
    EACH (j, PROBES)
        m->g[j] = 0.0;
    push_rows(m);
    constrain(m, m->rhs + UNKNOWNS);
    EACH (j, PROBES) {
        double total = -m->c * m->g[j];
        EACH (k, EQUATIONS)
            total += m->Jy[k][j] * m->trial_multipliers[k];
        m->g[j] = total;
    }
    add_transposed(m, 1.0, m->g, f);
}

/* P A = L U of a matrix by columns, A[j][i] at A + j n, the diagonal of U inverted; 0, or 1 where it is singular. */
static int factorise_dense(int n, double *A, int *pivots)
{
    EACH (k, n) {
        double *column = A + k * n;
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (size_of(column[i]) > size_of(column[best]))
                best = i;
        pivots[k] = best;
        if (!(size_of(column[best]) > 0.0))
            return 1;
        if (best != k)
            EACH (j, n) {
                const double kept = A[j * n + k];
                A[j * n + k] = A[j * n + best];
                A[j * n + best] = kept;
            }
        const double inverse = 1.0 / column[k];
        column[k] = inverse;
        for (int i = k + 1; i < n; i++)
            column[i] *= inverse;
        for (int j = k + 1; j < n; j++) {
            double *other = A + j * n;
            const double factor = other[k];
            if (factor != 0.0)
                for (int i = k + 1; i < n; i++)
                    other[i] -= column[i] * factor;
        }
    }
    return 0;
}

/* x <- A^-1 x with these factors. */
static void substitute(int n, const double *A, const int *pivots, double *x)
{
    EACH (k, n) {
        const double kept = x[k];
        x[k] = x[pivots[k]];
        x[pivots[k]] = kept;
    }
    EACH (k, n) {
        const double *column = A + k * n;
        const double value = x[k];
        for (int i = k + 1; i < n; i++)
            x[i] -= column[i] * value;
    }
    for (int k = n - 1; k >= 0; k--) {
        const double *column = A + k * n;
        const double value = x[k] * column[k];
        x[k] = value;
        EACH (i, k)
            x[i] -= column[i] * value;
    }
}

/* x <- W^-1 x, block by block. */
static void apply_factors(const NAME_memory *m, double *x)
{
    int at = 0;
    EACH (b, BLOCKS) {
        const int first = BLOCK[b], size = BLOCK[b + 1] - first;
        substitute(size, m->W + at, m->pivots + first, x + first);
        at += size * size;
    }
}

/* W += (1 + gh beta) (c^2 K_a + s^2 K_b + c s K_c): tangents of planar bodies that turn by an angle of c and s, without assembly. */
static void add_turned_tangents(NAME_memory *m)
{
    const double *K = m->turned_tangents;
    EACH (t, TURNING) {
        const int count = TURN[t][0], place = TURN[t][1], size = TURN[t][2];
        const double c = TURN_OFFSET[2 * t] + dot(TURN_ROWS + 2 * t * UNKNOWNS, m->trial_x, UNKNOWNS);
        const double s = TURN_OFFSET[2 * t + 1] + dot(TURN_ROWS + (2 * t + 1) * UNKNOWNS, m->trial_x, UNKNOWNS);
        const double factor = (1.0 + m->gh * TURN_BETA[t]) / (c * c + s * s), a = factor * c * c, b = factor * s * s;
        const double d = factor * c * s, *Kb = K + count * count, *Kc = Kb + count * count;
        EACH (i, count)
            EACH (j, count)
                m->W[place + i * size + j] += a * K[i * count + j] + b * Kb[i * count + j] + d * Kc[i * count + j];
        K += 3 * count * count;
    }
}

/* W at the trial state, with second derivatives of joints and forces on rows. */
static void assemble(NAME_memory *m, int held)
{
    EACH (i, ENTRIES)
        m->W[i] = m->bh * MASS[i] + (HAS_DAMPING ? m->gh * DAMPING[i] : 0.0) + (HAS_SPRINGS ? SPRINGS[i] : 0.0);
    if (TURNING > 0 && m->turning)
        add_turned_tangents(m);
    else
        elastic_tangents(m, held);
    EACH (i, ENTRIES)
        m->W[i] *= m->c;
    EACH (t, TERMS) {
        const int k = TERM[t][0], s = TERM[t][1], i = TERM[t][2], j = TERM[t][3];
        if (j >= 0) {
            const double value = TERM_VALUE[t] * (s < 0 ? 1.0 : m->signals[s]) * m->trial_multipliers[k];
            add_pair(m, i, j, value);
            add_pair(m, j, i, value);
        }
    }
    push_slopes(m);
}

/* Factors of W, W^-1 J^T and factors of J W^-1 J^T, J that of the trial state; 0, or 1 where one of them is singular. */
static int factorise(NAME_memory *m)
{
    m->secants = 0;
    m->factored = 0;
    m->factorisations++;
    EACH (b, BLOCKS)
        if (factorise_dense(BLOCK[b + 1] - BLOCK[b], m->W + BLOCK_AT[b], m->pivots + BLOCK[b]))
            return 1;
    EACH (k, EQUATIONS) {
        EACH (i, UNKNOWNS)
            m->J[k][i] = 0.0;
        add_transposed(m, 1.0, m->Jy[k], m->J[k]);
        EACH (i, UNKNOWNS)
            m->spread[k][i] = m->J[k][i];
        apply_factors(m, m->spread[k]);
    }
    EACH (k, EQUATIONS)
        EACH (l, EQUATIONS)
            m->schur[l * EQUATIONS + k] = dot(m->J[k], m->spread[l], UNKNOWNS);
    if (EQUATIONS > 0 && factorise_dense(EQUATIONS, m->schur, m->schur_pivots))
        return 1;
    m->factored = 1;
    return 0;
}

/* rhs <- [W, J^T; J, 0]^-1 rhs. */
static void solve(NAME_memory *m)
{
    double *front = m->rhs, *multipliers = m->rhs + UNKNOWNS;
    apply_factors(m, front);
    EACH (k, EQUATIONS)
        multipliers[k] = dot(m->J[k], front, UNKNOWNS) - multipliers[k];
    substitute(EQUATIONS, m->schur, m->schur_pivots, multipliers);
    EACH (k, EQUATIONS)
        EACH (i, UNKNOWNS)
            front[i] -= m->spread[k][i] * multipliers[k];
}

/* rhs, a solution with the factors, becomes one with the secants of the corrections made with them (Broyden's updates). */
static void add_secants(NAME_memory *m, int repeated)
{
    double *d = m->rhs;
    if (SECANTS == 0)
        return;
    for (int k = m->secants > SECANTS ? m->secants - SECANTS : 0; k < m->secants; k++) {
        const double factor = dot(m->shares[k % ROOM(SECANTS)], d, UNKNOWNS);
        EACH (i, UNKNOWNS + EQUATIONS)
            d[i] += factor * m->updates[k % ROOM(SECANTS)][i];
    }
    if (repeated) {
        double square = 0.0, part = 0.0;
        EACH (i, UNKNOWNS) {
            square += NORM[i] * m->moved[i] * m->moved[i];
            part += NORM[i] * m->moved[i] * d[i];
        }
        if (size_of(part) < CLEAR * square) {
            const int place = m->secants % ROOM(SECANTS);
            EACH (i, UNKNOWNS + EQUATIONS) {
                d[i] *= square / (square - part);
                m->updates[place][i] = d[i];
            }
            EACH (i, UNKNOWNS)
                m->shares[place][i] = NORM[i] * m->moved[i] / square;
            m->secants++;
        }
    }
    EACH (i, UNKNOWNS)
        m->moved[i] = d[i];
}

/* The size of the correction in rhs [m]. */
static double correction_size(const NAME_memory *m)
{
    double square = 0.0;
    EACH (i, UNKNOWNS)
        square += NORM[i] * m->rhs[i] * m->rhs[i];
    return math_sqrt(square);
}

/* Add the correction in rhs to the trial state. */
static void apply(NAME_memory *m)
{
    double pull = 0.0;
    EACH (i, UNKNOWNS) {
        const double d = m->rhs[i];
        m->trial_x[i] -= d;
        m->trial_v[i] -= m->gh * d;
        m->trial_acceleration[i] -= m->bh * d;
    }
    EACH (k, EQUATIONS) {
        const double d = m->rhs[UNKNOWNS + k];
        pull += d * d;
        m->trial_multipliers[k] -= d;
    }
    pull = math_sqrt(pull);
    if (pull > m->pull && pull > TOLERANCE * m->largest_mass) /* these factors are too old for the joints */
        m->factored = 0;
    m->pull = pull;
}

/* Remaining error of q [m] at which the iteration may stop: the tolerance, or less where q'' asks for it. */
static double goal(const NAME_memory *m, int iteration, double begun)
{
    if (iteration >= PATIENT)
        return TOLERANCE;
    return most(least(least(TOLERANCE, most(SHARE * begun, UNSEEN)), m->sharp * m->now.change), ROUND_OFF);
}

/* Go on, accept or give up after a correction of this size. */
static enum outcome judge(NAME_memory *m, int iteration, double norm, double last, int fresh, double exact, int growing, double begun)
{
    const double enough = goal(m, iteration, begun), rate = iteration > 0 && last > 0.0 ? norm / last : 1.0;
    const double rest = norm * rate * (SECANTS > 0 ? SURELY : 1.0), slow = TURNING > 0 && m->turning ? CHEAP * SLOW : SLOW;
    if (fresh > 1 && rate > SLOW) /* what turned tangents are worth */
        m->turning = 0;
    if (!is_finite(norm))
        return NOT_A_NUMBER;
    if (!m->factored && fresh == 0)
        return NOT_CONVERGED;
    if (((iteration > 0 || fresh > 0) && norm <= most(FLOOR * enough, ROUND_OFF)) || (rate < 1.0 && rest <= enough * (1.0 - rate))) {
        if (rate > slow && iteration > 0)
            m->factored = 0;
        return DONE;
    }
    if (SMOOTH && m->judging && fresh == 1 && !growing && exact > 0.0 && norm > most(exact, TOLERANCE))
        return DIVERGED;
    if (iteration > 3 && rate > 2.0 && norm > TOLERANCE && (fresh > 1 || (fresh == 1 && exact == last)))
        return DIVERGED;
    if (iteration > 0 && rate > 5.0 * slow)
        m->factored = 0;
    return NOT_CONVERGED;
}

/* Newton's iteration from the predicted state; corrections may grow if `growing`. */
static enum outcome iterate(NAME_memory *m, int growing)
{
    double last = 0.0, exact = 0.0, begun = 0.0;
    int fresh = 0, brief = 0, turned = 0, held = 0;
    EACH (iteration, ITERATIONS) {
        find_residual(m);
        if (!m->factored) {
            brief = iteration > 0 && m->age < 2;
            turned = TURNING > 0 && m->turning;
            held = iteration < HELD;
            assemble(m, held);
            if (factorise(m))
                return SINGULAR;
            m->age = 0;
            fresh = 1;
        }
        solve(m);
        add_secants(m, iteration > 0 && fresh != 1);
        const double norm = correction_size(m);
        m->corrections++;
        if (SMOOTH && iteration > 0 && fresh != 1 && !(norm <= last)) { /* factors of another state make it grow */
            m->factored = 0;
            if (fresh == 0) {
                predict(m);
                last = exact = 0.0;
            }
            fresh = 0;
            continue;
        }
        apply(m);
        begun = last == 0.0 ? norm : begun;
        const enum outcome found = judge(m, iteration, norm, last, fresh, turned || held ? 0.0 : exact, growing, begun);
        if (found == DONE) {
            m->factored = m->factored && !brief;
            m->age++;
        }
        if (found != NOT_CONVERGED)
            return found;
        exact = fresh == 1 && !turned && !held ? norm : exact;
        last = norm;
        fresh = fresh > 0 && m->factored ? fresh + 1 : 0;
    }
    return NOT_CONVERGED;
}

/* How many corrections leave less than the tolerance, where the last of `many` left `norm` and each is `rate` of the one before; 0
 * where they do not shrink. */
static int count_corrections(int many, double norm, double rate)
{
    if (!(rate < SHRINKS))
        return 0;
    for (; norm > TOLERANCE; norm *= rate)
        many++;
    return many;
}

/* The same number of operations in every step: new factors, then `many` corrections. Tangents are those of the guess: turned ones
 * contract by 0.8 beside fast motions, and what three corrections leave then grows from step to step until it is the motion. */
static enum outcome iterate_fixed(NAME_memory *m, int many)
{
    double norm = 0.0, last = 0.0, way = 0.0;
    EACH (iteration, many) {
        find_residual(m);
        if (iteration == 0) {
            m->turning = 0;
            assemble(m, 0);
            if (factorise(m))
                return SINGULAR;
        }
        solve(m);
        last = norm;
        norm = correction_size(m);
        apply(m);
        m->corrections++;
    }
    EACH (i, UNKNOWNS) {
        const double d = m->trial_x[i] - m->now.x[i];
        way += NORM[i] * d * d;
    }
    m->left = norm;
    m->factored = 1;
    if (!is_finite(norm) || !is_finite(way))
        return NOT_A_NUMBER;
    if (norm > TOLERANCE && (norm > UNCERTAIN * math_sqrt(way) || (many > 1 && norm > SHRINKS * last))) {
        m->enough = many > 1 ? count_corrections(many, norm, norm / last) : 0;
        return TOO_FEW;
    }
    return DONE;
}

/* Put q'' and multipliers of a step that is done before the earlier ones, and choose the predictor that came closest. */
static void add_known(NAME_memory *m, const double *acceleration, const double *multipliers)
{
    NAME_state *s = &m->now;
    double constant = 0.0, linear = 0.0, quadratic = 0.0;
    EACH (i, UNKNOWNS) {
        const double d = guess_of(s->history[0], s->history[1], s->history[2], 0, i) - acceleration[i];
        const double e = guess_of(s->history[0], s->history[1], s->history[2], 1, i) - acceleration[i];
        const double f = guess_of(s->history[0], s->history[1], s->history[2], 2, i) - acceleration[i];
        constant += NORM[i] * d * d;
        linear += NORM[i] * e * e;
        quadratic += NORM[i] * f * f;
        s->history[2][i] = s->history[1][i];
        s->history[1][i] = s->history[0][i];
        s->history[0][i] = acceleration[i];
    }
    s->order = s->known > 1 && linear < constant ? 1 : 0;
    if (s->known > 2 && quadratic < least(constant, linear))
        s->order = 2;
    s->change = s->known > 1 ? math_sqrt(linear) : HUGE_NUMBER;
    EACH (k, EQUATIONS) {
        s->past[2][k] = s->past[1][k];
        s->past[1][k] = s->past[0][k];
        s->past[0][k] = multipliers[k];
    }
    if (s->known < 3) {
        s->known++;
        s->order = s->order + 1 < s->known - 1 ? s->order + 1 : s->known - 1;
    }
}

/* Take over the converged trial state. */
static void accept(NAME_memory *m)
{
    EACH (i, UNKNOWNS) {
        m->now.a[i] = algorithmic(m->trial_acceleration[i], m->now.acceleration[i], m->now.a[i]);
        m->now.x[i] = m->trial_x[i];
        m->now.v[i] = m->trial_v[i];
        m->now.acceleration[i] = m->trial_acceleration[i];
    }
    add_known(m, m->trial_acceleration, m->trial_multipliers);
    EACH (k, EQUATIONS)
        m->now.multipliers[k] = m->trial_multipliers[k];
    if (KEPT > 0) {
        read_rows(m, m->now.x, 1, m->y);
        if (READS_RATES)
            read_rows(m, m->now.v, 0, m->rates);
        keep_forces(m);
    }
}

/* out = J z + D1 + second D2 + third D3 at the accepted state, D_k = d^k Phi/dt^k - J d^k q/dt^k, for the rates v of rows. */
static void find_drift(NAME_memory *m, const double *z_of, double second, double third, double *out)
{
    read_rows(m, m->now.x, 1, m->path_y);
    read_rows(m, z_of, 0, m->path_z);
    read_rows(m, m->now.v, 0, m->path_v);
    read_rows(m, m->now.acceleration, 0, m->path_a);
    EACH (k, EQUATIONS)
        out[k] = 0.0;
    EACH (t, TERMS) {
        const int k = TERM[t][0], number = TERM[t][1], i = TERM[t][2], j = TERM[t][3];
        const double *y = m->path_y, *z = m->path_z, *v = m->path_v, *a = m->path_a;
        double s = TERM_VALUE[t], s1 = 0.0, s2 = 0.0, s3 = 0.0;
        double p = 1.0, pz = 0.0, p1 = 0.0, p2 = 0.0, twice = 0.0, mixed = 0.0;
        if (number >= 0) {
            s1 = s * m->signals[SIGNALS + number];
            s2 = s * m->signals[2 * SIGNALS + number];
            s3 = s * m->signals[3 * SIGNALS + number];
            s *= m->signals[number];
        }
        if (j >= 0) {
            p = y[i] * y[j];
            pz = y[i] * z[j] + z[i] * y[j];
            p1 = y[i] * v[j] + v[i] * y[j];
            twice = 2.0 * v[i] * v[j];
            mixed = 3.0 * (v[i] * a[j] + a[i] * v[j]);
            p2 = y[i] * a[j] + a[i] * y[j] + twice;
        } else if (i >= 0) {
            p = y[i];
            pz = z[i];
            p1 = v[i];
            p2 = a[i];
        }
        out[k] += s * (pz + second * twice + third * mixed);
        if (number >= 0)
            out[k] += s1 * p + second * (s2 * p + 2.0 * s1 * p1) + third * (s3 * p + 3.0 * (s2 * p1 + s1 * p2));
    }
}

/* Put the accepted velocities onto the joints, with the factors that are there or once more with new ones:
 *     J (v + h (1/2 - beta) a) + D1 + h (1/2 - beta) D2 + h^2 (1/6 - beta (1 + am - af)) D3 = 0 */
static void settle(NAME_memory *m)
{
    const double lead = m->h * (0.5 - BETA), third = m->h * m->h * (1.0 / 6.0 - BETA * (1.0 + ALPHA_M - ALPHA_F));
    EACH (attempt, m->fixed > 0 ? 1 : 2) {
        double *mu = m->rhs + UNKNOWNS, square = 0.0, change = 0.0, wanted = 0.0, missed = 0.0;
        EACH (i, UNKNOWNS) {
            m->trial_v[i] = m->now.v[i] + lead * m->now.a[i];
            m->rhs[i] = 0.0;
        }
        find_drift(m, m->trial_v, lead, third, mu);
        EACH (k, EQUATIONS)
            m->trial_multipliers[k] = mu[k];
        solve(m);
        /* the joints have turned since the factors: rhs = (- J^T mu, 2 r - J d) with the directions of now */
        EACH (j, PROBES) {
            m->g[j] = 0.0;
            EACH (k, EQUATIONS)
                m->g[j] += m->Jy[k][j] * mu[k];
        }
        read_rows(m, m->rhs, 0, m->path_y);
        EACH (k, EQUATIONS) {
            mu[k] = 2.0 * m->trial_multipliers[k];
            EACH (j, PROBES)
                mu[k] -= m->Jy[k][j] * m->path_y[j];
        }
        EACH (i, UNKNOWNS)
            m->rhs[i] = 0.0;
        add_transposed(m, -1.0, m->g, m->rhs);
        solve(m);
        EACH (i, UNKNOWNS) {
            square += NORM[i] * m->now.v[i] * m->now.v[i];
            change += NORM[i] * m->rhs[i] * m->rhs[i];
        }
        read_rows(m, m->rhs, 0, m->g);
        EACH (k, EQUATIONS) {
            double rest = m->trial_multipliers[k];
            wanted += rest * rest;
            EACH (j, PROBES)
                rest -= m->Jy[k][j] * m->g[j];
            missed += rest * rest;
        }
        if (missed <= OLD * OLD * wanted || attempt == 1 || m->fixed > 0) {
            if (missed <= OLD * OLD * wanted && change <= square)
                EACH (i, UNKNOWNS)
                    m->now.v[i] -= m->rhs[i];
            return;
        }
        EACH (i, UNKNOWNS)
            m->trial_v[i] = m->now.v[i];
        EACH (k, EQUATIONS)
            m->trial_multipliers[k] = m->now.multipliers[k];
        assemble(m, 0);
        if (factorise(m)) {
            m->factored = 0;
            return;
        }
    }
}

/* Whether strains have more energy in the trial state than strains and motion had at the begin of the step. */
static int gains_energy(NAME_memory *m)
{
    const double bound = GAIN * NAME_strain_energy(m) + NAME_kinetic_energy(m);
    double after;
    EACH (i, UNKNOWNS) {
        m->moved_twice[i] = m->now.x[i];
        m->now.x[i] = m->trial_x[i];
    }
    after = NAME_strain_energy(m);
    EACH (i, UNKNOWNS)
        m->now.x[i] = m->moved_twice[i];
    return after > bound;
}

/* Whether the trial state is where constant q'' leads, but for a small part of the way from the accepted state. */
static int is_near(const NAME_memory *m)
{
    double off = 0.0, way = 0.0;
    EACH (i, UNKNOWNS) {
        const double change = (m->trial_acceleration[i] - m->now.acceleration[i]) / m->bh, d = m->trial_x[i] - m->now.x[i];
        off += NORM[i] * change * change;
        way += NORM[i] * d * d;
    }
    return off <= NEAR * NEAR * way;
}

/* The step that failed once more, from constant q'' and with first factors at x + h v: on a straight way nothing that turns becomes
 * shorter, so that stresses hold what is slender. */
static enum outcome try_straight(NAME_memory *m)
{
    const int order = m->now.order;
    const long long before = m->corrections;
    enum outcome found;
    EACH (i, UNKNOWNS) {
        m->trial_x[i] = m->now.x[i] + m->h * m->now.v[i];
        m->trial_v[i] = m->now.v[i];
    }
    EACH (k, EQUATIONS)
        m->trial_multipliers[k] = m->now.multipliers[k];
    m->turning = m->age = 0;
    find_residual(m);
    assemble(m, 0);
    if (factorise(m))
        return SINGULAR;
    m->now.order = 0;
    predict(m);
    found = iterate(m, 1);
    if (found == DONE && m->judging && m->corrections - before > MANY && gains_energy(m))
        found = DIVERGED;
    if (found == DONE && !is_near(m))
        found = DIVERGED;
    if (found != DONE)
        m->now.order = order;
    return found;
}

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

/* Values of inputs that drive joints at the end of a span; where it is another one than before, earlier ones are read of the cubic. */
static void take_inputs(NAME_memory *m, double span)
{
    const double end = m->given_end, before = m->given_span;
    double earlier[2][ROOM(DRIVEN)];
    EACH (k, 2) {
        follow_inputs(m, most(end - 3.0 * before, end - (k + 1) * span));
        EACH (i, DRIVEN)
            earlier[k][i] = m->smooth[0][i];
    }
    EACH (i, DRIVEN) {
        m->given[3][i] = earlier[1][i];
        m->given[2][i] = earlier[0][i];
        m->given[1][i] = m->given[0][i];
        m->given[0][i] = m->inputs[i];
    }
    m->given_end = m->time + span;
    m->given_span = span;
}

/* One step of the method to the time t [s]. */
static enum outcome take_step(NAME_memory *m, double t, int again)
{
    enum outcome found;
    follow_inputs(m, t);
    read_signals(m, t);
    predict(m);
    found = m->fixed > 0 ? iterate_fixed(m, m->fixed) : iterate(m, 0);
    if (found != DONE && again && SMOOTH && m->fixed == 0)
        found = try_straight(m);
    if (found != DONE) {
        m->factored = m->turning = 0;
        return found;
    }
    accept(m);
    if (!STEADY)
        settle(m);
    m->time = t;
    count_turns(m);
    return DONE;
}

/* ---------------------------------------------------------------------------------------------------------------------------------
 * A step that failed in equal parts, h / 2, h / 4, ... Earlier q'' and multipliers at the new distance are those of the parabola
 * through the three that are known, and the algorithmic acceleration moves on by (am - af) (h_new - h_old) dq''/dt (Bruels and Arnold,
 * J. Comput. Nonlinear Dyn. 3 (2008) 041007).
 * ------------------------------------------------------------------------------------------------------------------------------ */

static void move_algorithmic(NAME_memory *m, double longer, double whole)
{
    const double factor = (ALPHA_M - ALPHA_F) * longer / whole;
    if (m->now.order > 0 && m->now.known > 2)
        EACH (i, UNKNOWNS)
            m->now.a[i] += factor * (m->now.history[0][i] - m->now.history[1][i]);
}

static void scale_multipliers(NAME_memory *m, double factor)
{
    EACH (k, EQUATIONS) {
        m->now.multipliers[k] *= factor;
        EACH (row, 3)
            m->now.past[row][k] *= factor;
    }
}

/* The latest of three values stays, the earlier ones move to a distance of `ratio` and of twice of it. */
static void resample(double *latest, double *before, double *first, int known, double ratio)
{
    const double a = *latest, b = *before, c = known > 2 ? *first : 2.0 * b - a;
    for (int k = 1; k < known; k++) {
        const double d = k * ratio;
        *(k == 1 ? before : first) = 0.5 * (1.0 - d) * (2.0 - d) * a + d * (2.0 - d) * b - 0.5 * d * (1.0 - d) * c;
    }
}

/* What is known of whole steps becomes that of shorter ones. */
static void begin_parts(NAME_memory *m, double h)
{
    NAME_state *s = &m->now;
    const double whole = m->h, ratio = h / whole, c = m->c;
    set_step(m, h);
    scale_multipliers(m, m->c / c);
    if (s->known == 1)
        EACH (i, UNKNOWNS)
            s->a[i] = s->acceleration[i] + ratio * (s->a[i] - s->acceleration[i]);
    move_algorithmic(m, h - whole, whole);
    EACH (i, UNKNOWNS)
        resample(&s->history[0][i], &s->history[1][i], &s->history[2][i], s->known, ratio);
    EACH (k, EQUATIONS)
        resample(&s->past[0][k], &s->past[1][k], &s->past[2][k], s->known, ratio);
    s->change *= ratio * ratio;
}

/* Parts of the step are one: what was known before it goes on with its end. */
static void join_parts(NAME_memory *m, double whole)
{
    NAME_state *s = &m->now;
    const NAME_state *before = &m->before;
    const double h = m->h, c = m->c;
    set_step(m, whole);
    scale_multipliers(m, m->c / c);
    EACH (row, 3) {
        EACH (i, UNKNOWNS)
            s->history[row][i] = before->history[row][i];
        EACH (k, EQUATIONS)
            s->past[row][k] = before->past[row][k];
    }
    s->known = before->known;
    add_known(m, s->acceleration, s->multipliers);
    move_algorithmic(m, whole - h, whole);
    m->factored = 0;
}

/* The step to the time `end` [s] in parts; halvings, and whether corrections must not grow, one trial after the other. */
static enum outcome divide(NAME_memory *m, double end)
{
    static const int trials[TRIALS][2] = {PARTS_OF_TRIALS};
    const double begin = m->time, whole = m->h;
    enum outcome found = NOT_CONVERGED;
    m->before = m->now;
    EACH (trial, TRIALS) {
        const int parts = 1 << trials[trial][0];
        m->judging = trials[trial][1];
        m->divided++;
        begin_parts(m, whole / parts);
        found = DONE;
        for (int k = 1; k <= parts && found == DONE; k++)
            found = take_step(m, k == parts ? end : begin + (end - begin) * k / parts, 0);
        m->judging = 1;
        if (found == DONE) {
            join_parts(m, whole);
            return DONE;
        }
        m->now = m->before;
        m->time = begin;
        set_step(m, whole);
    }
    return found;
}

/* ---------------------------------------------------------------------------------------------------------------------------------
 * What NAME.h declares.
 * ------------------------------------------------------------------------------------------------------------------------------ */

static void change_step(NAME_memory *m, double h)
{
    const double ratio = h * h * BETA / m->c;
    EACH (k, EQUATIONS) /* multipliers are c times those in newtons */
        m->now.multipliers[k] = m->now.past[0][k] *= ratio;
    m->now.known = 1;
    m->now.order = 0;
    m->now.change = HUGE_NUMBER;
    m->factored = 0;
    set_step(m, h);
}

/* So many equal parts of a span; where they are whole steps of the model these are counted. */
static NAME_status take_parts(NAME_memory *m, double span, double parts, int whole)
{
    const double begin = m->time;
    for (double k = 1.0; k <= parts; k += 1.0) {
        const double end = whole ? m->since + (double)(m->whole + 1) * NAME_STEP : begin + span * (k / parts);
        enum outcome found = take_step(m, end, 1);
        if (found != DONE && m->fixed == 0)
            found = divide(m, end);
        m->steps += found == DONE;
        m->whole += found == DONE && whole;
        if (found == NOT_A_NUMBER)
            return NAME_NOT_FINITE;
        if (found == SINGULAR)
            return NAME_SINGULAR;
        if (found == TOO_FEW)
            return NAME_TOO_FEW_CORRECTIONS;
        if (found != DONE)
            return NAME_NOT_CONVERGED;
    }
    return NAME_OK;
}

/* What is shown of the start balances all forces; steps begin without the waves that none of them resolves. */
static void begin_steps(NAME_memory *m)
{
    EACH (i, UNKNOWNS)
        m->now.acceleration[i] = m->now.history[0][i];
    EACH (k, EQUATIONS)
        m->now.multipliers[k] = m->now.past[0][k];
}

NAME_status NAME_step(NAME_memory *m, double span)
{
    const double begin = m->time;
    double parts = math_floor(span / NAME_STEP + 0.5);
    int told = 0;
    EACH (k, INPUTS)
        if (!is_finite(m->inputs[k]))
            return NAME_INPUT_NOT_FINITE;
    if (!(span > 0.0) || !is_finite(span))
        return NAME_SPAN_NOT_POSITIVE;
    EACH (k, INPUTS) {
        const int beyond = m->inputs[k] < INPUT_LEAST[k] || m->inputs[k] > INPUT_MOST[k];
        told |= beyond && !m->outside[k];
        m->outside[k] |= beyond;
    }
    if (told)
        return NAME_INPUT_OUTSIDE;
    /* whole steps of the model where they fit, else as many equal ones as are not longer */
    if (parts < 1.0 || size_of(span - parts * NAME_STEP) > 1e-9 * span)
        parts = -math_floor(-span / NAME_STEP);
    const int whole = size_of(span - parts * NAME_STEP) <= 1e-9 * span;
    const double h = whole ? NAME_STEP : span / parts;
    if (m->now.known == 1) /* at no other instant they differ */
        begin_steps(m);
    if (size_of(h - m->h) > 1e-12 * m->h)
        change_step(m, h);
    /* inputs that a step has not been taken with are as if they had not been given: the caller may try it again */
    const double given_end = m->given_end, given_span = m->given_span;
    double given[4][ROOM(DRIVEN)];
    EACH (row, 4)
        EACH (i, DRIVEN)
            given[row][i] = m->given[row][i];
    if (DRIVEN > 0)
        take_inputs(m, span);
    if (!whole) {
        m->since = m->time;
        m->whole = 0;
    }
    const NAME_status found = take_parts(m, span, parts, whole);
    if (!whole)
        m->since = m->time;
    if (found != NAME_OK && m->time <= begin) {
        m->given_end = given_end;
        m->given_span = given_span;
        EACH (row, 4)
            EACH (i, DRIVEN)
                m->given[row][i] = given[row][i];
    }
    return found;
}
