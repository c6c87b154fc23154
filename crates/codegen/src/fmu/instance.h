/* Common part of both versions of FMI: an instance and its functions. Written by stickslip.
 *
 * An instance takes steps of FMU_STEP [s], each with the inputs at its end; communication steps may be of any length.
 * Steps are counted by the lengths of the communication steps. The importer's time has rounding errors that accumulate
 * where it adds up steps; it serves only to detect a skipped or repeated communication step.
 * Refused calls are reported to the logger of the importer, and change nothing. */
#ifndef FMU_INSTANCE_H
#define FMU_INSTANCE_H

#if !defined(_POSIX_C_SOURCE)
#define _POSIX_C_SOURCE 200809L
#endif

#include <fenv.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Role of a variable for the importer. */
typedef enum { FMU_INPUT, FMU_OUTPUT, FMU_PARAMETER, FMU_STATE } fmu_kind;

typedef struct {
    size_t offset;
    fmu_kind kind;
    const char *name;
} fmu_variable;

#include "model.h"

#if defined(_WIN32)
#define FMU_EXPORT __declspec(dllexport)
#else
#define FMU_EXPORT __attribute__((visibility("default")))
#endif

/* Phases of an instance. */
typedef enum { FMU_INSTANTIATED, FMU_INITIALIZING, FMU_STEPPING, FMU_TERMINATED, FMU_FAILED } fmu_phase;

/* All that a step depends on; it is saved and restored. */
typedef struct {
    fmu_model model;
    /* Start time [s], and number of steps. */
    double start;
    uint64_t steps;
    /* Requested part of the next step [steps], and the importer's time at the end of its last request [s]. */
    double part, end;
    fmu_phase phase;
    /* Whether parameters were set that are not checked yet. */
    int unchecked;
} fmu_memory;

#if defined(FMU_XCP)
#include "xcp.h"
#endif

typedef struct {
    fmu_memory memory;
#if defined(FMU_XCP)
    xcp_options options;
    /* Whether the options may be set (FMI 3.0). */
    int configuring;
    xcp_service *service;
#endif
    void (*report)(const void *importer, const char *name, int serious, const char *message);
    void *importer;
    void *callback;
    char name[];
} fmu_instance;

/* Reports a fault to the importer. */
static int fmu_refuse(const fmu_instance *instance, const char *format, ...) {
    char message[512];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    instance->report(instance, instance->name, 1, message);
    return 0;
}

#if defined(FMU_XCP)
#include "service.h"
#else
/* Only the importer accesses the model. */
#define fmu_lock(instance) 1
#define fmu_unlock(instance, done) (done)
#define fmu_stepped(instance) ((void)0)
#define fmu_serve(instance, must) 1
#define fmu_silence(instance) ((void)0)
#define fmu_service_defaults(instance) ((void)0)
#endif

static fmu_instance *fmu_new(const char *name) {
    const char *known = (name != NULL) ? name : "";
    const size_t length = strlen(known) + 1U;
    fmu_instance *instance = calloc(1, sizeof *instance + length);
    if (instance != NULL) {
        (void)memcpy(instance->name, known, length);
        fmu_start(&instance->memory.model);
        fmu_service_defaults(instance);
    }
    return instance;
}

static void fmu_free(fmu_instance *instance) {
    if (instance != NULL) {
        fmu_silence(instance);
        free(instance);
    }
}

static void fmu_reset(fmu_instance *instance) {
    fmu_silence(instance);
    fmu_service_defaults(instance);
    (void)memset(&instance->memory, 0, sizeof instance->memory);
    fmu_start(&instance->memory.model);
}

/* The end of the last step [s]. */
static double fmu_time(const fmu_instance *instance) {
    return instance->memory.start + (double)instance->memory.steps * FMU_STEP;
}

/* The number of a reference; NULL, with a message, if there is none. */
static double *fmu_number(fmu_instance *instance, uint32_t reference) {
    if ((reference < 1U) || (reference > FMU_COUNT)) {
        (void)fmu_refuse(instance, "There is no variable of value reference %lu: valid are 1 to %lu.",
                         (unsigned long)reference, (unsigned long)FMU_COUNT);
        return NULL;
    }
    return (double *)(void *)((char *)&instance->memory.model + FMU_VARIABLES[reference - 1U].offset);
}

