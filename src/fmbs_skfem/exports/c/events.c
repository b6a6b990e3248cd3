
/* The time of a place in the step that is looked at, 0 to 1 [s]. */
static double time_at(const NAME_memory *m, double place)
{
    return place == 1.0 ? m->step_end : m->step_begin + place * (m->step_end - m->step_begin);
}

/* States of the search are kept, or put back. */
static void copy_kept(NAME_memory *m, int which, int back)
{
    if (which == 0)
        CALL_COPY_BEGIN(m, back);
    else if (which == 1)
        CALL_COPY_PIECE(m, back);
    else
        CALL_COPY_END(m, back);
}

static void keep_state(NAME_memory *m, int which)
{
    m->kept_time[which] = m->time;
    m->kept_jump[which] = m->jump;
    copy_kept(m, which, 0);
}

static void put_state(NAME_memory *m, int which)
{
    m->time = m->kept_time[which];
    m->jump = m->kept_jump[which];
    copy_kept(m, which, 1);
}

#if LATE_READINGS
/* Accelerations and reactions that balance all forces take the place of those of the state, or go back. */
static void swap_balanced(NAME_memory *m)
{
    EACH (i, UNKNOWNS) {
        const double own = @state_acceleration@[i];
        @state_acceleration@[i] = @impulse_acceleration@[i];
        @impulse_acceleration@[i] = own;
    }
    EACH (k, EQUATIONS) {
        const double own = @state_multipliers@[k];
        @state_multipliers@[k] = @impulse_multipliers@[k];
        @impulse_multipliers@[k] = own;
    }
}
#endif

/* Values of all events in the present state; within a step with reactions that are found anew. */
static void read_values(NAME_memory *m, double place)
{
#if LATE_READINGS
    const int within = place > 0.0 && place < 1.0;
    if (within) {
        read_at(m, time_at(m, place), 0.0);
        CALL_BALANCE(m, 0);
        swap_balanced(m);
    }
    sense(m);
#else
    (void)place;
#endif
    READ
#if LATE_READINGS
    if (within)
        swap_balanced(m);
#endif
}

/* Their changes in a step, as they are in the present state. */
static void find_rates(NAME_memory *m, double place)
{
    double before[EVENT_VALUES] = {0};
    EACH (side, 2) {
        const double t = time_at(m, place) + (2 * side - 1) * BESIDE * m->method_h[0];
        read_at(m, t, m->method_h[0]);
        CALL_BESIDE(m, 0, 2 * side - 1);
        EACH (k, EVENT_VALUES) {
            const double value = KEPT_VALUE[k] < 0 ? NO_NUMBER : @space_memory@[KEPT_VALUE[k]];
            @watch_rates@[k] = (value - before[k]) / (2.0 * BESIDE);
            before[k] = value;
        }
    }
}

/* Go on from a place in the step to another one; the status. */
static long long take_part(NAME_memory *m, double place, double to)
{
    (void)place;
    if (@state_known@[0] == 1)
        begin_steps(m);
    return take_between_jumps(m, time_at(m, to));
}

/* Rows that events release or lock, an impulse, and accelerations behind it; the status. */
static long long let_happen(NAME_memory *m, double place)
{
    const double t = time_at(m, place), late = most(t, m->step_begin + LATE * m->method_h[0]);
    read_at(m, t, 0.0);
    CALL_BALANCE(m, 0);
    EACH (i, UNKNOWNS) {
        @state_a@[i] = @impulse_acceleration@[i];
        @space_x@[i] = @state_x@[i];
    }
    CALL_PROBES(m, 0);
    EACH (i, PROBES)
        @change_probes@[i] = @space_y@[i];
    CALL_CHANGE(m);
    EACH (k, EQUATIONS)
        @space_off@[k] = @change_closed@[k] == 0 ? 1.0 : 0.0;
    EACH (k, LATCHED)
        m->inputs[INPUTS + CONTROLLED + k] = @change_numbers@[k];
    read_at(m, late, 0.0);
    const long long failed = CALL_ANEW(m, 0);
    forget(m);
    EACH (k, EVENTS)
        if (failed == 0 && @watch_due@[k]) {
            m->happened[k]++;
            m->instant = t;
        }
    return failed == 0 ? DONE : failed == OPEN || failed == AGAINST ? CONTRADICTED : SINGULAR;
}

static long long happened_so_far(const NAME_memory *m)
{
    long long found = 0;
    EACH (k, EVENTS)
        found += m->happened[k];
    return found;
}

/* Let happen what happens in the step that was taken to a time t [s]; the status. */
static long long look_for_events(NAME_memory *m, double t)
{
    const long long steps = @job_counters@[0];
    m->step_begin = m->kept_time[0];
    m->step_end = t;
    @watch_told@[2] = m->pause;
    const double apart = (m->apart - m->step_begin) / (t - m->step_begin);
    @watch_reached@[2] = apart > 0.0 && apart < 1.0 ? apart : 1.0;
    const long long found = CALL_LOOK(m);
    m->apart = @watch_reached@[2] < 1.0 ? time_at(m, @watch_reached@[2]) : 0.0;
    @job_counters@[0] = steps;
    if (found == DONE)
        m->time = time_at(m, @watch_reached@[1]);
    else
        put_state(m, @watch_told@[3] ? 1 : 0);
    return found;
}
