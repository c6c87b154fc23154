/*
 * Example of an external rendering law, the law of the paper: the load motor generates the desired minus the own friction.
 * It fades out around standstill, where the sign of the velocity is noise.
 *
 *     stickslip load --header .
 *     cc -O2 -shared -fPIC -I. -o difference.so difference.c -lm
 *     stickslip load difference.so --as law
 *
 * The defaults are those of the preset clm-bench, including its model of the own friction.
 */
#include "stickslip_module.h"

#include <math.h>
#include <stdlib.h>

enum { BREAKAWAY, KINETIC, STRIBECK, VISCOUS, OWN_BREAKAWAY, OWN_KINETIC, OWN_STRIBECK, OWN_VISCOUS, FADE, COUNT };

static const stickslip_parameter PARAMETERS[COUNT] = {
    {"desired_breakaway_torque", "N m", "Desired breakaway torque", 0.0, 1.0, 0.300},
    {"desired_kinetic_torque", "N m", "Desired kinetic torque", 0.0, 1.0, 0.120},
    {"desired_stribeck_velocity", "rad/s", "Desired Stribeck velocity", 1e-3, 100.0, 1.5},
    {"desired_viscous_friction", "N m s/rad", "Desired viscous friction", 0.0, 0.1, 1.2e-3},
    {"own_breakaway_torque", "N m", "Own breakaway torque", 0.0, 1.0, 0.300},
    {"own_kinetic_torque", "N m", "Own kinetic torque", 0.0, 1.0, 0.180},
    {"own_stribeck_velocity", "rad/s", "Own Stribeck velocity", 1e-3, 100.0, 3.0},
    {"own_viscous_friction", "N m s/rad", "Own viscous friction", 0.0, 0.1, 2.0e-4},
    {"fade_velocity", "rad/s", "Speed below which the torque is 0", 0.0, 10.0, 0.3},
};

static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, COUNT, "difference torque", PARAMETERS};

typedef struct {
    double values[COUNT];
} law;

const stickslip_description *stickslip_describe(void) { return &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    law *self = calloc(1, sizeof *self);
    (void)sample_time; /* the law has no state */
    (void)torque_limit;
    if (self != NULL) {
        (void)stickslip_set(self, parameters);
    }
    return self;
}

int32_t stickslip_set(void *of, const double *parameters) {
    law *self = of;
    for (int k = 0; k < COUNT; k++) {
        self->values[k] = parameters[k];
    }
    return 0;
}

/* A Stribeck curve: breakaway torque, kinetic torque, Stribeck velocity, viscous friction. */
static double stribeck(const double *curve, double speed) {
    return curve[1] + (curve[0] - curve[1]) * exp(-speed / curve[2]) + curve[3] * speed;
}

int32_t stickslip_step(void *of, const stickslip_sample *sample, double *torque) {
    const double *value = ((law *)of)->values;
    const double velocity = sample->estimated_velocity, speed = fabs(velocity);
    const double difference = stribeck(value + BREAKAWAY, speed) - stribeck(value + OWN_BREAKAWAY, speed);
    *torque = speed > value[FADE] ? (velocity > 0.0 ? difference : -difference) : 0.0;
    return 0;
}

void stickslip_end(void *of) { free(of); }
