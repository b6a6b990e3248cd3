/* Loads the library of an FMU for co-simulation, steps it 100 times under an input and prints the bits of all that it says: time,
 * parameters, inputs and outputs at the start and after every step. -D VERSION=2 or 3, -D TOKEN, -D VARIABLES, -D INPUT, -D STEP. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef _WIN32 /* without a library of C, which zig takes minutes for */
__declspec(dllimport) void *__stdcall GetStdHandle(unsigned long which);
__declspec(dllimport) int __stdcall WriteFile(void *file, const void *text, unsigned long size, unsigned long *done, void *more);
__declspec(dllimport) void __stdcall ExitProcess(unsigned code);
__declspec(dllimport) void *__stdcall LoadLibraryA(const char *name);
__declspec(dllimport) void *__stdcall GetProcAddress(void *library, const char *name);
__declspec(dllimport) void *__stdcall GetProcessHeap(void);
__declspec(dllimport) void *__stdcall HeapAlloc(void *heap, unsigned long flags, size_t size);
__declspec(dllimport) int __stdcall HeapFree(void *heap, unsigned long flags, void *place);
int _fltused = 0;
static void put(const char *text, unsigned long size)
{
    unsigned long done;
    WriteFile(GetStdHandle((unsigned long)-11), text, size, &done, NULL);
}
static void *give(size_t count, size_t size) { return HeapAlloc(GetProcessHeap(), 8, count * size); }
static void take(void *place) { HeapFree(GetProcessHeap(), 0, place); }
#define LIBRARY "model.dll"
#define OPEN(name) LoadLibraryA(name)
#define FIND(library, name) GetProcAddress(library, name)
#define END(code) ExitProcess(code)
#else
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
static void put(const char *text, unsigned long size) { fwrite(text, 1, size, stdout); }
static void *give(size_t count, size_t size) { return calloc(count, size); }
static void take(void *place) { free(place); }
#define LIBRARY "./model.so"
#define OPEN(name) dlopen(name, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#define END(code) exit(code)
#endif

static void *library;

static void *find(const char *name)
{
    void *found = FIND(library, name);
    if (!found)
        END(2);
    return found;
}

static void check(int status)
{
    if (status != 0)
        END(3);
}

static void show(const double values[])
{
    char line[17];
    for (int k = 0; k < VARIABLES; k++) {
        union {
            double value;
            uint64_t bits;
        } one;
        one.value = values[k];
        for (int i = 0; i < 16; i++)
            line[i] = "0123456789abcdef"[one.bits >> (60 - 4 * i) & 15];
        line[16] = k + 1 < VARIABLES ? ' ' : '\n';
        put(line, 17);
    }
}

#if VERSION == 2
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*give)(size_t, size_t);
    void (*take)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;
#endif

static void run(void)
{
    unsigned all[VARIABLES];
    const unsigned input = INPUT;
    double values[VARIABLES];
    void *unit;
    library = OPEN(LIBRARY);
    if (!library)
        END(1);
    for (unsigned k = 0; k < VARIABLES; k++)
        all[k] = k;
#if VERSION == 2
    const callbacks told = {NULL, give, take, NULL, NULL};
    unit = ((void *(*)(const char *, int, const char *, const char *, const callbacks *, int, int))find("fmi2Instantiate"))(
        "one", 1, TOKEN, "", &told, 0, 0);
    if (!unit)
        END(4);
    check(((int (*)(void *, int, double, double, int, double))find("fmi2SetupExperiment"))(unit, 0, 0.0, 0.0, 0, 0.0));
    check(((int (*)(void *))find("fmi2EnterInitializationMode"))(unit));
    check(((int (*)(void *))find("fmi2ExitInitializationMode"))(unit));
    int (*set)(void *, const unsigned *, size_t, const double *) = find("fmi2SetReal");
    int (*get)(void *, const unsigned *, size_t, double *) = find("fmi2GetReal");
    int (*step)(void *, double, double, int) = find("fmi2DoStep");
#define SET(value) set(unit, &input, 1, value)
#define GET() get(unit, all, VARIABLES, values)
#define GO(t) step(unit, t, STEP, 1)
#else
    (void)give;
    (void)take;
    unit = ((void *(*)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *, void *,
        void *))find("fmi3InstantiateCoSimulation"))("one", TOKEN, "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
    if (!unit)
        END(4);
    check(((int (*)(void *, bool, double, double, bool, double))find("fmi3EnterInitializationMode"))(unit, false, 0.0, 0.0, false, 0.0));
    check(((int (*)(void *))find("fmi3ExitInitializationMode"))(unit));
    int (*set)(void *, const uint32_t *, size_t, const double *, size_t) = find("fmi3SetFloat64");
    int (*get)(void *, const uint32_t *, size_t, double *, size_t) = find("fmi3GetFloat64");
    int (*step)(void *, double, double, bool, bool *, bool *, bool *, double *) = find("fmi3DoStep");
    bool event, ends, early;
    double last;
#define SET(value) set(unit, &input, 1, value, 1)
#define GET() get(unit, all, VARIABLES, values, VARIABLES)
#define GO(t) step(unit, t, STEP, true, &event, &ends, &early, &last)
#endif
    check(GET());
    show(values);
    for (int k = 0; k < 100; k++) {
        const double value = 0.004 * (k % 25 - 12);
        check(SET(&value));
        check(GO(k * STEP));
        check(GET());
        show(values);
    }
    ((void (*)(void *))find(VERSION == 2 ? "fmi2FreeInstance" : "fmi3FreeInstance"))(unit);
}

#ifdef _WIN32
void start(void)
{
    run();
    ExitProcess(0);
}
#else
int main(void)
{
    run();
    return 0;
}
#endif
