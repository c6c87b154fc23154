/* The software of the bench. */
#ifndef SOFTWARE_H
#define SOFTWARE_H

#include "machine.h"

#include <stdint.h>

static struct {
    double count, position, angle, velocity, offset, current_integral, integral, computed, commanded, bump, difference;
    double servo, amplifier, measured, motor_velocity;
    command reference;
    int started, swapped;
} s;

static inline double stribeck(const curve *c, double speed) {
    return c->kinetic + (c->breakaway - c->kinetic) * exp(-speed / c->stribeck_velocity) + c->viscous * speed;
}

static inline int may_integrate(double demand, double increment, double limit) {
    return fabs(demand) <= limit || demand * increment <= 0.0;
}

/* Torque of the cascade without its integral part, and the deviation of the velocity. */
static inline double without_integral(const segment *g, double *deviation) {
    *deviation = g->position_gain * (s.reference.position - s.measured) + s.reference.velocity - s.motor_velocity;
    return g->velocity_gain * *deviation + g->inertia * s.reference.acceleration;
}

/* A tick of the software. */
static signals software_tick(const readings *r, const segment *g, const command *c, uint64_t tick) {
    const double moved = s.started ? r->count - s.count : 0.0;
    s.position += moved - p.counter_range * rint(moved / p.counter_range);
    s.count = r->count;
    const double angle = s.position * (2.0 * M_PI / p.counts), motor_velocity = r->tacho / p.tacho_scaling;
    const double current = r->current / p.current_scaling;
    /* Without control the set-point is the last measured position. */
    s.reference = c->control != 0.0 ? *c : (command){ .position = s.measured };
    s.measured = angle;
    s.motor_velocity = motor_velocity;

    if (!s.started) {
        s.angle = angle;
        s.started = 1;
    }
    const double deviation = angle - s.angle, corrected = s.angle + p.angle_gain * deviation;
    const double velocity = s.velocity + p.velocity_gain * deviation;
    s.offset += p.offset_gain * deviation;
    const double gained = tick_time * p.screw_ratio * (r->acceleration / p.acceleration_scaling - s.offset);
    s.angle = corrected + tick_time * (velocity + 0.5 * gained);
    s.velocity = velocity + gained;

    const uint64_t ticks = (uint64_t)g->control_ticks, phase = tick % ticks;
    if (phase == 0) {
        double wanted;
        const double direct = without_integral(g, &wanted);
        if (c->control != 0.0) {
            const double demand = direct + s.integral, increment = g->integral_gain * wanted * (double)ticks * tick_time;
            s.computed = limited(demand, -g->torque_limit, g->torque_limit);
            if (may_integrate(demand, increment, g->torque_limit)) {
                s.integral += increment;
            }
        } else {
            s.computed = 0.0;
            s.integral = -direct;
        }
    }
    if (phase == ticks - 1) {
        s.commanded = s.computed;
    }
    s.servo = limited((s.commanded + c->added_torque) / p.torque_per_volt, -p.servo_limit, p.servo_limit);

    const double speed = fabs(velocity);
    double difference = 0.0;
    if (speed > g->fade_velocity) {
        difference = limited(stribeck(&g->desired, speed) - stribeck(&g->own, speed), -g->law_limit, g->law_limit);
        difference = copysign(difference, difference * velocity);
    }
    s.bump = s.swapped ? s.difference - difference : s.bump * (1.0 - tick_time / 20e-3);
    s.swapped = 0;
    difference = c->render != 0.0 ? difference + s.bump : 0.0;
    s.difference = difference;
    const double limit = fmin(g->voltage_limit, g->gain * g->converter_limit);
    const double apart = limited(difference / g->torque_constant, -g->current_limit, g->current_limit) - current;
    const double demand = g->current_gain * apart + g->resistance * current + s.current_integral
        - g->torque_constant * velocity;
    const double increment = g->current_integral_gain * apart * tick_time;
    if (may_integrate(demand, increment, limit)) {
        s.current_integral += increment;
    }
    s.amplifier = limited(demand, -limit, limit) / g->gain;
    return (signals){ angle, velocity, s.servo * p.torque_per_volt, difference };
}

/* A new controller takes over the torque, by the inputs of the last tick. */
static void take_over(const segment *g) {
    double wanted;
    s.integral = limited(s.commanded, -g->torque_limit, g->torque_limit) - without_integral(g, &wanted);
}

#endif