static int fmu_get(fmu_instance *instance, const uint32_t *references, size_t count, double *values) {
    size_t k;
    for (k = 0; k < count; k++) {
        if (references[k] == 0U) {
            values[k] = fmu_time(instance);
        } else {
            const double *number = fmu_number(instance, references[k]);
            if (number == NULL) {
                return 0;
            }
            values[k] = *number;
        }
    }
    return 1;
}

/* Whether a variable may be set now to this value. */
static int fmu_may_set(const fmu_instance *instance, const fmu_variable *variable, double value) {
    const fmu_phase phase = instance->memory.phase;
    if (!isfinite(value)) {
        return fmu_refuse(instance, "%s = %g is not finite.", variable->name, value);
    }
    if ((variable->kind == FMU_OUTPUT) || ((variable->kind == FMU_STATE) && (phase > FMU_INITIALIZING))) {
        return fmu_refuse(instance, "%s is computed and cannot be set%s.", variable->name,
                          (variable->kind == FMU_OUTPUT) ? "" : " after initialization ends");
    }
    if (phase > FMU_STEPPING) {
        return fmu_refuse(instance, "%s cannot be set after the end of the simulation: reset the instance.",
                          variable->name);
    }
    return 1;
}

/* Sets all of them, or none. */
static int fmu_set(fmu_instance *instance, const uint32_t *references, size_t count, const double *values) {
    size_t k;
    for (k = 0; k < count; k++) {
        const double *number = fmu_number(instance, references[k]);
        if ((number == NULL) || !fmu_may_set(instance, &FMU_VARIABLES[references[k] - 1U], values[k])) {
            return 0;
        }
    }
    for (k = 0; k < count; k++) {
        *fmu_number(instance, references[k]) = values[k];
        instance->memory.unchecked |= (FMU_VARIABLES[references[k] - 1U].kind == FMU_PARAMETER);
    }
    return 1;
}

/* Checks the parameters once after they were set. */
static int fmu_checked(fmu_instance *instance) {
    if (instance->memory.unchecked) {
        const char *fault = fmu_check(&instance->memory.model);
        if (fault != NULL) {
            return fmu_refuse(instance, "%s", fault);
        }
        instance->memory.unchecked = 0;
    }
    return 1;
}

static int fmu_begin(fmu_instance *instance, double start) {
    if (!isfinite(start)) {
        return fmu_refuse(instance, "The simulation cannot start at %g s.", start);
    }
    instance->memory.start = start;
    instance->memory.end = start;
    return 1;
}

/* From one phase to the next. */
static int fmu_enter(fmu_instance *instance, const char *what, fmu_phase from, fmu_phase to) {
    if (instance->memory.phase != from) {
        return fmu_refuse(instance, "%s is not possible now.", what);
    }
    instance->memory.phase = to;
    return 1;
}

/* The slope of each number after one step from here along a direction of parameters, state and inputs: the
 * numbers `by` change by `seed`, all others are constant. */
static int fmu_derivative(fmu_instance *instance, const uint32_t *of, size_t n_of, const uint32_t *by, size_t n_by,
                          const double *seed, double *sensitivity) {
    const fmu_model *model = &instance->memory.model;
    /* The direction as one row of numbers, like the model; then the results of a step. */
    double direction[sizeof(fmu_model) / sizeof(double)] = {0.0};
    double values[FMU_STATES + FMU_OUTPUTS + 1U], slopes[FMU_STATES + FMU_OUTPUTS + 1U];
    const double *numbers = (const double *)(const void *)model;
    size_t k;
    for (k = 0; k < n_by; k++) {
        if (fmu_number(instance, by[k]) == NULL) {
            return 0;
        }
        if (FMU_VARIABLES[by[k] - 1U].kind == FMU_OUTPUT) {
            return fmu_refuse(instance, "No derivative with respect to %s: it is an output.",
                              FMU_VARIABLES[by[k] - 1U].name);
        }
        direction[FMU_VARIABLES[by[k] - 1U].offset / sizeof(double)] += seed[k];
    }
    for (k = 0; k < n_of; k++) {
        if (fmu_number(instance, of[k]) == NULL) {
            return 0;
        }
        if ((FMU_VARIABLES[of[k] - 1U].kind != FMU_OUTPUT) && (FMU_VARIABLES[of[k] - 1U].kind != FMU_STATE)) {
            return fmu_refuse(instance, "%s has no derivatives: it is not computed.", FMU_VARIABLES[of[k] - 1U].name);
        }
    }
    fmu_tangent(numbers, direction, numbers + FMU_PARAMETERS, direction + FMU_PARAMETERS,
                numbers + FMU_PARAMETERS + FMU_STATES, direction + FMU_PARAMETERS + FMU_STATES, FMU_STEP, values, slopes,
                values + FMU_STATES, slopes + FMU_STATES);
    for (k = 0; k < n_of; k++) {
        const size_t number = (FMU_VARIABLES[of[k] - 1U].offset / sizeof(double)) - FMU_PARAMETERS;
        /* Outputs are after the inputs in the model, and after the states in the results. */
        const double slope = slopes[(FMU_VARIABLES[of[k] - 1U].kind == FMU_STATE) ? number : (number - FMU_INPUTS)];
        if (!isfinite(slope)) {
            return fmu_refuse(instance, "%s has no finite slope here.", FMU_VARIABLES[of[k] - 1U].name);
        }
        sensitivity[k] = slope;
    }
    return 1;
}

