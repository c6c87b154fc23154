/* The slave of one XCP master: from commands to answers, from steps to rows of measurements, without socket or thread.
 *
 * No memory is touched: an address is the place of a number in the model, or it is refused. ASAM MCD-1 XCP 1.4, part 2.
 * Written by stickslip. */
#ifndef FMU_XCP_SLAVE_H
#define FMU_XCP_SLAVE_H

/* Numbers of the protocol: ASAM MCD-1 XCP 1.4, part 2. */
enum {
    XCP_OK = 0xFF, XCP_ERROR = 0xFE, XCP_SERVICE = 0xFC, XCP_SERVICE_TEXT = 0x01,
    XCP_SYNCH = 0x00, XCP_DAQ_ACTIVE = 0x11, XCP_UNKNOWN = 0x20, XCP_SYNTAX = 0x21, XCP_OUT_OF_RANGE = 0x22,
    XCP_WRITE_PROTECTED = 0x23, XCP_ACCESS_DENIED = 0x24, XCP_MODE = 0x27, XCP_SEQUENCE = 0x29, XCP_DAQ_CONFIG = 0x2A,
    XCP_MEMORY = 0x30
};

#define XCP_HEAD 4U
#define XCP_LISTS 32U
#define XCP_PACKETS 1024U
#define XCP_PACKETS_A_LIST 0x7CU
#define XCP_ENTRIES 4096U
/* Sizes of the buffers for the thread, and for the socket [bytes]. */
#define XCP_RING (4U << 20)
#define XCP_OUT (1U << 16)
#define XCP_TEXT_END 200U

typedef struct {
    uint32_t first, count;
} xcp_entry;

typedef struct {
    uint32_t first, entries;
} xcp_packet;

typedef struct {
    uint32_t first, packets;
    uint8_t timestamp, prescaler, priority, left, selected, running, overload;
} xcp_list;

typedef enum { XCP_NOTHING, XCP_FREED, XCP_LISTED, XCP_PACKED, XCP_ENTERED } xcp_stage;

typedef struct {
    int connected;
    uint16_t counter;
    /* Where the next upload or download begins. */
    int points;
    uint32_t pointer;
    const char *text;
    xcp_stage stage;
    uint32_t lists_used, packets_used, entries_used;
    xcp_list lists[XCP_LISTS];
    xcp_packet packets[XCP_PACKETS];
    xcp_entry entries[XCP_ENTRIES];
    /* List, packet and entry that is written next. */
    int placed;
    uint32_t place[3];
    /* Bytes written to the ring, read from it, and pending for the socket. */
    uint32_t head, tail, pending;
    uint8_t out[XCP_OUT];
    uint8_t ring[XCP_RING];
} xcp_slave;

static void xcp_put16(uint8_t *into, uint32_t value) {
    into[0] = (uint8_t)value;
    into[1] = (uint8_t)(value >> 8);
}

static void xcp_put32(uint8_t *into, uint32_t value) {
    xcp_put16(into, value & 0xFFFFU);
    xcp_put16(into + 2, value >> 16);
}

static uint32_t xcp_get16(const uint8_t *from) { return (uint32_t)from[0] | ((uint32_t)from[1] << 8); }

static uint32_t xcp_get32(const uint8_t *from) { return xcp_get16(from) | (xcp_get16(from + 2) << 16); }

/* A double in the packet: little-endian on every machine. */
static void xcp_put_double(uint8_t *into, double value) {
    uint64_t bits;
    (void)memcpy(&bits, &value, sizeof bits);
    xcp_put32(into, (uint32_t)bits);
    xcp_put32(into + 4, (uint32_t)(bits >> 32));
}

static double xcp_get_double(const uint8_t *from) {
    const uint64_t bits = (uint64_t)xcp_get32(from) | ((uint64_t)xcp_get32(from + 4) << 32);
    double value;
    (void)memcpy(&value, &bits, sizeof value);
    return value;
}

/* Readable numbers: all of the model, then the time [s]. */
#define XCP_NUMBERS ((uint32_t)(sizeof(fmu_model) / sizeof(double)) + 1U)

static double xcp_number(const fmu_memory *memory, uint32_t number) {
    return (number + 1U == XCP_NUMBERS) ? memory->start + (double)memory->steps * FMU_STEP
                                        : ((const double *)(const void *)&memory->model)[number];
}

