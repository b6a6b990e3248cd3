/* ---------------------------------------------------------------------------------------------------------------------------------
 * An instance: a model, the mode that it is in, and whom it tells what happens. Variables by value reference: 0 is time, then
 * parameters, inputs and outputs.
 * ------------------------------------------------------------------------------------------------------------------------------ */

enum { OK, WARNING, DISCARD, ERROR };
enum { INSTANTIATED, INITIALISING, STEPPING, AT_EVENT, TERMINATED };
enum { ROOM_OF_TEXT = 512, FIRST_INPUT = 1 + NAME_PARAMETERS, FIRST_OUTPUT = FIRST_INPUT + NAME_INPUTS };
#define VARIABLES (FIRST_OUTPUT + NAME_OUTPUTS)
#define AT_LEAST_ONE(n) ((n) > 0 ? (n) : 1)

static const char TOKEN[] = "TOKEN_OF_MODEL";
static const char *const CATEGORIES[] = {"logStatusWarning", "logStatusDiscard", "logStatusError", "logSteps"};
/* of parameters, then of inputs: names, ranges (without one: a least value above the largest), units */
static const struct {
    const char *name;
    double least, largest;
    const char *unit;
    int fixed; /* parameters that cannot change in a motion */
} GIVEN[AT_LEAST_ONE(NAME_PARAMETERS + NAME_INPUTS)] = {
TABLE_OF_GIVEN
};

/* What a saved state holds. */
typedef struct {
    NAME_memory model;
    double start; /* time of the master at the start of the motion [s] */
    double next;  /* and where it is to go on, by its own sums [s] */
    int mode;
    int stale;   /* values were set since the model was started */
    int told;    /* whether the message about steps was sent */
    int outside[AT_LEAST_ONE(NAME_INPUTS)]; /* inputs that were told to be outside of their range */
} state;

typedef struct {
    state now;
    double outputs[AT_LEAST_ONE(NAME_OUTPUTS)];
    int read; /* whether these are those of now */
    int early; /* whether the last step ended before its communication point */
    int event; /* whether an event has happened in it */
    int ended; /* whether one has stopped the motion */
    int muted;
    char name[ROOM_OF_TEXT];
    struct connection link;
} instance;

static void tell(instance *one, int status, const char *category, const char *text);
static NAME_status take_span(instance *one, double span);
static void *allocate(const struct connection *link, size_t size);
static void release(const struct connection *link, void *place);

/* ---- text, without a library ---- */

typedef struct {
    char text[ROOM_OF_TEXT];
    int length;
} message;

static void add(message *to, const char *text)
{
    while (*text && to->length < ROOM_OF_TEXT - 1)
        to->text[to->length++] = *text++;
    to->text[to->length] = 0;
}

static void add_whole(message *to, long long value)
{
    char digits[24];
    int count = 24;
    unsigned long long rest = value < 0 ? 0ULL - (unsigned long long)value : (unsigned long long)value;
    digits[--count] = 0;
    do {
        digits[--count] = (char)('0' + rest % 10);
        rest /= 10;
    } while (rest > 0);
    if (value < 0)
        digits[--count] = '-';
    add(to, digits + count);
}

