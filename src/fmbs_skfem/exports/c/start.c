/* K_a, K_b and K_c of planar bodies that turn, from their tangents at 0, 90 and 45 degrees; 1 where a fourth angle agrees. */
static int fill_turned_tangents(NAME_memory *m)
{
    static const double angles[4] = {0.0, 1.57079632679489655800e+00, 7.85398163397448278999e-01, PROOF};
    double *K = m->turned_tangents;
    int alike = 1;
    m->gh = 0.0;
    EACH (t, TURNING) {
        const int count = TURN[t][0], place = TURN[t][1], size = TURN[t][2], many = count * count;
        const double c = math_cos(PROOF), s = math_sin(PROOF);
        double off = 0.0, whole = 0.0;
        EACH (k, 4) {
            const double cosine = math_cos(angles[k]), sine = math_sin(angles[k]);
            EACH (i, UNKNOWNS) {
                const double *of = TURN_PLACES + (t * UNKNOWNS + i) * 3;
                m->trial_x[i] = of[0] * cosine + of[1] * sine + of[2];
            }
            EACH (i, ENTRIES)
                m->W[i] = 0.0;
            elastic_tangent(m, t);
            EACH (i, count)
                EACH (j, count) {
                    const double value = m->W[place + i * size + j];
                    double *of = K + i * count + j;
                    if (k < 3) {
                        of[k * many] = k == 2 ? 2.0 * value - of[0] - of[many] : value;
                    } else {
                        const double d = c * c * of[0] + s * s * of[many] + c * s * of[2 * many] - value;
                        off += d * d;
                        whole += value * value;
                    }
                }
        }
        alike = alike && off <= ALIKE * ALIKE * whole;
        K += 3 * many;
    }
    set_step(m, m->h);
    return alike;
}

/* out = - (second D2 + third D3) of the joints: the sums of `find_drift` less what it makes of first derivatives alone. */
static void find_curvature(NAME_memory *m, double second, double third, double *out)
{
    double *whole = m->now.past[1];
    find_drift(m, m->moved, second, third, whole);
    find_drift(m, m->moved, 0.0, 0.0, out);
    EACH (k, EQUATIONS)
        out[k] -= whole[k];
}

/* Accelerations and multipliers that balance the forces f of the start, in moved_twice, and in rhs what change with time they have:
 *     [ M J^T; J 0 ] (q'', lambda) = - (f, D2),   M + (K + gh C) / bh in place of M where they are filtered */
static int balance(NAME_memory *m, int filtered)
{
    const double scale = filtered ? m->bh : 1.0, c = m->c;
    double *mu = m->rhs + UNKNOWNS;
    m->c = 1.0;
    EACH (i, ENTRIES)
        m->W[i] = MASS[i];
    if (filtered)
        assemble(m, 0);
    m->c = c;
    if (factorise(m))
        return 1;
    find_curvature(m, 1.0, 0.0, mu);
    EACH (i, UNKNOWNS)
        m->rhs[i] = -scale * m->moved_twice[i];
    solve(m);
    EACH (i, UNKNOWNS)
        m->now.acceleration[i] = m->rhs[i];
    EACH (k, EQUATIONS)
        m->now.multipliers[k] = mu[k] / scale * c;
    find_curvature(m, 0.0, 1.0, mu);
    EACH (i, UNKNOWNS)
        m->rhs[i] = 0.0;
    solve(m);
    return 0;
}

/* What has been found is what the first step begins with, see `begin_steps`; its change waits in the row behind. */
static void begin_with_these(NAME_memory *m)
{
    EACH (i, UNKNOWNS) {
        m->now.history[0][i] = m->now.acceleration[i];
        m->now.history[1][i] = m->rhs[i];
    }
    EACH (k, EQUATIONS)
        m->now.past[0][k] = m->now.multipliers[k];
}

/* Accelerations and multipliers of the start, those that steps begin with, without the waves that none of them resolves where
 * bodies are elastic, and what puts velocities and algorithmic accelerations onto the path of the joints. */
static int find_accelerations(NAME_memory *m)
{
    const double late = ALPHA_M - ALPHA_F, h = m->h, c = m->c;
    int held = FILTERED;
    EACH (i, UNKNOWNS) {
        m->trial_x[i] = m->now.x[i];
        m->trial_v[i] = m->now.v[i];
        m->trial_acceleration[i] = 0.0;
    }
    EACH (k, EQUATIONS)
        m->trial_multipliers[k] = 0.0;
    follow_inputs(m, 0.0);
    read_signals(m, 0.0);
    read_rows(m, m->now.x, 1, m->y);
    if (READS_RATES)
        read_rows(m, m->now.v, 0, m->rates);
    keep_forces(m);
    m->c = 1.0;
    find_residual(m);
    m->c = c;
    EACH (i, UNKNOWNS)
        m->moved_twice[i] = m->rhs[i];
    if (FILTERED) {
        if (balance(m, 1))
            return 1;
        begin_with_these(m);
    }
    if (FILTERED && !MASSLESS) {
        /* what is left of M q'' + J^T lambda + f is - K q'' / bh: nothing holds what begins to move where q'' K q'' < 0 */
        EACH (i, UNKNOWNS)
            m->trial_acceleration[i] = m->now.acceleration[i];
        EACH (k, EQUATIONS)
            m->trial_multipliers[k] = m->now.multipliers[k];
        find_residual(m);
        held = dot(m->trial_acceleration, m->rhs, UNKNOWNS) <= 0.0;
    }
    if (!MASSLESS && balance(m, 0))
        return 1;
    if (!held)
        begin_with_these(m);
    EACH (i, UNKNOWNS) {
        m->now.a[i] = m->now.history[0][i];
        if (!STEADY) {
            m->now.v[i] += h * h * (1.0 / 6.0 - BETA - 0.5 * late) * m->now.history[1][i];
            m->now.a[i] += late * h * m->now.history[1][i];
        }
        m->now.history[1][i] = m->now.history[2][i] = 0.0;
    }
    EACH (k, EQUATIONS)
        m->now.past[1][k] = m->now.past[2][k] = 0.0;
    return 0;
}