/* The number at an address if the bytes from there are complete numbers of the model, else -1. */
static int64_t xcp_place(uint32_t address, uint32_t bytes) {
    const uint32_t number = (address - FMU_XCP_BASE) / 8U;
    const int whole = (address >= FMU_XCP_BASE) && (((address - FMU_XCP_BASE) % 8U) == 0U) && ((bytes % 8U) == 0U);
    return (whole && (number < XCP_NUMBERS) && (bytes / 8U <= XCP_NUMBERS - number)) ? (int64_t)number : -1;
}

static uint32_t xcp_waiting(const xcp_slave *slave) { return slave->head - slave->tail; }

static void xcp_into_ring(xcp_slave *slave, const uint8_t *bytes, uint32_t count) {
    uint32_t k;
    for (k = 0; k < count; k++) {
        slave->ring[slave->head % XCP_RING] = bytes[k];
        slave->head++;
    }
}

static void xcp_from_ring(xcp_slave *slave, uint8_t *bytes, uint32_t count) {
    uint32_t k;
    for (k = 0; k < count; k++) {
        bytes[k] = slave->ring[slave->tail % XCP_RING];
        slave->tail++;
    }
}

/* Bytes of one row of a list, with the lengths before its packets. */
static uint32_t xcp_row(const xcp_slave *slave, const xcp_list *list) {
    uint32_t bytes = list->timestamp ? 4U : 0U;
    uint32_t packet, entry;
    for (packet = list->first; packet < list->first + list->packets; packet++) {
        const xcp_packet *it = &slave->packets[packet];
        bytes += 4U;
        for (entry = it->first; entry < it->first + it->entries; entry++) {
            bytes += 8U * slave->entries[entry].count;
        }
    }
    return bytes;
}

/* Puts the row of a list into the ring, all of it or nothing. */
static void xcp_sample_list(xcp_slave *slave, const fmu_memory *memory, uint32_t number) {
    xcp_list *list = &slave->lists[number];
    uint32_t packet, entry, k;
    if (xcp_waiting(slave) + xcp_row(slave, list) > XCP_RING) {
        list->overload = 1U;
        return;
    }
    for (packet = 0; packet < list->packets; packet++) {
        const xcp_packet *it = &slave->packets[list->first + packet];
        uint8_t bytes[2U + FMU_XCP_MAX_DTO];
        uint32_t length = 4U;
        bytes[2] = (uint8_t)(packet | (list->overload ? 0x80U : 0U));
        bytes[3] = (uint8_t)number;
        list->overload = 0U;
        if (list->timestamp && (packet == 0U)) {
            /* Microseconds of simulated time, which overflow after 71 minutes. */
            xcp_put32(bytes + length, (uint32_t)(uint64_t)((double)memory->steps * (FMU_STEP * 1e6)));
            length += 4U;
        }
        for (entry = it->first; entry < it->first + it->entries; entry++) {
            for (k = 0; k < slave->entries[entry].count; k++) {
                xcp_put_double(bytes + length, xcp_number(memory, slave->entries[entry].first + k));
                length += 8U;
            }
        }
        xcp_put16(bytes, length - 2U);
        xcp_into_ring(slave, bytes, length);
    }
}

/* After each step, with the lock. */
static void xcp_sample(xcp_slave *slave, const fmu_memory *memory) {
    uint32_t number;
    for (number = 0; number < slave->lists_used; number++) {
        xcp_list *list = &slave->lists[number];
        if (list->running) {
            list->left--;
            if (list->left == 0U) {
                list->left = list->prescaler;
                xcp_sample_list(slave, memory, number);
            }
        }
    }
}

static int xcp_runs(const xcp_slave *slave) {
    uint32_t number;
    for (number = 0; number < slave->lists_used; number++) {
        if (slave->lists[number].running) {
            return 1;
        }
    }
    return 0;
}

/* Whether a list can be started: every entry is written, and every packet has its place. */
static int xcp_startable(const xcp_slave *slave, const xcp_list *list) {
    uint32_t packet, entry, any = 0U;
    for (packet = 0; packet < list->packets; packet++) {
        const xcp_packet *it = &slave->packets[list->first + packet];
        uint32_t bytes = 2U + ((list->timestamp && (packet == 0U)) ? 4U : 0U);
        for (entry = it->first; entry < it->first + it->entries; entry++) {
            if (slave->entries[entry].count == 0U) {
                return 0;
            }
            any = 1U;
            bytes += 8U * slave->entries[entry].count;
        }
        if (bytes > FMU_XCP_MAX_DTO) {
            return 0;
        }
    }
    return any != 0U;
}

