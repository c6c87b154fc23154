/*
 * Interface of an external position controller, friction or rendering law for stickslip: a shared library with the five
 * functions at the end of this file, in C or with C linkage. SI units; angles and torques refer to the screw. The
 * functions are never called by two threads at once.
 *
 *     cc -O2 -shared -fPIC -o my_controller.so my_controller.c
 *     stickslip load my_controller.so
 *     stickslip load my_friction.so --as friction
 *
 * A controller has one sample every bench.control_divider ticks (default: 1 ms); its torque is that of the drive. A
 * friction or law has one sample in every tick; its torque is that of the load motor, against positive motion, as for
 * friction.
 */
#ifndef STICKSLIP_MODULE_H
#define STICKSLIP_MODULE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this interface. */
#define STICKSLIP_MODULE_ABI 1u

/* A parameter, adjustable while the library runs. Texts are UTF-8 and valid as long as the library is loaded. */
typedef struct {
    const char *name; /* lower-case letters, digits and _; unique in the library */
    const char *unit; /* such as "N m s/rad"; "1" if dimensionless */
    const char *help; /* meaning, in one sentence */
    double minimum;
    double maximum;
    double initial;
} stickslip_parameter;

/* Description of a library. */
typedef struct {
    uint32_t abi; /* STICKSLIP_MODULE_ABI */
    uint32_t parameter_count;
    const char *name;
    const stickslip_parameter *parameters; /* array of parameter_count elements */
} stickslip_description;

/*
 * Inputs of a sample. Later versions only append members: a library compiled with fewer members reads those that it
 * knows.
 */
typedef struct {
    double time;                   /* time since the start [s] */
    double reference_position;     /* reference angle [rad] */
    double reference_velocity;     /* first derivative of the reference angle [rad/s] */
    double reference_acceleration; /* second derivative of the reference angle [rad/s^2] */
    double measured_angle;         /* angle from the encoder, unwrapped [rad] */
    double measured_velocity;      /* motor velocity from the tacho [rad/s] */
    /* The following members are 0 for a controller. */
    double estimated_velocity;   /* screw velocity from the observer of the bench [rad/s] */
    double measured_load_torque; /* load motor torque from its current, against positive motion [N m] */
    double commanded_torque;     /* torque command of the drive in the previous tick [N m] */
} stickslip_sample;

/* Returns the description of the library; may be called first, and repeatedly. */
const stickslip_description *stickslip_describe(void);

/*
 * Starts at rest: sampling time [s], maximum torque of its motor [N m], one value for each parameter. Returns NULL to
 * refuse these values.
 */
void *stickslip_begin(double sample_time, double torque_limit, const double *parameters);

/* Sets all parameters, between two samples. Returns 0, or another value to refuse them and keep the previous ones. */
int32_t stickslip_set(void *controller, const double *parameters);

/*
 * One sample: writes the torque [N m], which becomes active one sample later and is limited by the bench. Returns 0, or
 * another value for a failure: the bench then stops.
 */
int32_t stickslip_step(void *controller, const stickslip_sample *sample, double *torque);

/* Ends the controller and frees its memory. */
void stickslip_end(void *controller);

#ifdef __cplusplus
}
#endif

#endif
