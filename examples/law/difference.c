/*
 * The rendering law of the paper as an example of a law of one's own: the load motor gives what the desired friction is
 * more than the machine's own, faded out around standstill, where the sign of the velocity is noise.
 *
 *     stickslip load --header .
 *     cc -O2 -shared -fPIC -I. -o difference.so difference.c -lm
 *     stickslip load difference.so --as law
 *
 * The numbers are those of the preset clm-bench, what it believes of its own friction among them.
 */
#include "stickslip_module.h"

#include <math.h>
#include <stdlib.h>

enum { BREAKAWAY, KINETIC, STRIBECK, VISCOUS, OWN_BREAKAWAY, OWN_KINETIC, OWN_STRIBECK, OWN_VISCOUS, FADE, COUNT };

static const stickslip_parameter PARAMETERS[COUNT] = {
    {"desired_breakaway_torque", "N m", "Desired: torque at which it breaks away", 0.0, 1.0, 0.300},
    {"desired_kinetic_torque", "N m", "Desired: torque that is left at speed", 0.0, 1.0, 0.120},
    {"desired_stribeck_velocity", "rad/s", "Desired: speed at which 1/e of the drop is left", 1e-3, 100.0, 1.5},
    {"desired_viscous_friction", "N m s/rad", "Desired: torque per speed", 0.0, 0.1, 1.2e-3},
    {"own_breakaway_torque", "N m", "Own: torque at which it breaks away", 0.0, 1.0, 0.300},
    {"own_kinetic_torque", "N m", "Own: torque that is left at speed", 0.0, 1.0, 0.180},
    {"own_stribeck_velocity", "rad/s", "Own: speed at which 1/e of the drop is left", 1e-3, 100.0, 3.0},
    {"own_viscous_friction", "N m s/rad", "Own: torque per speed", 0.0, 0.1, 2.0e-4},
    {"fade_velocity", "rad/s", "Below this speed it gives nothing", 0.0, 10.0, 0.3},
};

static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, COUNT, "difference torque", PARAMETERS};

typedef struct {
    double values[COUNT];
} law;

const stickslip_description *stickslip_describe(void) { return &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    law *self = calloc(1, sizeof *self);
    (void)sample_time; /* it remembers nothing */
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
