/* $title as an FMU for co-simulation after FMI 2.0: the only file to compile.
 *
 * Every variable is a Real. The types below are those of the standard's header, whose place they take
 * where it is not included first.
 */
#ifndef fmi2Functions_h
#include <stddef.h>
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
#endif

#include "component.h"

#if defined(FMI2_FUNCTION_PREFIX) && !defined(fmi2Functions_h)
#define PASTE(a, b) a##b
#define PREFIXED(prefix, name) PASTE(prefix, name)
#define FMI(name) PREFIXED(FMI2_FUNCTION_PREFIX, fmi2##name)
#else
#define FMI(name) fmi2##name
#endif
#ifdef _WIN32
#define PUBLIC __declspec(dllexport)
#else
#define PUBLIC
#endif
#define UNUSED(x) (void)(x)

typedef struct {
    component c;
    fmi2CallbackFunctions calls;
    char name[200];
} instance;

/* The status of a call; a refusal's sentence goes to the environment's log. */
static fmi2Status answered(instance *i, int done)
{
    if (done)
        return fmi2OK;
    if (i->calls.logger != NULL)
        i->calls.logger(i->calls.componentEnvironment, i->name, fmi2Error, "logStatusError", "%s",
                        i->c.message);
    return fmi2Error;
}

PUBLIC const char *FMI(GetTypesPlatform)(void)
{
    return "default";
}

PUBLIC const char *FMI(GetVersion)(void)
{
    return "2.0";
}

PUBLIC fmi2Status FMI(SetDebugLogging)(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[])
{
    UNUSED(c), UNUSED(on), UNUSED(n), UNUSED(categories);
    return fmi2OK;
}

PUBLIC fmi2Component FMI(Instantiate)(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                               const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean logging)
{
    instance *i = (instance *)calloc(1, sizeof *i);
    UNUSED(resources), UNUSED(visible), UNUSED(logging);
    if (i == NULL)
        return NULL;
    if (calls != NULL)
        i->calls = *calls;
    snprintf(i->name, sizeof i->name, "%s", name == NULL ? "" : name);
    component_reset(&i->c);
    if (type != fmi2CoSimulation || token == NULL || strcmp(token, TOKEN) != 0) {
        answered(i, refuse(&i->c, type != fmi2CoSimulation
                           ? "this unit is for co-simulation only: instantiate it so"
                           : "the GUID is not that of this unit: take modelDescription.xml and binary from "
                             "the same file"));
        free(i);
        return NULL;
    }
    return i;
}

PUBLIC void FMI(FreeInstance)(fmi2Component c)
{
    free(c);
}

PUBLIC fmi2Status FMI(SetupExperiment)(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                                fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    instance *i = (instance *)c;
    UNUSED(has_tolerance), UNUSED(tolerance);
    if (!component_may(&i->c, "setting up the experiment", 1u << CREATED))
        return answered(i, 0);
    if (!isfinite(start) || (has_stop && !(stop >= start)))
        return answered(i, refuse(&i->c, "the experiment from %g s to %g s has no length: give a finite "
                                  "start and a later stop", start, stop));
    i->c.now.time = start;
    i->c.now.stop = has_stop ? stop : INFINITY;
    return fmi2OK;
}

PUBLIC fmi2Status FMI(EnterInitializationMode)(fmi2Component c)
{
    instance *i = (instance *)c;
    return answered(i, component_initialise(&i->c));
}

PUBLIC fmi2Status FMI(ExitInitializationMode)(fmi2Component c)
{
    instance *i = (instance *)c;
    return answered(i, component_run(&i->c));
}

PUBLIC fmi2Status FMI(Terminate)(fmi2Component c)
{
    instance *i = (instance *)c;
    return answered(i, component_end(&i->c));
}

PUBLIC fmi2Status FMI(Reset)(fmi2Component c)
{
    component_reset(&((instance *)c)->c);
    return fmi2OK;
}

PUBLIC fmi2Status FMI(GetReal)(fmi2Component c, const fmi2ValueReference refs[], size_t n, fmi2Real values[])
{
    instance *i = (instance *)c;
    return answered(i, component_get(&i->c, refs, n, values));
}

PUBLIC fmi2Status FMI(SetReal)(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                        const fmi2Real values[])
{
    instance *i = (instance *)c;
    return answered(i, component_set(&i->c, refs, n, values));
}

