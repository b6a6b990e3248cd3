/* The functions of FMI 3.0 for co-simulation (fmi-standard.org), for the model of NAME.h.
 *
 * A library that is loaded has functions of these names. For sources that are linked into a program, -D FMI3_FUNCTION_PREFIX=NAME_
 * puts the name of the model before them.
 */
#include "NAME.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define JOIN_BOTH(a, b) a##b
#define JOIN(a, b) JOIN_BOTH(a, b)
#if defined FMI3_FUNCTION_PREFIX && !defined FMI3_OVERRIDE_FUNCTION_PREFIX
#define FMI(name) JOIN(FMI3_FUNCTION_PREFIX, name)
#elif defined FMI3_ACTUAL_FUNCTION_PREFIX
#define FMI(name) JOIN(FMI3_ACTUAL_FUNCTION_PREFIX, name)
#else
#define FMI(name) name
#endif
#if defined _WIN32 || defined __CYGWIN__
#define EXPORT __declspec(dllexport)
#elif defined __GNUC__
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

/* memory of the operating system, so that Windows needs no C library */
#if defined _WIN32
__declspec(dllimport) void *__stdcall GetProcessHeap(void);
__declspec(dllimport) void *__stdcall HeapAlloc(void *heap, unsigned long flags, size_t size);
__declspec(dllimport) int __stdcall HeapFree(void *heap, unsigned long flags, void *place);
#define ALLOCATE(size) HeapAlloc(GetProcessHeap(), 0, size)
#define RELEASE(place) HeapFree(GetProcessHeap(), 0, place)
#else
void *malloc(size_t size);
void free(void *place);
#define ALLOCATE(size) malloc(size)
#define RELEASE(place) free(place)
#endif

typedef void updated(void *environment, double time, bool set, bool get, bool taken, bool can_end, bool *end, double *until);

struct connection {
    void *environment;
    void (*logger)(void *environment, int status, const char *category, const char *text);
    updated *update; /* asks for inputs within a step, and shows outputs */
    bool early;      /* whether it may end a step */
    bool events;     /* whether it handles events */
};

SHARED_PART

static void tell(instance *one, int status, const char *category, const char *text)
{
    if (one->link.logger)
        one->link.logger(one->link.environment, status, category, text);
}

static void *allocate(const struct connection *link, size_t size)
{
    (void)link;
    return ALLOCATE(size);
}

static void release(const struct connection *link, void *place)
{
    (void)link;
    RELEASE(place);
}

/* Whether the master wants to end the step at a time within it [s]. */
static int ask(instance *one, double time, bool taken)
{
    bool end = false;
    double until = time;
    one->link.update(one->link.environment, time, !taken, taken, taken, taken && one->link.early, &end, &until);
    return taken && one->link.early && end && until <= time + 1e-9 * NAME_STEP;
}

/* A span in steps of the model; between values that a master gives for their ends inputs are lines. */
static NAME_status take_span(instance *one, double span)
{
    NAME_memory *m = &one->now.model;
    const double whole = (double)(long long)(span / NAME_STEP + 1.0 - 1e-9), parts = whole < 1.0 ? 1.0 : whole, h = span / parts;
    const double begin = now(one);
    m->pause = one->link.events && one->link.early;
    if (!one->link.update)
        return go_on(one, span);
    for (double k = 1.0; k <= parts && !one->early; k += 1.0) {
        double before[AT_LEAST_ONE(NAME_INPUTS)];
        for (int i = 0; i < NAME_INPUTS; i++)
            before[i] = m->inputs[i];
        ask(one, begin + k * h, false);
        for (int i = 0; i < NAME_INPUTS; i++) {
            m->rates[0][i] = (m->inputs[i] - before[i]) / h;
            m->inputs[i] = before[i];
        }
        const NAME_status found = go_on(one, h);
        if (found != NAME_OK) {
            one->early = found == NAME_EVENT && k < parts;
            return found;
        }
        one->early = ask(one, now(one), true) && k < parts;
    }
    return NAME_OK;
}

typedef void call(void);

EXPORT const char *FMI(fmi3GetVersion)(void)
{
    return "3.0";
}

EXPORT int FMI(fmi3SetDebugLogging)(void *c, bool on, size_t count, const char *const categories[])
{
    return set_logging(c, on, count, categories);
}

