/* $TITLE. Written by isolation-sim; do not edit.
 *
 * Call device_init once; device_step moves the device in a step (s) to the displacement (m) and the
 * velocity (m/s) of the inputs, along the cubic through both ends, under a coil current (A). */
#ifndef DEVICE_H
#define DEVICE_H

#define device_N_INPUTS 3
#define device_N_OUTPUTS 2

typedef struct {
    double displacement, velocity, force;
    double states[$N_STATES]; /* the last is the work done on the device */
    double parameters[$N_PARAMETERS];
    double settings[2]; /* steps to begin with, largest force so far */
} device_state;

void device_init(device_state *it);
int device_step(device_state *it, const double *inputs, double step);
void device_observe(const device_state *it, const double *inputs, double *outputs);

#endif