static void xcp_start(xcp_list *list) {
    list->running = 1U;
    list->overload = 0U;
    list->left = 1U;
}

static void xcp_stop_all(xcp_slave *slave) {
    uint32_t number;
    for (number = 0; number < slave->lists_used; number++) {
        slave->lists[number].running = 0U;
    }
}

static void xcp_free_lists(xcp_slave *slave) {
    slave->lists_used = 0U;
    slave->packets_used = 0U;
    slave->entries_used = 0U;
    slave->placed = 0;
    slave->stage = XCP_NOTHING;
}

/* From one stage of allocation to the next; several of the same may follow each other. */
static int xcp_come_to(xcp_slave *slave, xcp_stage before, xcp_stage after) {
    if ((slave->stage != before) && ((slave->stage != after) || (after == XCP_LISTED))) {
        return 0;
    }
    slave->stage = after;
    /* The place of the next entry is set after the last allocation. */
    slave->placed = 0;
    return 1;
}

/* Appends a frame; there is space, since the thread does not continue without it. */
static void xcp_push(xcp_slave *slave, const uint8_t *packet, uint32_t length) {
    uint8_t *at = slave->out + slave->pending;
    xcp_put16(at, length);
    xcp_put16(at + 2, slave->counter);
    slave->counter++;
    (void)memcpy(at + XCP_HEAD, packet, length);
    slave->pending += XCP_HEAD + length;
}

static uint32_t xcp_refuse(uint8_t *answer, uint8_t code) {
    answer[0] = XCP_ERROR;
    answer[1] = code;
    return 2U;
}

/* Sends the reason of a refusal as text before the answer. */
static void xcp_say(xcp_slave *slave, const char *text) {
    uint8_t packet[FMU_XCP_MAX_CTO] = {XCP_SERVICE, XCP_SERVICE_TEXT};
    size_t length = strlen(text);
    length = (length < XCP_TEXT_END) ? length : XCP_TEXT_END;
    (void)memcpy(packet + 2, text, length);
    packet[2U + length] = (uint8_t)'\n';
    packet[3U + length] = 0U;
    xcp_push(slave, packet, (uint32_t)length + 4U);
}

/* `count` bytes from the pointer, which moves past them. */
static uint32_t xcp_upload(xcp_slave *slave, const fmu_memory *memory, uint32_t count, uint8_t *answer) {
    int64_t number;
    uint32_t k;
    if ((count == 0U) || (count >= FMU_XCP_MAX_CTO)) {
        return xcp_refuse(answer, XCP_OUT_OF_RANGE);
    }
    if ((slave->text == NULL) && !slave->points) {
        return xcp_refuse(answer, XCP_SEQUENCE);
    }
    if ((slave->text == NULL) && (slave->pointer >= FMU_XCP_EPK_ADDRESS)) {
        const size_t from = slave->pointer - FMU_XCP_EPK_ADDRESS;
        if ((from > strlen(FMU_XCP_EPK)) || (count > strlen(FMU_XCP_EPK) - from)) {
            return xcp_refuse(answer, XCP_ACCESS_DENIED);
        }
        (void)memcpy(answer + 1, FMU_XCP_EPK + from, count);
        slave->pointer += count;
    } else if (slave->text != NULL) {
        if (count > strlen(slave->text)) {
            return xcp_refuse(answer, XCP_ACCESS_DENIED);
        }
        (void)memcpy(answer + 1, slave->text, count);
        slave->text += count;
    } else {
        number = xcp_place(slave->pointer, count);
        if (number < 0) {
            return xcp_refuse(answer, XCP_ACCESS_DENIED);
        }
        for (k = 0; k < count / 8U; k++) {
            xcp_put_double(answer + 1U + 8U * k, xcp_number(memory, (uint32_t)number + k));
        }
        slave->pointer += count;
    }
    answer[0] = XCP_OK;
    return 1U + count;
}

