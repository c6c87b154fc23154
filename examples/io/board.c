/* The same mass on a microcontroller, over its serial port: what a board of yours does with timers and converters.
 *
 * For the board MPS2 AN386 (Cortex-M4F), which QEMU emulates; start-up and memory lie in the folder firmware:
 *
 *     F=../../firmware
 *     arm-none-eabi-gcc -std=c99 -O2 -mthumb -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard --specs=rdimon.specs \
 *         -nostartfiles -T $F/link.ld $F/startup.c board.c -o board.elf -lm -lc -lrdimon
 *     qemu-system-arm -M mps2-an386 -nographic -monitor none -semihosting -serial pty -kernel board.elf
 *
 * QEMU says which port it takes, /dev/pts/N. Then: stickslip measure breakaway --io serial:/dev/pts/N. The emulator hands
 * bytes over one by one, some milliseconds a tick: patience, and --set bench.tick_rate=1000.
 *
 * On a board of steel machine_tick writes the converters, waits until shortly before the tick's end by a timer, and
 * reads counter and converters; a watchdog takes the outputs to 0 V where no frame comes for some ticks. */
#include "machine.h"
#include "mass.h"

/* The serial port of the board: CMSDK UART 0, its clock 25 MHz. */
#define UART(offset) (*(volatile uint32_t *)(0x40004000u + (offset)))
enum { DATA = 0x0, STATE = 0x4, CONTROL = 0x8, DIVIDER = 0x10 };
enum { SEND_FULL = 1, HAS_RECEIVED = 2, BOTH_WAYS = 3 };

static unsigned char received(void) {
    while ((UART(STATE) & HAS_RECEIVED) == 0) {
    }
    return (unsigned char)UART(DATA);
}

static void send(const unsigned char *bytes, size_t length) {
    while (length-- > 0) {
        while ((UART(STATE) & SEND_FULL) != 0) {
        }
        UART(DATA) = *bytes++;
    }
}

int main(void) {
    unsigned char in[IO_LONGEST], out[IO_LONGEST];
    size_t have = 0;
    UART(DIVIDER) = 25; /* 1 Mbit/s */
    UART(CONTROL) = BOTH_WAYS;
    for (;;) {
        in[have++] = received();
        /* Bytes have no borders: a frame is where mark and kind are, and is one where its checksum says so. */
        while (have >= 4) {
            const size_t length = io_length(in);
            if (length > have) {
                break;
            }
            size_t used = 1;
            if (length > 0) {
                send(out, io_answer(in, length, out));
                used = io_sum(in, length - IO_SUM) == io_get(in + length - IO_SUM, 4) ? length : 1;
            }
            have -= used;
            memmove(in, in + used, have);
        }
    }
}
