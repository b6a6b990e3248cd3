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
        m->given[0][i] = input_at(m, i, m->time + span);
    }
    m->given_end = m->time + span;
    m->given_span = span;
}

/* All functions of time at the end t [s] of a step h [s], 0 for an instant. */
static void read_at(NAME_memory *m, double t, double h)
{
    follow_inputs(m, t);
    read_signals(m, t, h, @job_signals@);
}

/* What was known of a motion that goes on otherwise: earlier accelerations, and factors. */
static void forget(NAME_memory *m)
{
    @state_known@[0] = 1;
    @state_order@[0] = 0;
    @state_change@[0] = HUGE_NUMBER;
    @work_kind@[0] = 0;
}

static void change_step(NAME_memory *m, double h)
{
    const double before = m->method_c[0];
    set_step(m, h);
    EACH (k, EQUATIONS) /* multipliers are c times those in newtons */
        @state_multipliers@[k] = @state_past@[k] *= m->method_c[0] / before;
    forget(m);
}

#if JUMPING
/* Accelerations and reactions of the present state jump onto what is given at a time t [s], where drives may bend. */
static void jump(NAME_memory *m, double t, int bends)
{
    read_at(m, t, (bends ? -AHEAD : 1.0) * m->method_h[0]);
    if (CALL_JUMP(m, 0, bends) != DONE) /* the step finds its own way */
        @work_kind@[0] = 0;
}
#endif

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

/* A step of the method to the time t [s] by `fixed` corrections. */
static long long take_fixed(NAME_memory *m, double t)
{
    read_at(m, t, m->method_h[0]);
    const long long found = CALL_TAKE_FIXED(m, 0, m->fixed);
    m->left = @job_left@[0];
    if (found == TOO_FEW)
        m->enough = (int)@job_left@[1];
    return found;
}

/* What is taken next begins at the present state, and is no step with a number. */
static void place(NAME_memory *m)
{
    @levels_spans@[0] = m->time;
    @levels_found@[4] = -1;
    @job_done@[0] = 0;
}

#if JUMPS > 0 || EVENTS > 0
/* Go on to a time t [s] up to which no load jumps: by the method, or by a series over less than a hundredth of a step. */
static long long take_piece(NAME_memory *m, double t)
{
    const double h = m->method_h[0], span = t - m->time;
    long long found = DONE;
    if (span >= TINY * h && m->fixed > 0) {
        change_step(m, span);
        found = take_fixed(m, t);
        change_step(m, h);
    } else if (span > 0.0) {
        place(m);
        @levels_spans@[1] = span;
        found = span >= TINY * h ? CALL_TAKE_SPAN(m, 0) : CALL_TAKE_SERIES(m, 0);
#if LOCATING
        if (found == TOUCHES)
            found = CALL_TOUCH(m, 0);
#endif
        @levels_spans@[1] = h;
        set_parts(m, 0);
        forget(m);
    }
    if (found == DONE)
        m->time = t;
    return found;
}

#if JUMPS > 0
/* The next load that jumps does so up to a time t [s]. */
static int jumps_before(const NAME_memory *m, double t)
{
    return m->jump < JUMPS && JUMP[3 * m->jump + 1] <= t + SAME * m->method_h[0];
}
#endif

/* Go on to the time t [s] from jump to jump: the first of the two times of each is just before it, the second one just behind. */
static long long take_between_jumps(NAME_memory *m, double t)
{
    long long found = DONE;
#if JUMPS > 0
    while (found == DONE && jumps_before(m, t)) {
        const double *at = JUMP + 3 * m->jump;
        found = take_piece(m, at[0]);
        if (found == DONE) {
            jump(m, at[1], at[2] > 0.0);
            forget(m);
            m->time = at[1];
            m->jump++;
        }
    }
#endif
    return found == DONE ? take_piece(m, t) : found;
}
#endif

