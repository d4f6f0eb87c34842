/* $TITLE. Written by isolation-sim; do not edit.
 *
 * Call plant_init once; plant_step moves it on by a step (s) under the inputs, and returns 1 where
 * the response leaves the range of the law; plant_observe says where it is. Inputs are accelerations
 * of the ground at the step's start, their rates, and commands of the coils. */
#ifndef PLANT_H
#define PLANT_H

#define plant_N_INPUTS $N_INPUTS
#define plant_N_OUTPUTS $N_OUTPUTS

typedef struct {
$MEMBERS
} plant_state;

void plant_init(plant_state *it);
int plant_step(plant_state *it, const double *inputs, double step);
void plant_observe(plant_state *it, const double *inputs, double *outputs);

#endif