/* A number to seven digits, 1.25e-3. */
static void add_number(message *to, double value)
{
    int exponent = 0, length = 7;
    long long digits;
    char text[2] = {0, 0};
    if (!(value - value == 0.0)) {
        add(to, value != value ? "nan" : value > 0.0 ? "inf" : "-inf");
        return;
    }
    if (value < 0.0) {
        add(to, "-");
        value = -value;
    }
    for (; value > 0.0 && value < 1e6; exponent--)
        value *= 10.0;
    for (; value >= 1e7; exponent++)
        value /= 10.0;
    digits = (long long)(value + 0.5);
    if (digits >= 10000000) {
        digits /= 10;
        exponent++;
    }
    for (; length > 1 && digits % 10 == 0; length--, exponent++)
        digits /= 10;
    if (digits == 0) {
        add(to, "0");
    } else if (exponent >= 0 && length + exponent <= 7) {
        for (; exponent > 0; exponent--)
            digits *= 10;
        add_whole(to, digits);
    } else {
        long long power = 1;
        int shown = 0; /* places behind the point */
        for (int k = 1; k < length; k++)
            power *= 10;
        exponent += length - 1;
        shown = exponent < 0 && exponent >= -4 ? -exponent : 0;
        if (shown) { /* 0.00125 */
            add(to, "0.");
            for (int k = 1; k < shown; k++)
                add(to, "0");
        }
        for (int k = 0; k < length; k++, power /= 10) {
            if (!shown && k == (exponent >= 0 && exponent < 7 ? exponent + 1 : 1))
                add(to, ".");
            text[0] = (char)('0' + digits / power % 10);
            add(to, text);
        }
        if (exponent < -4 || exponent >= 7) {
            add(to, "e");
            add_whole(to, exponent);
        }
    }
}

static int complain(instance *one, int status, const char *text)
{
    tell(one, status, CATEGORIES[status - WARNING], text);
    return status;
}

static int refuse_mode(instance *one, const char *call)
{
    message text = {"", 0};
    add(&text, call);
    add(&text, ": not allowed in this mode");
    return complain(one, ERROR, text.text);
}

/* ---- life ---- */

static int same(const char *a, const char *b)
{
    for (; *a && *a == *b; a++, b++)
        ;
    return *a == *b;
}

static int is_finite(double value)
{
    return value - value == 0.0;
}

static void copy(unsigned char *to, const unsigned char *from, size_t size)
{
    for (size_t k = 0; k < size; k++)
        to[k] = from[k];
}

/* As after it was made: nothing of an earlier run is left. */
static int reset(instance *one)
{
    unsigned char *bytes = (unsigned char *)&one->now;
    for (size_t k = 0; k < sizeof one->now; k++)
        bytes[k] = 0;
    NAME_init(&one->now.model);
    one->now.mode = INSTANTIATED;
    one->now.stale = 1;
    one->read = one->early = one->event = one->ended = 0;
    return OK;
}

static instance *make(const char *name, const char *token, const struct connection *link)
{
    instance *one = (instance *)allocate(link, sizeof(instance));
    message text = {"", 0};
    if (!one)
        return 0;
    add(&text, name && *name ? name : "NAME");
    copy((unsigned char *)one->name, (unsigned char *)text.text, sizeof one->name);
    one->link = *link;
    one->muted = 0;
    if (!token || !same(token, TOKEN)) {
        complain(one, ERROR, "the token of the model description is that of another model");
        release(link, one);
        return 0;
    }
    reset(one);
    return one;
}

static void forget(instance *one)
{
    struct connection link;
    if (!one)
        return;
    link = one->link;
    release(&link, one);
}

static int set_logging(instance *one, int on, size_t count, const char *const categories[])
{
    for (size_t k = 0; k < count; k++) {
        int known = 0;
        for (size_t j = 0; j < sizeof CATEGORIES / sizeof *CATEGORIES; j++)
            known = known || same(categories[k], CATEGORIES[j]);
        if (!known)
            return complain(one, ERROR, "there is no such category of messages");
    }
    one->muted = !on;
    return OK;
}

/* The motion at the values that were set. */
static int start(instance *one)
{
    const NAME_status found = NAME_start(&one->now.model);
    one->now.stale = 0;
    one->read = 0;
    return found == NAME_OK ? OK : complain(one, ERROR, NAME_message(found));
}

