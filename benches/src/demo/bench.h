/* See bench.c. SI units; the order of the members is that of the numbers from the benchmark. */
#ifndef BENCH_H
#define BENCH_H

typedef struct {
    double breakaway, kinetic, stribeck_velocity, viscous, stiffness, damping, damping_velocity, elastic_fraction;
} contact_parameters;

typedef struct {
    double tick_rate, steps, start_angle;
    double motor_inertia, load_inertia, coupling_stiffness, coupling_damping, lead;
    double motor_constant, motor_resistance;
    double servo_torque_per_volt, servo_input_limit, servo_lag, servo_torque_limit, servo_supply;
    double load_constant, load_resistance, load_inductance;
    double amplifier_gain, amplifier_supply, amplifier_current_limit;
    contact_parameters brushes, screw, wheel;
    double counts, counter_range, index_angle;
    double tacho_constant, tacho_ripple, tacho_periods, tacho_bandwidth, tacho_noise;
    double acceleration_sensitivity, acceleration_offset, acceleration_noise_density, acceleration_bandwidth,
        acceleration_damping, acceleration_range;
    double current_sensitivity, current_offset, current_noise, current_range;
    double input_bits, input_range, input_noise, output_bits, output_range;
    /* Of the software. */
    double tacho_scaling, acceleration_scaling, current_scaling, torque_per_volt, servo_limit;
    double screw_ratio, angle_gain, velocity_gain, offset_gain;
} parameters;

typedef struct {
    double breakaway, kinetic, stribeck_velocity, viscous;
} curve;

/* Parameters that are active from a tick on. */
typedef struct {
    double first_tick, preload;
    double position_gain, velocity_gain, integral_gain, inertia, torque_limit, control_ticks;
    curve desired, own;
    double fade_velocity, law_limit;
    double current_gain, current_integral_gain, resistance, torque_constant, current_limit, voltage_limit, gain,
        converter_limit;
} segment;

/* Command of a tick. */
typedef struct {
    double position, velocity, acceleration, added_torque, control, render;
} command;

/* Signals of a tick that are compared. */
typedef struct {
    double angle, velocity, torque, difference_torque;
} signals;

#endif
