/* A mass with Coulomb friction as a machine of its own, over datagrams or shared memory:
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

/* Datagrams: each has one frame; the answer goes to whoever sent it. */
static void over_udp(int port) {
    const int line = socket(AF_INET, SOCK_DGRAM, 0);
    struct sockaddr_in here, there;
    socklen_t size = sizeof here;
    memset(&here, 0, sizeof here);
    here.sin_family = AF_INET;
    here.sin_port = htons((uint16_t)port);
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK); /* who can reach it can move the machine */
    if (line < 0 || bind(line, (struct sockaddr *)&here, size) != 0 ||
        getsockname(line, (struct sockaddr *)&here, &size) != 0) {
        fail("cannot listen");
    }
    printf("udp:127.0.0.1:%d\n", ntohs(here.sin_port));
    fflush(stdout);
    for (;;) {
        unsigned char in[IO_LONGEST], out[IO_LONGEST];
        size = sizeof there;
        const ssize_t came = recvfrom(line, in, sizeof in, 0, (struct sockaddr *)&there, &size);
        const size_t answer = came < 0 ? 0 : io_answer(in, (size_t)came, out);
        if (answer > 0 && sendto(line, out, answer, 0, (struct sockaddr *)&there, size) < 0) {
            perror("an answer is lost");
        }
    }
}

/* The memory, as docs/src/frame.md lays it out. */
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
        unsigned char alone[56]; /* a cache line of its own */
    } count[4];              /* software wrote, machine took, machine wrote, software took */
    unsigned char unused[192];
    struct ring from_software, from_machine;
    unsigned char rest[4096 - 512 - 2 * 1024];
};

static uint64_t seen(uint64_t *count) { return __atomic_load_n(count, __ATOMIC_ACQUIRE); }
static void tell(uint64_t *count, uint64_t value) { __atomic_store_n(count, value, __ATOMIC_RELEASE); }

static struct memory *mapped(const char *name) {
    static const unsigned char MARK[8] = { 'S', 'S', 'H', 'M', 1, 0, SLOTS, 0 };
    char path[256];
    snprintf(path, sizeof path, strchr(name, '/') ? "%s" : "/dev/shm/stickslip-%s", name);
    const int file = open(path, O_RDWR | O_CREAT, 0600);
    /* The lock says that a machine lives here; the system ends it with this process, however that ends. */
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
    tell(&m->count[1].value, seen(&m->count[0].value)); /* what was meant for a machine before */
    return m;
}

static void over_memory(const char *name) {
    struct memory *const m = mapped(name);
    printf("shm:%s\n", name);
    fflush(stdout);
    for (;;) {
        const uint64_t taken = m->count[1].value, wrote = seen(&m->count[0].value);
        if (taken == wrote) { /* asleep until the software has written, and wakes */
            syscall(SYS_futex, &m->count[0].value, FUTEX_WAIT, (uint32_t)wrote, NULL, NULL, 0);
            continue;
        }
        unsigned char in[IO_LONGEST], out[IO_LONGEST];
        const uint64_t told = m->from_software.slot[taken % SLOTS].length;
        const size_t length = told < IO_LONGEST ? (size_t)told : IO_LONGEST;
        memcpy(in, m->from_software.slot[taken % SLOTS].bytes, length);
        tell(&m->count[1].value, taken + 1);
        const size_t answer = io_answer(in, length, out);
        const uint64_t mine = m->count[2].value;
        if (answer > 0 && mine - seen(&m->count[3].value) < SLOTS) { /* else it is lost */
            m->from_machine.slot[mine % SLOTS].length = answer;
            memcpy(m->from_machine.slot[mine % SLOTS].bytes, out, answer);
            tell(&m->count[2].value, mine + 1);
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
