
#include <stdbool.h>
#include <stdint.h>

#define EXPORTED __attribute__((visibility("default")))
#define OK 0
#define FAILED 3

typedef void *Model;
typedef uint32_t Reference;

EXPORTED const char *fmi3GetVersion(void) { return "3.0"; }
EXPORTED int fmi3SetDebugLogging(Model m, bool on, size_t n, const char *const categories[])
{
    (void)m, (void)on, (void)n, (void)categories;
    return OK;
}
EXPORTED Model fmi3InstantiateModelExchange(const char *name, const char *token,
                                            const char *resources, bool visible, bool logging,
                                            void *environment, void *log)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment;
    (void)log;
    return NULL;
}
EXPORTED Model fmi3InstantiateScheduledExecution(const char *name, const char *token,
                                                 const char *resources, bool visible, bool logging,
                                                 void *environment, void *log, void *update,
                                                 void *lock, void *unlock)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment;
    (void)log, (void)update, (void)lock, (void)unlock;
    return NULL;
}
EXPORTED Model fmi3InstantiateCoSimulation(const char *name, const char *token,
                                           const char *resources, bool visible, bool logging,
                                           bool events, bool early, const Reference *required,
                                           size_t n_required, void *environment, void *log,
                                           void *intermediate)
{
    Instance *it;
    (void)name, (void)resources, (void)visible, (void)logging, (void)early, (void)required;
    (void)environment, (void)log, (void)intermediate;
    if (events || n_required || !token || strcmp(token, "GUID") != 0)
        return NULL;
    if ((it = malloc(sizeof *it)))
        put_to_rest(it);
    return it;
}
EXPORTED void fmi3FreeInstance(Model m) { free(m); }
EXPORTED int fmi3EnterInitializationMode(Model m, bool has_tolerance, double tolerance,
                                         double start, bool has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((Instance *)m)->start = ((Instance *)m)->time = start;
    return OK;
}
EXPORTED int fmi3ExitInitializationMode(Model m) { (void)m; return OK; }
EXPORTED int fmi3Terminate(Model m) { (void)m; return OK; }
EXPORTED int fmi3Reset(Model m) { put_to_rest(m); return OK; }

EXPORTED int fmi3GetFloat64(Model m, const Reference *r, size_t n, double *values, size_t n_values)
{
    return n != n_values || transfer(m, r, n, values, NULL) ? FAILED : OK;
}
EXPORTED int fmi3SetFloat64(Model m, const Reference *r, size_t n, const double *values,
                            size_t n_values)
{
    return n != n_values || transfer(m, r, n, NULL, values) ? FAILED : OK;
}
#define NONE(name, type)                                                          \
    EXPORTED int fmi3Get##name(Model m, const Reference *r, size_t n, type *values,   \
                               size_t n_values)                                   \
    {                                                                             \
        (void)m, (void)r, (void)values, (void)n_values;                           \
        return n ? FAILED : OK;                                                   \
    }                                                                             \
    EXPORTED int fmi3Set##name(Model m, const Reference *r, size_t n, const type *values, \
                               size_t n_values)                                   \
    {                                                                             \
        (void)m, (void)r, (void)values, (void)n_values;                           \
        return n ? FAILED : OK;                                                   \
    }
typedef const char *Text;
NONE(Float32, float)
NONE(Int8, int8_t)
NONE(UInt8, uint8_t)
NONE(Int16, int16_t)
NONE(UInt16, uint16_t)
NONE(Int32, int32_t)
NONE(UInt32, uint32_t)
NONE(Int64, int64_t)
NONE(UInt64, uint64_t)
NONE(Boolean, bool)
NONE(String, Text)

EXPORTED int fmi3GetFMUState(Model m, void **state) { return copy_state(m, state) ? FAILED : OK; }
EXPORTED int fmi3SetFMUState(Model m, void *state)
{
    memcpy(m, state, sizeof(Instance));
    return OK;
}
EXPORTED int fmi3FreeFMUState(Model m, void **state)
{
    (void)m;
    free(*state);
    *state = NULL;
    return OK;
}
EXPORTED int fmi3SerializedFMUStateSize(Model m, void *state, size_t *size)
{
    (void)m, (void)state;
    *size = sizeof(Instance);
    return OK;
}
EXPORTED int fmi3SerializeFMUState(Model m, void *state, uint8_t bytes[], size_t size)
{
    (void)m;
    if (size < sizeof(Instance))
        return FAILED;
    memcpy(bytes, state, sizeof(Instance));
    return OK;
}
EXPORTED int fmi3DeserializeFMUState(Model m, const uint8_t bytes[], size_t size, void **state)
{
    if (size != sizeof(Instance) || copy_state(m, state))
        return FAILED;
    memcpy(*state, bytes, size);
    return OK;
}
EXPORTED int fmi3EnterStepMode(Model m) { (void)m; return FAILED; }
EXPORTED int fmi3DoStep(Model m, double time, double step, bool keep, bool *event, bool *terminate,
                        bool *early, double *last)
{
    const int failed = advance(m, time, step);
    (void)keep;
    *event = *terminate = *early = false;
    *last = ((Instance *)m)->time;
    return failed ? FAILED : OK;
}

/* What belongs to other kinds of unit: declared to be absent, never called, but looked up by name.
 * None takes its arguments off the stack itself, so that one form serves all. */
#define ABSENT(name) EXPORTED int fmi3##name(Model m) { (void)m; return FAILED; }
ABSENT(EnterEventMode)
ABSENT(GetBinary)
ABSENT(GetClock)
ABSENT(SetBinary)
ABSENT(SetClock)
ABSENT(GetNumberOfVariableDependencies)
ABSENT(GetVariableDependencies)
ABSENT(GetDirectionalDerivative)
ABSENT(GetAdjointDerivative)
ABSENT(EnterConfigurationMode)
ABSENT(ExitConfigurationMode)
ABSENT(GetIntervalDecimal)
ABSENT(GetIntervalFraction)
ABSENT(GetShiftDecimal)
ABSENT(GetShiftFraction)
ABSENT(SetIntervalDecimal)
ABSENT(SetIntervalFraction)
ABSENT(SetShiftDecimal)
ABSENT(SetShiftFraction)
ABSENT(EvaluateDiscreteStates)
ABSENT(UpdateDiscreteStates)
ABSENT(EnterContinuousTimeMode)
ABSENT(CompletedIntegratorStep)
ABSENT(SetTime)
ABSENT(SetContinuousStates)
ABSENT(GetContinuousStateDerivatives)
ABSENT(GetEventIndicators)
ABSENT(GetContinuousStates)
ABSENT(GetNominalsOfContinuousStates)
ABSENT(GetNumberOfEventIndicators)
ABSENT(GetNumberOfContinuousStates)
ABSENT(GetOutputDerivatives)
ABSENT(ActivateModelPartition)
