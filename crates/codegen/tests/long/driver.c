/* The ticks of schedule.rs in C. Prints the hash after each chunk, or the numbers of one chunk. */
#include "block.c"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

#if HAS_PARAMETERS
static block_parameters sets[SETS], p;
#define P &p,
#else
#define P
#endif
#if HAS_STATE
static block_state s, saved;
#define S &s,
#else
#define S
#endif
#if HAS_INPUT
static block_input ordinary[ORDINARY], special[SPECIAL], in;
#define IN &in,
#else
#define IN
#endif
static block_output out;

static uint64_t fold(uint64_t hash, double number) {
    uint64_t bits = UINT64_C(0x7ff8000000000000);
    if (number == number) {
        memcpy(&bits, &number, sizeof bits);
    }
    return (((hash << 5) | (hash >> 59)) ^ bits) * UINT64_C(0x9e3779b97f4a7c15);
}

static uint64_t fold_all(uint64_t hash, const REAL *numbers, size_t bytes) {
    for (size_t i = 0; i < bytes / sizeof(REAL); ++i) {
        hash = fold(hash, (double)numbers[i]);
    }
    return hash;
}

static void fill(void *to, size_t bytes) {
    if (fread(to, 1, bytes, stdin) != bytes) {
        exit(2);
    }
}

int main(int argc, char **argv) {
    const long ticks = atol(argv[1]), printed = argc > 2 ? atol(argv[2]) : -1;
    REAL dt;
    uint64_t hash = 0;
    fill(&dt, sizeof dt);
#if HAS_PARAMETERS
    fill(sets, sizeof sets);
#endif
#if HAS_STATE
    block_init(&s);
#endif
#if HAS_INPUT
    fill(ordinary, sizeof ordinary);
    fill(special, sizeof special);
#endif
    for (long k = 0; k < ticks; ++k) {
        const long within = k % RUN, first_special = RUN - SPECIAL_TICKS;
        const int is_special = within >= first_special;
#if HAS_PARAMETERS
        if (within == 0) {
            p = sets[k / RUN % SETS];
        }
#endif
#if HAS_STATE
        if (within == first_special) {
            saved = s;
        }
        if ((is_special && (within - first_special) % SPECIAL_RESTART == 0) || (within == 0 && k > 0)) {
            s = saved;
        }
#endif
#if HAS_INPUT
        in = is_special ? special[k % SPECIAL] : ordinary[k % ORDINARY];
#endif
        RAW_STEP(P S IN dt, &out);
#ifdef FLIPPED_TICK
        if (k == FLIPPED_TICK) {
            *(unsigned char *)&out ^= 1u;
        }
#endif
        hash = fold_all(hash, (const REAL *)&out, sizeof out);
#if HAS_STATE
        hash = fold_all(hash, (const REAL *)&s, sizeof s);
#endif
        if (k / CHUNK == printed) {
            fwrite(&out, sizeof out, 1, stdout);
#if HAS_STATE
            fwrite(&s, sizeof s, 1, stdout);
#endif
        }
        if (printed < 0 && (k + 1) % CHUNK == 0) {
            printf("%016" PRIx64 "\n", hash);
        }
    }
    return 0;
}
