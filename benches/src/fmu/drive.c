/* Runs the plant's FMU like an importer, which sets inputs and reads outputs at each step: drive TICKS.
 * Prints nanoseconds per tick, and the sum of all outputs. */
#define _POSIX_C_SOURCE 199309L
#include "fmi3.c"

#include <time.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec * 1e9 + (double)t.tv_nsec;
}

int main(int argc, char **argv) {
    const long ticks = (argc > 1) ? atol(argv[1]) : 0;
    fmi3Instance plant = fmi3InstantiateCoSimulation("plant", FMU_TOKEN, NULL, false, false, false, false, NULL, 0, NULL, NULL, NULL);
    fmi3ValueReference inputs[FMU_INPUTS], outputs[FMU_OUTPUTS];
    double input[FMU_INPUTS] = {0.0}, output[FMU_OUTPUTS], sum = 0.0, reached;
    bool event, terminate, early;
    size_t k;
    for (k = 0; k < FMU_INPUTS; k++) {
        inputs[k] = (fmi3ValueReference)(k + 1U);
    }
    for (k = 0; k < FMU_OUTPUTS; k++) {
        outputs[k] = (fmi3ValueReference)(FMU_INPUTS + k + 1U);
    }
    if ((plant == NULL) || (fmi3EnterInitializationMode(plant, false, 0.0, 0.0, false, 0.0) != fmi3OK) ||
        (fmi3ExitInitializationMode(plant) != fmi3OK)) {
        return 1;
    }
    const double start = now();
    for (long tick = 0; tick < ticks; tick++) {
        /* The first input, the voltage of the drive, alternates. */
        input[0] = ((tick / 1000) % 2 == 0) ? 2.0 : -2.0;
        if ((fmi3SetFloat64(plant, inputs, FMU_INPUTS, input, FMU_INPUTS) != fmi3OK) ||
            (fmi3DoStep(plant, (double)tick * FMU_STEP, FMU_STEP, true, &event, &terminate, &early, &reached) != fmi3OK) ||
            (fmi3GetFloat64(plant, outputs, FMU_OUTPUTS, output, FMU_OUTPUTS) != fmi3OK)) {
            return 1;
        }
        for (k = 0; k < FMU_OUTPUTS; k++) {
            sum += output[k];
        }
    }
    const double end = now();
    fmi3FreeInstance(plant);
    printf("%.6f %.17g\n", (end - start) / (double)ticks, sum);
    return 0;
}
