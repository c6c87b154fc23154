/* Machine side of the stickslip link in C99: decodes and answers frames over any transport. docs/src/frame.md describes
 * the frames.
 *
 * Include this file once and define the two functions of your machine. All numbers are doubles, in the order of that
 * page: readings are count, index, latch, tacho, accelerometer and current; volts are servo and load amplifier. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { IO_BEGIN = 1, IO_BEGUN, IO_VOLTAGES, IO_READINGS, IO_PRESS, IO_PRESSED, IO_REFUSAL, IO_END, IO_CLOCKED };
enum { IO_LONGEST = 120, IO_HEAD = 12, IO_SUM = 4, IO_LEFT_OUT = 4000 };
enum { NOT_NEXT = 1, STRANGER = 4, UNKNOWN_KIND = 5 };

/* User-defined. Starts at rest with this tick time [s] and sets the readings. Returns 0 if it does not support it. */
static int machine_begin(double tick_time, double readings[6]);
/* User-defined. Runs one tick with these voltages [V] and sets the readings at its end. */
static void machine_tick(const double volts[2], double readings[6]);

/* State of the link. */
static struct {
    uint64_t due;     /* number of the next frame */
    int begun;        /* whether a session is active */
    int clocked;      /* whether it runs in real time */
    double volts[2];  /* active voltages */
} io;

static uint64_t io_get(const unsigned char *from, int bytes) {
    uint64_t value = 0;
    while (bytes-- > 0) {
        value = value << 8 | from[bytes];
    }
    return value;
}

static void io_put(unsigned char *to, uint64_t value, int bytes) {
    for (; bytes > 0; --bytes, value >>= 8) {
        *to++ = (unsigned char)(value & 0xFF);
    }
}

/* CRC-32 as in gzip, bit by bit. A table of 256 words would be eight times as fast. */
static uint32_t io_sum(const unsigned char *bytes, size_t length) {
    uint32_t sum = 0xFFFFFFFFu;
    for (size_t k = 0; k < length; ++k) {
        sum ^= bytes[k];
        for (int bit = 0; bit < 8; ++bit) {
            sum = sum >> 1 ^ (0xEDB88320u & (0u - (sum & 1u)));
        }
    }
    return ~sum;
}

/* Count of numbers of a kind of frame; negative for a kind that the bench does not send. */
static int io_numbers(unsigned kind) {
    switch (kind) {
    case IO_BEGIN: case IO_CLOCKED: case IO_PRESS: return 1;
    case IO_VOLTAGES: return 2;
    case IO_END: return 0;
    default: return -1;
    }
}

/* Length in bytes of the frame that starts here, from its first 4 bytes; 0 if no frame starts here. */
static size_t io_length(const unsigned char *in) {
    const int numbers = memcmp(in, "SI\2", 3) == 0 ? io_numbers(in[3]) : -1;
    return numbers < 0 ? 0 : (size_t)(IO_HEAD + 8 * numbers + IO_SUM);
}

static double io_number(const unsigned char *in, int place) {
    const uint64_t bits = io_get(in + IO_HEAD + 8 * place, 8);
    double number;
    memcpy(&number, &bits, sizeof number);
    return number;
}

static size_t io_frame(unsigned char *out, int kind, uint64_t number, const double *numbers, int count) {
    memcpy(out, "SI\2", 3);
    out[3] = (unsigned char)kind;
    io_put(out + 4, number, 8);
    for (int k = 0; k < count; ++k) {
        uint64_t bits;
        memcpy(&bits, &numbers[k], sizeof bits);
        io_put(out + IO_HEAD + 8 * k, bits, 8);
    }
    const size_t length = (size_t)(IO_HEAD + 8 * count);
    io_put(out + length, io_sum(out, length), 4);
    return length + IO_SUM;
}

static size_t io_refuse(unsigned char *out, uint64_t number, double reason, double due, double received) {
    const double numbers[3] = { reason, due, received };
    return io_frame(out, IO_REFUSAL, number, numbers, 3);
}

/* Answers a frame. Returns the length of the answer, 0 without one. */
static size_t io_answer(const unsigned char *in, size_t length, unsigned char *out) {
    double numbers[7] = { 0 };
    if (length < IO_HEAD + IO_SUM || io_length(in) != length ||
        io_sum(in, length - IO_SUM) != io_get(in + length - IO_SUM, 4)) {
        return io_refuse(out, 0, 0, 0, 0);
    }
    const unsigned kind = in[3];
    const uint64_t number = io_get(in + 4, 8);
    if (kind == IO_END) {
        io.begun = 0;
        io.volts[0] = io.volts[1] = 0;
        machine_tick(io.volts, numbers);
        return 0;
    }
    if (kind == IO_BEGIN || kind == IO_CLOCKED) {
        io.begun = machine_begin(io_number(in, 0), numbers + 1);
        io.clocked = kind == IO_CLOCKED;
        io.volts[0] = io.volts[1] = 0;
        io.due = number + 1;
        numbers[0] = 1; /* preload 1: a machine without a friction wheel reports it as pressed */
        return io.begun ? io_frame(out, IO_BEGUN, number, numbers, 7) : io_refuse(out, number, 2, 0, io_number(in, 0));
    }
    if (!io.begun) {
        return io_refuse(out, number, STRANGER, 0, 0);
    }
    if (io.clocked && kind == IO_PRESS) {
        numbers[0] = io_number(in, 0);
        return io_frame(out, IO_PRESSED, number, numbers, 1);
    }
    if (io.clocked && number < io.due) {
        return 0; /* late or duplicate: its tick has passed */
    }
    if (number != io.due && (!io.clocked || number - io.due > IO_LEFT_OUT)) {
        return io_refuse(out, number, NOT_NEXT, (double)io.due, (double)number);
    }
    int pulse = 0;
    for (; io.due < number; ++io.due) { /* omitted ticks run with the active voltages */
        machine_tick(io.volts, numbers);
        pulse |= numbers[1] > 0;
    }
    ++io.due;
    if (kind == IO_PRESS) {
        numbers[0] = io_number(in, 0);
        return io_frame(out, IO_PRESSED, number, numbers, 1);
    }
    io.volts[0] = io_number(in, 0);
    io.volts[1] = io_number(in, 1);
    machine_tick(io.volts, numbers);
    numbers[1] = pulse || numbers[1] > 0;
    return io_frame(out, IO_READINGS, number, numbers, 6);
}
