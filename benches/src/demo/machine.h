/* The virtual machine: masses, contacts, motors, instruments. */
#ifndef MACHINE_H
#define MACHINE_H

#include "bench.h"

#include <math.h>
#include <string.h>

#define ROWS 8 /* five states, change of the angle, padding */
#define COLUMNS 9

typedef struct {
    double kinetic, drop, per_stribeck, viscous, stiffness, per_stiffness, damping, per_damping_velocity, elastic;
} contact;

/* A step: its length, flow over half of it, sensors; h/J_M, h/J_L, travel per angle and h. The tacho sees the mean velocity
 * and this share of its change. */
typedef struct {
    double h, flow[COLUMNS][ROWS], sensor_flow[2][3], tacho_share, ramp, per_motor, per_load, per_step;
} stride;

static parameters p;
static contact brushes, screw, wheel;
static stride small, large;
/* Small steps in a large one, and in a tick. */
static int in_large, in_tick;
/* Changes of both velocities in a tick; torque per volt of the motor, noise of the accelerometer. */
static double change[COLUMNS][2], tick_time, per_volt, noise_share;

/* States: twist, motor velocity, velocity, load current, motor torque. */
static struct {
    double x[ROWS], angle, motor_held, load_held, brushes, screw, wheel;
    double tacho, felt, felt_rate, revolution, latch;
    int running;
} m;

static inline double limited(double value, double low, double high) {
    return value < low ? low : value > high ? high : value;
}

/* Elasto-plastic bristles over dt with the velocity held: mean torque; *z becomes the deflection at the end. */
static inline double relax(const contact *c, double *z, double probe, double w, double dt, int predicts) {
    const double speed = fabs(w), start = *z;
    const double level = c->drop != 0.0 ? c->kinetic + c->drop * exp(-speed * c->per_stribeck) : c->kinetic;
    const double size = c->stiffness * fabs(probe), elastic = fmin(c->elastic, 0.95 * level);
    double share = 0.0, slope = 0.0;
    if (probe * w > 0.0 && size > elastic) {
        if (size >= level) {
            share = 1.0;
        } else {
            const double per_width = 1.0 / (level - elastic);
            double sine, cosine;
            sincos(M_PI * (size - elastic) * per_width, &sine, &cosine);
            share = 0.5 - 0.5 * cosine;
            slope = 0.5 * M_PI * sine * size * per_width;
        }
    }
    const double quick = c->stiffness * speed / level, decay = (share + slope) * quick, x = decay * dt;
    const double rate = w + slope * quick * probe - decay * start;
    double phi1, phi2;
    if (predicts) {
        phi1 = 1.0 / (1.0 + x);
        phi2 = 0.5 * phi1;
    } else if (x < 0.0078125) {
        phi2 = 0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x * (1.0 / 720.0))));
        phi1 = 1.0 - x * phi2;
    } else {
        const double per = 1.0 / x;
        phi1 = (1.0 - exp(-x)) * per;
        phi2 = (1.0 - phi1) * per;
    }
    const double mean_rate = rate * phi1, most = fmax(fabs(start), level * c->per_stiffness);
    const double ratio = w * c->per_damping_velocity, square = ratio * ratio;
    *z = limited(start + mean_rate * dt, -most, most);
    const double damping = square < 40.0 ? c->damping * exp(-square) : 0.0;
    return c->stiffness * (start + rate * dt * phi2) + damping * mean_rate + c->viscous * w;
}

static inline void half_step(const stride *q, double voltage, double aim, double motor_held, double load_held) {
    const double in[COLUMNS] = { m.x[0], m.x[1], m.x[2], m.x[3], m.x[4], motor_held, load_held, voltage, aim };
    double out[ROWS] = { 0 };
    for (int column = 0; column < COLUMNS; ++column) {
        for (int row = 0; row < ROWS; ++row) {
            out[row] += q->flow[column][row] * in[column];
        }
    }
    m.angle += out[5];
    memcpy(m.x, out, sizeof out);
}

typedef struct {
    double voltage, aim;
} drives;

/* Voltage at the winding of the load motor, reference of the drive's torque. */
static inline drives driven(double servo, double amplifier) {
    const double hold = p.load_resistance * m.x[3] - p.load_constant * m.x[2];
    double voltage = amplifier * p.amplifier_gain;
    if (m.x[3] > p.amplifier_current_limit) {
        voltage = fmin(voltage, hold);
    } else if (m.x[3] < -p.amplifier_current_limit) {
        voltage = fmax(voltage, hold);
    }
    const double asked = limited(limited(servo, -p.servo_input_limit, p.servo_input_limit) * p.servo_torque_per_volt,
        -p.servo_torque_limit, p.servo_torque_limit);
    const double emf = p.motor_constant * m.x[1];
    return (drives){ limited(voltage, -p.amplifier_supply, p.amplifier_supply),
        limited(asked, fmin(per_volt * (-p.servo_supply - emf), 0.0), fmax(per_volt * (p.servo_supply - emf), 0.0)) };
}

