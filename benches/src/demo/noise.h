/* Standard normals: Marsaglia's polar method on xoshiro256+. With SAME_NOISE those of stickslip, for the comparison of
 * the trajectories: Philox 4x32-10 and Box-Muller. */
#ifndef NOISE_H
#define NOISE_H

#include <math.h>
#include <stdint.h>

#ifdef SAME_NOISE

static void normals(double n[6], uint64_t tick, uint64_t seed) {
    for (uint32_t pair = 0; pair < 3; ++pair) {
        uint32_t a = (uint32_t)tick, b = (uint32_t)(tick >> 32), c = pair, d = 0;
        uint32_t key0 = (uint32_t)seed, key1 = (uint32_t)(seed >> 32);
        for (int round = 0; round < 10; ++round) {
            const uint64_t p = 0xD2511F53u * (uint64_t)a, q = 0xCD9E8D57u * (uint64_t)c;
            a = (uint32_t)(q >> 32) ^ b ^ key0;
            c = (uint32_t)(p >> 32) ^ d ^ key1;
            b = (uint32_t)q;
            d = (uint32_t)p;
            key0 += 0x9E3779B9u;
            key1 += 0xBB67AE85u;
        }
        const double u = (double)(((uint64_t)a << 32 | b) >> 11) * 0x1p-53;
        const double v = (double)(((uint64_t)c << 32 | d) >> 11) * 0x1p-53;
        const double radius = sqrt(-2.0 * log(1.0 - u));
        n[2 * pair] = radius * cos(2.0 * M_PI * v);
        n[2 * pair + 1] = radius * sin(2.0 * M_PI * v);
    }
}

#else

static uint64_t word[4] = { 0x9E3779B97F4A7C15u, 0xBF58476D1CE4E5B9u, 0x94D049BB133111EBu, 0x2545F4914F6CDD1Du };

static inline double uniform(void) {
    const uint64_t result = word[0] + word[3], t = word[1] << 17;
    word[2] ^= word[0];
    word[3] ^= word[1];
    word[1] ^= word[2];
    word[0] ^= word[3];
    word[2] ^= t;
    word[3] = word[3] << 45 | word[3] >> 19;
    return (double)(int64_t)(result >> 11) * 0x1p-52 - 1.0;
}

static void normals(double n[6], uint64_t tick, uint64_t seed) {
    (void)tick;
    (void)seed;
    for (int pair = 0; pair < 3; ++pair) {
        double u, v, square;
        do {
            u = uniform();
            v = uniform();
            square = u * u + v * v;
        } while (square >= 1.0 || square == 0.0);
        const double factor = sqrt(-2.0 * log(square) / square);
        n[2 * pair] = factor * u;
        n[2 * pair + 1] = factor * v;
    }
}

#endif
#endif