static int enter_initialisation(instance *one, double begin)
{
    message text = {"", 0};
    if (one->now.mode != INSTANTIATED)
        return refuse_mode(one, "EnterInitializationMode");
    if (!is_finite(begin))
        return complain(one, ERROR, "the start time is not finite");
    one->now.start = begin;
    one->now.mode = INITIALISING;
    if (begin != 0.0 && !one->muted) {
        add(&text, "the motion begins at ");
        add_number(&text, begin);
        add(&text, " s: functions of time of the model count from there");
        tell(one, OK, CATEGORIES[3], text.text);
    }
    return OK;
}

static int exit_initialisation(instance *one)
{
    if (one->now.mode != INITIALISING)
        return refuse_mode(one, "ExitInitializationMode");
    if (one->now.stale) {
        const int status = start(one);
        if (status != OK)
            return status;
    }
    one->now.mode = STEPPING;
    one->now.next = one->now.start;
    return OK;
}

static int terminate(instance *one)
{
    if (one->now.mode != STEPPING && one->now.mode != AT_EVENT)
        return refuse_mode(one, "Terminate");
    one->now.mode = TERMINATED;
    return OK;
}

/* ---- values ---- */

static double now(const instance *one)
{
    return one->now.start + (one->now.mode >= STEPPING ? one->now.model.time : 0.0);
}

static int get(instance *one, const unsigned references[], size_t count, double values[])
{
    for (size_t k = 0; k < count; k++) {
        const unsigned at = references[k];
        if (at >= (unsigned)VARIABLES)
            return complain(one, ERROR, "there is no variable of this value reference");
        if (at == 0) {
            values[k] = now(one);
        } else if (at < (unsigned)FIRST_INPUT) {
            values[k] = one->now.model.parameters[at - 1];
        } else if (at < (unsigned)FIRST_OUTPUT) {
            values[k] = one->now.model.inputs[at - FIRST_INPUT];
        } else {
            if (one->now.mode < STEPPING && one->now.stale) {
                const int status = start(one);
                if (status != OK)
                    return status;
            }
            if (!one->read)
                NAME_outputs(&one->now.model, one->outputs);
            one->read = 1;
            values[k] = one->outputs[at - FIRST_OUTPUT];
        }
    }
    return OK;
}

/* "E = 5 [Pa] is outside of 1 to 2": what is wrong with a value. */
static int complain_of(instance *one, int status, size_t which, double value, const char *what)
{
    message text = {"", 0};
    add(&text, GIVEN[which].name);
    add(&text, " = ");
    add_number(&text, value);
    if (*GIVEN[which].unit) {
        add(&text, " ");
        add(&text, GIVEN[which].unit);
    }
    add(&text, what);
    if (is_finite(value)) {
        add_number(&text, GIVEN[which].least);
        add(&text, " to ");
        add_number(&text, GIVEN[which].largest);
    }
    return complain(one, status, text.text);
}

static int is_outside(size_t which, double value)
{
    return GIVEN[which].least <= GIVEN[which].largest && !(value >= GIVEN[which].least && value <= GIVEN[which].largest);
}

/* All values, or none where one of them is refused. */
static int set(instance *one, const unsigned references[], size_t count, const double values[])
{
    int status = OK;
    for (size_t k = 0; k < count; k++) {
        const unsigned at = references[k];
        if (at == 0 || at >= (unsigned)FIRST_OUTPUT)
            return complain(one, ERROR, "only parameters and inputs can be set");
        if (GIVEN[at - 1].fixed && one->now.mode > INITIALISING)
            return complain(one, ERROR, "this parameter is fixed when the motion has started: reset the model");
        if (!is_finite(values[k]))
            return complain_of(one, DISCARD, at - 1, values[k], " is not finite: the value before stays");
        if (at < (unsigned)FIRST_INPUT && is_outside(at - 1, values[k]))
            return complain_of(one, DISCARD, at - 1, values[k], " is refused, outside of what the model was trained for, ");
    }
    for (size_t k = 0; k < count; k++) {
        const unsigned at = references[k];
        if (at < (unsigned)FIRST_INPUT) {
            one->now.model.parameters[at - 1] = values[k];
        } else {
            int *outside = one->now.outside + (at - FIRST_INPUT);
            if (is_outside(at - 1, values[k]) && !*outside) {
                *outside = 1;
                status = complain_of(one, WARNING, at - 1, values[k], " is outside of what the model was trained for, ");
            }
            one->now.model.inputs[at - FIRST_INPUT] = values[k];
        }
        if (one->now.mode <= INITIALISING)
            one->now.stale = 1;
    }
    return status;
}

