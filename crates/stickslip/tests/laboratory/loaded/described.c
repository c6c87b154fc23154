/* A library that describes itself wrongly, each CASE in its way. */
#include "stickslip_module.h"

#include <math.h>
#include <stddef.h>

#define ONE {"gain", "1", "What it is", 0.0, 1.0, 0.5}

static const stickslip_parameter PARAMETERS[] = {
#if CASE == 4
    {NULL, "1", "What it is", 0.0, 1.0, 0.5},
#elif CASE == 5
    {"gain", NULL, "What it is", 0.0, 1.0, 0.5},
#elif CASE == 6
    {"gain", "1", NULL, 0.0, 1.0, 0.5},
#elif CASE == 7
    {"gain", "1", "What it is", NAN, 1.0, 0.5},
#elif CASE == 8
    {"gain", "1", "What it is", 1.0, 0.0, 0.5},
#elif CASE == 9
    {"gain", "1", "What it is", 0.0, 1.0, 1.5},
#elif CASE == 10
    {"The Gain", "1", "What it is", 0.0, 1.0, 0.5},
#elif CASE == 11
    ONE, ONE,
#elif CASE == 14
    {"gain", "1", "What it is", 0.0, 1.0, NAN},
#elif CASE == 15
    {"gain", "1", "What it is", 0.0, INFINITY, 0.5},
#else
    ONE,
#endif
};

static const stickslip_description DESCRIPTION = {
    CASE == 0 ? 2u : STICKSLIP_MODULE_ABI,
    CASE == 12 ? 5000u : sizeof PARAMETERS / sizeof *PARAMETERS,
    CASE == 3 ? NULL : CASE == 13 ? " " : "described",
    CASE == 2 ? NULL : PARAMETERS,
};

const stickslip_description *stickslip_describe(void) { return CASE == 1 ? NULL : &DESCRIPTION; }

void *stickslip_begin(double sample_time, double torque_limit, const double *parameters) {
    (void)sample_time, (void)torque_limit, (void)parameters;
    return NULL;
}

int32_t stickslip_set(void *of, const double *parameters) { return (void)of, (void)parameters, 0; }

int32_t stickslip_step(void *of, const stickslip_sample *sample, double *torque) {
    return (void)of, (void)sample, *torque = 0.0, 0;
}

void stickslip_end(void *of) { (void)of; }
