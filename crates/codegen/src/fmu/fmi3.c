/* FMI 3.0 for co-simulation. Written by stickslip. */
#include "instance.h"

#include <stdbool.h>

typedef void *fmi3Instance;
typedef void *fmi3InstanceEnvironment;
typedef void *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef bool fmi3Boolean;
typedef uint8_t fmi3Byte;
typedef char fmi3Char;
typedef const fmi3Char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef bool fmi3Clock;
typedef double fmi3Float64;
typedef float fmi3Float32;

typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum { fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent } fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;

typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)(void);

/* A pointer to a function is not a pointer to an object: this union converts it. */
typedef union {
    fmi3LogMessageCallback function;
    void *object;
} callback;

static void report(const void *of, const char *name, int serious, const char *message) {
    const fmu_instance *instance = of;
    callback log;
    (void)name;
    log.object = instance->callback;
    if (log.object != NULL) {
        log.function(instance->importer, serious ? fmi3Error : fmi3OK, "logStatusError", message);
    }
}

#define FMI(Name) fmi3##Name
#define FMI_OK fmi3OK
#define FMI_ERROR fmi3Error
#define FMI_SIZE , size_t m
#define FMI_USE_SIZE (void)m
typedef fmi3Status fmi_status;
typedef fmi3Boolean fmi_boolean;
typedef fmi3String fmi_string;
typedef fmi3Byte fmi_byte;

/* FMI 3.0 spells them differently. */
#define fmi3GetFMUstate fmi3GetFMUState
#define fmi3SetFMUstate fmi3SetFMUState
#define fmi3FreeFMUstate fmi3FreeFMUState
#define fmi3SerializedFMUstateSize fmi3SerializedFMUStateSize
#define fmi3SerializeFMUstate fmi3SerializeFMUState
#define fmi3DeSerializeFMUstate fmi3DeserializeFMUState

#include "fmi.h"

FMU_EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

FMU_EXPORT fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                                    fmi3Boolean early_return, const fmi3ValueReference intermediate[],
                                                    size_t n, fmi3InstanceEnvironment environment,
                                                    fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update) {
    callback log;
    (void)resources;
    (void)visible;
    (void)logging;
    (void)events;
    (void)early_return;
    (void)intermediate;
    (void)n;
    (void)update;
    log.object = NULL;
    if (logger != NULL) {
        log.function = logger;
    }
    return fmi_new(name, token, environment, log.object, NULL);
}

/* The model is for co-simulation. */
FMU_EXPORT fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                     fmi3Boolean visible, fmi3Boolean logging,
                                                     fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger) {
    (void)name;
    (void)token;
    (void)resources;
    (void)visible;
    (void)logging;
    if (logger != NULL) {
        logger(environment, fmi3Error, "logStatusError", "The model is for co-simulation.");
    }
    return NULL;
}

FMU_EXPORT fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                          fmi3Boolean visible, fmi3Boolean logging,
                                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                                          fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                                          fmi3LockPreemptionCallback unlock) {
    (void)update;
    (void)lock;
    (void)unlock;
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, logger);
}

FMU_EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                                  fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    if ((c == NULL) || !fmu_serve(INSTANCE, 1)) {
        return fmi3Error;
    }
    return ANSWER(fmu_begin(INSTANCE, start) && fmu_enter(INSTANCE, "Initialization", FMU_INSTANTIATED, FMU_INITIALIZING));
}

FMU_EXPORT fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 values[], size_t n_values) {
    return ANSWER(((n == n_values) || fmu_refuse(INSTANCE, "%lu values for %lu variables, each of which is one number.",
                                                 (unsigned long)n_values, (unsigned long)n)) &&
                  fmu_get(INSTANCE, r, n, values));
}

FMU_EXPORT fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 values[],
                                     size_t n_values) {
    return ANSWER(((n == n_values) || fmu_refuse(INSTANCE, "%lu values for %lu variables, each of which is one number.",
                                                 (unsigned long)n_values, (unsigned long)n)) &&
                  fmu_set(INSTANCE, r, n, values));
}