/* There are no variables of the other types. */
#define NO_VARIABLES(Type, type)                                                                     \
    PUBLIC fmi2Status FMI(Get##Type)(fmi2Component c, const fmi2ValueReference refs[], size_t n, type values[]) \
    {                                                                                                \
        instance *i = (instance *)c;                                                                 \
        UNUSED(refs), UNUSED(values);                                                                \
        return answered(i, n == 0 || refuse(&i->c, "every variable is a Real: use fmi2GetReal"));    \
    }                                                                                                \
    PUBLIC fmi2Status FMI(Set##Type)(fmi2Component c, const fmi2ValueReference refs[], size_t n,            \
                              const type values[])                                                   \
    {                                                                                                \
        instance *i = (instance *)c;                                                                 \
        UNUSED(refs), UNUSED(values);                                                                \
        return answered(i, n == 0 || refuse(&i->c, "every variable is a Real: use fmi2SetReal"));    \
    }

NO_VARIABLES(Integer, fmi2Integer)
NO_VARIABLES(Boolean, fmi2Boolean)
NO_VARIABLES(String, fmi2String)

PUBLIC fmi2Status FMI(GetFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    instance *i = (instance *)c;
    return answered(i, component_save(&i->c, state));
}

PUBLIC fmi2Status FMI(SetFMUstate)(fmi2Component c, fmi2FMUstate state)
{
    instance *i = (instance *)c;
    return answered(i, component_restore(&i->c, state));
}

PUBLIC fmi2Status FMI(FreeFMUstate)(fmi2Component c, fmi2FMUstate *state)
{
    UNUSED(c);
    free(*state);
    *state = NULL;
    return fmi2OK;
}

PUBLIC fmi2Status FMI(SerializedFMUstateSize)(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    UNUSED(c), UNUSED(state);
    *size = component_serial_size();
    return fmi2OK;
}

PUBLIC fmi2Status FMI(SerializeFMUstate)(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    instance *i = (instance *)c;
    return answered(i, component_serialise(&i->c, state, bytes, size));
}

PUBLIC fmi2Status FMI(DeSerializeFMUstate)(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                    fmi2FMUstate *state)
{
    instance *i = (instance *)c;
    return answered(i, component_deserialise(&i->c, bytes, size, state));
}

PUBLIC fmi2Status FMI(GetDirectionalDerivative)(fmi2Component c, const fmi2ValueReference unknowns[],
                                         size_t n_unknowns, const fmi2ValueReference knowns[],
                                         size_t n_knowns, const fmi2Real seed[], fmi2Real result[])
{
    instance *i = (instance *)c;
    UNUSED(unknowns), UNUSED(n_unknowns), UNUSED(knowns), UNUSED(n_knowns), UNUSED(seed), UNUSED(result);
    return answered(i, refuse(&i->c, "this unit gives no directional derivatives: do without"));
}

PUBLIC fmi2Status FMI(SetRealInputDerivatives)(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                                        const fmi2Integer order[], const fmi2Real values[])
{
    instance *i = (instance *)c;
    UNUSED(refs), UNUSED(n), UNUSED(order), UNUSED(values);
    return answered(i, refuse(&i->c, "inputs are held over a step: give no derivatives of them"));
}

PUBLIC fmi2Status FMI(GetRealOutputDerivatives)(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                                         const fmi2Integer order[], fmi2Real values[])
{
    instance *i = (instance *)c;
    UNUSED(refs), UNUSED(n), UNUSED(order), UNUSED(values);
    return answered(i, refuse(&i->c, "this unit gives no derivatives of outputs: do without"));
}

PUBLIC fmi2Status FMI(DoStep)(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_return)
{
    instance *i = (instance *)c;
    UNUSED(no_return);
    return answered(i, component_step(&i->c, time, step));
}

PUBLIC fmi2Status FMI(CancelStep)(fmi2Component c)
{
    instance *i = (instance *)c;
    return answered(i, refuse(&i->c, "a step ends before its call returns: there is none to cancel"));
}

PUBLIC fmi2Status FMI(GetStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    UNUSED(c), UNUSED(kind), UNUSED(value);
    return fmi2Discard;
}

PUBLIC fmi2Status FMI(GetRealStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime)
        return fmi2Discard;
    *value = ((instance *)c)->c.now.time;
    return fmi2OK;
}

PUBLIC fmi2Status FMI(GetIntegerStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    UNUSED(c), UNUSED(kind), UNUSED(value);
    return fmi2Discard;
}

PUBLIC fmi2Status FMI(GetBooleanStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated)
        return fmi2Discard;
    *value = ((instance *)c)->c.now.phase == FAILED;
    return fmi2OK;
}

PUBLIC fmi2Status FMI(GetStringStatus)(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    if (kind != fmi2PendingStatus)
        return fmi2Discard;
    *value = ((instance *)c)->c.message;
    return fmi2OK;
}
