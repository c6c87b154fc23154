/* FMI 2.0 for co-simulation. Written by stickslip. */
#include "instance.h"

typedef void *fmi2Component;
typedef void *fmi2ComponentEnvironment;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef char fmi2Char;
typedef const fmi2Char *fmi2String;
typedef char fmi2Byte;

typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;

typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;

static void report(const void *of, const char *name, int serious, const char *message) {
    const fmu_instance *instance = of;
    const fmi2CallbackFunctions *functions = instance->callback;
    /* The message is a format, which not every importer evaluates: it has no conversions. */
    char format[1024];
    size_t length = 0;
    for (; (*message != '\0') && (length + 3U < sizeof format); message++) {
        if (*message == '%') {
            format[length++] = '%';
        }
        format[length++] = *message;
    }
    format[length] = '\0';
    if ((functions != NULL) && (functions->logger != NULL)) {
        functions->logger(functions->componentEnvironment, name, serious ? fmi2Error : fmi2OK, "logStatusError", format);
    }
}

#define FMI(Name) fmi2##Name
#define FMI_OK fmi2OK
#define FMI_ERROR fmi2Error
#define FMI_SIZE
#define FMI_USE_SIZE (void)0
typedef fmi2Status fmi_status;
typedef fmi2Boolean fmi_boolean;
typedef fmi2String fmi_string;
typedef fmi2Byte fmi_byte;

#include "fmi.h"

FMU_EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }

FMU_EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

FMU_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                         const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources;
    (void)visible;
    (void)logging;
    /* The standard demands that the callbacks stay where they are until the instance is freed. */
    return fmi_new(name, guid, NULL, (void *)(uintptr_t)functions,
                   (type == fmi2CoSimulation) ? NULL : "The model is for co-simulation.");
}

FMU_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                          fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    if (c != NULL) {
        (void)fmu_serve(INSTANCE, 0);
    }
    return ANSWER(fmu_begin(INSTANCE, start));
}

FMU_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    if ((c == NULL) || !fmu_serve(INSTANCE, 1)) {
        return fmi2Error;
    }
    return ANSWER(fmu_enter(INSTANCE, "Initialization", FMU_INSTANTIATED, FMU_INITIALIZING));
}

FMU_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real values[]) {
    return ANSWER(fmu_get(INSTANCE, r, n, values));
}

FMU_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real values[]) {
    return ANSWER(fmu_set(INSTANCE, r, n, values));
}

#if defined(FMU_XCP)
/* Options of the XCP service. */
OPTIONS(Integer, fmi2Integer, XCP_TCP_PORT, 0, door->port, fmu_set_port(INSTANCE, door, values[k]))
OPTIONS(Boolean, fmi2Boolean, XCP_TCP_ENABLE, 0, door->enable, (door->enable = (values[k] != 0), 1))
OPTIONS(String, fmi2String, XCP_TCP_ADDRESS, 0, door->address, fmu_set_address(INSTANCE, door, values[k]))
#else
NO_VARIABLES(Integer, fmi2Integer)
NO_VARIABLES(Boolean, fmi2Boolean)
NO_VARIABLES(String, fmi2String)
#endif

FMU_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference of[], size_t n_of,
                                                   const fmi2ValueReference by[], size_t n_by, const fmi2Real seed[],
                                                   fmi2Real sensitivity[]) {
    return ANSWER(fmu_derivative(INSTANCE, of, n_of, by, n_by, seed, sensitivity));
}

FMU_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                                  const fmi2Integer order[], const fmi2Real values[]) {
    (void)r;
    (void)order;
    (void)values;
    return NONE_OF("variables of type Real whose derivatives can be set");
}

FMU_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference r[], size_t n,
                                                   const fmi2Integer order[], fmi2Real values[]) {
    (void)r;
    (void)order;
    (void)values;
    return NONE_OF("variables of type Real with derivatives");
}

FMU_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real length, fmi2Boolean no_set_before) {
    (void)no_set_before;
    return ANSWER(fmu_do_step(INSTANCE, point, length));
}

FMU_EXPORT fmi2Status fmi2CancelStep(fmi2Component c) {
    return ANSWER(fmu_refuse(INSTANCE, "No step is in progress: each is finished when fmi2DoStep returns."));
}

FMU_EXPORT fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind;
    *value = ((c != NULL) && (INSTANCE->memory.phase != FMU_FAILED)) ? fmi2OK : fmi2Error;
    return ANSWER(1);
}

FMU_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    (void)kind;
    *value = (c != NULL) ? fmu_time(INSTANCE) : 0.0;
    return ANSWER(1);
}

FMU_EXPORT fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)c;
    (void)kind;
    *value = 0;
    return fmi2Discard;
}

FMU_EXPORT fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    (void)kind;
    *value = ((c != NULL) && (INSTANCE->memory.phase == FMU_FAILED));
    return ANSWER(1);
}

FMU_EXPORT fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind;
    *value = "";
    return ANSWER(1);
}
