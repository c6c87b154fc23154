/* A controller with one fault, chosen when it is compiled; it comes in the sample that its parameter names. */
#include "stickslip_module.h"

#include <fenv.h>
#include <math.h>
#include <stdlib.h>

static const stickslip_parameter PARAMETERS[] = {{"sample", "1", "Sample of the fault", 0.0, 1e9, 300.0}};
static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, 1, "faulty", PARAMETERS};

static double count, when;
static int self;

const stickslip_description *stickslip_describe(void) { return &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    (void)sample_time;
    (void)torque_limit;
    count = 0.0;
    when = parameters[0];
    return &self;
}

int32_t stickslip_set(void *of, const double *parameters) {
    (void)of;
    when = parameters[0];
    return 0;
}

int32_t stickslip_step(void *of, const stickslip_sample *sample, double *torque) {
    (void)of;
    *torque = 20.0 * (sample->reference_position - sample->measured_angle) +
              0.1 * (sample->reference_velocity - sample->measured_velocity);
    if (count++ < when) {
        return 0;
    }
#if FAULT == 0
    *(volatile int *)0 = 1;
#elif FAULT == 1
    for (;;) {
    }
#elif FAULT == 2
    *torque = NAN;
#elif FAULT == 3
    *torque = -INFINITY;
#elif FAULT == 4
    return 7;
#elif FAULT == 5
    fesetround(FE_UPWARD);
#elif FAULT == 6
    exit(3);
#endif
    return 0;
}

void stickslip_end(void *of) { (void)of; }
