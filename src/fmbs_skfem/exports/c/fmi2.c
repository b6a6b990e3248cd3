/* The functions of FMI 2.0.4 for co-simulation (fmi-standard.org), for the model of NAME.h.
 *
 * A library that is loaded has functions of these names. For sources that are linked into a program, -D FMI2_FUNCTION_PREFIX=NAME_
 * puts the name of the model before them.
 */
#include "NAME.h"
#include <stddef.h>

#define JOIN_BOTH(a, b) a##b
#define JOIN(a, b) JOIN_BOTH(a, b)
#if defined FMI2_FUNCTION_PREFIX && !defined FMI2_OVERRIDE_FUNCTION_PREFIX
#define FMI(name) JOIN(FMI2_FUNCTION_PREFIX, name)
#elif defined FMI2_ACTUAL_FUNCTION_PREFIX
#define FMI(name) JOIN(FMI2_ACTUAL_FUNCTION_PREFIX, name)
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

typedef struct {
    void (*logger)(void *environment, const char *name, int status, const char *category, const char *format, ...);
    void *(*allocateMemory)(size_t count, size_t size);
    void (*freeMemory)(void *place);
    void (*stepFinished)(void *environment, int status);
    void *environment;
} callbacks;

struct connection {
    callbacks master;
};

SHARED_PART

static void tell(instance *one, int status, const char *category, const char *text)
{
    if (one->link.master.logger)
        one->link.master.logger(one->link.master.environment, one->name, status, category, "%s", text);
}

static void *allocate(const struct connection *link, size_t size)
{
    return link->master.allocateMemory ? link->master.allocateMemory(1, size) : NULL;
}

static void release(const struct connection *link, void *place)
{
    if (link->master.freeMemory)
        link->master.freeMemory(place);
}

static NAME_status take_span(instance *one, double span)
{
    return go_on(one, span);
}

EXPORT const char *FMI(fmi2GetTypesPlatform)(void)
{
    return "default";
}

EXPORT const char *FMI(fmi2GetVersion)(void)
{
    return "2.0";
}

EXPORT void *FMI(fmi2Instantiate)(const char *name, int type, const char *token, const char *resources, const callbacks *functions,
    int visible, int logging)
{
    struct connection link;
    (void)resources;
    (void)visible;
    (void)logging;
    if (!functions || type != 1) /* co-simulation */
        return NULL;
    link.master = *functions;
    return make(name, token, &link);
}

EXPORT void FMI(fmi2FreeInstance)(void *c)
{
    forget(c);
}

EXPORT int FMI(fmi2SetDebugLogging)(void *c, int on, size_t count, const char *const categories[])
{
    return set_logging(c, on, count, categories);
}

EXPORT int FMI(fmi2SetupExperiment)(void *c, int known, double tolerance, double begin, int ends, double end)
{
    instance *one = c;
    (void)known;
    (void)tolerance;
    (void)ends;
    (void)end;
    if (one->now.mode != INSTANTIATED)
        return refuse_mode(one, "SetupExperiment");
    one->now.start = begin;
    return OK;
}

EXPORT int FMI(fmi2EnterInitializationMode)(void *c)
{
    return enter_initialisation(c, ((instance *)c)->now.start);
}

EXPORT int FMI(fmi2ExitInitializationMode)(void *c)
{
    return exit_initialisation(c);
}

EXPORT int FMI(fmi2Terminate)(void *c)
{
    return terminate(c);
}

EXPORT int FMI(fmi2Reset)(void *c)
{
    return reset(c);
}

EXPORT int FMI(fmi2GetReal)(void *c, const unsigned references[], size_t count, double values[])
{
    return get(c, references, count, values);
}

EXPORT int FMI(fmi2SetReal)(void *c, const unsigned references[], size_t count, const double values[])
{
    return set(c, references, count, values);
}

/* The model has numbers only. */
#define NONE_OF(name, kind)                                                                                                        \
    EXPORT int FMI(name)(void *c, const unsigned references[], size_t count, kind values[])                                        \
    {                                                                                                                              \
        (void)references;                                                                                                          \
        (void)values;                                                                                                              \
        return count == 0 ? OK : complain(c, ERROR, "the model has real numbers only");                                            \
    }
