/* Start-up of a Cortex-M4F or M7 from reset to main: vectors, memory, floating point, fault messages. */
#include <stdint.h>
#include <stdlib.h>

extern uint32_t data_load[], data_start[], data_end[], bss_start[], bss_end[], stack_top[];
extern void initialise_monitor_handles(void);
extern int main(void);
void reset(void);
void _fini(void);

/* Called by the C library at the end of a program; empty. */
void _fini(void) {}

/* A request to the debugger or emulator (Arm's semihosting). */
static void request(uint32_t operation, const void *argument) {
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

/* Ends the program; an emulator returns 1. */
static void stop(const char *reason) {
    enum { WRITE0 = 0x04, EXIT = 0x18, RUN_TIME_ERROR = 0x20023 };
    request(WRITE0, reason);
    for (;;) {
        /* EXIT expects its reason instead of a pointer. */
        request(EXIT, (const void *)RUN_TIME_ERROR);
    }
}

static void hard_fault(void) { stop("hard fault: invalid address, division by zero or unsupported instruction\n"); }
static void memory_fault(void) { stop("memory management fault\n"); }
static void bus_fault(void) { stop("bus fault: no memory or device at this address\n"); }
static void usage_fault(void) { stop("usage fault: unsupported instruction\n"); }
static void unexpected(void) { stop("unexpected interrupt\n"); }

/* Stack, reset and the exceptions of the processor; no interrupt is enabled. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handlers[15])(void);
} VECTORS = {
    stack_top,
    { reset, unexpected, hard_fault, memory_fault, bus_fault, usage_fault, 0, 0, 0, 0, unexpected, unexpected, 0,
      unexpected, unexpected }
};

void reset(void) {
    /* Coprocessors 10 and 11 are the floating-point unit. Its control word 0: round to nearest, keep subnormals. */
    volatile uint32_t *const access_control = (volatile uint32_t *)0xE000ED88u;
    *access_control |= 0xFu << 20;
    __asm__ volatile("dsb\n isb\n vmsr fpscr, %0" : : "r"(0));
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; ++to) {
        *to = *from++;
    }
    for (uint32_t *to = bss_start; to < bss_end; ++to) {
        *to = 0;
    }
    initialise_monitor_handles();
    exit(main());
}
