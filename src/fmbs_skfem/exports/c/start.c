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
    set_step(m, NAME_STEP);
    m->time = 0.0;
    m->steps = m->corrections = m->factorisations = 0;
    m->factored = m->age = m->secants = 0;
    m->turning = TURNING > 0;
    m->known = 1;
    m->order = 0;
    m->change = HUGE_NUMBER;
    m->left = 0.0;
    EACH (i, UNKNOWNS) {
        m->norm[i] = NORM[i];
        m->x[i] = START_X[i];
        m->v[i] = START_V[i];
        m->a[i] = START_ALGORITHMIC[i];
        m->acceleration[i] = START_ACCELERATION[i];
        m->history[0][i] = START_ACCELERATION[i];
        m->history[1][i] = m->history[2][i] = 0.0;
        m->moved[i] = 0.0;
    }
    EACH (k, EQUATIONS) {
        m->multipliers[k] = m->past[0][k] = START_MULTIPLIERS[k] * m->c;
        m->past[1][k] = m->past[2][k] = 0.0;
    }
    EACH (k, KEPT)
        m->kept[k] = START_KEPT[k];
    EACH (k, TURNED)
        m->turned[k] = 0.0;
    count_turns(m);
    return NAME_OK;
}

/* Derivatives of all outputs by one input, at the end of a step in which it changes: the step's own tangent. */
NAME_status NAME_derivative(NAME_memory *m, int input, double out[])
{
    static const double part = 1e-6;
    const double value = m->inputs[input], change = part * most(1.0, size_of(value));
    double before[NAME_OUTPUTS > 0 ? NAME_OUTPUTS : 1];
    if (input < 0 || input >= INPUTS)
        return NAME_NO_SUCH_INPUT;
    EACH (i, UNKNOWNS) {
        m->trial_x[i] = m->x[i];
        m->trial_v[i] = m->v[i];
        m->trial_acceleration[i] = m->acceleration[i];
    }
    EACH (k, EQUATIONS)
        m->trial_multipliers[k] = m->multipliers[k];
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
    if (factorise(m, 0))
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
            m->x[i] -= by * m->moved_twice[i];
            m->v[i] -= by * m->gh * m->moved_twice[i];
        }
        count_turns(m);
        NAME_outputs(m, side == 0 ? out : before);
        EACH (i, UNKNOWNS) {
            m->x[i] = m->trial_x[i];
            m->v[i] = m->trial_v[i];
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
        "a parameter is outside of the range that the model was trained for"};
    return texts[status];
}