/* What is shown of the start balances all forces; steps begin without the waves that none of them resolves. */
static void begin_steps(NAME_memory *m)
{
    EACH (i, UNKNOWNS)
        @state_acceleration@[i] = @state_history@[i];
    EACH (k, EQUATIONS)
        @state_multipliers@[k] = @state_past@[k];
}

SEARCH_OF_EVENTS
/* One step of the method to the time t [s], in parts where it fails, or from touch to touch; with `fixed` corrections it is whole. */
static int take_step(NAME_memory *m, double t)
{
    long long found;
    copy_state(m, m->begun);
#if EVENTS > 0
    keep_state(m, 0);
#endif
#if JUMPS > 0
    const long long steps = @job_counters@[0];
    if (jumps_before(m, t)) {
        found = take_between_jumps(m, t);
        @job_counters@[0] = steps + (found == DONE);
    } else
#endif
    if (m->fixed > 0)
        found = take_fixed(m, t);
    else {
        read_at(m, t, m->method_h[0]);
        place(m);
        found = CALL_TAKE(m, 0);
    }
    if (found == DONE) {
        m->time = t;
#if EVENTS > 0
        found = look_for_events(m, t);
#endif
        count_turns(m);
    }
    count_costs(m);
    return (int)found;
}

/* So many equal parts of a span; where they are whole steps of the model these are counted. */
static NAME_status take_parts(NAME_memory *m, double span, double parts, int whole)
{
    const double begin = m->time;
    for (double k = 1.0; k <= parts; k += 1.0) {
        const double end = whole ? m->since + (double)(m->whole + 1) * NAME_STEP : begin + span * (k / parts);
#if EVENTS > 0
        const long long before = happened_so_far(m);
#endif
        const int found = take_step(m, end);
        m->whole += found == DONE && whole && m->time >= end;
#if JUMPS > 0 || EVENTS > 0
        if (m->time < end) { /* it may have come to a jump, or to an event */
            m->since = m->time;
            m->whole = 0;
        }
#endif
#if EVENTS > 0
        if (found == BROKEN)
            return NAME_EVENT_NOT_FINITE;
        if (found == REPEATED)
            return NAME_EVENTS_ENDLESS;
        if (found == CONTRADICTED)
            return NAME_EVENT_CONTRADICTED;
        if (found == DONE && @watch_told@[1])
            return NAME_STOPPED;
        if (found == DONE && m->pause && happened_so_far(m) > before)
            return NAME_EVENT;
#endif
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

/* Go on by a span: whole steps of the model where they fit, else as many equal ones as are not longer. The state jumps where forces do at
 * its begin, as what is given has `changed`. */
static NAME_status go_on(NAME_memory *m, double span, int changed)
{
    const double round_off = 1e-9 * span + 1e-15 * m->time;
    double parts = math_floor(span / NAME_STEP + 0.5);
    if (parts < 1.0 || size_of(span - parts * NAME_STEP) > round_off)
        parts = -math_floor(-span / NAME_STEP);
    const int whole = size_of(span - parts * NAME_STEP) <= round_off;
    const double h = whole ? NAME_STEP : span / parts;
    if (@state_known@[0] == 1) /* at no other instant they differ */
        begin_steps(m);
    if (size_of(h - m->method_h[0]) > 1e-12 * m->method_h[0])
        change_step(m, h);
#if JUMPING
    if (changed) {
        @work_kind@[0] = @work_kind@[1] = 0; /* factors of another state, and turned tangents, miss a part of it */
#if JUMPS > 0 /* behind loads that jump at this instant */
        jump(m, m->jump > 0 ? most(m->time, JUMP[3 * m->jump - 2]) : m->time, 0);
#else
        jump(m, m->time, 0);
#endif
    }
#else
    (void)changed;
#endif
    if (!whole) {
        m->since = m->time;
        m->whole = 0;
    }
    const NAME_status found = take_parts(m, span, parts, whole);
    if (!whole)
        m->since = m->time;
    return found;
}

#if CONTROLLED > 0
/* The same from sample to sample of controllers. */
static NAME_status go_by_samples(NAME_memory *m, double span, int changed)
{
    const double end = m->time + span, least_part = 1e-9 * NAME_STEP + 1e-15 * end;
    while (end - m->time > least_part) {
        follow_inputs(m, m->time);
        NAME_status found = act(m, &changed);
        if (found != NAME_OK)
            return found;
        double next = end;
        EACH (k, CONTROLLED)
            next = least(next, next_sample(m, k));
        if (end - next <= least_part)
            next = end;
#if STEERING /* through values at the ends of steps */
        next = least(next, m->time + NAME_STEP);
        take_inputs(m, next - m->time);
#endif
        found = go_on(m, next - m->time, changed);
        if (found != NAME_OK)
            return found;
        changed = 0;
    }
    return NAME_OK;
}
#endif

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
    const int sizes[] = {1, 1, GIVEN, PARAMETERS, 4 * DRIVEN, UNKNOWNS, UNKNOWNS, 3 * UNKNOWNS, EQUATIONS, 3 * EQUATIONS};
    EACH (row, 10)
        EACH (i, sizes[row]) {
            if (back)
                rows[row][i] = *room;
            else
                *room = rows[row][i];
            room++;
        }
    if (!back)
        *room = m->method_c[0];
    /* multipliers are c times those in newtons */
    EACH (k, back ? EQUATIONS : 0)
        @state_multipliers@[k] *= m->method_c[0] / *room;
    EACH (k, back ? 3 * EQUATIONS : 0)
        @state_past@[k] *= m->method_c[0] / *room;
}

/* Inputs of a span that is taken next; whether forces change at its begin by other ones than before. */
static int begin_span(NAME_memory *m, double span)
{
    double before[ROOM(INPUTS)];
    int changed = 0;
    EACH (k, INPUTS)
        before[k] = m->acting[k];
    if (!STEERING)
        take_inputs(m, span);
    follow_inputs(m, m->time);
    EACH (k, INPUTS) /* what masters interpolate is there but for round-off */
        changed |= !DRIVES[k] && size_of(m->acting[k] - before[k]) > 1e-12 * most(size_of(m->acting[k]), size_of(before[k]));
    return changed;
}

static int is_outside(const NAME_memory *m, int k)
{
    return !(m->parameters[k] >= PARAMETER[k][0] && m->parameters[k] <= PARAMETER[k][1]);
}

NAME_status NAME_step(NAME_memory *m, double span)
{
    const double begin = m->time;
    double kept[3 + 4 * ROOM(DRIVEN) + ROOM(GIVEN) + ROOM(PARAMETERS) + 5 * ROOM(UNKNOWNS) + 4 * ROOM(EQUATIONS)];
    int told = 0;
    if (!(span > 0.0) || !is_finite(span))
        return NAME_SPAN_NOT_POSITIVE;
    EACH (k, PARAMETERS)
        if (m->parameters[k] != m->acting_parameters[k] && (!TUNABLE[k] || is_outside(m, k)))
            return TUNABLE[k] ? NAME_PARAMETER_OUTSIDE : NAME_PARAMETER_FIXED;
    m->told = begin;
    EACH (k, INPUTS)
        if (!is_finite(m->inputs[k]) || !is_finite(input_at(m, k, begin + span)))
            return NAME_INPUT_NOT_FINITE;
    EACH (k, INPUTS) {
        const double low = least(m->inputs[k], input_at(m, k, begin + span)), high = most(m->inputs[k], input_at(m, k, begin + span));
        const int beyond = low < INPUT_LEAST[k] || high > INPUT_MOST[k];
        told |= beyond && !m->outside[k];
        m->outside[k] |= beyond;
    }
    if (told)
        return NAME_INPUT_OUTSIDE;
#if EVENTS > 0
    if (@watch_told@[1])
        return NAME_STOPPED;
#endif
    copy_begin(m, kept, 0);
    const int tuned = tune(m);
    const int changed = begin_span(m, span) || tuned;
#if CONTROLLED > 0
    const NAME_status found = go_by_samples(m, span, changed);
#else
    const NAME_status found = go_on(m, span, changed);
#endif
    if (found != NAME_OK && found != NAME_EVENT && found != NAME_STOPPED && m->time <= begin) {
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
    EACH (k, INPUTS)
        m->inputs[k] = INPUT_START[k];
    EACH (k, GIVEN)
        m->rates[0][k] = m->rates[1][k] = m->rates[2][k] = 0.0;
    EACH (k, PARAMETERS)
        m->parameters[k] = PARAMETER[k][2];
    m->fixed = m->pause = 0;
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
    m->time = m->since = m->told = m->given_end = 0.0;
    m->whole = 0;
    EACH (k, INPUTS)
        m->outside[k] = 0;
#if CONTROLLED > 0
    EACH (k, CONTROLLED) {
        m->inputs[INPUTS + k] = @own_given@[k];
        m->samples[k] = 0;
    }
#endif
    m->given_span = NAME_STEP;
    EACH (row, 4)
        EACH (i, DRIVEN)
            m->given[row][i] = m->inputs[i];
    m->jump = 0;
    m->left = 0.0;
    m->enough = 0;
    EACH (k, TURNED)
        m->turned[k] = 0.0;
    set_parameters(m, 1);
    follow_inputs(m, 0.0);
    EACH (k, GIVEN)
        m->acting[k] = m->inputs[k];
    read_signals(m, 0.0, -AHEAD * NAME_STEP, @job_signals@); /* by what comes */
    EACH (k, SIGNALS)
        @state_signals@[k] = @job_signals@[k];
    if (CALL_START(m, 0) != 0)
        return NAME_SINGULAR;
    EACH (i, UNKNOWNS)
        if (!is_finite(@state_v@[i]) || !is_finite(@state_acceleration@[i]))
            return NAME_NOT_FINITE;
    @work_kind@[0] = 0;
    EACH (k, 4)
        @job_counters@[k] = 0;
    count_costs(m);
    count_turns(m);
#if EVENTS > 0
    EACH (k, EVENTS)
        m->happened[k] = 0;
    m->instant = m->step_begin = m->step_end = m->apart = 0.0;
    if (CALL_WATCH(m) != 0)
        return NAME_EVENT_NOT_FINITE;
#endif
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
    read_signals(m, t, m->method_h[0], @space_signals@);
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
    const double h = m->method_h[0], change = CHANGE * most(1.0, size_of(m->acting[input]));
    @work_kind@[1] = 0;
    if (!correct_beside(m, input, m->time - h, m->begun, along, found))
        return NAME_SINGULAR;
    EACH (i, UNKNOWNS + EQUATIONS)
        along[i] = -found[i] * (i < UNKNOWNS ? m->method_bh[0] : 1.0);
    copy_state(m, state);
    @work_kind@[1] = 0;
    const int solved = correct_beside(m, input, m->time, state, along, found);
    @work_kind@[0] = 0;
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
        "a step, or the start, found no finite numbers: the state is that of the last good one",
        "the matrix of a step is singular: the state is that of the last good one",
        "there is no such input",
        "a parameter is outside of the range that the model was trained for",
        "an input that drives a joint has no derivatives",
        "the corrections of a step are too few, or do not shrink: the state is that of the last good one, see `enough`",
        "an input is outside of the range that the model was trained for: errors are not known; the next call takes the step",
        "a controller gives no finite number: the state is that of the last good step, look at what it reads",
        "a parameter is fixed when the motion has started: start again, or put its value back",
        "an event has happened: the state is that behind it, the rest of the span is not taken",
        "an event has stopped the motion: the state is that at its instant",
        "the value of an event is no number: the state is the last one known before it",
        "events happen again and again at one instant: the state is that behind one of them",
        "an event locks what a drive moves: the state is that before it"};
    return texts[status];
}
