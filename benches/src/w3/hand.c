/* The tick of the paper's load-motor control in hand-written C: three-state observer, difference of two Stribeck curves,
 * PI current control, P-PI cascade. Structs, libm, branches. Inputs are not checked, unless CHECKED is defined: then
 * outputs and states are always finite, as in the generated code. */
#include "hand.h"

#include <math.h>

static double limited(double value, double limit) {
    return value > limit ? limit : value < -limit ? -limit : value;
}

static double stribeck(const hand_curve *c, double speed) {
    return c->kinetic + (c->breakaway - c->kinetic) * exp(-speed / c->stribeck_velocity) + c->viscous * speed;
}

static double observe(const hand_parameters *p, hand_state *s, double angle, double acceleration, double dt) {
    if (!s->started) {
        s->angle = angle;
        s->started = 1;
    }
    const double deviation = angle - s->angle;
    const double corrected = s->angle + p->angle_gain * deviation;
    const double velocity = s->velocity + p->observer_gain * deviation;
    s->offset += p->offset_gain * deviation;
    const double gained = dt * p->screw_ratio * (acceleration - s->offset);
    s->angle = corrected + dt * (velocity + 0.5 * gained);
    s->velocity = velocity + gained;
    return velocity;
}

static double difference_torque(const hand_parameters *p, double velocity) {
    const double speed = fabs(velocity);
    if (speed <= p->fade_velocity) {
        return 0.0;
    }
    const double torque = limited(stribeck(&p->desired, speed) - stribeck(&p->own, speed), p->torque_limit);
    return velocity < 0.0 ? -torque : torque;
}

static double control_current(const hand_parameters *p, hand_state *s, double wanted, double measured,
    double velocity, double dt) {
    const double limit = p->voltage_limit < p->amplifier_gain * p->converter_limit
        ? p->voltage_limit : p->amplifier_gain * p->converter_limit;
    const double deviation = limited(wanted, p->current_limit) - measured;
    const double demand = p->current_gain * deviation + p->resistance * measured + s->current_integral
        - p->torque_constant * velocity;
    const double increment = p->current_integral_gain * deviation * dt;
    if (fabs(demand) <= limit || demand * increment <= 0.0) {
        s->current_integral += increment;
    }
    return limited(demand, limit) / p->amplifier_gain;
}

static double control_position(const hand_parameters *p, hand_state *s, const hand_input *in, double dt) {
    const double wanted = p->position_gain * (in->reference_position - in->measured_angle) + in->reference_velocity;
    const double deviation = wanted - in->measured_velocity;
    const double demand = p->velocity_gain * deviation + p->inertia * in->reference_acceleration + s->integral;
    const double increment = p->integral_gain * deviation * dt;
    if (fabs(demand) <= p->drive_limit || demand * increment <= 0.0) {
        s->integral += increment;
    }
    return limited(demand, p->drive_limit);
}

static void step(const hand_parameters *p, hand_state *s, const hand_input *in, double dt, hand_output *out) {
    const double velocity = observe(p, s, in->measured_angle, in->acceleration, dt);
    const double wanted = difference_torque(p, velocity) / p->torque_constant;
    out->amplifier_voltage = control_current(p, s, wanted, in->current, velocity, dt);
    out->torque = control_position(p, s, in, dt);
}

#ifndef CHECKED

int hand_step(const hand_parameters *p, hand_state *s, const hand_input *in, double dt, hand_output *out) {
    step(p, s, in, dt, out);
    return 0;
}

#else

/* Replaces non-finite inputs: the observer continues its prediction, the current counts as 0, the position torque is 0. */
int hand_step(const hand_parameters *p, hand_state *s, const hand_input *in, double dt, hand_output *out) {
    const hand_state before = *s;
    hand_input checked = *in;
    const int position = isfinite(in->reference_position) && isfinite(in->reference_velocity)
        && isfinite(in->reference_acceleration) && isfinite(in->measured_angle) && isfinite(in->measured_velocity);
    const int others = isfinite(in->acceleration) && isfinite(in->current);
    if (!(position && others)) {
        checked.measured_angle = isfinite(in->measured_angle) ? in->measured_angle : s->angle;
        checked.acceleration = isfinite(in->acceleration) ? in->acceleration : s->offset;
        checked.current = isfinite(in->current) ? in->current : 0.0;
    }
    step(p, s, &checked, dt, out);
    if (!position) {
        out->torque = 0.0;
        s->integral = before.integral;
    }
    if (!(isfinite(dt) && dt > 0.0 && isfinite(s->angle) && isfinite(s->velocity) && isfinite(s->offset)
        && isfinite(s->current_integral) && isfinite(s->integral) && isfinite(out->amplifier_voltage)
        && isfinite(out->torque))) {
        *s = before;
        out->amplifier_voltage = 0.0;
        out->torque = 0.0;
        return 2;
    }
    return position && others ? 0 : 1;
}

#endif
