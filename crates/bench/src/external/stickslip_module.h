/*
 * A position controller, a friction or a rendering law of your own for stickslip: a shared library with the five
 * functions at the end of this file, in C or with C linkage. SI units; angles and torques are those of the screw. No
 * function may be called by two threads at once.
 *
 *     cc -O2 -shared -fPIC -o my_controller.so my_controller.c
 *     stickslip load my_controller.so
 *     stickslip load my_friction.so --as friction
 *
 * A controller has a sample every millisecond or as bench.control_divider says; its torque is the drive's. A friction and
 * a law have one in every tick; their torque is the load motor's, against positive motion as friction is.
 */
#ifndef STICKSLIP_MODULE_H
#define STICKSLIP_MODULE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The version of what stands here. */
#define STICKSLIP_MODULE_ABI 1u

/* A number that may be changed while it runs. Texts are UTF-8 and live as long as the library. */
typedef struct {
    const char *name; /* lower-case letters, digits and _, once in a library */
    const char *unit; /* such as "N m s/rad"; "1" where it has none */
    const char *help; /* what it is, in a sentence */
    double minimum;
    double maximum;
    double initial;
} stickslip_parameter;

/* What a library is. */
typedef struct {
    uint32_t abi; /* STICKSLIP_MODULE_ABI */
    uint32_t parameter_count;
    const char *name;
    const stickslip_parameter *parameters; /* parameter_count of them */
} stickslip_description;

/*
 * What is read in a sample. It only ever grows at its end: a library that was compiled with less of it reads what it
 * knows.
 */
typedef struct {
    double time;                   /* since its begin [s] */
    double reference_position;     /* wanted angle [rad] */
    double reference_velocity;     /* its first derivative [rad/s] */
    double reference_acceleration; /* its second derivative [rad/s^2] */
    double measured_angle;         /* by the encoder, unwrapped [rad] */
    double measured_velocity;      /* of the motor, by the tacho [rad/s] */
    /* What follows is 0 for a controller. */
    double estimated_velocity;   /* of the screw, by the observer of the bench [rad/s] */
    double measured_load_torque; /* of the load motor by its current, against positive motion [N m] */
    double commanded_torque;     /* asked of the drive in the tick before [N m] */
} stickslip_sample;

/* Tells what the library is; may be called before everything else, and again. */
const stickslip_description *stickslip_describe(void);

/*
 * Begins at rest: time from sample to sample [s], largest torque of its motor [N m], a value of each parameter. NULL
 * refuses them.
 */
void *stickslip_begin(double sample_time, double torque_limit, const double *parameters);

/* Takes other values of all parameters, between two samples. Not 0 refuses them: the last ones stay. */
int32_t stickslip_set(void *controller, const double *parameters);

/*
 * One sample: the torque [N m], which comes into force a sample later and is limited by the bench. Not 0 is a failure:
 * the bench stops.
 */
int32_t stickslip_step(void *controller, const stickslip_sample *sample, double *torque);

/* Ends it and frees what it has. */
void stickslip_end(void *controller);

#ifdef __cplusplus
}
#endif

#endif
