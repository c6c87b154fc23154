/* Instructions and stack of a step, in an emulator that keeps time by instructions: QEMU with `-icount shift=10` takes
 * 1.024 µs for each, and the SysTick timer of its boards counts at 25 MHz, so that an instruction is 25.6 counts.
 * The numbers are not cycles: the emulator models neither pipeline nor cache nor memory wait states. */
#ifndef MEASURE_H
#define MEASURE_H

static volatile uint32_t *const SYSTICK = (volatile uint32_t *)0xE000E010u; /* control, reload, current */
enum { COUNTER_TOP = 0xFFFFFF, PAINTED = 4096 };
#define PAINT 0xA5C3963Cu

static uint32_t overhead, largest, deepest;
static uint64_t total, steps;

/* Instructions between two readings of the timer, which counts downwards; up to 655,000. */
static uint32_t instructions(uint32_t from, uint32_t to) {
    return (uint32_t)((((from - to) & COUNTER_TOP) * (uint64_t)10 + 128) / 256);
}

/* A loop of two instructions per iteration. */
static uint32_t known_loop(uint32_t turns) {
    const uint32_t from = SYSTICK[2];
    __asm__ volatile("1: subs %0, #1\n bne 1b" : "+r"(turns) : : "cc");
    return instructions(from, SYSTICK[2]);
}

static void start_timer(void) {
    SYSTICK[1] = COUNTER_TOP;
    SYSTICK[2] = 0;
    SYSTICK[0] = 5; /* on, at the processor's clock */
    const uint32_t from = SYSTICK[2];
    overhead = instructions(from, SYSTICK[2]);
}

/* The stack below main is unused; without interrupts only the step writes there. */
#define BEFORE_STEP()                                                 \
    volatile uint32_t *stack_;                                        \
    __asm__ volatile("mov %0, sp" : "=r"(stack_));                    \
    for (int i_ = 1; i_ <= PAINTED; ++i_) {                           \
        stack_[-i_] = PAINT;                                          \
    }                                                                 \
    if (steps == 0) {                                                 \
        start_timer();                                                \
    }                                                                 \
    const uint32_t from_ = SYSTICK[2]

#define AFTER_STEP()                                                  \
    const uint32_t took_ = instructions(from_, SYSTICK[2]) - overhead; \
    uint32_t depth_ = PAINTED;                                        \
    while (depth_ > 0 && stack_[-(int)depth_] == PAINT) {             \
        --depth_;                                                     \
    }                                                                 \
    deepest = depth_ > deepest ? depth_ : deepest;                    \
    largest = took_ > largest ? took_ : largest;                      \
    total += took_;                                                   \
    ++steps

static void report(uint32_t parameter_bytes, uint32_t state_bytes) {
    printf("steps %lu\n", (unsigned long)steps);
    printf("instructions %lu\n", (unsigned long)total);
    printf("largest %lu\n", (unsigned long)largest);
    printf("stack %lu\n", (unsigned long)(4 * deepest));
    printf("painted %lu\n", (unsigned long)(4 * PAINTED));
    printf("parameters %lu\n", (unsigned long)parameter_bytes);
    printf("state %lu\n", (unsigned long)state_bytes);
    printf("loop_1000 %lu\n", (unsigned long)known_loop(1000));
    printf("loop_3000 %lu\n", (unsigned long)known_loop(3000));
}
#endif
