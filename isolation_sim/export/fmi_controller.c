/* A sampled controller. It decides at the multiples of its period, from the inputs that it has then:
 * at the start of a communication step, and within one that is longer than the period. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "NAME.h"

#define N_INPUTS NAME_N_MEASURED
#define N_OUTPUTS NAME_N_COMMANDS
#define N_VARIABLES (N_INPUTS + N_OUTPUTS)

typedef struct {
    NAME_state state;
    double command[N_OUTPUTS];
    double decided; /* decisions made, from the start */
} Unit;

static void unit_init(Unit *it)
{
    it->decided = 0.0;
    NAME_init(&it->state);
}

static int unit_step(Unit *it, const double *inputs, double time, double step)
{
    const double end = time + step - 1e-6 * NAME_PERIOD;
    for (; it->decided * NAME_PERIOD < end; it->decided += 1.0)
        NAME_step(&it->state, it->decided * NAME_PERIOD, inputs, it->command);
    return 0;
}

static void unit_observe(Unit *it, const double *inputs, double *outputs)
{
    (void)inputs;
    memcpy(outputs, it->command, sizeof it->command);
}

