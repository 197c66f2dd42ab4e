/* $title as an FMU for co-simulation after FMI 3.0: the only file to compile.
 *
 * Every variable is a Float64. The types below are those of the standard's header, whose place they take
 * where it is not included first.
 */
#ifndef fmi3Functions_h
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef int16_t fmi3Int16;
typedef int32_t fmi3Int32;
typedef int64_t fmi3Int64;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef uint16_t fmi3UInt16;
typedef uint32_t fmi3UInt32;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)();
typedef void (*fmi3UnlockPreemptionCallback)();
#endif

#include "component.h"

#if defined(FMI3_FUNCTION_PREFIX) && !defined(FMI3_OVERRIDE_FUNCTION_PREFIX) && !defined(fmi3Functions_h)
#define PASTE(a, b) a##b
#define PREFIXED(prefix, name) PASTE(prefix, name)
#define FMI(name) PREFIXED(FMI3_FUNCTION_PREFIX, fmi3##name)
#else
#define FMI(name) fmi3##name
#endif
#ifdef _WIN32
#define PUBLIC __declspec(dllexport)
#else
#define PUBLIC
#endif

#if defined __GNUC__ /* much of the interface has no meaning here, so that arguments stay unused */
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

typedef struct {
    component c;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} instance;

/* The status of a call; a refusal's sentence goes to the environment's log. */
static fmi3Status answered(fmi3Instance instance_, int done)
{
    instance *i = (instance *)instance_;
    if (done)
        return fmi3OK;
    if (i->log != NULL)
        i->log(i->environment, fmi3Error, "logStatusError", i->c.message);
    return fmi3Error;
}

static component *of(fmi3Instance i)
{
    return &((instance *)i)->c;
}

PUBLIC const char *FMI(GetVersion)(void)
{
    return "3.0";
}

PUBLIC fmi3Status FMI(SetDebugLogging)(fmi3Instance i, fmi3Boolean on, size_t n, const fmi3String categories[])
{
    return fmi3OK;
}

PUBLIC fmi3Instance FMI(InstantiateCoSimulation)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[],
    size_t n_intermediate, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
    instance *i = (instance *)calloc(1, sizeof *i);
    if (i == NULL)
        return NULL;
    i->log = log;
    i->environment = environment;
    component_reset(&i->c);
    if (token == NULL || strcmp(token, TOKEN) != 0) {
        answered(i, refuse(&i->c, "the instantiation token is not that of this unit: take "
                           "modelDescription.xml and binary from the same file"));
        free(i);
        return NULL;
    }
    return i;
}

PUBLIC fmi3Instance FMI(InstantiateModelExchange)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    return NULL;
}

PUBLIC fmi3Instance FMI(InstantiateScheduledExecution)(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3ClockUpdateCallback update,
    fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    return NULL;
}

PUBLIC void FMI(FreeInstance)(fmi3Instance i)
{
    free(i);
}

PUBLIC fmi3Status FMI(EnterInitializationMode)(fmi3Instance i, fmi3Boolean has_tolerance,
                                               fmi3Float64 tolerance, fmi3Float64 start,
                                               fmi3Boolean has_stop, fmi3Float64 stop)
{
    const int done = component_initialise(of(i));
    if (done)
        of(i)->now.time = start;
    return answered(i, done);
}

PUBLIC fmi3Status FMI(ExitInitializationMode)(fmi3Instance i)
{
    return answered(i, component_run(of(i)));
}

PUBLIC fmi3Status FMI(Terminate)(fmi3Instance i)
{
    return answered(i, component_end(of(i)));
}

PUBLIC fmi3Status FMI(Reset)(fmi3Instance i)
{
    component_reset(of(i));
    return fmi3OK;
}

PUBLIC fmi3Status FMI(GetFloat64)(fmi3Instance i, const fmi3ValueReference refs[], size_t n,
                                  fmi3Float64 values[], size_t n_values)
{
    if (n != n_values)
        return answered(i, refuse(of(i), "%zu references but %zu values: give one of each", n, n_values));
    return answered(i, component_get(of(i), refs, n, values));
}

PUBLIC fmi3Status FMI(SetFloat64)(fmi3Instance i, const fmi3ValueReference refs[], size_t n,
                                  const fmi3Float64 values[], size_t n_values)
{
    if (n != n_values)
        return answered(i, refuse(of(i), "%zu references but %zu values: give one of each", n, n_values));
    return answered(i, component_set(of(i), refs, n, values));
}

PUBLIC fmi3Status FMI(GetFMUState)(fmi3Instance i, fmi3FMUState *state)
{
    return answered(i, component_save(of(i), state));
}

PUBLIC fmi3Status FMI(SetFMUState)(fmi3Instance i, fmi3FMUState state)
{
    return answered(i, component_restore(of(i), state));
}

PUBLIC fmi3Status FMI(FreeFMUState)(fmi3Instance i, fmi3FMUState *state)
{
    free(*state);
    *state = NULL;
    return fmi3OK;
}

PUBLIC fmi3Status FMI(SerializedFMUStateSize)(fmi3Instance i, fmi3FMUState state, size_t *size)
{
    *size = component_serial_size();
    return fmi3OK;
}

PUBLIC fmi3Status FMI(SerializeFMUState)(fmi3Instance i, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return answered(i, component_serialise(of(i), state, bytes, size));
}

PUBLIC fmi3Status FMI(DeserializeFMUState)(fmi3Instance i, const fmi3Byte bytes[], size_t size,
                                           fmi3FMUState *state)
{
    return answered(i, component_deserialise(of(i), bytes, size, state));
}

PUBLIC fmi3Status FMI(DoStep)(fmi3Instance i, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_return,
                              fmi3Boolean *event_handling_needed, fmi3Boolean *terminate,
                              fmi3Boolean *early_return, fmi3Float64 *last_time)
{
    const int done = component_step(of(i), time, step);
    *event_handling_needed = *terminate = *early_return = false;
    *last_time = of(i)->now.time;
    return answered(i, done);
}

PUBLIC fmi3Status FMI(EnterStepMode)(fmi3Instance i)
{
    return answered(i, component_may(of(i), "step mode", 1u << RUNNING));
}

#include "fmi3_absent.h"
