/* A controller with one fault, chosen when it is compiled; it comes in the sample that its parameter names. */
#include "stickslip_module.h"

#ifndef STIFFNESS
#define STIFFNESS 20.0
#define DAMPING 0.1
#define FRICTION 0.0
#endif

#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#include <time.h>

static const stickslip_parameter PARAMETERS[] = {{"sample", "1", "Sample of the fault", 0.0, 1e9, 300.0}};
static const stickslip_description DESCRIPTION = {STICKSLIP_MODULE_ABI, 1, "faulty", PARAMETERS};

static double count, when;
static int self;

#if FAULT == 7
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* Overwrites all memory that it shares with another process with random data. */
static void scribble(void) {
    static uint64_t random = 1;
    char line[512], rest[512];
    unsigned long begin, end;
    FILE *maps = fopen("/proc/self/maps", "r");
    while (maps && fgets(line, sizeof line, maps)) {
        if (sscanf(line, "%lx-%lx rw-s %511[^\n]", &begin, &end, rest) == 3 && strstr(rest, "memfd:stickslip")) {
            for (uint64_t *word = (uint64_t *)begin; word < (uint64_t *)end; word++) {
                random = random * 6364136223846793005u + 1442695040888963407u;
                *word = random ^ (random >> 29);
            }
        }
    }
    if (maps) {
        fclose(maps);
    }
}
#endif

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
    *torque = STIFFNESS * (sample->reference_position - sample->measured_angle) +
              DAMPING * (sample->reference_velocity - sample->measured_velocity) +
              FRICTION * (sample->reference_velocity > 0.0);
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
#elif FAULT == 7
    scribble();
#elif FAULT == 8
    /* Far longer than a sample, once. */
    if (count == when + 1.0) {
        nanosleep(&(struct timespec){.tv_nsec = 200000000}, NULL);
    }
#endif
    return 0;
}

void stickslip_end(void *of) { (void)of; }
