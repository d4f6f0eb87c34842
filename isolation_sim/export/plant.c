/* $TITLE. Written by isolation-sim; do not edit. */
#include "plant.h"

#include <complex.h>
#include <math.h>
#include <string.h>

$FUNCTIONS
$CONSTANTS

/* a longer step is integrated in equal parts that are no longer than this, s */
static const double longest = $PERIOD;

static void move_row(double *rows, long n)
{
    memcpy(rows, rows + n, (size_t)n * sizeof *rows);
}

/* forces at the present coil currents, where these are not the elements' yet */
static void change_currents(plant_state *it)
{
    for (long e = 0; e < $N_ELEMENTS; ++e)
        $CHANGE(e, 0,
            $CHANGED);
}

/* the segment between the two points of the grid; the constants are only read */
static long integrate(plant_state *it)
{
$GROUPS
    return $INTEGRATE($ARGUMENTS);
}

void plant_init(plant_state *it)
{
    memset(it, 0, sizeof *it);
$STARTED
    change_currents(it);
}

int plant_step(plant_state *it, const double *inputs, double step)
{
    const double n = ceil(step / longest * (1.0 - 1e-9)), span = step / n;
    const double *rate = inputs + $N_GROUND, *commands = inputs + 2 * $N_GROUND;

    if (span != it->time_grid_spans[0])
        memset(it->propagation_built, 0, sizeof it->propagation_built);
    it->time_grid_spans[0] = span;
    memcpy(it->measurements_chosen, commands, ($N_CHANNELS - 1) * sizeof *commands);
    for (double k = 0.0; k < n; k += 1.0) {
        for (int g = 0; g < $N_GROUND; ++g) {
            it->time_grid_ground[g] = inputs[g] + rate[g] * (k * span);
            it->time_grid_ground[$N_GROUND + g] = inputs[g] + rate[g] * ((k + 1.0) * span);
        }
        it->position[0] = 0;
        it->position[1] = $COMMAND;
        do
            it->history_step_count[0] = 0;
        while (integrate(it) == $BUFFER_FULL);
        if (it->lanes_alive[0] != $ALIVE)
            return 1;
        move_row(it->history_z, $N_ROW);
        move_row(it->history_states, $N_STATES);
        move_row(it->coils_command, $N_CHANNELS);
    }
    return 0;
}

void plant_observe(plant_state *it, const double *inputs, double *outputs)
{
    double numbers[$N_SHOWN + $N_CHANNELS];
    array ground = {(double *)inputs, $N_GROUND};
    array_d3 noise = {0, {0}}, seen = {numbers, {1, 1, $N_SHOWN + $N_CHANNELS}};

    $OBSERVE(0, 0, $N_SHOWN, $N_CHANNELS, $N_MODES, $N_PAD, $N_ELEMENTS, $N_GROUND,
        $OBSERVED,
        seen);
    memcpy(outputs, numbers, plant_N_OUTPUTS * sizeof *outputs);
}
