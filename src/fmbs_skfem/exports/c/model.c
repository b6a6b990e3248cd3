/* ---------------------------------------------------------------------------------------------------------------------------------
 * What NAME.h declares, around the kernels of a time step.
 * ------------------------------------------------------------------------------------------------------------------------------ */
#define CHANGE 1e-6 /* of an input, for differences */

/* Steps of a length [s] are what is taken next. */
static void set_step(NAME_memory *m, double h)
{
    set_method(m, 0, h);
    @levels_spans@[1] = h;
    set_parts(m, 0);
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
    EACH (k, DRIVEN > 0 ? 2 : 0) {
        follow_inputs(m, most(end - 3.0 * before, end - (k + 1) * span));
        EACH (i, DRIVEN)
            earlier[k][i] = m->smooth[0][i];
    }
    EACH (i, DRIVEN) {
        m->given[3][i] = earlier[1][i];
        m->given[2][i] = earlier[0][i];
        m->given[1][i] = m->given[0][i];
        m->given[0][i] = input_after(m, i, span);
    }
    m->given_end = m->time + span;
    m->given_span = span;
}

/* x, v, q'' and multipliers. */
static void copy_state(const NAME_memory *m, double *state)
{
    EACH (i, UNKNOWNS) {
        state[i] = @state_x@[i];
        state[UNKNOWNS + i] = @state_v@[i];
        state[2 * UNKNOWNS + i] = @state_acceleration@[i];
    }
    EACH (k, EQUATIONS)
        state[3 * UNKNOWNS + k] = @state_multipliers@[k];
}

