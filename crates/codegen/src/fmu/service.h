/* The XCP service of an instance: its address, start and end. Written by stickslip. */
#ifndef FMU_SERVICE_H
#define FMU_SERVICE_H

static void fmu_service_defaults(fmu_instance *instance) {
    xcp_defaults(&instance->options);
    instance->configuring = 0;
}

#if defined(_WIN32)

#define fmu_lock(instance) 1
#define fmu_unlock(instance, done) (done)
#define fmu_stepped(instance) ((void)0)
#define fmu_silence(instance) ((void)0)

static int fmu_serve(fmu_instance *instance, int must) {
    const int enabled = instance->options.doors[0].enable || instance->options.doors[1].enable;
    return !must || !enabled || fmu_refuse(instance, "The model has no XCP service on Windows: set xcp.tcp.enable to false.");
}

#else

static int fmu_lock(fmu_instance *instance) {
    if (instance->service != NULL) {
        (void)pthread_mutex_lock(&instance->service->lock);
    }
    return 1;
}

static int fmu_unlock(fmu_instance *instance, int done) {
    if (instance->service != NULL) {
        (void)pthread_mutex_unlock(&instance->service->lock);
        xcp_yield(instance->service);
    }
    return done;
}

/* After a step, with the lock. */
static void fmu_stepped(fmu_instance *instance) {
    if (instance->service != NULL) {
        xcp_sample(&instance->service->slave, &instance->memory);
    }
}

static void fmu_silence(fmu_instance *instance) {
    if (instance->service != NULL) {
        xcp_end(instance->service);
        instance->service = NULL;
    }
}

/* The service at the address of the options; a socket that cannot be opened is an error if it `must` be. */
static int fmu_serve(fmu_instance *instance, int must) {
    const xcp_options *options = &instance->options;
    const int by_datagrams = options->doors[1].enable;
    const xcp_door *door = &options->doors[by_datagrams];
    if (instance->memory.phase != FMU_INSTANTIATED) {
        return 1;
    }
    if ((instance->service != NULL) && (memcmp(options, &instance->service->options, sizeof *options) == 0)) {
        return 1;
    }
    fmu_silence(instance);
    if (!door->enable) {
        return 1;
    }
    if (options->doors[0].enable && by_datagrams) {
        return !must || fmu_refuse(instance, "The XCP service has one master: set xcp.tcp.enable or xcp.udp.enable to false.");
    }
    instance->service = xcp_begin(options, &instance->memory);
    return (instance->service != NULL) || !must ||
           fmu_refuse(instance, "XCP cannot be served at %s, port %d (%s): set xcp.%s.port to another, or xcp.%s.enable to false.",
                      door->address, door->port, strerror(errno), by_datagrams ? "udp" : "tcp", by_datagrams ? "udp" : "tcp");
}

#endif /* _WIN32 */

/* The socket options of a reference; NULL, with a message, if it is not an option of the kind. */
static xcp_door *fmu_door(fmu_instance *instance, uint32_t reference, xcp_option kind, const char *type) {
    const uint32_t option = reference - FMU_COUNT - 1U;
    if ((reference <= FMU_COUNT) || (option >= XCP_OPTIONS) || (option % 3U != (uint32_t)kind)) {
        (void)fmu_refuse(instance, "There is no variable of type %s of value reference %lu.", type, (unsigned long)reference);
        return NULL;
    }
    return &instance->options.doors[option / 3U];
}

/* Whether options may be set now. */
static int fmu_may_configure(const fmu_instance *instance, int configuring) {
    if ((instance->memory.phase != FMU_INSTANTIATED) || (configuring && !instance->configuring)) {
        return fmu_refuse(instance, "Options of the XCP service can be set only before initialization%s.",
                          configuring ? ", in configuration mode" : "");
    }
    return 1;
}

static int fmu_set_port(const fmu_instance *instance, xcp_door *door, long port) {
    if ((port < 1) || (port > 65535)) {
        return fmu_refuse(instance, "Port %ld is not valid: it must be from 1 to 65535.", port);
    }
    door->port = (int)port;
    return 1;
}

static int fmu_set_address(const fmu_instance *instance, xcp_door *door, const char *address) {
    if ((address == NULL) || (strlen(address) >= XCP_TEXT)) {
        return fmu_refuse(instance, "The listen address must be of the form 127.0.0.1 or ::1.");
    }
    (void)memset(door->address, 0, sizeof door->address);
    (void)memcpy(door->address, address, strlen(address));
    return 1;
}

#endif /* FMU_SERVICE_H */