EXPORT void *FMI(fmi3InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool events, bool early, const uint32_t between[], size_t many, void *environment,
    void (*logger)(void *, int, const char *, const char *), updated *update)
{
    struct connection link;
    instance *one;
    (void)resources;
    (void)visible;
    (void)logging;
    link.environment = environment;
    link.logger = logger;
    link.update = update;
    link.early = early;
    link.events = events;
    one = make(name, token, &link);
    int known = NAME_EVENTS > 0 || !events;
    for (size_t k = 0; one && k < many; k++)
        known = known && between[k] >= (uint32_t)FIRST_INPUT && between[k] < (uint32_t)VARIABLES;
    if (one && !known) {
        complain(one, ERROR, NAME_EVENTS > 0 ? "between communication points there are only inputs and outputs" :
            "the model has no events, and only inputs and outputs between communication points");
        forget(one);
        return NULL;
    }
    return one;
}

EXPORT void *FMI(fmi3InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, void (*logger)(void *, int, const char *, const char *))
{
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    if (logger)
        logger(environment, ERROR, CATEGORIES[2], "the model is there for co-simulation only");
    return NULL;
}

EXPORT void *FMI(fmi3InstantiateScheduledExecution)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, void *environment, void (*logger)(void *, int, const char *, const char *), call *clock, call *lock, call *unlock)
{
    (void)clock;
    (void)lock;
    (void)unlock;
    return FMI(fmi3InstantiateModelExchange)(name, token, resources, visible, logging, environment, logger);
}

EXPORT void FMI(fmi3FreeInstance)(void *c)
{
    forget(c);
}

EXPORT int FMI(fmi3EnterInitializationMode)(void *c, bool known, double tolerance, double begin, bool ends, double end)
{
    (void)known;
    (void)tolerance;
    (void)ends;
    (void)end;
    return enter_initialisation(c, begin);
}

EXPORT int FMI(fmi3ExitInitializationMode)(void *c)
{
    instance *one = c;
    const int status = exit_initialisation(one);
    if (status == OK && one->link.events)
        one->now.mode = AT_EVENT;
    return status;
}

EXPORT int FMI(fmi3EnterEventMode)(void *c)
{
    instance *one = c;
    if (!one->link.events || one->now.mode != STEPPING)
        return refuse_mode(one, "fmi3EnterEventMode");
    one->now.mode = AT_EVENT;
    return OK;
}

EXPORT int FMI(fmi3EnterStepMode)(void *c)
{
    instance *one = c;
    if (one->now.mode != AT_EVENT)
        return refuse_mode(one, "fmi3EnterStepMode");
    one->now.mode = STEPPING;
    return OK;
}

/* What events do is done when a step ends behind them. */
EXPORT int FMI(fmi3UpdateDiscreteStates)(void *c, bool *again, bool *ends, bool *nominals, bool *values, bool *defined, double *next)
{
    instance *one = c;
    if (one->now.mode != AT_EVENT)
        return refuse_mode(one, "fmi3UpdateDiscreteStates");
    *again = *nominals = *values = *defined = false;
    *ends = one->ended;
    *next = 0.0;
    return OK;
}

EXPORT int FMI(fmi3Terminate)(void *c)
{
    return terminate(c);
}

EXPORT int FMI(fmi3Reset)(void *c)
{
    return reset(c);
}

/* Points of bodies are an array behind all other variables, linear in the unknowns of the model. */
enum { SHAPE = VARIABLES, POINTS = SIZE_OF_SHAPE };
#if SIZE_OF_SHAPE > 0
ARRAYS_OF_SHAPE
#endif

static int get_shape(instance *one, double values[])
{
    double unread;
    const unsigned first = (unsigned)FIRST_OUTPUT;
    int status = OK;
    /* any output asks for the start where it is due */
    if (NAME_OUTPUTS > 0)
        status = get(one, &first, 1, &unread);
    else if (one->now.mode < STEPPING && one->now.stale)
        status = start(one);
    if (status != OK)
        return status;
#if SIZE_OF_SHAPE > 0
    const int count = (int)(sizeof one->now.model.state_x / sizeof(double));
    for (int k = 0; k < POINTS; k++) {
        values[k] = SHAPE_OFFSET[k];
        for (int i = 0; i < count; i++)
            values[k] += SHAPE_MATRIX[k * count + i] * one->now.model.state_x[i];
    }
#else
    (void)values;
#endif
    return OK;
}

EXPORT int FMI(fmi3GetFloat64)(void *c, const uint32_t references[], size_t count, double values[], size_t many)
{
    size_t expected = 0;
    for (size_t k = 0; k < count; k++)
        expected += POINTS > 0 && references[k] == SHAPE ? (size_t)POINTS : 1;
    if (many != expected)
        return complain(c, ERROR, "every variable is one number, but for the shape");
    for (size_t k = 0; k < count; k++) {
        const int whole = POINTS > 0 && references[k] == SHAPE;
        const int status = whole ? get_shape(c, values) : get(c, references + k, 1, values);
        if (status != OK)
            return status;
        values += whole ? POINTS : 1;
    }
    return OK;
}

