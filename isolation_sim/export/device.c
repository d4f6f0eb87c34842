/* $TITLE. Written by isolation-sim; do not edit. */
#include "device.h"

#include <math.h>
#include <string.h>

$FUNCTIONS
/* deformation and force here over those of the device that was tested */
static const double length_scale = $LENGTH, force_scale = $FORCE;
/* limits of the current, A, the currents at which the pieces of its polynomials begin, and these */
static const double low = $LOW, high = $HIGH, breaks[$N_BREAKS] = {$BREAKS};
static const double coefficients[$N_PIECES][$N_PARAMETERS][$N_POWERS] = $COEFFICIENTS;

static void set_parameters(double *parameters, double current)
{
    int piece = 0;

    if (!(current >= low))
        current = low;
    else if (current > high)
        current = high;
    while (piece < $N_PIECES - 1 && current >= breaks[piece + 1])
        ++piece;
    for (int k = 0; k < $N_PARAMETERS; ++k) {
        parameters[k] = 0.0;
        for (int power = $N_POWERS - 1; power >= 0; --power)
            parameters[k] = parameters[k] * current + coefficients[piece][k][power];
    }
}

void device_init(device_state *it)
{
    memset(it, 0, sizeof *it);
    it->settings[1] = 1e-300;
}

int device_step(device_state *it, const double *inputs, double step)
{
    double trial[$N_STATES], slopes[$N_STATES * ($N_STATES + $N_PARAMETERS)];
    array settings = {it->settings, 2}, states = {it->states, $N_STATES};
    array tried = {trial, $N_STATES}, parameters = {it->parameters, $N_PARAMETERS};
    array none = {0, 0};
    array_d3 no_slope = {0, {0, 0, 0}};
    array_d2 by = {slopes, {$N_STATES, $N_STATES + $N_PARAMETERS}};

    set_parameters(it->parameters, inputs[2]);
    it->force = force_scale * $FOLLOW(
        it->displacement / length_scale, it->velocity / length_scale, inputs[0] / length_scale,
        inputs[1] / length_scale, step, $TOLERANCE, settings, states, tried, parameters, none,
        no_slope, by);
    it->displacement = inputs[0];
    it->velocity = inputs[1];
    return !isfinite(it->force);
}

void device_observe(const device_state *it, const double *inputs, double *outputs)
{
    (void)inputs;
    outputs[0] = it->force;
    outputs[1] = it->states[$N_STATES - 1] * length_scale * force_scale;
}
