/* ---------------------------------------------------------------------------------------------------------------------------------
 * What NAME.h declares, around the kernels of a time step.
 * ------------------------------------------------------------------------------------------------------------------------------ */

/* Numbers of the method that depend on the step h [s]: of whole steps, and of all parts of a step. */
static void set_step(NAME_memory *m, double h)
{
    EACH (k, LENGTHS) {
        const double own = k == 0 ? h : h / (double)(1 << HALVINGS[k]), c = own * own * BETA;
        m->method_h[k] = own;
        m->method_c[k] = c;
        m->method_bh[k] = (1.0 - ALPHA_M) / (c * (1.0 - ALPHA_F));
        m->method_gh[k] = GAMMA / (own * BETA);
        m->method_sharp[k] = SHARP * c;
    }
}

/* Steps and their costs since the start. */
static void count_costs(NAME_memory *m)
{
    m->steps = @job_counters@[0];
    m->corrections = @job_counters@[1];
    m->factorisations = @job_counters@[2];
    m->divided = @job_counters@[3];
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

/* One step of the method to the time t [s], in parts where it fails; with `fixed` corrections it has no parts. */
static int take_step(NAME_memory *m, double t)
{
    long long found;
    m->begin = m->time;
    m->end = t;
    follow_inputs(m, t);
    read_signals(m, t, @job_signals@);
    if (m->fixed > 0) {
        found = CALL_TAKE_FIXED(m, 0, m->fixed);
        m->left = @job_left@[0];
        if (found == TOO_FEW)
            m->enough = (int)@job_left@[1];
    } else {
        found = CALL_TAKE(m, 0);
        if (found != DONE)
            found = CALL_DIVIDE(m, 0, found);
    }
    count_costs(m);
    if (found == DONE) {
        m->time = t;
        count_turns(m);
    }
    return (int)found;
}

static void change_step(NAME_memory *m, double h)
{
    const double before = m->method_c[0];
    set_step(m, h);
    EACH (k, EQUATIONS) /* multipliers are c times those in newtons */
        @state_multipliers@[k] = @state_past@[k] *= m->method_c[0] / before;
    @state_known@[0] = 1;
    @state_order@[0] = 0;
    @state_change@[0] = HUGE_NUMBER;
    @work_kind@[0] = 0;
}

/* So many equal parts of a span; where they are whole steps of the model these are counted. */
static NAME_status take_parts(NAME_memory *m, double span, double parts, int whole)
{
    const double begin = m->time;
    for (double k = 1.0; k <= parts; k += 1.0) {
        const double end = whole ? m->since + (double)(m->whole + 1) * NAME_STEP : begin + span * (k / parts);
        const int found = take_step(m, end);
        m->whole += found == DONE && whole;
        if (found == NOT_FINITE)
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
        @state_acceleration@[i] = @state_history@[i];
    EACH (k, EQUATIONS)
        @state_multipliers@[k] = @state_past@[k];
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
    if (@state_known@[0] == 1) /* at no other instant they differ */
        begin_steps(m);
    if (size_of(h - m->method_h[0]) > 1e-12 * m->method_h[0])
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

double NAME_kinetic_energy(NAME_memory *m)
{
    CALL_ENERGIES(m, 0, 0);
    return @space_energy@[0];
}

double NAME_strain_energy(NAME_memory *m)
{
    CALL_ENERGIES(m, 0, 1);
    return @space_energy@[0];
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
    set_start(m);
    set_numbers(m);
    set_step(m, NAME_STEP);
    m->time = m->since = m->given_end = m->begin = m->end = 0.0;
    m->whole = 0;
    EACH (k, INPUTS)
        m->outside[k] = 0;
    m->given_span = NAME_STEP;
    EACH (row, 4)
        EACH (i, DRIVEN)
            m->given[row][i] = m->inputs[i];
    m->left = 0.0;
    m->enough = 0;
    EACH (k, TURNED)
        m->turned[k] = 0.0;
    follow_inputs(m, 0.0);
    read_signals(m, 0.0, @job_signals@);
    EACH (k, SIGNALS)
        @state_signals@[k] = @job_signals@[k];
#if TURNING
    CALL_TURN(m, 0);
#endif
    if (CALL_START(m, 0) != 0)
        return NAME_SINGULAR;
    @work_kind@[0] = 0;
    EACH (k, 4)
        @job_counters@[k] = 0;
    count_costs(m);
    count_turns(m);
    return NAME_OK;
}

/* Derivatives of all outputs by one input, at the end of a step in which it changes: the step's own tangent. */
NAME_status NAME_derivative(NAME_memory *m, int input, double out[])
{
    double before[ROOM(NAME_OUTPUTS)], x[ROOM(UNKNOWNS)], v[ROOM(UNKNOWNS)], change_of[ROOM(UNKNOWNS + EQUATIONS)];
    if (input < 0 || input >= INPUTS)
        return NAME_NO_SUCH_INPUT;
    if (DRIVES[input])
        return NAME_NO_DERIVATIVE;
    const double value = m->inputs[input], change = 1e-6 * most(1.0, size_of(value));
    EACH (i, UNKNOWNS) {
        @space_x@[i] = x[i] = @state_x@[i];
        @space_v@[i] = v[i] = @state_v@[i];
        @space_acceleration@[i] = @state_acceleration@[i];
    }
    EACH (k, EQUATIONS)
        @space_multipliers@[k] = @state_multipliers@[k];
    @space_c@[0] = m->method_c[0];
    /* forces are linear in inputs as good as always: their difference is the derivative */
    EACH (side, 3) {
        m->inputs[input] = side == 0 ? value - change : side == 1 ? value + change : value;
        read_signals(m, m->time, @space_signals@);
        CALL_RESIDUAL(m, 0);
        EACH (i, UNKNOWNS + EQUATIONS)
            change_of[i] = side == 0 ? @space_f@[i] : side == 1 ? (@space_f@[i] - change_of[i]) / (2.0 * change) : change_of[i];
    }
    @work_kind@[1] = 0;
    if (CALL_FACTORISE(m, 0) != 0)
        return NAME_SINGULAR;
    EACH (i, UNKNOWNS + EQUATIONS)
        @space_f@[i] = change_of[i];
    CALL_SOLVE(m, 0);
    EACH (i, UNKNOWNS)
        change_of[i] = @space_f@[i];
    /* outputs on both sides of the state, along this change of it */
    EACH (side, 2) {
        const double by = side == 0 ? change : -change;
        EACH (i, UNKNOWNS) {
            @state_x@[i] -= by * change_of[i];
            @state_v@[i] -= by * m->method_gh[0] * change_of[i];
        }
        count_turns(m);
        NAME_outputs(m, side == 0 ? out : before);
        EACH (i, UNKNOWNS) {
            @state_x@[i] = x[i];
            @state_v@[i] = v[i];
        }
    }
    count_turns(m);
    EACH (k, NAME_OUTPUTS)
        out[k] = (out[k] - before[k]) / (2.0 * change);
    @work_kind@[0] = 0;
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
