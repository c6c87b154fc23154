/* Functions that FMI 2.0 and FMI 3.0 share except for prefix and types. Written by stickslip.
 *
 * The including file defines FMI(Name), the name with its prefix, the types fmi_status, fmi_boolean, fmi_string and
 * fmi_byte, FMI_OK and FMI_ERROR, and FMI_SIZE, the last argument of getters and setters, with FMI_USE_SIZE. */
#ifndef FMU_FMI_H
#define FMU_FMI_H

#define INSTANCE ((fmu_instance *)c)
#define STATUS(done) ((done) ? FMI_OK : FMI_ERROR)
/* The status of a call that holds the lock; an error without instance. */
#define ANSWER(done) STATUS((c != NULL) && fmu_lock(INSTANCE) && fmu_unlock(INSTANCE, (done)))
#define REFUSE(message) ANSWER(fmu_refuse(INSTANCE, message))
#define NONE_OF(what) ANSWER((n == 0U) || fmu_refuse(INSTANCE, "The model has no " what "."))

/* A new instance that is for co-simulation of this model; NULL, with the fault reported, if another is requested. */
static fmu_instance *fmi_new(fmi_string name, fmi_string token, void *importer, void *logger, const char *fault) {
    fmu_instance *instance = fmu_new(name);
    if (instance == NULL) {
        return NULL;
    }
    instance->report = report;
    instance->importer = importer;
    instance->callback = logger;
    if ((fault == NULL) && ((token == NULL) || (strcmp(token, FMU_TOKEN) != 0))) {
        fault = "The token (GUID) is not that of this model: description and library are of different models.";
    }
    if (fault != NULL) {
        (void)fmu_refuse(instance, "%s", fault);
        free(instance);
        return NULL;
    }
    return instance;
}

FMU_EXPORT void FMI(FreeInstance)(void *c) { fmu_free(c); }

FMU_EXPORT fmi_status FMI(SetDebugLogging)(void *c, fmi_boolean on, size_t n, const fmi_string categories[]) {
    (void)on;
    (void)n;
    (void)categories;
    return ANSWER(1);
}

FMU_EXPORT fmi_status FMI(ExitInitializationMode)(void *c) {
    return ANSWER(fmu_checked(INSTANCE) && fmu_enter(INSTANCE, "The end of initialization", FMU_INITIALIZING, FMU_STEPPING));
}

FMU_EXPORT fmi_status FMI(Terminate)(void *c) {
    const fmi_status status = ANSWER(fmu_enter(INSTANCE, "The end of the simulation", FMU_STEPPING, FMU_TERMINATED));
    if (status == FMI_OK) {
        fmu_silence(INSTANCE);
    }
    return status;
}

FMU_EXPORT fmi_status FMI(Reset)(void *c) {
    if (c != NULL) {
        fmu_reset(INSTANCE);
    }
    return ANSWER(1);
}

/* Getter and setter of a type without variables. */
#define NO_VARIABLES(Name, Type)                                                                                       \
    FMU_EXPORT fmi_status FMI(Get##Name)(void *c, const uint32_t r[], size_t n, Type values[] FMI_SIZE) {              \
        (void)r;                                                                                                       \
        (void)values;                                                                                                  \
        FMI_USE_SIZE;                                                                                                  \
        return NONE_OF("variables of type " #Name);                                                                    \
    }                                                                                                                  \
    FMU_EXPORT fmi_status FMI(Set##Name)(void *c, const uint32_t r[], size_t n, const Type values[] FMI_SIZE) {        \
        (void)r;                                                                                                       \
        (void)values;                                                                                                  \
        FMI_USE_SIZE;                                                                                                  \
        return NONE_OF("variables of type " #Name);                                                                    \
    }

/* Getter and setter of the options of the XCP service of one type; `MODE` is 1 if they require configuration mode. */
#define OPTIONS(Name, Type, KIND, MODE, READ, WRITE)                                                                   \
    FMU_EXPORT fmi_status FMI(Get##Name)(void *c, const uint32_t r[], size_t n, Type values[] FMI_SIZE) {              \
        size_t k;                                                                                                      \
        FMI_USE_SIZE;                                                                                                  \
        for (k = 0; (c != NULL) && (k < n); k++) {                                                                     \
            const xcp_door *door = fmu_door(INSTANCE, r[k], KIND, #Name);                                              \
            if (door == NULL) {                                                                                        \
                return FMI_ERROR;                                                                                      \
            }                                                                                                          \
            values[k] = READ;                                                                                          \
        }                                                                                                              \
        return ANSWER(1);                                                                                              \
    }                                                                                                                  \
    FMU_EXPORT fmi_status FMI(Set##Name)(void *c, const uint32_t r[], size_t n, const Type values[] FMI_SIZE) {        \
        size_t k;                                                                                                      \
        FMI_USE_SIZE;                                                                                                  \
        for (k = 0; (c != NULL) && (k < n); k++) {                                                                     \
            xcp_door *door = fmu_door(INSTANCE, r[k], KIND, #Name);                                                    \
            if ((door == NULL) || !fmu_may_configure(INSTANCE, MODE) || !(WRITE)) {                                    \
                return FMI_ERROR;                                                                                      \
            }                                                                                                          \
        }                                                                                                              \
        return ANSWER(1);                                                                                              \
    }

/* Memory for a saved state, unless there is some. */
static int fmi_room(fmu_instance *instance, void **state) {
    if (*state == NULL) {
        *state = malloc(FMU_SAVED);
    }
    return (*state != NULL) || fmu_refuse(instance, "There is no memory for a state.");
}

FMU_EXPORT fmi_status FMI(GetFMUstate)(void *c, void **state) {
    if ((c == NULL) || (state == NULL) || !fmi_room(INSTANCE, state)) {
        return FMI_ERROR;
    }
    fmu_save(INSTANCE, *state);
    return FMI_OK;
}

FMU_EXPORT fmi_status FMI(SetFMUstate)(void *c, void *state) {
    if ((c == NULL) || !fmu_saved(INSTANCE, state, FMU_SAVED)) {
        return FMI_ERROR;
    }
    fmu_restore(INSTANCE, state);
    return FMI_OK;
}

FMU_EXPORT fmi_status FMI(FreeFMUstate)(void *c, void **state) {
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return ANSWER(1);
}

FMU_EXPORT fmi_status FMI(SerializedFMUstateSize)(void *c, void *state, size_t *size) {
    (void)state;
    *size = FMU_SAVED;
    return ANSWER(1);
}

FMU_EXPORT fmi_status FMI(SerializeFMUstate)(void *c, void *state, fmi_byte bytes[], size_t size) {
    if ((c == NULL) || !fmu_saved(INSTANCE, state, size)) {
        return FMI_ERROR;
    }
    (void)memcpy(bytes, state, size);
    return FMI_OK;
}

FMU_EXPORT fmi_status FMI(DeSerializeFMUstate)(void *c, const fmi_byte bytes[], size_t size, void **state) {
    if ((c == NULL) || (state == NULL) || !fmu_saved(INSTANCE, (const unsigned char *)bytes, size) ||
        !fmi_room(INSTANCE, state)) {
        return FMI_ERROR;
    }
    (void)memcpy(*state, bytes, size);
    return FMI_OK;
}

#endif /* FMU_FMI_H */