NO_VARIABLES(Float32, fmi3Float32)
NO_VARIABLES(Int8, int8_t)
NO_VARIABLES(UInt8, uint8_t)
NO_VARIABLES(Int16, int16_t)
NO_VARIABLES(Int32, int32_t)
NO_VARIABLES(UInt32, uint32_t)
NO_VARIABLES(Int64, int64_t)
NO_VARIABLES(UInt64, uint64_t)
#if defined(FMU_XCP)
/* Options of the XCP service. */
OPTIONS(UInt16, uint16_t, XCP_TCP_PORT, 1, (uint16_t)door->port, fmu_set_port(INSTANCE, door, values[k]))
OPTIONS(Boolean, fmi3Boolean, XCP_TCP_ENABLE, 1, door->enable != 0, (door->enable = values[k], 1))
OPTIONS(String, fmi3String, XCP_TCP_ADDRESS, 1, door->address, fmu_set_address(INSTANCE, door, values[k]))

FMU_EXPORT fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    if ((c == NULL) || !fmu_may_configure(INSTANCE, 0)) {
        return fmi3Error;
    }
    INSTANCE->configuring = 1;
    return fmi3OK;
}

FMU_EXPORT fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    if ((c == NULL) || !fmu_may_configure(INSTANCE, 1)) {
        return fmi3Error;
    }
    INSTANCE->configuring = 0;
    return fmu_serve(INSTANCE, 1) ? fmi3OK : fmi3Error;
}
#else
NO_VARIABLES(UInt16, uint16_t)
NO_VARIABLES(Boolean, fmi3Boolean)
NO_VARIABLES(String, fmi3String)
#endif

FMU_EXPORT fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, size_t sizes[], fmi3Binary values[], size_t m) {
    (void)r;
    (void)sizes;
    (void)values;
    (void)m;
    return NONE_OF("variables of type Binary");
}

FMU_EXPORT fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference r[], size_t n, const size_t sizes[], const fmi3Binary values[], size_t m) {
    (void)r;
    (void)sizes;
    (void)values;
    (void)m;
    return NONE_OF("variables of type Binary");
}

FMU_EXPORT fmi3Status fmi3GetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Clock values[]) {
    (void)r;
    (void)values;
    return NONE_OF("clocks");
}

FMU_EXPORT fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Clock values[]) {
    (void)r;
    (void)values;
    return NONE_OF("clocks");
}

FMU_EXPORT fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 point, fmi3Float64 length, fmi3Boolean no_set_before,
                                 fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    int done;
    (void)no_set_before;
    if (c == NULL) {
        return fmi3Error;
    }
    done = fmu_do_step(INSTANCE, point, length);
    *event = false;
    *terminate = false;
    *early = false;
    *reached = done ? point + length : fmu_time(INSTANCE);
    return ANSWER(done);
}

FMU_EXPORT fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference of[], size_t n_of,
                                                   const fmi3ValueReference by[], size_t n_by, const fmi3Float64 seed[],
                                                   size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    return ANSWER(((n_by == n_seed && n_of == n_sensitivity) ||
                   fmu_refuse(INSTANCE, "Each known has one seed and each unknown one sensitivity.")) &&
                  fmu_derivative(INSTANCE, of, n_of, by, n_by, seed, sensitivity));
}

/* Adjoint: derivatives of a weighted sum of numbers after one step, each `of` with the weight `seed`. One derivative for
 * each number `by`. */
static int fmu_adjoint(fmu_instance *instance, const uint32_t *of, size_t n_of, const uint32_t *by, size_t n_by,
                       const double *seed, double *sensitivity) {
    double column[FMU_STATES + FMU_OUTPUTS + 1U];
    size_t j, k;
    if (n_of > FMU_STATES + FMU_OUTPUTS) {
        return fmu_refuse(instance, "Derivatives of %lu numbers are requested, but the model computes %lu.",
                          (unsigned long)n_of,
                          (unsigned long)(FMU_STATES + FMU_OUTPUTS));
    }
    for (j = 0; j < n_by; j++) {
        const double one = 1.0;
        double sum = 0.0;
        if (!fmu_derivative(instance, of, n_of, &by[j], 1U, &one, column)) {
            return 0;
        }
        for (k = 0; k < n_of; k++) {
            sum += column[k] * seed[k];
        }
        sensitivity[j] = sum;
    }
    return 1;
}

FMU_EXPORT fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference of[], size_t n_of,
                                               const fmi3ValueReference by[], size_t n_by, const fmi3Float64 seed[],
                                               size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    return ANSWER(((n_of == n_seed && n_by == n_sensitivity) ||
                   fmu_refuse(INSTANCE, "Each unknown has one seed and each known one sensitivity.")) &&
                  fmu_adjoint(INSTANCE, of, n_of, by, n_by, seed, sensitivity));
}