EXPORT int FMI(fmi3SetFloat64)(void *c, const uint32_t references[], size_t count, const double values[], size_t many)
{
    return many == count ? set(c, references, count, values) : complain(c, ERROR, "every variable is one number");
}

/* The model has numbers of 64 bits only. */
static int refuse_kind(void *c, size_t count)
{
    return count == 0 ? OK : complain((instance *)c, ERROR, "the model has variables of Float64 only");
}

#define NONE_OF(name, kind)                                                                                                        \
    EXPORT int FMI(fmi3Get##name)(void *c, const uint32_t references[], size_t count, kind values[], size_t many)                  \
    {                                                                                                                              \
        (void)references;                                                                                                          \
        (void)values;                                                                                                              \
        (void)many;                                                                                                                \
        return refuse_kind(c, count);                                                                                              \
    }                                                                                                                              \
    EXPORT int FMI(fmi3Set##name)(void *c, const uint32_t references[], size_t count, kind const values[], size_t many)            \
    {                                                                                                                              \
        (void)references;                                                                                                          \
        (void)values;                                                                                                              \
        (void)many;                                                                                                                \
        return refuse_kind(c, count);                                                                                              \
    }
NONE_OF(Float32, float)
NONE_OF(Int8, int8_t)
NONE_OF(UInt8, uint8_t)
NONE_OF(Int16, int16_t)
NONE_OF(UInt16, uint16_t)
NONE_OF(Int32, int32_t)
NONE_OF(UInt32, uint32_t)
NONE_OF(Int64, int64_t)
NONE_OF(UInt64, uint64_t)
NONE_OF(Boolean, bool)
NONE_OF(String, const char *)

EXPORT int FMI(fmi3GetBinary)(void *c, const uint32_t references[], size_t count, size_t sizes[], const uint8_t *values[], size_t many)
{
    (void)references;
    (void)sizes;
    (void)values;
    (void)many;
    return refuse_kind(c, count);
}

EXPORT int FMI(fmi3SetBinary)(void *c, const uint32_t references[], size_t count, const size_t sizes[], const uint8_t *const values[],
    size_t many)
{
    (void)references;
    (void)sizes;
    (void)values;
    (void)many;
    return refuse_kind(c, count);
}

EXPORT int FMI(fmi3GetClock)(void *c, const uint32_t references[], size_t count, bool values[])
{
    (void)references;
    (void)values;
    return refuse_kind(c, count);
}

EXPORT int FMI(fmi3SetClock)(void *c, const uint32_t references[], size_t count, const bool values[])
{
    (void)references;
    (void)values;
    return refuse_kind(c, count);
}

EXPORT int FMI(fmi3GetFMUState)(void *c, void **place)
{
    return save(c, place);
}

EXPORT int FMI(fmi3SetFMUState)(void *c, void *place)
{
    return restore(c, place);
}

EXPORT int FMI(fmi3FreeFMUState)(void *c, void **place)
{
    return drop(c, place);
}

EXPORT int FMI(fmi3SerializedFMUStateSize)(void *c, void *place, size_t *size)
{
    (void)c;
    (void)place;
    *size = HEAD + sizeof(state);
    return OK;
}

EXPORT int FMI(fmi3SerializeFMUState)(void *c, void *place, uint8_t bytes[], size_t size)
{
    return write_state(c, place, bytes, size);
}

EXPORT int FMI(fmi3DeserializeFMUState)(void *c, const uint8_t bytes[], size_t size, void **place)
{
    return read_state(c, bytes, size, place);
}

EXPORT int FMI(fmi3GetDirectionalDerivative)(void *c, const uint32_t unknowns[], size_t rows, const uint32_t knowns[], size_t columns,
    const double seed[], size_t seeds, double found[], size_t many)
{
    if (seeds != columns || many != rows)
        return complain(c, ERROR, "every variable is one number");
    return derive(c, unknowns, rows, knowns, columns, seed, found);
}

EXPORT int FMI(fmi3GetAdjointDerivative)(void *c, const uint32_t unknowns[], size_t rows, const uint32_t knowns[], size_t columns,
    const double seed[], size_t seeds, double found[], size_t many)
{
    const double one = 1.0;
    if (seeds != rows || many != columns)
        return complain(c, ERROR, "every variable is one number");
    for (size_t j = 0; j < columns; j++) {
        found[j] = 0.0;
        for (size_t i = 0; i < rows; i++) {
            double slope;
            const int status = derive(c, unknowns + i, 1, knowns + j, 1, &one, &slope);
            if (status != OK)
                return status;
            found[j] += slope * seed[i];
        }
    }
    return OK;
}

EXPORT int FMI(fmi3DoStep)(void *c, double from, double span, bool forget_before, bool *event, bool *ends, bool *early, double *reached)
{
    const int status = step(c, from, span);
    (void)forget_before;
    const instance *one = c;
    *event = one->link.events && one->event;
    *ends = one->ended;
    *early = one->early && one->link.early;
    *reached = now(one);
    return status;
}

EXPORT int FMI(fmi3GetOutputDerivatives)(void *c, const uint32_t references[], size_t count, const int32_t orders[], double values[],
    size_t many)
{
    (void)references;
    (void)orders;
    (void)values;
    (void)many;
    return count == 0 ? OK : complain(c, ERROR, "derivatives of outputs by time are not there");
}

/* What belongs to clocks, arrays of other sizes and model exchange; dependencies are those of the model description. */
#define NOT_THERE(name, arguments, unread)                                                                                         \
    EXPORT int FMI(name) arguments                                                                                                 \
    {                                                                                                                              \
        unread;                                                                                                                    \
        return refuse_mode(c, #name);                                                                                              \
    }
#define REFERENCES void *c, const uint32_t references[], size_t count
NOT_THERE(fmi3EnterConfigurationMode, (void *c), (void)0)
NOT_THERE(fmi3ExitConfigurationMode, (void *c), (void)0)
NOT_THERE(fmi3EvaluateDiscreteStates, (void *c), (void)0)
NOT_THERE(fmi3EnterContinuousTimeMode, (void *c), (void)0)
NOT_THERE(fmi3GetIntervalDecimal, (REFERENCES, double a[], int b[]), ((void)references, (void)count, (void)a, (void)b))
NOT_THERE(fmi3GetIntervalFraction, (REFERENCES, uint64_t a[], uint64_t b[], int d[]),
    ((void)references, (void)count, (void)a, (void)b, (void)d))
NOT_THERE(fmi3GetShiftDecimal, (REFERENCES, double a[]), ((void)references, (void)count, (void)a))
NOT_THERE(fmi3GetShiftFraction, (REFERENCES, uint64_t a[], uint64_t b[]), ((void)references, (void)count, (void)a, (void)b))
NOT_THERE(fmi3SetIntervalDecimal, (REFERENCES, const double a[]), ((void)references, (void)count, (void)a))
NOT_THERE(fmi3SetIntervalFraction, (REFERENCES, const uint64_t a[], const uint64_t b[]),
    ((void)references, (void)count, (void)a, (void)b))
NOT_THERE(fmi3SetShiftDecimal, (REFERENCES, const double a[]), ((void)references, (void)count, (void)a))
NOT_THERE(fmi3SetShiftFraction, (REFERENCES, const uint64_t a[], const uint64_t b[]), ((void)references, (void)count, (void)a, (void)b))
NOT_THERE(fmi3CompletedIntegratorStep, (void *c, bool a, bool *b, bool *d), ((void)a, (void)b, (void)d))
NOT_THERE(fmi3SetTime, (void *c, double a), (void)a)
NOT_THERE(fmi3SetContinuousStates, (void *c, const double a[], size_t b), ((void)a, (void)b))
NOT_THERE(fmi3GetContinuousStateDerivatives, (void *c, double a[], size_t b), ((void)a, (void)b))
NOT_THERE(fmi3GetEventIndicators, (void *c, double a[], size_t b), ((void)a, (void)b))
NOT_THERE(fmi3GetContinuousStates, (void *c, double a[], size_t b), ((void)a, (void)b))
NOT_THERE(fmi3GetNominalsOfContinuousStates, (void *c, double a[], size_t b), ((void)a, (void)b))
NOT_THERE(fmi3GetNumberOfEventIndicators, (void *c, size_t *a), (void)a)
NOT_THERE(fmi3GetNumberOfContinuousStates, (void *c, size_t *a), (void)a)
NOT_THERE(fmi3ActivateModelPartition, (void *c, uint32_t a, double b), ((void)a, (void)b))
NOT_THERE(fmi3GetNumberOfVariableDependencies, (void *c, uint32_t a, size_t *b), ((void)a, (void)b))
NOT_THERE(fmi3GetVariableDependencies, (void *c, uint32_t a, size_t b[], uint32_t d[], size_t e[], int f[], size_t g),
    ((void)a, (void)b, (void)d, (void)e, (void)f, (void)g))
