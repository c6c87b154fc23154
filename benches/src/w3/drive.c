/* Times a tick over a table of inputs: drive TABLE PASSES.
 * The table contains the parameters, dt, and inputs, all as doubles. Prints nanoseconds per tick, the last outputs, the
 * sum of the voltages, and the sum of the return values. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include DRIVE_HEADER

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

int main(int argc, char **argv) {
    static DRIVE(input) table[4096];
    static DRIVE(parameters) p;
    static DRIVE(state) s;
    DRIVE(output) out = { 0 };
    double dt, sum = 0.0;
    unsigned status = 0;
    FILE *file = argc > 2 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL || fread(&p, sizeof p, 1, file) != 1 || fread(&dt, sizeof dt, 1, file) != 1) {
        return 1;
    }
    const size_t rows = fread(table, sizeof table[0], sizeof table / sizeof table[0], file);
    const long passes = atol(argv[2]);
    const double start = now();
    for (long pass = 0; pass < passes; ++pass) {
        for (size_t k = 0; k < rows; ++k) {
            status += (unsigned)DRIVE(step)(&p, &s, &table[k], dt, &out);
            sum += out.amplifier_voltage;
        }
    }
    const double end = now();
    printf("%.6f %.17g %.17g %.17g %u\n", (end - start) / ((double)rows * (double)passes), out.amplifier_voltage,
        out.torque, sum, status);
    return 0;
}