/* Writes parameters from the pointer: all of them, or none. */
static uint32_t xcp_download(xcp_slave *slave, fmu_memory *memory, const uint8_t *bytes, uint32_t count,
                             uint8_t *answer) {
    const int64_t number = xcp_place(slave->pointer, count);
    fmu_model model = memory->model;
    double *numbers = (double *)(void *)&model;
    const char *fault;
    uint32_t k;
    if (!slave->points || (slave->text != NULL)) {
        return xcp_refuse(answer, XCP_SEQUENCE);
    }
    if (number < 0) {
        return xcp_refuse(answer, XCP_ACCESS_DENIED);
    }
    if ((uint32_t)number + count / 8U > FMU_PARAMETERS) {
        return xcp_refuse(answer, XCP_WRITE_PROTECTED);
    }
    for (k = 0; k < count / 8U; k++) {
        const double value = xcp_get_double(bytes + 8U * k);
        if (!isfinite(value)) {
            xcp_say(slave, "A parameter must be a finite number.");
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        numbers[(uint32_t)number + k] = value;
    }
    fault = fmu_check(&model);
    if (fault != NULL) {
        xcp_say(slave, fault);
        return xcp_refuse(answer, XCP_OUT_OF_RANGE);
    }
    memory->model = model;
    memory->unchecked = 0;
    slave->pointer += count;
    answer[0] = XCP_OK;
    return 1U;
}

/* Commands of measurement. */
static uint32_t xcp_measure(xcp_slave *slave, const fmu_memory *memory, const uint8_t *c, uint8_t *answer) {
    const uint32_t number = xcp_get16(c + 2);
    xcp_list *list = (number < slave->lists_used) ? &slave->lists[number] : NULL;
    uint32_t k;
    answer[0] = XCP_OK;
    if ((((c[0] >= 0xE0U) && (c[0] <= 0xE2U)) || ((c[0] >= 0xD3U) && (c[0] <= 0xD5U))) && xcp_runs(slave)) {
        return xcp_refuse(answer, XCP_DAQ_ACTIVE);
    }
    switch (c[0]) {
    case 0xD6U: /* FREE_DAQ */
        xcp_stop_all(slave);
        xcp_free_lists(slave);
        slave->stage = XCP_FREED;
        return 1U;
    case 0xD5U: /* ALLOC_DAQ */
        if (!xcp_come_to(slave, XCP_FREED, XCP_LISTED)) {
            return xcp_refuse(answer, XCP_SEQUENCE);
        }
        if (number > XCP_LISTS) {
            return xcp_refuse(answer, XCP_MEMORY);
        }
        (void)memset(slave->lists, 0, sizeof slave->lists);
        for (k = 0; k < number; k++) {
            slave->lists[k].prescaler = 1U;
        }
        slave->lists_used = number;
        return 1U;
    case 0xD4U: /* ALLOC_ODT */
        if (!xcp_come_to(slave, XCP_LISTED, XCP_PACKED)) {
            return xcp_refuse(answer, XCP_SEQUENCE);
        }
        if (list == NULL) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        if ((c[4] > XCP_PACKETS_A_LIST) || (slave->packets_used + c[4] > XCP_PACKETS)) {
            return xcp_refuse(answer, XCP_MEMORY);
        }
        list->first = slave->packets_used;
        list->packets = c[4];
        (void)memset(&slave->packets[list->first], 0, c[4] * sizeof slave->packets[0]);
        slave->packets_used += c[4];
        return 1U;
    case 0xD3U: /* ALLOC_ODT_ENTRY */
        if (!xcp_come_to(slave, XCP_PACKED, XCP_ENTERED)) {
            return xcp_refuse(answer, XCP_SEQUENCE);
        }
        if ((list == NULL) || (c[4] >= list->packets)) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        if (slave->entries_used + c[5] > XCP_ENTRIES) {
            return xcp_refuse(answer, XCP_MEMORY);
        }
        slave->packets[list->first + c[4]].first = slave->entries_used;
        slave->packets[list->first + c[4]].entries = c[5];
        (void)memset(&slave->entries[slave->entries_used], 0, c[5] * sizeof slave->entries[0]);
        slave->entries_used += c[5];
        return 1U;
    case 0xE2U: /* SET_DAQ_PTR */
        if ((list == NULL) || (c[4] >= list->packets) || (c[5] >= slave->packets[list->first + c[4]].entries)) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        slave->placed = 1;
        slave->place[0] = number;
        slave->place[1] = c[4];
        slave->place[2] = c[5];
        return 1U;
    case 0xE1U: { /* WRITE_DAQ */
        const int64_t first = xcp_place(xcp_get32(c + 4), c[2]);
        const xcp_packet *packet;
        if (!slave->placed) {
            return xcp_refuse(answer, XCP_SEQUENCE);
        }
        if ((c[1] != 0xFFU) || (c[2] == 0U)) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        if ((first < 0) || (c[3] != 0U)) {
            return xcp_refuse(answer, XCP_ACCESS_DENIED);
        }
        packet = &slave->packets[slave->lists[slave->place[0]].first + slave->place[1]];
        slave->entries[packet->first + slave->place[2]].first = (uint32_t)first;
        slave->entries[packet->first + slave->place[2]].count = c[2] / 8U;
        slave->place[2]++;
        slave->placed = slave->place[2] < packet->entries;
        return 1U;
    }
    case 0xE0U: /* SET_DAQ_LIST_MODE */
        if (list == NULL) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        if ((c[1] & ~0x10U) != 0U) {
            return xcp_refuse(answer, XCP_MODE);
        }
        if ((xcp_get16(c + 4) != 0U) || (c[6] == 0U)) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        list->timestamp = (c[1] & 0x10U) != 0U;
        list->prescaler = c[6];
        list->priority = c[7];
        return 1U;
    case 0xDFU: /* GET_DAQ_LIST_MODE */
        if (list == NULL) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        (void)memset(answer + 1, 0, 7U);
        answer[1] = (uint8_t)(list->selected | (list->timestamp << 4) | (list->running << 6));
        answer[6] = list->prescaler;
        answer[7] = list->priority;
        return 8U;
    case 0xDEU: /* START_STOP_DAQ_LIST */
        if (list == NULL) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        if (c[1] > 2U) {
            return xcp_refuse(answer, XCP_MODE);
        }
        if ((c[1] == 1U) && !xcp_startable(slave, list)) {
            return xcp_refuse(answer, XCP_DAQ_CONFIG);
        }
        if (c[1] == 0U) {
            list->running = 0U;
        } else if (c[1] == 1U) {
            xcp_start(list);
        } else {
            list->selected = 1U;
        }
        answer[1] = 0U;
        return 2U;
    case 0xDDU: /* START_STOP_SYNCH */
        if (c[1] > 2U) {
            return xcp_refuse(answer, XCP_MODE);
        }
        for (k = 0; k < slave->lists_used; k++) {
            if ((c[1] == 1U) && slave->lists[k].selected && !xcp_startable(slave, &slave->lists[k])) {
                return xcp_refuse(answer, XCP_DAQ_CONFIG);
            }
        }
        for (k = 0; k < slave->lists_used; k++) {
            if ((c[1] == 1U) && slave->lists[k].selected) {
                xcp_start(&slave->lists[k]);
            } else if ((c[1] == 0U) || slave->lists[k].selected) {
                slave->lists[k].running = 0U;
            } else {
                /* It is not selected. */
            }
            slave->lists[k].selected = 0U;
        }
        return 1U;
    case 0xDCU: /* GET_DAQ_CLOCK */
        (void)memset(answer + 1, 0, 3U);
        xcp_put32(answer + 4, (uint32_t)(uint64_t)((double)memory->steps * (FMU_STEP * 1e6)));
        return 8U;
    case 0xDAU: /* GET_DAQ_PROCESSOR_INFO: dynamic, prescaler, time stamps, overload in the number of a packet. */
        answer[1] = 0x01U | 0x02U | 0x10U | 0x40U;
        xcp_put16(answer + 2, slave->lists_used);
        xcp_put16(answer + 4, 1U);
        answer[6] = 0U;
        answer[7] = 0x40U;
        return 8U;
    case 0xD9U: /* GET_DAQ_RESOLUTION_INFO: doubles; time stamps of 4 bytes, a microsecond each. */
        answer[1] = 8U;
        answer[2] = (uint8_t)(FMU_XCP_MAX_CTO / 8U * 8U);
        answer[3] = 8U;
        answer[4] = 0U;
        answer[5] = 0x34U;
        xcp_put16(answer + 6, 1U);
        return 8U;
    case 0xD8U: /* GET_DAQ_LIST_INFO */
        if (list == NULL) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        answer[1] = 0x04U;
        answer[2] = (uint8_t)list->packets;
        answer[3] = 0U;
        for (k = 0; k < list->packets; k++) {
            const uint32_t entries = slave->packets[list->first + k].entries;
            answer[3] = (entries > answer[3]) ? (uint8_t)entries : answer[3];
        }
        xcp_put16(answer + 4, 0U);
        return 6U;
    case 0xD7U: /* GET_DAQ_EVENT_INFO: the name is uploaded. */
        if (number != 0U) {
            return xcp_refuse(answer, XCP_OUT_OF_RANGE);
        }
        slave->text = FMU_XCP_EVENT;
        answer[1] = 0x44U;
        answer[2] = 0xFFU;
        answer[3] = (uint8_t)strlen(FMU_XCP_EVENT);
        answer[4] = FMU_XCP_CYCLE;
        answer[5] = FMU_XCP_UNIT;
        answer[6] = 0U;
        return 7U;
    default:
        return xcp_refuse(answer, XCP_UNKNOWN);
    }
}

/* The shortest command of each code. */
static uint32_t xcp_shortest(uint8_t code) {
    switch (code) {
    case 0xFFU: case 0xFAU: case 0xF5U: case 0xDDU: case 0xC0U: return 2U;
    case 0xF0U: return 10U;
    case 0xEDU: return 16U;
    case 0xF6U: case 0xF4U: case 0xE1U: case 0xE0U: return 8U;
    case 0xE2U: case 0xD3U: return 6U;
    case 0xD4U: return 5U;
    case 0xDFU: case 0xDEU: case 0xD8U: case 0xD7U: case 0xD5U: return 4U;
    default: return 1U;
    }
}

/* The answer to a command, with the lock: its length. */
static uint32_t xcp_answer(xcp_slave *slave, fmu_memory *memory, const uint8_t *c, uint32_t length, uint8_t *answer) {
    answer[0] = XCP_OK;
    if (length < xcp_shortest(c[0])) {
        return xcp_refuse(answer, XCP_SYNTAX);
    }
    switch (c[0]) {
    case 0xFFU: /* CONNECT: calibration, measurement; optional modes can be queried; bytes, little-endian. */
        xcp_stop_all(slave);
        xcp_free_lists(slave);
        slave->tail = slave->head;
        slave->connected = 1;
        slave->points = 0;
        slave->text = NULL;
        answer[1] = 0x01U | 0x04U;
        answer[2] = 0x80U;
        answer[3] = FMU_XCP_MAX_CTO;
        xcp_put16(answer + 4, FMU_XCP_MAX_DTO);
        answer[6] = 1U;
        answer[7] = 1U;
        return 8U;
    case 0xFEU: /* DISCONNECT */
        xcp_stop_all(slave);
        xcp_free_lists(slave);
        slave->tail = slave->head;
        slave->connected = 0;
        return 1U;
    case 0xFDU: /* GET_STATUS */
        (void)memset(answer + 1, 0, 5U);
        answer[1] = xcp_runs(slave) ? 0x40U : 0U;
        return 6U;
    case 0xFCU: /* SYNCH */
        return xcp_refuse(answer, XCP_SYNCH);
    case 0xFBU: /* GET_COMM_MODE_INFO: no block mode, no queue; driver 1.0. */
        (void)memset(answer + 1, 0, 7U);
        answer[7] = 0x10U;
        return 8U;
    case 0xFAU: /* GET_ID: the text is uploaded. */
        slave->text = (c[1] == 0U) ? FMU_XCP_NAME : ((c[1] == 1U) ? FMU_XCP_FILE : ((c[1] == 5U) ? FMU_XCP_EPK : ""));
        (void)memset(answer + 1, 0, 3U);
        xcp_put32(answer + 4, (uint32_t)strlen(slave->text));
        return 8U;
    case 0xC0U: /* GET_VERSION of protocol and transport */
        if (c[1] != 0U) {
            return xcp_refuse(answer, XCP_UNKNOWN);
        }
        answer[1] = 0U;
        answer[2] = 1U;
        answer[3] = 4U;
        answer[4] = 1U;
        answer[5] = 4U;
        return 6U;
    case 0xF6U: /* SET_MTA */
    case 0xF4U: /* SHORT_UPLOAD */
    case 0xEDU: /* SHORT_DOWNLOAD */
        if (c[3] != 0U) {
            return xcp_refuse(answer, XCP_ACCESS_DENIED);
        }
        slave->text = NULL;
        slave->points = 1;
        slave->pointer = xcp_get32(c + 4);
        if (c[0] == 0xF4U) {
            return xcp_upload(slave, memory, c[1], answer);
        }
        if (c[0] == 0xEDU) {
            return ((uint32_t)c[1] + 8U > length) ? xcp_refuse(answer, XCP_SYNTAX)
                                                  : xcp_download(slave, memory, c + 8, c[1], answer);
        }
        return 1U;
    case 0xF5U: /* UPLOAD */
        return xcp_upload(slave, memory, c[1], answer);
    case 0xF0U: /* DOWNLOAD */
        return ((uint32_t)c[1] + 2U > length) ? xcp_refuse(answer, XCP_SYNTAX)
                                              : xcp_download(slave, memory, c + 2, c[1], answer);
    default:
        return xcp_measure(slave, memory, c, answer);
    }
}

#endif /* FMU_XCP_SLAVE_H */