/* ---- steps ---- */

/* Tells once that the master steps otherwise than the model. */
static void tell_steps(instance *one, double span)
{
    const double parts = span / NAME_STEP;
    long long count = (long long)parts;
    message text = {"", 0};
    if (one->now.told || one->muted || (parts - 1.0 < 1e-9 && 1.0 - parts < 1e-9))
        return;
    one->now.told = 1;
    count += parts - (double)count > 1e-9 * parts;
    add(&text, "a communication step of ");
    add_number(&text, span);
    add(&text, " s is taken as ");
    add_whole(&text, count);
    add(&text, count == 1 ? " step of " : " steps of ");
    add_number(&text, span / (double)count);
    add(&text, " s; the step of the model is ");
    add_number(&text, NAME_STEP);
    add(&text, " s");
    tell(one, OK, CATEGORIES[3], text.text);
}

static int is_near(double time, double other)
{
    const double off = time - other, least = 1e-3 * NAME_STEP + 1e-15 * (time < 0.0 ? -time : time);
    return off <= least && -off <= least;
}

/* What is outside of a range was told as it was set. */
static NAME_status go_on(instance *one, double span)
{
    const NAME_status found = NAME_step(&one->now.model, span);
    one->read = 0;
    return found == NAME_INPUT_OUTSIDE ? NAME_step(&one->now.model, span) : found;
}

/* How many events have happened so far. */
static long long events_of(const instance *one)
{
    long long found = 0;
    for (int k = 0; k < NAME_EVENTS; k++)
        found += one->now.model.happened[k];
    return found;
}

/* Go on by a span [s]; where a step fails the state is that of the last good one. Masters that add up steps are off by their round-off
 * after millions of them: they go on where they have been before, or at the time of the model, which counts its steps. */
static int step(instance *one, double from, double span)
{
    const double here = now(one), next = from + span;
    NAME_status found;
    if (one->now.mode != STEPPING)
        return refuse_mode(one, "DoStep");
    if (!is_near(from, here) && !is_near(from, one->now.next)) {
        message text = {"", 0};
        add(&text, "the communication point ");
        add_number(&text, from);
        add(&text, " s is not the time of the model, ");
        add_number(&text, here);
        add(&text, " s");
        return complain(one, ERROR, text.text);
    }
    if (!(span > 0.0) || !is_finite(span) || span / NAME_STEP > 1e15)
        return complain(one, ERROR, NAME_message(NAME_SPAN_NOT_POSITIVE));
    if (span > 0.5 * NAME_STEP) { /* a whole number of steps but for the round-off of time */
        const double whole = (double)(long long)(span / NAME_STEP + 0.5) * NAME_STEP;
        const double round_off = 1e-9 * span + 1e-15 * (here < 0.0 ? -here : here);
        if (span - whole <= round_off && whole - span <= round_off)
            span = whole;
    }
    tell_steps(one, span);
    one->early = 0;
    const long long before = events_of(one);
    found = take_span(one, span);
    one->event = events_of(one) > before;
    one->ended = found == NAME_STOPPED;
    one->early |= one->ended || (found == NAME_EVENT && !is_near(now(one), next));
    if (found == NAME_EVENT || (one->ended && one->event))
        found = NAME_OK;
    one->now.next = found == NAME_OK && !one->early ? next : now(one);
    return found == NAME_OK ? OK : complain(one, DISCARD, NAME_message(found));
}

