/* A mass with Coulomb friction as a separate machine process, over datagrams or shared memory:
 *
 *     cc -std=c99 -O2 -o mass mass.c -lm
 *     ./mass udp 9750 &    then: stickslip measure friction --io udp:127.0.0.1:9750
 *     ./mass shm axis &    then: stickslip serve --io shm:axis
 */
#define _DEFAULT_SOURCE
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "machine.h"
#include "mass.h"

static void fail(const char *what) {
    perror(what);
    exit(1);
}

/* Datagrams: one frame each; the answer goes to the sender. */
static void over_udp(int port) {
    const int line = socket(AF_INET, SOCK_DGRAM, 0);
    struct sockaddr_in local, peer;
    socklen_t size = sizeof local;
    memset(&local, 0, sizeof local);
    local.sin_family = AF_INET;
    local.sin_port = htons((uint16_t)port);
    local.sin_addr.s_addr = htonl(INADDR_LOOPBACK); /* every process with access to this port can move the machine */
    if (line < 0 || bind(line, (struct sockaddr *)&local, size) != 0 ||
        getsockname(line, (struct sockaddr *)&local, &size) != 0) {
        fail("cannot listen");
    }
    printf("udp:127.0.0.1:%d\n", ntohs(local.sin_port));
    fflush(stdout);
    for (;;) {
        unsigned char in[IO_LONGEST], out[IO_LONGEST];
        size = sizeof peer;
        const ssize_t length = recvfrom(line, in, sizeof in, 0, (struct sockaddr *)&peer, &size);
        const size_t answer = length < 0 ? 0 : io_answer(in, (size_t)length, out);
        if (answer > 0 && sendto(line, out, answer, 0, (struct sockaddr *)&peer, size) < 0) {
            perror("cannot send an answer");
        }
    }
}

/* Layout of the shared memory, as in docs/src/frame.md. */
enum { SLOTS = 8 };
struct ring {
    struct {
        uint64_t length;
        unsigned char bytes[IO_LONGEST];
    } slot[SLOTS];
};
struct memory {
    unsigned char mark[64];
    struct {
        uint64_t value;
        unsigned char padding[56]; /* to a full cache line */
    } count[4];              /* written by software, read by machine, written by machine, read by software */
    unsigned char unused[192];
    struct ring from_software, from_machine;
    unsigned char rest[4096 - 512 - 2 * 1024];
};

static uint64_t load_count(uint64_t *count) { return __atomic_load_n(count, __ATOMIC_ACQUIRE); }
static void store_count(uint64_t *count, uint64_t value) { __atomic_store_n(count, value, __ATOMIC_RELEASE); }

static struct memory *mapped(const char *name) {
    static const unsigned char MARK[8] = { 'S', 'S', 'H', 'M', 1, 0, SLOTS, 0 };
    char path[256];
    snprintf(path, sizeof path, strchr(name, '/') ? "%s" : "/dev/shm/stickslip-%s", name);
    const int file = open(path, O_RDWR | O_CREAT, 0600);
    /* The lock marks a running machine; the system releases it when this process ends. */
    if (file < 0 || flock(file, LOCK_EX | LOCK_NB) != 0 || ftruncate(file, sizeof(struct memory)) != 0) {
        fail(path);
    }
    struct memory *m = mmap(NULL, sizeof *m, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (m == MAP_FAILED) {
        fail(path);
    }
    if (memcmp(m->mark, MARK, sizeof MARK) != 0) {
        memset(m, 0, sizeof *m);
        __atomic_thread_fence(__ATOMIC_RELEASE);
        memcpy(m->mark, MARK, sizeof MARK);
    }
    store_count(&m->count[1].value, load_count(&m->count[0].value)); /* discard frames for an earlier machine */
    return m;
}

static void over_memory(const char *name) {
    struct memory *const m = mapped(name);
    printf("shm:%s\n", name);
    fflush(stdout);
    for (;;) {
        const uint64_t taken = m->count[1].value, wrote = load_count(&m->count[0].value);
        if (taken == wrote) { /* sleep until the software writes */
            syscall(SYS_futex, &m->count[0].value, FUTEX_WAIT, (uint32_t)wrote, NULL, NULL, 0);
            continue;
        }
        unsigned char in[IO_LONGEST], out[IO_LONGEST];
        const uint64_t stated = m->from_software.slot[taken % SLOTS].length;
        const size_t length = stated < IO_LONGEST ? (size_t)stated : IO_LONGEST;
        memcpy(in, m->from_software.slot[taken % SLOTS].bytes, length);
        store_count(&m->count[1].value, taken + 1);
        const size_t answer = io_answer(in, length, out);
        const uint64_t mine = m->count[2].value;
        if (answer > 0 && mine - load_count(&m->count[3].value) < SLOTS) { /* a full ring drops the answer */
            m->from_machine.slot[mine % SLOTS].length = answer;
            memcpy(m->from_machine.slot[mine % SLOTS].bytes, out, answer);
            store_count(&m->count[2].value, mine + 1);
            syscall(SYS_futex, &m->count[2].value, FUTEX_WAKE, 1, NULL, NULL, 0);
        }
    }
}

int main(int count, char **words) {
    if (count == 3 && strcmp(words[1], "udp") == 0) {
        over_udp(atoi(words[2]));
    } else if (count == 3 && strcmp(words[1], "shm") == 0) {
        over_memory(words[2]);
    }
    fprintf(stderr, "%s udp PORT | shm NAME\n", words[0]);
    return 2;
}
