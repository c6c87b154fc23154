/*
 * Example of an external controller: P-PI cascade with inertia feedforward.
 *
 *     stickslip load --header .
 *     cc -O2 -shared -fPIC -I. -o p_pi.so p_pi.c
 *     stickslip load p_pi.so --set position_gain=60
 */
#include "stickslip_module.h"

#include <stdlib.h>

enum { POSITION_GAIN, VELOCITY_GAIN, INTEGRAL_TIME, INERTIA, COUNT };

static const stickslip_parameter PARAMETERS[COUNT] = {
    {"position_gain", "1/s", "Velocity per position deviation", 0.0, 500.0, 60.0},
    {"velocity_gain", "N m s/rad", "Torque per velocity deviation", 0.0, 10.0, 0.1},
    {"integral_time", "s", "Integral time of the velocity loop", 1e-3, 10.0, 0.03},
    {"inertia", "kg m^2", "Inertia for the acceleration feedforward", 0.0, 1.0, 4e-4},
};

static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, COUNT, "P-PI cascade", PARAMETERS};

typedef struct {
    double values[COUNT];
    double sample_time;
    double torque_limit;
    double integral;
} controller;

const stickslip_description *stickslip_describe(void) { return &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    controller *self = calloc(1, sizeof *self);
    if (self != NULL) {
        self->sample_time = sample_time;
        self->torque_limit = torque_limit;
        (void)stickslip_set(self, parameters);
    }
    return self;
}

int32_t stickslip_set(void *of, const double *parameters) {
    controller *self = of;
    for (int k = 0; k < COUNT; k++) {
        self->values[k] = parameters[k];
    }
    return 0;
}

int32_t stickslip_step(void *of, const stickslip_sample *sample, double *torque) {
    controller *self = of;
    const double *p = self->values;
    const double deviation = sample->reference_position - sample->measured_angle;
    const double velocity = sample->reference_velocity + p[POSITION_GAIN] * deviation;
    const double error = velocity - sample->measured_velocity;
    const double direct = p[VELOCITY_GAIN] * error + p[INERTIA] * sample->reference_acceleration;
    const double sum = direct + self->integral;
    const double limit = self->torque_limit;
    *torque = sum > limit ? limit : sum < -limit ? -limit : sum;
    /* At the limit integrate only away from it. */
    if (*torque == sum || error * sum < 0.0) {
        self->integral += p[VELOCITY_GAIN] * error * self->sample_time / p[INTEGRAL_TIME];
    }
    return 0;
}

void stickslip_end(void *of) { free(of); }