/* Whether the bristles take up less than a hundredth of the motion. */
static inline int slides(const contact *c, double z, double w) {
    const double speed = fabs(w), level = c->kinetic + c->drop * exp(-speed * c->per_stribeck);
    const double size = c->stiffness * fabs(z), elastic = fmin(c->elastic, 0.95 * level);
    double share = 0.0;
    if (z * w > 0.0 && size > elastic) {
        share = size >= level ? 1.0 : 0.5 - 0.5 * cos(M_PI * (size - elastic) / (level - elastic));
    }
    return fabs(w - share * c->stiffness * speed / level * z) < 0.01 * speed;
}

/* Whether a tick from this state is taken in large steps: with friction held, no velocity changes by a hundredth. */
static inline int steady(double servo, double amplifier) {
    const drives d = driven(servo, amplifier);
    const double in[COLUMNS] = { m.x[0], m.x[1], m.x[2], m.x[3], m.x[4], m.motor_held, m.load_held, d.voltage, d.aim };
    double motor = 0.0, load = 0.0;
    for (int column = 0; column < COLUMNS; ++column) {
        motor += change[column][0] * in[column];
        load += change[column][1] * in[column];
    }
    return fabs(motor) < 0.01 * fabs(m.x[1]) && fabs(load) < 0.01 * fabs(m.x[2]) && slides(&brushes, m.brushes, m.x[1])
        && slides(&screw, m.screw, m.x[2]) && slides(&wheel, m.wheel, m.x[2]);
}

static inline void machine_step(const stride *q, double servo, double amplifier, double preload, double noise) {
    const double start = m.x[2], motor_start = m.x[1], h = q->h;
    const drives d = driven(servo, amplifier);
    const double voltage = d.voltage, aim = d.aim;
    const double motor_held = m.motor_held, load_held = m.load_held;
    half_step(q, voltage, aim, motor_held, load_held);

    const double half = 0.5 * h, w_motor = m.x[1], w = m.x[2];
    double z_brushes = m.brushes, z_screw = m.screw, z_wheel = m.wheel;
    const double on_motor = relax(&brushes, &z_brushes, m.brushes, w_motor, half, 1);
    double on_load = relax(&screw, &z_screw, m.screw, w, half, 1);
    on_load += preload * relax(&wheel, &z_wheel, m.wheel, w, half, 1);
    const double w_motor_middle = w_motor - (on_motor - motor_held) * 0.5 * q->per_motor;
    const double w_middle = w - (on_load - load_held) * 0.5 * q->per_load;
    m.motor_held = relax(&brushes, &m.brushes, z_brushes, w_motor_middle, h, 0);
    m.load_held = relax(&screw, &m.screw, z_screw, w_middle, h, 0);
    m.load_held += preload * relax(&wheel, &m.wheel, z_wheel, w_middle, h, 0);
    m.x[1] = w_motor - (m.motor_held - motor_held) * q->per_motor;
    m.x[2] = w - (m.load_held - load_held) * q->per_load;
    half_step(q, voltage, aim, motor_held, load_held);

    const double mean_velocity = 0.5 * (motor_start + m.x[1]), motor_angle = m.angle + m.x[0] - half * mean_velocity;
    const double seen = mean_velocity + q->ramp * (m.x[1] - motor_start);
    const double generated = p.tacho_constant * seen * (1.0 + p.tacho_ripple * sin(p.tacho_periods * motor_angle));
    m.tacho += q->tacho_share * (generated - m.tacho);
    const double felt = (m.x[2] - start) * q->per_step + noise, a = m.felt, v = m.felt_rate;
    m.felt = q->sensor_flow[0][0] * a + q->sensor_flow[0][1] * v + q->sensor_flow[0][2] * felt;
    m.felt_rate = q->sensor_flow[1][0] * a + q->sensor_flow[1][1] * v + q->sensor_flow[1][2] * felt;
}

static inline double quantised(double voltage, double bits, double range) {
    const double unit = 2.0 * range * exp2(-bits);
    return limited(rint(voltage / unit), -range / unit, range / unit - 1.0) * unit;
}

static inline double wrapped(double count) {
    return count - p.counter_range * floor(count / p.counter_range);
}

typedef struct {
    double count, tacho, acceleration, current;
} readings;

/* A tick of the machine, and its readings at the end. */
static readings machine_tick(double servo, double amplifier, double preload, const double n[6]) {
    servo = quantised(servo, p.output_bits, p.output_range);
    amplifier = quantised(amplifier, p.output_bits, p.output_range);
    const double noise = noise_share * n[0];
    if (in_large > 1 && steady(servo, amplifier)) {
        for (int step = 0; step < in_tick; step += in_large) {
            machine_step(&large, servo, amplifier, preload, noise);
        }
    } else {
        for (int step = 0; step < in_tick; ++step) {
            machine_step(&small, servo, amplifier, preload, noise);
        }
    }
    const double per_angle = p.counts / (2.0 * M_PI);
    const double revolution = floor((m.angle - p.index_angle) / (2.0 * M_PI));
    if (m.running && revolution != m.revolution) {
        const double edge = fmax(revolution, m.revolution);
        m.latch = wrapped(floor(p.index_angle * per_angle) + edge * p.counts);
    }
    m.revolution = revolution;
    m.running = 1;
    const double unit = 2.0 * p.input_range * exp2(-p.input_bits), step = p.input_noise * unit;
    const double shown = limited(m.felt + p.acceleration_offset, -p.acceleration_range, p.acceleration_range);
    const double current = limited(m.x[3] + p.current_offset + p.current_noise * n[2], -p.current_range, p.current_range);
    return (readings){
        .count = wrapped(floor(m.angle * per_angle)),
        .tacho = quantised(m.tacho + p.tacho_noise * n[1] + n[3] * step, p.input_bits, p.input_range),
        .acceleration = quantised(shown * p.acceleration_sensitivity + n[4] * step, p.input_bits, p.input_range),
        .current = quantised(current * p.current_sensitivity + n[5] * step, p.input_bits, p.input_range),
    };
}

