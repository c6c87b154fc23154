/* Processor in the loop: runs a generated block on the records of a file and writes its outputs.
 *
 * The file `inputs` contains records in the memory format of the processor (little endian, REAL is double or float):
 *     1, the parameters                   for the next steps; default: those of BLOCK_parameters_init
 *     2, the state                        for the next step; default: that of BLOCK_init
 *     3, REAL dt, the input               runs a step
 * The first number is a 32-bit word. After each step the program appends the status (a 32-bit word), the output and the
 * state to the file `outputs`.
 *
 * Compile with -DBLOCK=name, with -DREAL=float for single precision, and with -DNO_PARAMETERS, -DNO_STATE, -DNO_INPUT or
 * -DNO_OUTPUT for missing parts of the block. -DMEASURE counts instructions and stack (measure.h). */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#ifndef REAL
#define REAL double
#endif
#define TEXT_(x) #x
#define TEXT(x) TEXT_(x)
#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define OF(what) JOIN(BLOCK, what)
#include TEXT(BLOCK.h)

#ifdef NO_PARAMETERS
#define P
#define P_BYTES 0
#else
#define P &parameters,
#define P_BYTES sizeof parameters
static OF(parameters) parameters;
#endif
#ifdef NO_STATE
#define S
#define S_BYTES 0
#else
#define S &state,
#define S_BYTES sizeof state
static OF(state) state;
#endif
#ifdef NO_INPUT
#define IN
#else
#define IN &input,
static OF(input) input;
#endif
#ifdef NO_OUTPUT
#define OUT
#else
#define OUT , &output
static OF(output) output;
#endif

#ifdef MEASURE
#include "measure.h"
#else
#define BEFORE_STEP() (void)0
#define AFTER_STEP() (void)0
#define report(parameter_bytes, state_bytes) (void)0
#endif

static FILE *opened(const char *name, const char *mode) {
    static char buffers[2][1 << 16];
    static int count;
    FILE *file = fopen(name, mode);
    if (file == NULL) {
        printf("cannot open the file %s\n", name);
        exit(2);
    }
    setvbuf(file, buffers[count++], _IOFBF, sizeof buffers[0]);
    return file;
}

static void read_all(void *to, size_t size, FILE *file) {
    if (fread(to, 1, size, file) != size) {
        printf("the file inputs ends within a record\n");
        exit(3);
    }
}

int main(void) {
    enum { PARAMETERS = 1, STATE, STEP };
    FILE *const inputs = opened("inputs", "rb");
    FILE *const outputs = opened("outputs", "wb");
    uint32_t kind;
#ifndef NO_PARAMETERS
    OF(parameters_init)(&parameters);
#endif
#ifndef NO_STATE
    OF(init)(&state);
#endif
    while (fread(&kind, sizeof kind, 1, inputs) == 1) {
        if (kind == STEP) {
            REAL dt;
            read_all(&dt, sizeof dt, inputs);
#ifndef NO_INPUT
            read_all(&input, sizeof input, inputs);
#endif
            BEFORE_STEP();
            const uint32_t status = (uint32_t)OF(step)(P S IN dt OUT);
            AFTER_STEP();
            fwrite(&status, sizeof status, 1, outputs);
#ifndef NO_OUTPUT
            fwrite(&output, sizeof output, 1, outputs);
#endif
#ifndef NO_STATE
            fwrite(&state, sizeof state, 1, outputs);
        } else if (kind == STATE) {
            read_all(&state, sizeof state, inputs);
#endif
#ifndef NO_PARAMETERS
        } else if (kind == PARAMETERS) {
            read_all(&parameters, sizeof parameters, inputs);
#endif
        } else {
            printf("unknown record %lu in the file inputs\n", (unsigned long)kind);
            return 4;
        }
    }
    report(P_BYTES, S_BYTES);
    return fclose(outputs);
}
