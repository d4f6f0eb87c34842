
#define EXPORTED __attribute__((visibility("default")))
#define OK 0
#define FAILED 3
#define INSTANCE ((Instance *)c)

typedef void *Component;
typedef unsigned int Reference;

EXPORTED const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORTED const char *fmi2GetVersion(void) { return "2.0"; }
EXPORTED int fmi2SetDebugLogging(Component c, int on, size_t n, const char *const categories[])
{
    (void)c, (void)on, (void)n, (void)categories;
    return OK;
}

EXPORTED Component fmi2Instantiate(const char *name, int kind, const char *guid,
                                   const char *resources, const void *callbacks, int visible,
                                   int logging)
{
    Instance *it;
    (void)name, (void)resources, (void)callbacks, (void)visible, (void)logging;
    if (kind != 1 || !guid || strcmp(guid, "GUID") != 0)
        return NULL;
    if ((it = malloc(sizeof *it)))
        put_to_rest(it);
    return it;
}
EXPORTED void fmi2FreeInstance(Component c) { free(c); }
EXPORTED int fmi2SetupExperiment(Component c, int has_tolerance, double tolerance, double start,
                                 int has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    INSTANCE->start = INSTANCE->time = start;
    return OK;
}
EXPORTED int fmi2EnterInitializationMode(Component c) { (void)c; return OK; }
EXPORTED int fmi2ExitInitializationMode(Component c) { (void)c; return OK; }
EXPORTED int fmi2Terminate(Component c) { (void)c; return OK; }
EXPORTED int fmi2Reset(Component c) { put_to_rest(c); return OK; }

EXPORTED int fmi2GetReal(Component c, const Reference *r, size_t n, double *values)
{
    return transfer(c, r, n, values, NULL) ? FAILED : OK;
}
EXPORTED int fmi2SetReal(Component c, const Reference *r, size_t n, const double *values)
{
    return transfer(c, r, n, NULL, values) ? FAILED : OK;
}
#define NONE(name, type)                                                        \
    EXPORTED int fmi2##name(Component c, const Reference *r, size_t n, type values) \
    {                                                                           \
        (void)c, (void)r, (void)values;                                         \
        return n ? FAILED : OK;                                                 \
    }
NONE(GetInteger, int *)
NONE(GetBoolean, int *)
NONE(GetString, const char **)
NONE(SetInteger, const int *)
NONE(SetBoolean, const int *)
NONE(SetString, const char *const *)

EXPORTED int fmi2GetFMUstate(Component c, void **state)
{
    return copy_state(c, state) ? FAILED : OK;
}
EXPORTED int fmi2SetFMUstate(Component c, void *state)
{
    memcpy(c, state, sizeof(Instance));
    return OK;
}
EXPORTED int fmi2FreeFMUstate(Component c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}
EXPORTED int fmi2SerializedFMUstateSize(Component c, void *state, size_t *size)
{
    (void)c, (void)state;
    *size = sizeof(Instance);
    return OK;
}
EXPORTED int fmi2SerializeFMUstate(Component c, void *state, char bytes[], size_t size)
{
    (void)c;
    if (size < sizeof(Instance))
        return FAILED;
    memcpy(bytes, state, sizeof(Instance));
    return OK;
}
EXPORTED int fmi2DeSerializeFMUstate(Component c, const char bytes[], size_t size, void **state)
{
    if (size != sizeof(Instance) || copy_state(c, state))
        return FAILED;
    memcpy(*state, bytes, size);
    return OK;
}
EXPORTED int fmi2GetDirectionalDerivative(Component c, const Reference *u, size_t n,
                                          const Reference *k, size_t m, const double *du,
                                          double *dk)
{
    (void)c, (void)u, (void)n, (void)k, (void)m, (void)du, (void)dk;
    return FAILED;
}
EXPORTED int fmi2SetRealInputDerivatives(Component c, const Reference *r, size_t n,
                                         const int *order, const double *values)
{
    (void)c, (void)r, (void)n, (void)order, (void)values;
    return FAILED;
}
EXPORTED int fmi2GetRealOutputDerivatives(Component c, const Reference *r, size_t n,
                                          const int *order, double *values)
{
    (void)c, (void)r, (void)n, (void)order, (void)values;
    return FAILED;
}
EXPORTED int fmi2DoStep(Component c, double time, double step, int keep)
{
    (void)keep;
    return advance(c, time, step) ? FAILED : OK;
}
EXPORTED int fmi2CancelStep(Component c) { (void)c; return FAILED; }
#define STATUS(name, type)                                  \
    EXPORTED int fmi2##name(Component c, int kind, type *value) \
    {                                                       \
        (void)c, (void)kind, (void)value;                   \
        return FAILED;                                      \
    }
STATUS(GetStatus, int)
STATUS(GetIntegerStatus, int)
STATUS(GetBooleanStatus, int)
STATUS(GetStringStatus, const char *)
EXPORTED int fmi2GetRealStatus(Component c, int kind, double *value)
{
    if (kind != 2)
        return FAILED;
    *value = INSTANCE->time;
    return OK;
}
