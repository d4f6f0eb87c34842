/* A sampled controller behind the Functional Mock-up Interface. Written by isolation-sim.
 *
 * It decides at the multiples of its period, from the inputs that it has then: at the start of a
 * communication step, and within one that is longer than the period. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "NAME.h"

#define N_INPUTS NAME_N_MEASURED
#define N_OUTPUTS NAME_N_COMMANDS
#define N_VARIABLES (N_INPUTS + N_OUTPUTS)

typedef struct {
    NAME_state controller;
    double values[N_VARIABLES]; /* inputs, then outputs */
    double start, time;
    double decided; /* decisions made, from the start */
} Instance;

static void put_to_rest(Instance *it)
{
    memset(it, 0, sizeof *it);
    NAME_init(&it->controller);
}

static void advance(Instance *it, double time, double step)
{
    const double period = NAME_PERIOD, end = time + step - 1e-6 * period;
    for (double due = it->start + it->decided * period; due < end;
         due = it->start + it->decided * period) {
        NAME_step(&it->controller, it->decided * period, it->values, it->values + N_INPUTS);
        it->decided += 1.0;
    }
    it->time = time + step;
}

/* 0 if all references are known and, to be set, inputs */
static int transfer(Instance *it, const unsigned int *references, size_t n, double *out,
                    const double *in)
{
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
