/* W1 and W2 by the classical Runge-Kutta method: two masses with a bristle on the load, a P-PI cascade every millisecond
 * on the motor's encoder. Compiled for one variant after the other (libm's exponential) or, with -DWIDTH=8, 16 or 32, for
 * as many side by side in vectors (an inlined exponential); -DELASTO_PLASTIC for the bristles of the product's default.
 *
 *   rk4 VARIANTS SAMPLES [OUT]     VARIANTS: rows of M_S, Omega_Strib, K_p and substeps a millisecond, as doubles
 *
 * Variants of one row of vectors must ask for the same number of substeps. Prints the seconds of processor time that the motion took; OUT
 * gets angle and deflection at each sample, a variant after the other. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef WIDTH
typedef double num __attribute__((vector_size(8 * WIDTH)));
typedef long mask __attribute__((vector_size(8 * WIDTH)));
#define LANE(x, i) ((x)[i])
static inline num all(double x) { return x - (num){ 0 }; }
static inline num choose(mask m, num yes, num no) { return (num)(((mask)yes & m) | ((mask)no & ~m)); }
static inline num magnitude(num x) { return (num)((mask)x & 0x7fffffffffffffffL); }
/* As the C library's within 2 ulp for the arguments that occur, x <= 0. */
static inline num exponential(num x) {
    x = choose(x > -708.4, x, all(-708.4));
    const num k = (x * 1.4426950408889634 + 6755399441055744.0) - 6755399441055744.0;
    const num r = (x - k * 6.93147180369123816490e-1) - k * 1.90821492927058770002e-10;
    num p = all(2.509554685120205e-8);
    p = p * r + 2.761379668517062e-7;
    p = p * r + 2.755728008111812e-6;
    p = p * r + 2.480153640702703e-5;
    p = p * r + 1.984126985433155e-4;
    p = p * r + 1.388888890587236e-3;
    p = p * r + 8.333333333332157e-3;
    p = p * r + 4.166666666665136e-2;
    p = p * r + 1.666666666666667e-1;
    p = p * r + 0.5;
    p = p * r + 1.0;
    p = p * r + 1.0;
    return p * (num)((mask)(k + (4503599627370496.0 + 1023.0)) << 52);
}
/* sin of |x| <= pi/2, for the release. */
static inline num sine(num x) {
    const num z = x * x;
    num p = all(-7.6471637318198164759e-13);
    p = p * z + 1.6059043836821614599e-10;
    p = p * z - 2.5052108385441718775e-8;
    p = p * z + 2.7557319223985890653e-6;
    p = p * z - 1.9841269841269841270e-4;
    p = p * z + 8.3333333333333333333e-3;
    p = p * z - 1.6666666666666666667e-1;
    return x + x * z * p;
}
#else
#define WIDTH 1
typedef double num;
typedef int mask;
#define LANE(x, i) (*(&(x) + (i)))
static inline num all(double x) { return x; }
static inline num choose(mask m, num yes, num no) { return m ? yes : no; }
static inline num magnitude(num x) { return fabs(x); }
static inline num exponential(num x) { return exp(x); }
static inline num sine(num x) { return sin(x); }
#endif

#define J_M 8e-4
#define J_L 1.2e-3
#define STIFFNESS 100.0
#define DAMPING 0.01
#define SIGMA_0 5e3
#define SIGMA_1 1.0
#define M_K 0.2
#define VISCOUS 2e-3
#define FADING 1.2 /* rad/s, of sigma_1 in the elasto-plastic model */
#define ELASTIC 0.7

typedef struct { num twist, motor, angle, velocity, z; } state;
typedef struct { num drop, per_stribeck; } friction;

static inline state rates(state x, num torque, friction f) {
    const num coupling = STIFFNESS * x.twist + DAMPING * (x.motor - x.velocity);
    const num speed = magnitude(x.velocity);
    const num g = M_K + f.drop * exponential(-speed * f.per_stribeck);
    state d;
#ifdef ELASTO_PLASTIC
    const num size = SIGMA_0 * magnitude(x.z), limit = ELASTIC * (f.drop + M_K);
    const num elastic = choose(limit < 0.95 * g, limit, 0.95 * g);
    const num u = (size - elastic) / (g - elastic);
    num alpha = 0.5 + 0.5 * sine(3.14159265358979323846 * (choose(u < 1.0, choose(u > 0.0, u, all(0.0)), all(1.0)) - 0.5));
    alpha = choose(size >= g, all(1.0), alpha);
    alpha = choose((x.z * x.velocity <= 0.0) | (size <= elastic), all(0.0), alpha);
    const num s = x.velocity * (1.0 / FADING), sigma_1 = SIGMA_1 / (1.0 + s * s);
#else
    const num alpha = all(1.0), sigma_1 = all(SIGMA_1);
#endif
    d.z = x.velocity - alpha * (SIGMA_0 * speed * x.z / g);
    d.twist = x.motor - x.velocity;
    d.motor = (torque - coupling) * (1.0 / J_M);
    d.angle = x.velocity;
    d.velocity = (coupling - SIGMA_0 * x.z - sigma_1 * d.z - VISCOUS * x.velocity) * (1.0 / J_L);
    return d;
}

