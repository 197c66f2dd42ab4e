/* The functions of FMI 3.0 that have no meaning for this unit: they say so. */

static fmi3Status absent(fmi3Instance i, const char *what)
{
    return answered(i, refuse(of(i), "this unit has no %s: see modelDescription.xml for what it has", what));
}

#define NO_VARIABLES(Type, type)                                                                         \
    PUBLIC fmi3Status FMI(Get##Type)(fmi3Instance i, const fmi3ValueReference refs[], size_t n,          \
                                     type values[], size_t n_values)                                     \
    {                                                                                                    \
        return n == 0 ? fmi3OK : absent(i, "variables but Float64");                                     \
    }                                                                                                    \
    PUBLIC fmi3Status FMI(Set##Type)(fmi3Instance i, const fmi3ValueReference refs[], size_t n,          \
                                     const type values[], size_t n_values)                               \
    {                                                                                                    \
        return n == 0 ? fmi3OK : absent(i, "variables but Float64");                                     \
    }

NO_VARIABLES(Float32, fmi3Float32)
NO_VARIABLES(Int8, fmi3Int8)
NO_VARIABLES(UInt8, fmi3UInt8)
NO_VARIABLES(Int16, fmi3Int16)
NO_VARIABLES(UInt16, fmi3UInt16)
NO_VARIABLES(Int32, fmi3Int32)
NO_VARIABLES(UInt32, fmi3UInt32)
NO_VARIABLES(Int64, fmi3Int64)
NO_VARIABLES(UInt64, fmi3UInt64)
NO_VARIABLES(Boolean, fmi3Boolean)
NO_VARIABLES(String, fmi3String)

#define REFS const fmi3ValueReference refs[], size_t n
#define ABSENT(what, Name, ...)                              \
    PUBLIC fmi3Status FMI(Name)(fmi3Instance i, __VA_ARGS__) \
    {                                                        \
        return absent(i, what);                              \
    }
#define ABSENT_MODE(what, Name)                 \
    PUBLIC fmi3Status FMI(Name)(fmi3Instance i) \
    {                                           \
        return absent(i, what);                 \
    }

ABSENT("binary variables", GetBinary, REFS, size_t sizes[], fmi3Binary values[], size_t n_values)
ABSENT("binary variables", SetBinary, REFS, const size_t sizes[], const fmi3Binary values[], size_t n_values)
ABSENT("clocks", GetClock, REFS, fmi3Clock values[])
ABSENT("clocks", SetClock, REFS, const fmi3Clock values[])
ABSENT("clocks", GetIntervalDecimal, REFS, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
ABSENT("clocks", GetIntervalFraction, REFS, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
       fmi3IntervalQualifier qualifiers[])
ABSENT("clocks", GetShiftDecimal, REFS, fmi3Float64 shifts[])
ABSENT("clocks", GetShiftFraction, REFS, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
ABSENT("clocks", SetIntervalDecimal, REFS, const fmi3Float64 intervals[])
ABSENT("clocks", SetIntervalFraction, REFS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT("clocks", SetShiftDecimal, REFS, const fmi3Float64 shifts[])
ABSENT("clocks", SetShiftFraction, REFS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
ABSENT("clocks", ActivateModelPartition, fmi3ValueReference reference, fmi3Float64 time)
ABSENT("list of dependencies", GetNumberOfVariableDependencies, fmi3ValueReference reference, size_t *n)
ABSENT("list of dependencies", GetVariableDependencies, fmi3ValueReference dependent, size_t elements[],
       fmi3ValueReference independents[], size_t other_elements[], fmi3DependencyKind kinds[], size_t n)
ABSENT("derivatives", GetDirectionalDerivative, REFS, const fmi3ValueReference knowns[], size_t n_knowns,
       const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
ABSENT("derivatives", GetAdjointDerivative, REFS, const fmi3ValueReference knowns[], size_t n_knowns,
       const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity)
ABSENT("derivatives", GetOutputDerivatives, REFS, const fmi3Int32 orders[], fmi3Float64 values[],
       size_t n_values)
ABSENT_MODE("configuration mode", EnterConfigurationMode)
ABSENT_MODE("configuration mode", ExitConfigurationMode)
ABSENT_MODE("event mode", EnterEventMode)
ABSENT_MODE("event mode", EvaluateDiscreteStates)
ABSENT("event mode", UpdateDiscreteStates, fmi3Boolean *need_update, fmi3Boolean *terminate,
       fmi3Boolean *nominals_changed, fmi3Boolean *values_changed, fmi3Boolean *time_defined,
       fmi3Float64 *next_time)
ABSENT_MODE("model exchange", EnterContinuousTimeMode)
ABSENT("model exchange", CompletedIntegratorStep, fmi3Boolean no_return, fmi3Boolean *event_mode,
       fmi3Boolean *terminate)
ABSENT("model exchange", SetTime, fmi3Float64 time)
ABSENT("model exchange", SetContinuousStates, const fmi3Float64 states[], size_t n)
ABSENT("model exchange", GetContinuousStateDerivatives, fmi3Float64 derivatives[], size_t n)
ABSENT("model exchange", GetEventIndicators, fmi3Float64 indicators[], size_t n)
ABSENT("model exchange", GetContinuousStates, fmi3Float64 states[], size_t n)
ABSENT("model exchange", GetNominalsOfContinuousStates, fmi3Float64 nominals[], size_t n)
ABSENT("model exchange", GetNumberOfEventIndicators, size_t *n)
ABSENT("model exchange", GetNumberOfContinuousStates, size_t *n)