/* Changes of outputs at the end of the last step, by changes of the inputs that were held over it. */
static int derive(instance *one, const unsigned unknowns[], size_t rows, const unsigned knowns[], size_t columns,
    const double seed[], double found[])
{
    double slopes[AT_LEAST_ONE(NAME_OUTPUTS)];
    if (one->now.mode != STEPPING)
        return refuse_mode(one, "GetDirectionalDerivative");
    for (size_t i = 0; i < rows; i++) {
        found[i] = 0.0;
        if (unknowns[i] < (unsigned)FIRST_OUTPUT || unknowns[i] >= (unsigned)VARIABLES)
            return complain(one, ERROR, "only outputs have derivatives");
    }
    for (size_t j = 0; j < columns; j++) {
        NAME_status status;
        if (knowns[j] < (unsigned)FIRST_INPUT || knowns[j] >= (unsigned)FIRST_OUTPUT)
            return complain(one, ERROR, "there are derivatives by inputs only");
        status = NAME_derivative(&one->now.model, (int)(knowns[j] - FIRST_INPUT), slopes);
        if (status != NAME_OK)
            return complain(one, DISCARD, NAME_message(status));
        for (size_t i = 0; i < rows; i++)
            found[i] += slopes[unknowns[i] - FIRST_OUTPUT] * seed[j];
    }
    return OK;
}

/* ---- states ---- */

static int save(instance *one, void **place)
{
    if (!*place)
        *place = allocate(&one->link, sizeof(state));
    if (!*place)
        return complain(one, ERROR, "there is no memory for a state");
    *(state *)*place = one->now;
    return OK;
}

static int restore(instance *one, const void *place)
{
    if (!place)
        return complain(one, ERROR, "there is no such state");
    one->now = *(const state *)place;
    one->read = 0;
    return OK;
}

static int drop(instance *one, void **place)
{
    if (*place)
        release(&one->link, *place);
    *place = 0;
    return OK;
}

enum { HEAD = 64, SUM = 56 }; /* bytes before a state: whose it is, and from SUM on the sum of its bytes */

/* The sum of Fowler, Noll and Vo over some bytes: a state has indices and numbers that nothing checks any more. */
static unsigned long long sum_of(const unsigned char bytes[], size_t count)
{
    unsigned long long sum = 14695981039346656037ull;
    for (size_t k = 0; k < count; k++)
        sum = (sum ^ bytes[k]) * 1099511628211ull;
    return sum;
}

static unsigned char head_of(unsigned long long sum, size_t k)
{
    if (k >= SUM)
        return (unsigned char)(sum >> (8 * (k - SUM)));
    return (unsigned char)(k < sizeof TOKEN ? TOKEN[k] : 0);
}

static int write_state(instance *one, const void *place, unsigned char bytes[], size_t size)
{
    if (!place || size < HEAD + sizeof(state))
        return complain(one, ERROR, "there is no such state, or no room for it");
    const unsigned long long sum = sum_of(place, sizeof(state));
    for (size_t k = 0; k < HEAD; k++)
        bytes[k] = head_of(sum, k);
    copy(bytes + HEAD, (const unsigned char *)place, sizeof(state));
    return OK;
}

static int read_state(instance *one, const unsigned char bytes[], size_t size, void **place)
{
    int ours = size == HEAD + sizeof(state);
    const unsigned long long sum = ours ? sum_of(bytes + HEAD, sizeof(state)) : 0;
    for (size_t k = 0; ours && k < HEAD; k++)
        ours = bytes[k] == head_of(sum, k);
    if (!ours)
        return complain(one, ERROR, "these bytes are the state of another model or of another machine, or are damaged");
    if (!*place)
        *place = allocate(&one->link, sizeof(state));
    if (!*place)
        return complain(one, ERROR, "there is no memory for a state");
    copy((unsigned char *)*place, bytes + HEAD, sizeof(state));
    return OK;
}
