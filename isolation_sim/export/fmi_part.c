/* A part that moves on in time. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "NAME.h"

#define N_INPUTS NAME_N_INPUTS
#define N_OUTPUTS NAME_N_OUTPUTS
#define N_VARIABLES (N_INPUTS + N_OUTPUTS)

typedef NAME_state Unit;

static void unit_init(Unit *it) { NAME_init(it); }

static int unit_step(Unit *it, const double *inputs, double time, double step)
{
    (void)time;
    return NAME_step(it, inputs, step);
}

static void unit_observe(Unit *it, const double *inputs, double *outputs)
{
    NAME_observe(it, inputs, outputs);
}

