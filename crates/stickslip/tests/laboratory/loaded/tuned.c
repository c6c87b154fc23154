/* A controller whose numbers are changed while it runs; it refuses a stiffness above 5. With MORE it has one more. */
#include "stickslip_module.h"

static const stickslip_parameter PARAMETERS[] = {
    {"stiffness", "N m/rad", "Torque per deviation", 0.0, 10.0, 1.0},
    {"damping", "N m s/rad", "Torque per deviation of the velocity", 0.0, 1.0, 0.03},
    {"bias", "N m", "Torque added to it", -1.0, 1.0, 0.0},
#ifdef MORE
    {"more", "1", "New in the second version", 0.0, 1.0, 0.5},
#endif
};
enum { COUNT = sizeof PARAMETERS / sizeof *PARAMETERS };
static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, COUNT, "tuned", PARAMETERS};

static double values[COUNT];

const stickslip_description *stickslip_describe(void) { return &DESCRIPTION; }

int32_t stickslip_set(void *of, const double *parameters) {
    (void)of;
    if (parameters[0] > 5.0) {
        return -2;
    }
    for (int k = 0; k < COUNT; k++) {
        values[k] = parameters[k];
    }
    return 0;
}

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    (void)sample_time;
    (void)torque_limit;
    return stickslip_set(values, parameters) ? 0 : values;
}

int32_t stickslip_step(void *of, const stickslip_sample *sample, double *torque) {
    (void)of;
    *torque = values[0] * (sample->reference_position - sample->measured_angle) +
              values[1] * (sample->reference_velocity - sample->measured_velocity) + values[2];
    return 0;
}

void stickslip_end(void *of) { (void)of; }