NONE_OF(fmi2GetInteger, int)
NONE_OF(fmi2GetBoolean, int)
NONE_OF(fmi2GetString, const char *)
NONE_OF(fmi2SetInteger, const int)
NONE_OF(fmi2SetBoolean, const int)
NONE_OF(fmi2SetString, const char *const)

EXPORT int FMI(fmi2GetFMUstate)(void *c, void **place)
{
    return save(c, place);
}

EXPORT int FMI(fmi2SetFMUstate)(void *c, void *place)
{
    return restore(c, place);
}

EXPORT int FMI(fmi2FreeFMUstate)(void *c, void **place)
{
    return drop(c, place);
}

EXPORT int FMI(fmi2SerializedFMUstateSize)(void *c, void *place, size_t *size)
{
    (void)c;
    (void)place;
    *size = HEAD + sizeof(state);
    return OK;
}

EXPORT int FMI(fmi2SerializeFMUstate)(void *c, void *place, char bytes[], size_t size)
{
    return write_state(c, place, (unsigned char *)bytes, size);
}

EXPORT int FMI(fmi2DeSerializeFMUstate)(void *c, const char bytes[], size_t size, void **place)
{
    return read_state(c, (const unsigned char *)bytes, size, place);
}

EXPORT int FMI(fmi2GetDirectionalDerivative)(void *c, const unsigned unknowns[], size_t rows, const unsigned knowns[],
    size_t columns, const double seed[], double found[])
{
    return derive(c, unknowns, rows, knowns, columns, seed, found);
}

/* Derivatives by time at the begin of the next step: all of them, or none where one is refused. */
EXPORT int FMI(fmi2SetRealInputDerivatives)(void *c, const unsigned references[], size_t count, const int order[],
    const double value[])
{
    instance *one = c;
    for (size_t k = 0; k < count; k++) {
        if (references[k] < (unsigned)FIRST_INPUT || references[k] >= (unsigned)FIRST_OUTPUT)
            return complain(one, ERROR, "only inputs have derivatives that can be set");
        if (order[k] < 1 || order[k] > 3)
            return complain(one, ERROR, "derivatives of inputs have the order 1, 2 or 3");
        if (!is_finite(value[k]))
            return complain_of(one, DISCARD, references[k] - 1, value[k], " is not finite: the derivative before stays");
    }
    for (size_t k = 0; k < count; k++)
        one->now.model.rates[order[k] - 1][references[k] - FIRST_INPUT] = value[k];
    return OK;
}

EXPORT int FMI(fmi2GetRealOutputDerivatives)(void *c, const unsigned references[], size_t count, const int order[], double value[])
{
    (void)references;
    (void)order;
    (void)value;
    return count == 0 ? OK : complain(c, ERROR, "derivatives of outputs by time are not there");
}

EXPORT int FMI(fmi2DoStep)(void *c, double from, double span, int forget_before)
{
    (void)forget_before;
    const int status = step(c, from, span);
    /* see fmi2GetBooleanStatus */
    return status == OK && ((instance *)c)->ended ? DISCARD : status;
}

EXPORT int FMI(fmi2CancelStep)(void *c)
{
    return complain(c, ERROR, "steps end before their call does: there is none to cancel");
}

EXPORT int FMI(fmi2GetStatus)(void *c, int kind, int *value)
{
    (void)kind;
    *value = OK;
    return complain(c, DISCARD, "steps end before their call does: none is pending");
}

EXPORT int FMI(fmi2GetRealStatus)(void *c, int kind, double *value)
{
    if (kind != 2) /* last successful time */
        return complain(c, DISCARD, "there is no such status");
    *value = now(c);
    return OK;
}

EXPORT int FMI(fmi2GetIntegerStatus)(void *c, int kind, int *value)
{
    (void)kind;
    (void)value;
    return complain(c, DISCARD, "there is no such status");
}

EXPORT int FMI(fmi2GetBooleanStatus)(void *c, int kind, int *value)
{
    if (kind != 3) /* terminated */
        return complain(c, DISCARD, "there is no such status");
    *value = ((instance *)c)->ended;
    return OK;
}

EXPORT int FMI(fmi2GetStringStatus)(void *c, int kind, const char **value)
{
    (void)kind;
    *value = "";
    return complain(c, DISCARD, "there is no such status");
}