/* The steps of `length` [s] from `point` [s] on; the phase is `FMU_FAILED` if one cannot be computed. */
static int fmu_do_step(fmu_instance *instance, double point, double length) {
    fmu_memory *memory = &instance->memory;
    /* The difference of two times may stand for their length: its rounding error, which does not accumulate. */
    const double rounding = 8.0 * DBL_EPSILON * fabs(point);
    const double requested = memory->part + length / FMU_STEP;
    const double slack = 1e-3 + rounding / FMU_STEP;
    const double due = floor(requested + ((slack < 0.25) ? slack : 0.25));
    double left;
    fenv_t caller;
    if (memory->phase != FMU_STEPPING) {
        return fmu_refuse(instance, "A step is possible only between initialization and the end of the simulation.");
    }
    if (!isfinite(point) || !isfinite(length) || !(length > 0.0)) {
        return fmu_refuse(instance, "A step of %g s from %g s is not valid.", length, point);
    }
    if (fabs(point - memory->end) > 0.5 * FMU_STEP + rounding) {
        return fmu_refuse(instance, "The step begins at %.17g s, but the instance is at %.17g s.", point, memory->end);
    }
    if (due > 1e12) {
        return fmu_refuse(instance, "A step of %g s is more than 1e12 steps of %g s.", length, FMU_STEP);
    }
    if (!(fmu_lock(instance) && fmu_unlock(instance, fmu_checked(instance)))) {
        return 0;
    }
    /* The arithmetic of the model: to nearest, with subnormal numbers, independent of the importer's settings. */
    (void)fegetenv(&caller);
    (void)fesetenv(FE_DFL_ENV);
    for (left = due; (left > 0.0) && (memory->phase == FMU_STEPPING); left -= 1.0) {
        (void)fmu_lock(instance);
        if (fmu_step(&memory->model) == 0) {
            memory->steps++;
            fmu_stepped(instance);
        } else {
            memory->phase = FMU_FAILED;
        }
        (void)fmu_unlock(instance, 1);
    }
    (void)fesetenv(&caller);
    if (memory->phase != FMU_STEPPING) {
        return fmu_refuse(instance, "The step from %.17g s cannot be computed: a result would not be finite.", fmu_time(instance));
    }
    memory->part = requested - due;
    memory->end = point + length;
    return 1;
}

/* A saved memory begins with the token of its model. */
#define FMU_SAVED (sizeof FMU_TOKEN + sizeof(fmu_memory))

static void fmu_save(fmu_instance *instance, unsigned char *into) {
    (void)memcpy(into, FMU_TOKEN, sizeof FMU_TOKEN);
    (void)fmu_lock(instance);
    (void)memcpy(into + sizeof FMU_TOKEN, &instance->memory, sizeof instance->memory);
    (void)fmu_unlock(instance, 1);
}

static int fmu_saved(const fmu_instance *instance, const unsigned char *saved, size_t size) {
    if ((saved == NULL) || (size != FMU_SAVED) || (memcmp(saved, FMU_TOKEN, sizeof FMU_TOKEN) != 0)) {
        return fmu_refuse(instance, "The state to restore was not saved by this model.");
    }
    return 1;
}

static void fmu_restore(fmu_instance *instance, const unsigned char *saved) {
    (void)fmu_lock(instance);
    (void)memcpy(&instance->memory, saved + sizeof FMU_TOKEN, sizeof instance->memory);
    (void)fmu_unlock(instance, 1);
}

#endif /* FMU_INSTANCE_H */