/* Functions of other kinds of FMU, or of models with clocks, events, structural parameters or derivatives. */
#define NOT_OFFERED(Name, arguments, used)                                                                             \
    FMU_EXPORT fmi3Status fmi3##Name arguments {                                                                       \
        used;                                                                                                          \
        return REFUSE("fmi3" #Name " is not supported by the model.");                                              \
    }

NOT_OFFERED(EnterEventMode, (fmi3Instance c), (void)c)
NOT_OFFERED(EnterStepMode, (fmi3Instance c), (void)c)
#if !defined(FMU_XCP)
NOT_OFFERED(EnterConfigurationMode, (fmi3Instance c), (void)c)
NOT_OFFERED(ExitConfigurationMode, (fmi3Instance c), (void)c)
#endif
NOT_OFFERED(EnterContinuousTimeMode, (fmi3Instance c), (void)c)
NOT_OFFERED(EvaluateDiscreteStates, (fmi3Instance c), (void)c)
NOT_OFFERED(GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference r, size_t *n), ((void)r, (void)n))
NOT_OFFERED(GetVariableDependencies,
            (fmi3Instance c, fmi3ValueReference r, size_t a[], fmi3ValueReference b[], size_t d[], fmi3DependencyKind k[], size_t n),
            ((void)r, (void)a, (void)b, (void)d, (void)k, (void)n))
NOT_OFFERED(GetIntervalDecimal,
            (fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], fmi3IntervalQualifier q[]),
            ((void)r, (void)n, (void)v, (void)q))
NOT_OFFERED(GetIntervalFraction,
            (fmi3Instance c, const fmi3ValueReference r[], size_t n, uint64_t a[], uint64_t b[], fmi3IntervalQualifier q[]),
            ((void)r, (void)n, (void)a, (void)b, (void)q))
NOT_OFFERED(GetShiftDecimal, (fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[]), ((void)r, (void)n, (void)v))
NOT_OFFERED(GetShiftFraction, (fmi3Instance c, const fmi3ValueReference r[], size_t n, uint64_t a[], uint64_t b[]),
            ((void)r, (void)n, (void)a, (void)b))
NOT_OFFERED(SetIntervalDecimal, (fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[]),
            ((void)r, (void)n, (void)v))
NOT_OFFERED(SetIntervalFraction, (fmi3Instance c, const fmi3ValueReference r[], size_t n, const uint64_t a[], const uint64_t b[]),
            ((void)r, (void)n, (void)a, (void)b))
NOT_OFFERED(SetShiftDecimal, (fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[]),
            ((void)r, (void)n, (void)v))
NOT_OFFERED(SetShiftFraction, (fmi3Instance c, const fmi3ValueReference r[], size_t n, const uint64_t a[], const uint64_t b[]),
            ((void)r, (void)n, (void)a, (void)b))
NOT_OFFERED(UpdateDiscreteStates,
            (fmi3Instance c, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *d, fmi3Boolean *e, fmi3Boolean *f, fmi3Float64 *t),
            ((void)a, (void)b, (void)d, (void)e, (void)f, (void)t))
NOT_OFFERED(CompletedIntegratorStep, (fmi3Instance c, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *d), ((void)a, (void)b, (void)d))
NOT_OFFERED(SetTime, (fmi3Instance c, fmi3Float64 t), (void)t)
NOT_OFFERED(SetContinuousStates, (fmi3Instance c, const fmi3Float64 x[], size_t n), ((void)x, (void)n))
NOT_OFFERED(GetContinuousStateDerivatives, (fmi3Instance c, fmi3Float64 x[], size_t n), ((void)x, (void)n))
NOT_OFFERED(GetEventIndicators, (fmi3Instance c, fmi3Float64 x[], size_t n), ((void)x, (void)n))
NOT_OFFERED(GetContinuousStates, (fmi3Instance c, fmi3Float64 x[], size_t n), ((void)x, (void)n))
NOT_OFFERED(GetNominalsOfContinuousStates, (fmi3Instance c, fmi3Float64 x[], size_t n), ((void)x, (void)n))
NOT_OFFERED(GetNumberOfEventIndicators, (fmi3Instance c, size_t *n), (void)n)
NOT_OFFERED(GetNumberOfContinuousStates, (fmi3Instance c, size_t *n), (void)n)
NOT_OFFERED(GetOutputDerivatives,
            (fmi3Instance c, const fmi3ValueReference r[], size_t n, const int32_t order[], fmi3Float64 v[], size_t m),
            ((void)r, (void)n, (void)order, (void)v, (void)m))
NOT_OFFERED(ActivateModelPartition, (fmi3Instance c, fmi3ValueReference r, fmi3Float64 t), ((void)r, (void)t))
