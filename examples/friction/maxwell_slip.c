/*
 * Example of an external friction: Maxwell slip with four parallel springs, each of which slips at its share of a Stribeck
 * curve. In presliding it is a spring with hysteresis and memory of every reversal; in sliding it follows the curve.
 *
 *     stickslip load --header .
 *     cc -O2 -shared -fPIC -I. -o maxwell_slip.so maxwell_slip.c -lm
 *     stickslip load maxwell_slip.so --as friction --preset-set bench.law.kind=residual
 *
 * With a very high stiffness a rendering motor chatters because of its delays; 100 N m/rad is far below that.
 */
#include "stickslip_module.h"

#include <math.h>
#include <stdlib.h>

enum { BREAKAWAY, KINETIC, STRIBECK, VISCOUS, STIFFNESS, DAMPING, COUNT };

static const stickslip_parameter PARAMETERS[COUNT] = {
    {"breakaway_torque", "N m", "Breakaway torque", 1e-6, 1.0, 0.30},
    {"kinetic_torque", "N m", "Kinetic torque, without the viscous part", 1e-6, 1.0, 0.15},
    {"stribeck_velocity", "rad/s", "Stribeck velocity: speed at which 1/e of the drop remains", 1e-3, 100.0, 1.5},
    {"viscous_friction", "N m s/rad", "Viscous friction", 0.0, 0.1, 1e-3},
    {"stiffness", "N m/rad", "Total stiffness of the springs at rest", 1.0, 1e4, 100.0},
    {"damping", "N m s/rad", "Damping parallel to the springs while they deflect", 0.0, 1.0, 0.1},
};

static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, COUNT, "Maxwell slip", PARAMETERS};

/* Shares of the stiffness and of the slip torque; the stiffest spring slips first. */
enum { SPRINGS = 4 };
static const double STIFF[SPRINGS] = {0.4, 0.3, 0.2, 0.1};
static const double STRONG[SPRINGS] = {0.1, 0.2, 0.3, 0.4};

typedef struct {
    double values[COUNT];
    double sample_time;
    double torques[SPRINGS]; /* [N m] */
} friction;

const stickslip_description *stickslip_describe(void) { return &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    friction *self = calloc(1, sizeof *self);
    (void)torque_limit; /* the bench limits the torque */
    if (self != NULL) {
        self->sample_time = sample_time;
        (void)stickslip_set(self, parameters);
    }
    return self;
}

int32_t stickslip_set(void *of, const double *parameters) {
    friction *self = of;
    for (int k = 0; k < COUNT; k++) {
        self->values[k] = parameters[k];
    }
    return 0;
}

int32_t stickslip_step(void *of, const stickslip_sample *sample, double *torque) {
    friction *self = of;
    const double *value = self->values;
    /* Screw velocity from the observer of the bench. The tacho measures the motor, on the other side of the coupling. */
    const double velocity = sample->estimated_velocity;
    const double speed = fabs(velocity);
    const double drop = value[BREAKAWAY] - value[KINETIC];
    const double level = value[KINETIC] + drop * exp(-speed / value[STRIBECK]);
    double sum = 0.0, stretched = 0.0;
    for (int k = 0; k < SPRINGS; k++) {
        const double limit = STRONG[k] * level;
        const double elastic = self->torques[k] + STIFF[k] * value[STIFFNESS] * velocity * self->sample_time;
        self->torques[k] = fmax(-limit, fmin(limit, elastic));
        stretched += self->torques[k] == elastic ? STIFF[k] : 0.0;
        sum += self->torques[k];
    }
    /* Sign: positive against positive motion, as for every friction of the bench. */
    *torque = sum + stretched * value[DAMPING] * velocity + value[VISCOUS] * velocity;
    return 0;
}

void stickslip_end(void *of) { free(of); }
