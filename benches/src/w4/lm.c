/* The Stribeck curve through noisy points by Levenberg and Marquardt, as one writes it in C: analytic Jacobian, normal
 * equations by Cholesky, Marquardt's scaling. lm FILE START... reads the points (count, speeds, torques, all as doubles),
 * fits them again and again, and prints nanoseconds of the fastest, the parameters M_S, M_K, Omega_Strib, b, and the root
 * mean square of what is left. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { PARAMETERS = 4, MOST_STEPS = 100 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

static double squares(const double *v, const double *torque, size_t count, const double *p) {
    const double drop = p[0] - p[1], inverse = 1.0 / p[2];
    double sum = 0.0;
    for (size_t k = 0; k < count; k++) {
        const double r = torque[k] - (p[1] + drop * exp(-v[k] * inverse) + p[3] * v[k]);
        sum += r * r;
    }
    return sum;
}

/* Normal equations, and the sum of squares. */
static double normal(const double *v, const double *torque, size_t count, const double *p, double a[4][4],
                     double g[4]) {
    const double drop = p[0] - p[1], inverse = 1.0 / p[2], slope = drop * inverse * inverse;
    double a00 = 0, a01 = 0, a02 = 0, a03 = 0, a11 = 0, a12 = 0, a13 = 0, a22 = 0, a23 = 0, a33 = 0;
    double g0 = 0, g1 = 0, g2 = 0, g3 = 0, sum = 0;
    for (size_t k = 0; k < count; k++) {
        const double e = exp(-v[k] * inverse), j0 = e, j1 = 1.0 - e, j2 = slope * v[k] * e, j3 = v[k];
        const double r = torque[k] - (p[1] + drop * e + p[3] * v[k]);
        a00 += j0 * j0, a01 += j0 * j1, a02 += j0 * j2, a03 += j0 * j3;
        a11 += j1 * j1, a12 += j1 * j2, a13 += j1 * j3;
        a22 += j2 * j2, a23 += j2 * j3, a33 += j3 * j3;
        g0 += j0 * r, g1 += j1 * r, g2 += j2 * r, g3 += j3 * r;
        sum += r * r;
    }
    const double whole[4][4] = {
        { a00, a01, a02, a03 }, { a01, a11, a12, a13 }, { a02, a12, a22, a23 }, { a03, a13, a23, a33 }
    };
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) a[i][j] = whole[i][j];
    }
    g[0] = g0; g[1] = g1; g[2] = g2; g[3] = g3;
    return sum;
}

/* (A + damping diag A) step = g; 0 where it is not positive definite. */
static int solve(double a[4][4], const double g[4], double damping, double step[4]) {
    double l[4][4], y[4];
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = a[i][j] * (i == j ? 1.0 + damping : 1.0);
            for (int k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
            if (i != j) l[i][j] = sum / l[j][j];
            else if (sum > 0.0) l[i][i] = sqrt(sum);
            else return 0;
        }
        double sum = g[i];
        for (int k = 0; k < i; k++) sum -= l[i][k] * y[k];
        y[i] = sum / l[i][i];
    }
    for (int i = 3; i >= 0; i--) {
        double sum = y[i];
        for (int k = i + 1; k < 4; k++) sum -= l[k][i] * step[k];
        step[i] = sum / l[i][i];
    }
    return 1;
}

static double fit(const double *v, const double *torque, size_t count, double *p) {
    double a[4][4], g[4], step[4], damping = 1e-3;
    double cost = normal(v, torque, count, p, a, g);
    for (int k = 0; k < MOST_STEPS; k++) {
        if (!solve(a, g, damping, step)) {
            damping *= 10.0;
            continue;
        }
        const double next[4] = { p[0] + step[0], p[1] + step[1], p[2] + step[2], p[3] + step[3] };
        const double there = next[2] > 0.0 ? squares(v, torque, count, next) : INFINITY;
        if (there <= cost) {
            double largest = 0.0;
            for (int i = 0; i < 4; i++) {
                largest = fmax(largest, fabs(step[i]) / (fabs(next[i]) + 1e-300));
                p[i] = next[i];
            }
            const double fall = (cost - there) / cost;
            damping *= 0.1;
            /* The tolerances of MINPACK as SciPy sets them. */
            if (largest < 1e-8 || fall < 1e-8) {
                cost = there;
                break;
            }
            cost = normal(v, torque, count, p, a, g);
        } else {
            damping *= 10.0;
            if (damping > 1e12) break;
        }
    }
    return sqrt(cost / (double)count);
}

int main(int argc, char **argv) {
    FILE *file = argc == 6 ? fopen(argv[1], "rb") : NULL;
    double length;
    if (file == NULL || fread(&length, sizeof length, 1, file) != 1 || !(length >= 5.0 && length <= 1e8)) return 1;
    const size_t count = (size_t)length;
    double *v = malloc(count * sizeof *v), *torque = malloc(count * sizeof *torque);
    if (v == NULL || torque == NULL || fread(v, sizeof *v, count, file) != count) return 1;
    if (fread(torque, sizeof *torque, count, file) != count) return 1;
    double p[PARAMETERS] = { 0 }, rms = 0.0, best = INFINITY;
    for (int round = 0; round < 50; round++) {
        for (int i = 0; i < PARAMETERS; i++) p[i] = atof(argv[2 + i]);
        const double begin = now();
        rms = fit(v, torque, count, p);
        best = fmin(best, now() - begin);
    }
    printf("%.17g %.17g %.17g %.17g %.17g %.17g\n", best, p[0], p[1], p[2], p[3], rms);
    return 0;
}
