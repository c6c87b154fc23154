/* A library that was compiled with a header of before: its sample ends with the measured velocity. */
#include <stdint.h>

typedef struct {
    uint32_t abi;
    uint32_t parameter_count;
    const char *name;
    const void *parameters;
} description;

typedef struct {
    double time;
    double reference_position;
    double reference_velocity;
    double reference_acceleration;
    double measured_angle;
    double measured_velocity;
} sample;

static const description DESCRIPTION = {1, 0, "before", 0};
static int self;

const description *stickslip_describe(void) { return &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    (void)sample_time;
    (void)torque_limit;
    (void)parameters;
    return &self;
}

int32_t stickslip_set(void *of, const double *parameters) {
    (void)of;
    (void)parameters;
    return 0;
}

int32_t stickslip_step(void *of, const sample *read, double *torque) {
    (void)of;
    const sample known = *read;
    *torque = known.time + known.measured_angle + known.measured_velocity;
    return 0;
}

void stickslip_end(void *of) { (void)of; }