static inline state along(state x, double h, state k) {
    return (state){ x.twist + h * k.twist, x.motor + h * k.motor, x.angle + h * k.angle, x.velocity + h * k.velocity,
        x.z + h * k.z };
}

static void motion(const double *variants, long count, const double *reference, long samples, double *out) {
    friction f;
    num gain, integral = all(0.0);
    state x;
    memset(&x, 0, sizeof x);
    for (long i = 0; i < WIDTH; ++i) {
        const double *v = variants + 4 * (i < count ? i : count - 1);
        LANE(f.drop, i) = v[0] - M_K;
        LANE(f.per_stribeck, i) = 1.0 / v[1];
        LANE(gain, i) = v[2];
    }
    const long substeps = (long)variants[3];
    const double h = 1e-3 / (double)substeps;
    for (long k = 0; k < samples; ++k) {
        memcpy(out + 2 * WIDTH * k, &x.angle, sizeof x.angle);
        memcpy(out + 2 * WIDTH * k + WIDTH, &x.z, sizeof x.z);
        const num e = gain * (reference[k] - (x.angle + x.twist)) - x.motor;
        const num demand = 0.12 * e + integral, increment = 3e-3 * e;
        integral = choose((magnitude(demand) <= 2.0) | (demand * increment <= 0.0), integral + increment, integral);
        const num torque = choose(demand > 2.0, all(2.0), choose(demand < -2.0, all(-2.0), demand));
        for (long s = 0; s < substeps; ++s) {
            const state k1 = rates(x, torque, f), k2 = rates(along(x, 0.5 * h, k1), torque, f);
            const state k3 = rates(along(x, 0.5 * h, k2), torque, f), k4 = rates(along(x, h, k3), torque, f);
            x.twist += h / 6.0 * (k1.twist + 2.0 * (k2.twist + k3.twist) + k4.twist);
            x.motor += h / 6.0 * (k1.motor + 2.0 * (k2.motor + k3.motor) + k4.motor);
            x.angle += h / 6.0 * (k1.angle + 2.0 * (k2.angle + k3.angle) + k4.angle);
            x.velocity += h / 6.0 * (k1.velocity + 2.0 * (k2.velocity + k3.velocity) + k4.velocity);
            x.z += h / 6.0 * (k1.z + 2.0 * (k2.z + k3.z) + k4.z);
        }
    }
}

int main(int argc, char **argv) {
    static double variants[4 * 4096];
    FILE *file = argc > 2 ? fopen(argv[1], "rb") : NULL;
    if (file == NULL) {
        return 1;
    }
    const long count = (long)fread(variants, 4 * sizeof(double), 4096, file), samples = atol(argv[2]);
    double *reference = malloc((size_t)samples * sizeof(double));
    double *out = aligned_alloc(64, (size_t)(2 * WIDTH * samples + 64) / 64 * 64 * sizeof(double));
    FILE *results = argc > 3 ? fopen(argv[3], "wb") : NULL;
    if (count == 0 || reference == NULL || out == NULL || (argc > 3 && results == NULL)) {
        return 1;
    }
    memset(out, 0, (size_t)(2 * WIDTH * samples) * sizeof(double));
    for (long k = 0; k < samples; ++k) {
        reference[k] = 0.2 * sin(2.0 * 3.14159265358979323846 * 1e-3 * (double)k);
    }
    double seconds = 0.0;
    for (long first = 0; first < count;) {
        long team = 0;
        while (team < WIDTH && first + team < count && variants[4 * (first + team) + 3] == variants[4 * first + 3]) {
            ++team;
        }
        struct timespec begin, end;
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
        motion(variants + 4 * first, team, reference, samples, out);
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
        seconds += (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec);
        for (long i = 0; results != NULL && i < team; ++i) {
            for (long half = 0; half < 2; ++half) {
                for (long k = 0; k < samples; ++k) {
                    fwrite(out + 2 * WIDTH * k + WIDTH * half + i, sizeof(double), 1, results);
                }
            }
        }
        first += team;
    }
    printf("%.9f\n", seconds);
    return results != NULL && fclose(results) != 0;
}