/* One step of the method to the time t [s], in parts where it fails, or from touch to touch; with `fixed` corrections it is whole. */
static int take_step(NAME_memory *m, double t)
{
    long long found;
    follow_inputs(m, t);
    read_signals(m, t, @job_signals@);
    copy_state(m, m->begun);
    if (m->fixed > 0) {
        found = CALL_TAKE_FIXED(m, 0, m->fixed);
        m->left = @job_left@[0];
        if (found == TOO_FEW)
            m->enough = (int)@job_left@[1];
    } else {
        @levels_spans@[0] = m->time;
        @levels_found@[4] = -1; /* the begin of the step is that of the span */
        @job_done@[0] = 0;
        found = CALL_TAKE(m, 0);
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

/* Numbers at the parameters that act: those of forces, or all and the state at the start. */
static void set_parameters(NAME_memory *m, int starting)
{
    set_numbers(m, starting);
    @work_kind@[0] = 0;
#if TURNING
    CALL_TURN(m, 0);
#endif
}

/* Parameters that have changed act from now on; whether one has. */
static int tune(NAME_memory *m)
{
    int changed = 0;
    EACH (k, PARAMETERS) {
        changed |= m->acting_parameters[k] != m->parameters[k];
        m->acting_parameters[k] = m->parameters[k];
    }
    if (changed)
        set_parameters(m, 0);
    return changed;
}

/* What inputs change before a step is taken with them is kept, or put back: where it fails they are as if they had not been given. */
static void copy_begin(NAME_memory *m, double *room, int back)
{
    double *const rows[] = {&m->given_end, &m->given_span, m->acting, m->acting_parameters, &m->given[0][0], @state_acceleration@, @state_a@,
        @state_history@, @state_multipliers@, @state_past@};
    const int sizes[] = {1, 1, INPUTS, PARAMETERS, 4 * DRIVEN, UNKNOWNS, UNKNOWNS, 3 * UNKNOWNS, EQUATIONS, 3 * EQUATIONS};
    EACH (row, 10)
        EACH (i, sizes[row]) {
            if (back)
                rows[row][i] = *room;
            else
                *room = rows[row][i];
            room++;
        }
}

/* Inputs and parameters of a span that is taken next; the state jumps where forces do at its begin. Whether parameters have changed. */
static int begin_span(NAME_memory *m, double span)
{
    double before[ROOM(INPUTS)];
    const int tuned = tune(m);
    int jumps = tuned;
    EACH (k, INPUTS)
        before[k] = m->acting[k];
    take_inputs(m, span);
    follow_inputs(m, m->time);
    EACH (k, INPUTS) /* what masters interpolate is there but for round-off */
        jumps |= !DRIVES[k] && size_of(m->acting[k] - before[k]) > 1e-12 * most(size_of(m->acting[k]), size_of(before[k]));
    if (jumps) {
        read_signals(m, m->time, @job_signals@);
#if JUMPING
        if (CALL_JUMP(m, 0) != DONE) /* the step finds its own way */
            @work_kind@[0] = 0;
#endif
    }
    return tuned;
}

static int is_outside(const NAME_memory *m, int k)
{
    return !(m->parameters[k] >= PARAMETER[k][0] && m->parameters[k] <= PARAMETER[k][1]);
}

NAME_status NAME_step(NAME_memory *m, double span)
{
    const double begin = m->time;
    double parts = math_floor(span / NAME_STEP + 0.5);
    double kept[2 + 4 * ROOM(DRIVEN) + ROOM(INPUTS) + ROOM(PARAMETERS) + 5 * ROOM(UNKNOWNS) + 4 * ROOM(EQUATIONS)];
    int told = 0;
    if (!(span > 0.0) || !is_finite(span))
        return NAME_SPAN_NOT_POSITIVE;
    EACH (k, PARAMETERS)
        if (m->parameters[k] != m->acting_parameters[k] && (!TUNABLE[k] || is_outside(m, k)))
            return TUNABLE[k] ? NAME_PARAMETER_OUTSIDE : NAME_PARAMETER_FIXED;
    EACH (k, INPUTS)
        if (!is_finite(m->inputs[k]) || !is_finite(input_after(m, k, span)))
            return NAME_INPUT_NOT_FINITE;
    EACH (k, INPUTS) {
        const double low = least(m->inputs[k], input_after(m, k, span)), high = most(m->inputs[k], input_after(m, k, span));
        const int beyond = low < INPUT_LEAST[k] || high > INPUT_MOST[k];
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
    copy_begin(m, kept, 0);
    const int tuned = begin_span(m, span);
    if (!whole) {
        m->since = m->time;
        m->whole = 0;
    }
    const NAME_status found = take_parts(m, span, parts, whole);
    if (!whole)
        m->since = m->time;
    if (found != NAME_OK && m->time <= begin) {
        copy_begin(m, kept, 1);
        if (tuned)
            set_parameters(m, 0);
        return found;
    }
    follow_inputs(m, m->time); /* those of the last good step */
    EACH (k, INPUTS) {
        m->inputs[k] = DRIVES[k] ? m->given[0][k] : m->acting[k];
        m->rates[0][k] = m->rates[1][k] = m->rates[2][k] = 0.0;
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
    EACH (k, INPUTS) {
        m->inputs[k] = INPUT_START[k];
        m->rates[0][k] = m->rates[1][k] = m->rates[2][k] = 0.0;
    }
    EACH (k, PARAMETERS)
        m->parameters[k] = PARAMETER[k][2];
    m->fixed = 0;
}

NAME_status NAME_start(NAME_memory *m)
{
    EACH (k, PARAMETERS)
        if (is_outside(m, k))
            return NAME_PARAMETER_OUTSIDE;
    EACH (k, INPUTS)
        if (!is_finite(m->inputs[k]))
            return NAME_INPUT_NOT_FINITE;
    set_start(m);
    EACH (k, PARAMETERS)
        m->acting_parameters[k] = m->parameters[k];
    set_step(m, NAME_STEP);
    m->time = m->since = m->given_end = 0.0;
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
    set_parameters(m, 1);
    follow_inputs(m, 0.0);
    EACH (k, INPUTS)
        m->acting[k] = m->inputs[k];
    read_signals(m, 0.0, @job_signals@);
    EACH (k, SIGNALS)
        @state_signals@[k] = @job_signals@[k];
    if (CALL_START(m, 0) != 0)
        return NAME_SINGULAR;
    @work_kind@[0] = 0;
    EACH (k, 4)
        @job_counters@[k] = 0;
    count_costs(m);
    count_turns(m);
    return NAME_OK;
}

/* The trial state beside a state (x, v, q'', multipliers), along a change of q'' that was there over the whole step and of multipliers, and
 * forces there. */
static void find_beside(NAME_memory *m, double t, const double *state, double by, const double *along)
{
    const double h = m->method_h[0];
    EACH (i, UNKNOWNS) {
        @space_x@[i] = state[i] + 0.5 * h * h * by * along[i];
        @space_v@[i] = state[UNKNOWNS + i] + h * by * along[i];
        @space_acceleration@[i] = state[2 * UNKNOWNS + i] + by * along[i];
    }
    EACH (k, EQUATIONS)
        @space_multipliers@[k] = state[3 * UNKNOWNS + k] + by * along[UNKNOWNS + k];
    @space_c@[0] = m->method_c[0];
    read_signals(m, t, @space_signals@);
    CALL_RESIDUAL(m, 0);
}

/* Corrections of the state, and of multipliers, for what an input and such a change of the state leave of forces, per unit. */
static int correct_beside(NAME_memory *m, int input, double t, const double *state, const double *along, double *found)
{
    /* forces are linear in inputs as good as always: their difference is the derivative */
    const double value = m->acting[input], change = CHANGE * most(1.0, size_of(value));
    find_beside(m, t, state, 0.0, along);
    if (CALL_FACTORISE(m, 0) != 0)
        return 0;
    EACH (side, 2) {
        m->acting[input] = side == 0 ? value - change : value + change;
        find_beside(m, t, state, side == 0 ? -change : change, along);
        EACH (i, UNKNOWNS + EQUATIONS)
            @space_f@[i] = found[i] = side == 0 ? @space_f@[i] : (@space_f@[i] - found[i]) / (2.0 * change);
    }
    m->acting[input] = value;
    CALL_SOLVE(m, 0);
    EACH (i, UNKNOWNS + EQUATIONS)
        found[i] = @space_f@[i];
    return 1;
}

/* Derivatives of all outputs by one input, at the end of a step at whose begin it changes and q'' jumps: the tangents of both its ends. */
NAME_status NAME_derivative(NAME_memory *m, int input, double out[])
{
    double before[ROOM(NAME_OUTPUTS)], state[ROOM(3 * UNKNOWNS + EQUATIONS)];
    double along[ROOM(UNKNOWNS + EQUATIONS)] = {0}, found[ROOM(UNKNOWNS + EQUATIONS)];
    if (input < 0 || input >= INPUTS)
        return NAME_NO_SUCH_INPUT;
    if (DRIVES[input])
        return NAME_NO_DERIVATIVE;
    const long long turns = @work_kind@[1];
    const double h = m->method_h[0], change = CHANGE * most(1.0, size_of(m->acting[input]));
    if (!correct_beside(m, input, m->time - h, m->begun, along, found))
        return NAME_SINGULAR;
    EACH (i, UNKNOWNS + EQUATIONS)
        along[i] = -found[i] * (i < UNKNOWNS ? m->method_bh[0] : 1.0);
    copy_state(m, state);
    @work_kind@[1] = 0; /* a jump has the tangents of steps, an end its own */
    const int solved = correct_beside(m, input, m->time, state, along, found);
    @work_kind@[0] = 0;
    @work_kind@[1] = turns;
    if (!solved)
        return NAME_SINGULAR;
    /* outputs on both sides of the state, along this change of it */
    EACH (side, 2) {
        const double by = side == 0 ? -change : change;
        EACH (i, UNKNOWNS) {
            @state_x@[i] += by * (0.5 * h * h * along[i] - found[i]);
            @state_v@[i] += by * (h * along[i] - m->method_gh[0] * found[i]);
        }
        count_turns(m);
        NAME_outputs(m, side == 0 ? before : out);
        EACH (i, UNKNOWNS) {
            @state_x@[i] = state[i];
            @state_v@[i] = state[UNKNOWNS + i];
        }
    }
    count_turns(m);
    EACH (k, NAME_OUTPUTS)
        out[k] = (out[k] - before[k]) / (2.0 * change);
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
        "an input is outside of the range that the model was trained for: errors are not known; the next call takes the step",
        "a parameter is fixed when the motion has started: start again, or put its value back"};
    return texts[status];
}
