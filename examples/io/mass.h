/* A machine to test the link: one mass with Coulomb friction, an encoder, a tacho and an accelerometer. Replace it by the
 * instruments of your machine. Its numbers are those of the model of the preset clm-bench. */
#include <math.h>

static const double INERTIA = 1.01e-3;        /* kg m^2 */
static const double FRICTION = 0.1;           /* N m, at rest and sliding */
static const double TORQUE_PER_VOLT = 0.14;   /* model.scaling.torque_per_volt */
static const double TACHO = 0.0287;           /* V s/rad, model.scaling.tacho */
static const double ACCELEROMETER = 0.025493; /* V/(m/s^2), model.scaling.accelerometer */
static const double SCREW_LEAD = 0.005;       /* m, model.drive.screw_lead */
static const double COUNTS = 10000;           /* per revolution, model.encoder.counts_per_revolution */
static const double RANGE = 65536;            /* model.encoder.counter_range */
static const double TURN = 6.283185307179586;
static const double INDEX = 2.0;              /* rad, the angle of the index pulse */

static struct {
    double dt, angle, velocity, latch;
} mass;

static double wrapped(double count) { return count - RANGE * floor(count / RANGE); }

static int machine_begin(double tick_time, double readings[6]) {
    mass.dt = tick_time;
    mass.angle = mass.velocity = mass.latch = 0;
    for (int k = 0; k < 6; ++k) {
        readings[k] = 0;
    }
    return tick_time > 0 && tick_time <= 0.01;
}

static void machine_tick(const double volts[2], double readings[6]) {
    const double torque = TORQUE_PER_VOLT * volts[0], before = mass.velocity;
    /* Friction stops the mass within the tick, or brakes it. */
    const double freely = before + mass.dt / INERTIA * torque, most = mass.dt / INERTIA * FRICTION;
    mass.velocity = fabs(freely) <= most ? 0 : freely - copysign(most, freely);
    const double turns = floor((mass.angle - INDEX) / TURN);
    mass.angle += mass.dt * 0.5 * (before + mass.velocity);
    const double now = floor((mass.angle - INDEX) / TURN);
    if (now != turns) { /* counter at the index pulse, equal in both directions */
        mass.latch = wrapped(floor(INDEX / TURN * COUNTS) + COUNTS * (now > turns ? now : turns));
    }
    readings[0] = wrapped(floor(mass.angle / TURN * COUNTS));
    readings[1] = now != turns;
    readings[2] = mass.latch;
    readings[3] = TACHO * mass.velocity;
    readings[4] = ACCELEROMETER * SCREW_LEAD / TURN * (mass.velocity - before) / mass.dt;
    readings[5] = 0; /* no load motor */
}