void NAME_init(NAME_memory *m)
{
    EACH (k, INPUTS)
        m->inputs[k] = INPUT_START[k];
    EACH (k, PARAMETERS)
        m->parameters[k] = PARAMETER[k][2];
    m->fixed = 0;
}

NAME_status NAME_start(NAME_memory *m)
{
    EACH (k, PARAMETERS)
        if (!(m->parameters[k] >= PARAMETER[k][0] && m->parameters[k] <= PARAMETER[k][1]))
            return NAME_PARAMETER_OUTSIDE;
    EACH (k, INPUTS)
        if (!is_finite(m->inputs[k]))
            return NAME_INPUT_NOT_FINITE;
    set_numbers(m);
    m->largest_mass = 0.0;
    EACH (b, BLOCKS)
        EACH (i, BLOCK[b + 1] - BLOCK[b])
            m->largest_mass = most(m->largest_mass, MASS[BLOCK_AT[b] + i * (BLOCK[b + 1] - BLOCK[b] + 1)]);
    set_step(m, NAME_STEP);
    m->time = m->since = m->given_end = 0.0;
    m->whole = 0;
    EACH (k, INPUTS)
        m->outside[k] = 0;
    m->given_span = NAME_STEP;
    EACH (row, 4)
        EACH (i, DRIVEN)
            m->given[row][i] = m->inputs[i];
    m->steps = m->corrections = m->factorisations = m->divided = 0;
    m->judging = 1;
    m->age = m->now.order = 0;
    m->now.known = 1;
    m->now.change = HUGE_NUMBER;
    m->left = 0.0;
    EACH (i, UNKNOWNS) {
        m->now.x[i] = START_X[i];
        m->now.v[i] = START_V[i];
        m->now.a[i] = m->now.acceleration[i] = m->moved[i] = 0.0;
    }
    EACH (k, KEPT)
        m->now.kept[k] = START_KEPT[k];
    EACH (k, TURNED)
        m->now.turned[k] = 0.0;
    m->turning = TURNING > 0 && fill_turned_tangents(m);
    if (find_accelerations(m))
        return NAME_SINGULAR;
    m->factored = 0;
    m->factorisations = 0;
    count_turns(m);
    return NAME_OK;
}

/* Derivatives of all outputs by one input, at the end of a step in which it changes: the step's own tangent. */
NAME_status NAME_derivative(NAME_memory *m, int input, double out[])
{
    double before[NAME_OUTPUTS > 0 ? NAME_OUTPUTS : 1];
    if (input < 0 || input >= INPUTS)
        return NAME_NO_SUCH_INPUT;
    if (DRIVES[input])
        return NAME_NO_DERIVATIVE;
    const double value = m->inputs[input], change = 1e-6 * most(1.0, size_of(value));
    EACH (i, UNKNOWNS) {
        m->trial_x[i] = m->now.x[i];
        m->trial_v[i] = m->now.v[i];
        m->trial_acceleration[i] = m->now.acceleration[i];
    }
    EACH (k, EQUATIONS)
        m->trial_multipliers[k] = m->now.multipliers[k];
    /* forces are linear in inputs as good as always: their difference is the derivative */
    m->inputs[input] = value - change;
    read_signals(m, m->time);
    find_residual(m);
    EACH (i, UNKNOWNS + EQUATIONS)
        m->moved_twice[i] = m->rhs[i];
    m->inputs[input] = value + change;
    read_signals(m, m->time);
    find_residual(m);
    EACH (i, UNKNOWNS + EQUATIONS)
        m->moved_twice[i] = (m->rhs[i] - m->moved_twice[i]) / (2.0 * change);
    m->inputs[input] = value;
    read_signals(m, m->time);
    find_residual(m);
    assemble(m, 0);
    if (factorise(m))
        return NAME_SINGULAR;
    EACH (i, UNKNOWNS + EQUATIONS)
        m->rhs[i] = m->moved_twice[i];
    solve(m);
    /* outputs on both sides of the state, along this change of it */
    EACH (i, UNKNOWNS)
        m->moved_twice[i] = m->rhs[i];
    EACH (side, 2) {
        const double by = side == 0 ? change : -change;
        EACH (i, UNKNOWNS) {
            m->now.x[i] -= by * m->moved_twice[i];
            m->now.v[i] -= by * m->gh * m->moved_twice[i];
        }
        count_turns(m);
        NAME_outputs(m, side == 0 ? out : before);
        EACH (i, UNKNOWNS) {
            m->now.x[i] = m->trial_x[i];
            m->now.v[i] = m->trial_v[i];
        }
    }
    count_turns(m);
    EACH (k, NAME_OUTPUTS)
        out[k] = (out[k] - before[k]) / (2.0 * change);
    m->factored = 0;
    return NAME_OK;
}

const char *NAME_message(NAME_status status)
{
    static const char *const texts[] = {"done",
        "an input is not finite",
        "the span of a step is not positive",
        "the iteration of a step did not converge: the state is that of the last good one",
        "a step found no finite numbers: the state is that of the last good one",
        "the matrix of a step is singular: the state is that of the last good one",
        "there is no such input",
        "a parameter is outside of the range that the model was trained for",
        "an input that drives a joint has no derivatives",
        "the corrections of a step are too few, or do not shrink: the state is that of the last good one, see `enough`",
        "an input is outside of the range that the model was trained for: errors are not known; the next call takes the step"};
    return texts[status];
}
