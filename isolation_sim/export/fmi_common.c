/* A unit behind the Functional Mock-up Interface. Written by isolation-sim. */
typedef struct {
    Unit unit;
    double values[N_VARIABLES]; /* inputs, then outputs */
    double start, time;
} Instance;

static void put_to_rest(Instance *it)
{
    memset(it, 0, sizeof *it);
    unit_init(&it->unit);
}

static int advance(Instance *it, double time, double step)
{
    const int failed = unit_step(&it->unit, it->values, time - it->start, step);
    it->time = time + step;
    return failed;
}

/* 0 if all references are known and, to be set, inputs */
static int transfer(Instance *it, const unsigned int *references, size_t n, double *out,
                    const double *in)
{
    if (out)
        unit_observe(&it->unit, it->values, it->values + N_INPUTS);
    for (size_t k = 0; k < n; ++k) {
        const unsigned int at = references[k];
        if (out && at == N_VARIABLES)
            out[k] = it->time;
        else if (at >= (out ? N_VARIABLES : N_INPUTS))
            return 1;
        else if (out)
            out[k] = it->values[at];
        else
            it->values[at] = in[k];
    }
    return 0;
}

static int copy_state(Instance *it, void **state)
{
    if (!*state && !(*state = malloc(sizeof *it)))
        return 1;
    memcpy(*state, it, sizeof *it);
    return 0;
}
