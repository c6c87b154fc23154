/* An FMU in the style of another tool: degrees, revolutions per minute, millinewtonmetres, own names, an input
 * that is not a signal. FMI selects the version, FAULT its fault in step 300. */
#include <fenv.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { NOTHING, CRASH, HANG, NAN_TORQUE, FAILS, ROUNDS, EXITS, DISCARDS, DIES, WARNS, REFUSES, ABORTS, TERMINATES, BEGINS_NOT };

/* Value references are 0 …: angle [deg], set-point [deg], its velocity [rpm], torque [mN m], gain, bias [mN m]. */
typedef struct {
    double v[6];
    long steps;
    int initialized;
    double end;
} model;

static void start(model *it) {
    memset(it, 0, sizeof *it);
    it->v[4] = 35.0;
}

#if FMI == 2
typedef void (*logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    logger log;
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void *finished, *environment;
} callbacks;
static const callbacks *importer;
#define TELL(status, ...) importer->log(importer->environment, "servo", status, "logStatus", __VA_ARGS__)
#else
#include <stdio.h>
typedef void (*logger)(void *, int, const char *, const char *);
static logger importer;
static void *environment;
#define TELL(status, ...)                                                                                              \
    do {                                                                                                               \
        char text[200];                                                                                                \
        snprintf(text, sizeof text, __VA_ARGS__);                                                                      \
        importer(environment, status, "logStatus", text);                                                              \
    } while (0)
#endif

static int step(model *it, double point, double length) {
    if (!it->initialized || fabs(point - it->end) > 1e-9) {
        TELL(ERROR, "A step from %g s where the last ended at %g s.", point, it->end);
        return ERROR;
    }
    it->end = point + length;
    it->v[3] = it->v[4] * (it->v[1] - it->v[0]) + 1.5 * it->v[2] + it->v[5];
    if (it->steps++ != 300) {
        return OK;
    }
    if (FAULT != NOTHING) {
        TELL((FAULT == WARNS) ? WARNING : ERROR, "Step %ld: the angle is %s.", it->steps - 1, "wrong");
    }
    switch (FAULT) {
    case CRASH: *(volatile int *)0 = 1; break;
    case HANG:
        for (;;) {
        }
    case NAN_TORQUE: it->v[3] = NAN; break;
    case FAILS: return ERROR;
    case ROUNDS: fesetround(FE_UPWARD); break;
    case EXITS: exit(3);
    case DISCARDS: return DISCARD;
    case DIES: return FATAL;
    case WARNS: return WARNING;
    case ABORTS: abort();
    default: break;
    }
    return OK;
}

static int set(model *it, const unsigned *r, size_t n, const double *values) {
    for (size_t k = 0; k < n; k++) {
        if (r[k] > 5 || r[k] == 3) {
            return ERROR;
        }
        it->v[r[k]] = values[k];
    }
    return OK;
}

static int get(model *it, const unsigned *r, size_t n, double *values) {
    for (size_t k = 0; k < n; k++) {
        values[k] = it->v[r[k]];
    }
    return OK;
}

static int finish_initialization(void *c) {
    ((model *)c)->initialized = 1;
    return OK;
}

#if FMI == 2
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const callbacks *functions,
                      int visible, int logging) {
    (void)name, (void)visible, (void)logging;
    importer = functions;
    if (FAULT == REFUSES || type != 1 || strcmp(guid, "{servo}") != 0 || strncmp(resources, "file:///", 8) != 0) {
        TELL(ERROR, "No licence for %s", "servo");
        return NULL;
    }
    model *it = functions->allocate(1, sizeof *it);
    start(it);
    return it;
}
void fmi2FreeInstance(void *c) { importer->free(c); }
int fmi2SetupExperiment(void *c, int t, double tolerance, double begin, int s, double stop) {
    (void)c, (void)t, (void)tolerance, (void)s, (void)stop;
    return begin == 0.0 ? OK : ERROR;
}
int fmi2EnterInitializationMode(void *c) { return (void)c, (FAULT == BEGINS_NOT) ? ERROR : OK; }
int fmi2ExitInitializationMode(void *c) { return finish_initialization(c); }
int fmi2Terminate(void *c) { return (void)c, OK; }
int fmi2SetReal(void *c, const unsigned *r, size_t n, const double *v) { return set(c, r, n, v); }
int fmi2GetReal(void *c, const unsigned *r, size_t n, double *v) { return get(c, r, n, v); }
int fmi2DoStep(void *c, double point, double length, int never_back) { return (void)never_back, step(c, point, length); }
#else
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool events, bool early, const unsigned *between, size_t n, void *log_environment,
                                  logger log, void *intermediate) {
    (void)name, (void)visible, (void)logging, (void)between, (void)intermediate;
    importer = log, environment = log_environment;
    /* There is a folder of resources, and its path ends as that of a folder. */
    const char *end = "/resources/";
    if (FAULT == REFUSES || events || early || n != 0 || strcmp(token, "{servo}") != 0 || resources == NULL ||
        strcmp(resources + strlen(resources) - strlen(end), end) != 0) {
        TELL(ERROR, "No licence for %s", "servo");
        return NULL;
    }
    model *it = malloc(sizeof *it);
    start(it);
    return it;
}
void fmi3FreeInstance(void *c) { free(c); }
int fmi3EnterInitializationMode(void *c, bool t, double tolerance, double begin, bool s, double stop) {
    (void)c, (void)t, (void)tolerance, (void)s, (void)stop;
    return (begin != 0.0 || FAULT == BEGINS_NOT) ? ERROR : OK;
}
int fmi3ExitInitializationMode(void *c) { return finish_initialization(c); }
int fmi3Terminate(void *c) { return (void)c, OK; }
int fmi3SetFloat64(void *c, const unsigned *r, size_t n, const double *v, size_t m) {
    return n == m ? set(c, r, n, v) : ERROR;
}
int fmi3GetFloat64(void *c, const unsigned *r, size_t n, double *v, size_t m) {
    return n == m ? get(c, r, n, v) : ERROR;
}
int fmi3DoStep(void *c, double point, double length, bool never_back, bool *event, bool *terminate, bool *early,
               double *reached) {
    (void)never_back;
    *event = false, *early = false, *reached = point + length;
    *terminate = FAULT == TERMINATES && ((model *)c)->steps == 300;
    return step(c, point, length);
}
#endif
