/* The virtual bench and its software in hand-written C, for speed: two masses with three elasto-plastic contacts, servo,
 * load motor and its current, encoder, tacho, accelerometer and current sensor with noise and converters; velocity
 * observer, the paper's law, PI current control, P-PI cascade. The integrator is the well-balanced splitting of
 * stickslip, with its long steps in steady sliding; libm, branches on signals, reciprocals computed once, products and
 * sums contracted where gcc does so.
 *
 *   bench FILE SEED [OUT]: nanoseconds of the processor per tick, and the last angle; with OUT, the signals of all ticks. */
#define _GNU_SOURCE
#include "noise.h"
#include "software.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

int main(int argc, char **argv) {
    double sizes[2];
    FILE *file = argc > 2 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL || fread(&p, sizeof p, 1, file) != 1 || fread(sizes, sizeof sizes, 1, file) != 1) {
        return 1;
    }
    const size_t segments = (size_t)sizes[0], ticks = (size_t)sizes[1];
    segment *g = malloc(segments * sizeof *g);
    command *c = malloc(ticks * sizeof *c);
    signals *out = argc > 3 ? malloc(ticks * sizeof *out) : NULL;
    if (fread(g, sizeof *g, segments, file) != segments || fread(c, sizeof *c, ticks, file) != ticks) {
        return 1;
    }
    prepare();
    const uint64_t seed = strtoull(argv[2], NULL, 10);
    const double none[6] = { 0 };
    m.angle = p.start_angle;
    readings r = machine_tick(0.0, 0.0, g[0].preload, none);
    size_t at = 0;
    signals seen = { 0 };
    const double start = now();
    for (size_t tick = 0; tick < ticks; ++tick) {
        while (at + 1 < segments && g[at + 1].first_tick == (double)tick) {
            ++at;
            const segment *a = &g[at - 1], *b = &g[at];
            if (memcmp(&a->position_gain, &b->position_gain, 6 * sizeof(double)) != 0) {
                take_over(b);
            }
            s.swapped |= memcmp(&a->desired, &b->desired, sizeof *a - offsetof(segment, desired)) != 0;
        }
        const double servo = s.servo, amplifier = s.amplifier;
        seen = software_tick(&r, &g[at], &c[tick], tick);
        if (out != NULL) {
            out[tick] = seen;
        }
        double n[6];
        normals(n, tick, seed);
        r = machine_tick(servo, amplifier, g[at].preload, n);
    }
    const double end = now();
    printf("%.6f %.17g\n", (end - start) / (double)ticks, seen.angle);
    if (out != NULL) {
        FILE *to = fopen(argv[3], "wb");
        return to == NULL || fwrite(out, sizeof *out, ticks, to) != ticks || fclose(to) != 0;
    }
    return 0;
}
