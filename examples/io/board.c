/* The mass of mass.h on a microcontroller with a serial port, as a template for a board with timers and converters.
 *
 * For the board MPS2 AN386 (Cortex-M4F), which QEMU emulates; start-up code and linker script are in the folder firmware:
 *
 *     F=../../firmware
 *     arm-none-eabi-gcc -std=c99 -O2 -mthumb -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard --specs=rdimon.specs \
 *         -nostartfiles -T $F/link.ld $F/startup.c board.c -o board.elf -lm -lc -lrdimon
 *     qemu-system-arm -M mps2-an386 -nographic -monitor none -semihosting -serial pty -kernel board.elf
 *
 * QEMU prints its port, /dev/pts/N. Then: stickslip measure breakaway --io serial:/dev/pts/N. The emulator transfers
 * single bytes and takes some milliseconds per tick: use --set bench.tick_rate=1000.
 *
 * On physical hardware, machine_tick writes the converters, waits on a timer until shortly before the end of the tick,
 * and reads counter and converters. A watchdog sets the outputs to 0 V if no frame arrives for some ticks. */
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
    size_t count = 0;
    UART(DIVIDER) = 25; /* 1 Mbit/s */
    UART(CONTROL) = BOTH_WAYS;
    for (;;) {
        in[count++] = received();
        /* A frame starts with mark and kind in the byte stream; its checksum confirms it. */
        while (count >= 4) {
            const size_t length = io_length(in);
            if (length > count) {
                break;
            }
            size_t used = 1;
            if (length > 0) {
                send(out, io_answer(in, length, out));
                used = io_sum(in, length - IO_SUM) == io_get(in + length - IO_SUM, 4) ? length : 1;
            }
            count -= used;
            memmove(in, in + used, count);
        }
    }
}
