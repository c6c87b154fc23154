/* See hand.c. SI units; the order of the members is that of the numbers from the benchmark. */
#ifndef HAND_H
#define HAND_H

typedef struct {
    double breakaway, kinetic, stribeck_velocity, viscous;
} hand_curve;

typedef struct {
    double screw_ratio, angle_gain, observer_gain, offset_gain;
    hand_curve desired, own;
    double fade_velocity, torque_limit;
    double current_gain, current_integral_gain, resistance, torque_constant, current_limit, voltage_limit, amplifier_gain,
        converter_limit;
    double position_gain, velocity_gain, integral_gain, inertia, drive_limit;
} hand_parameters;

typedef struct {
    double angle, velocity, offset, current_integral, integral;
    int started;
} hand_state;

typedef struct {
    double reference_position, reference_velocity, reference_acceleration, measured_angle, measured_velocity;
    /* For friction compensation, which this tick does not have. */
    double added_torque, integrates, forgotten;
    double acceleration, current;
} hand_input;

typedef struct {
    double amplifier_voltage, torque;
} hand_output;

/* Returns 0; 1 if an input is non-finite; 2 if the step was not taken. Always 0 unless CHECKED is defined. */
int hand_step(const hand_parameters *p, hand_state *s, const hand_input *in, double dt, hand_output *out);

#endif