/* e^(A h) of n rows by scaling, series and squaring. */
static void exponential(int n, const double *a, double time, double *e) {
    double power[100], next[100];
    for (int i = 0; i < n * n; ++i) {
        e[i] = power[i] = i % (n + 1) == 0 ? 1.0 : 0.0;
    }
    for (int k = 1; k < 16; ++k) {
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                double sum = 0.0;
                for (int l = 0; l < n; ++l) {
                    sum += power[i * n + l] * a[l * n + j];
                }
                next[i * n + j] = sum * (time / 1024.0 / k);
            }
        }
        memcpy(power, next, sizeof power);
        for (int i = 0; i < n * n; ++i) {
            e[i] += power[i];
        }
    }
    for (int squaring = 0; squaring < 10; ++squaring) {
        for (int i = 0; i < n; ++i) {
            for (int j = 0; j < n; ++j) {
                double sum = 0.0;
                for (int l = 0; l < n; ++l) {
                    sum += e[i * n + l] * e[l * n + j];
                }
                next[i * n + j] = sum;
            }
        }
        memcpy(e, next, sizeof next);
    }
}

static contact prepared(const contact_parameters *c) {
    return (contact){ c->kinetic, c->breakaway - c->kinetic, 1.0 / c->stribeck_velocity, c->viscous, c->stiffness,
        1.0 / c->stiffness, c->damping, 1.0 / c->damping_velocity, c->elastic_fraction * c->breakaway };
}

static void prepare_step(stride *q, double h, const double a[10][10]) {
    double e[100];
    q->h = h;
    q->per_motor = h / p.motor_inertia;
    q->per_load = h / p.load_inertia;
    q->per_step = p.lead / (2.0 * M_PI * h);
    exponential(10, &a[0][0], 0.5 * h, e);
    for (int column = 0; column < COLUMNS; ++column) {
        for (int row = 0; row < 5; ++row) {
            q->flow[column][row] = e[10 * row + column];
        }
        q->flow[column][5] = e[90 + column];
    }
    const double w = 2.0 * M_PI * p.acceleration_bandwidth;
    const double sensor[3][3] = { { 0, 1 }, { -w * w, -2.0 * p.acceleration_damping * w, w * w } };
    exponential(3, &sensor[0][0], h, e);
    memcpy(q->sensor_flow, e, sizeof q->sensor_flow);
    q->tacho_share = 1.0 - exp(-2.0 * M_PI * p.tacho_bandwidth * h);
}

static void prepare(void) {
    tick_time = 1.0 / p.tick_rate;
    in_tick = (int)p.steps;
    for (in_large = 5; in_tick % in_large != 0; --in_large) {
    }
    per_volt = p.motor_constant / p.motor_resistance;
    noise_share = p.acceleration_noise_density * sqrt(0.5 * p.tick_rate);
    brushes = prepared(&p.brushes);
    screw = prepared(&p.screw);
    wheel = prepared(&p.wheel);
    const double c = p.coupling_stiffness, d = p.coupling_damping, jm = p.motor_inertia, jl = p.load_inertia;
    const double a[10][10] = {
        { 0, 1, -1 },
        { -c / jm, -d / jm, d / jm, 0, 1 / jm, -1 / jm },
        { c / jl, d / jl, -d / jl, -p.load_constant / jl, 0, 0, -1 / jl },
        { 0, 0, p.load_constant / p.load_inductance, -p.load_resistance / p.load_inductance, 0, 0, 0,
            1 / p.load_inductance },
        { 0, 0, 0, 0, -1 / p.servo_lag, 0, 0, 0, 1 / p.servo_lag },
        [9] = { 0, 0, 1 },
    };
    prepare_step(&small, tick_time / p.steps, a);
    prepare_step(&large, tick_time / p.steps * in_large, a);
    large.ramp = 1.0 / large.tacho_share - 1.0 / (2.0 * M_PI * p.tacho_bandwidth * large.h) - 0.5;
    double e[100];
    exponential(10, &a[0][0], tick_time, e);
    for (int column = 0; column < COLUMNS; ++column) {
        change[column][0] = e[10 + column] - (column == 1);
        change[column][1] = e[20 + column] - (column == 2);
    }
}

#endif
