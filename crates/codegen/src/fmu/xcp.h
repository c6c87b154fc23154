/* XCP on Ethernet in a model, as FMI-LS-XCP 1.0 describes it: one master by TCP or UDP. Written by stickslip.
 *
 * The service runs in a separate thread. Commands and steps exclude each other; a step waits at most for one command,
 * and never for a socket. After each step the numbers that a master measures go into a ring, which the thread sends;
 * rows without space there are dropped, and the next one has the overload mark. On Windows there is no service. */
#ifndef FMU_XCP_H
#define FMU_XCP_H

#if !defined(_WIN32)
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <unistd.h>

/* Systems without MSG_NOSIGNAL suppress the signal of a closed connection by other means. */
#if !defined(MSG_NOSIGNAL)
#define MSG_NOSIGNAL 0
#endif
#endif

/* Options of the service, in the order of their references after those of the model. */
typedef enum { XCP_TCP_ENABLE, XCP_TCP_PORT, XCP_TCP_ADDRESS, XCP_UDP_ENABLE, XCP_UDP_PORT, XCP_UDP_ADDRESS } xcp_option;

#define XCP_OPTIONS 6U
/* Longest text of an address, with its end. */
#define XCP_TEXT 64U

typedef struct {
    int enable;
    int port;
    char address[XCP_TEXT];
} xcp_door;

/* By TCP and by UDP. */
typedef struct {
    xcp_door doors[2];
} xcp_options;

static void xcp_defaults(xcp_options *options) {
    size_t k;
    (void)memset(options, 0, sizeof *options);
    for (k = 0; k < 2U; k++) {
        options->doors[k].enable = (k == 0U);
        options->doors[k].port = FMU_XCP_PORT;
        (void)strcpy(options->doors[k].address, FMU_XCP_LISTEN);
    }
}

#if defined(_WIN32)

typedef struct {
    int unused;
} xcp_service;

#else

#include "xcp_slave.h"

/* With FMU_EARLY_GLIBC a shared library asks for the first versions of these functions, which all systems have, and not
 * for those of the computer that compiles it. It must be linked to libpthread.so.0. */
#if defined(FMU_EARLY_GLIBC) && defined(__GLIBC__)
#if defined(__x86_64__) && defined(__LP64__)
#define XCP_EARLY(name) __asm__(".symver " #name ", " #name "@GLIBC_2.2.5")
#elif defined(__aarch64__)
#define XCP_EARLY(name) __asm__(".symver " #name ", " #name "@GLIBC_2.17")
#endif
#endif
#if defined(XCP_EARLY)
XCP_EARLY(pthread_create);
XCP_EARLY(pthread_join);
XCP_EARLY(pthread_mutexattr_init);
XCP_EARLY(pthread_mutexattr_settype);
XCP_EARLY(pthread_mutexattr_destroy);
#endif

typedef struct {
    pthread_mutex_t lock;
    pthread_t thread;
    /* The options at the start, and whether it uses UDP. */
    xcp_options options;
    int by_datagrams;
    /* The socket, the master's connection or -1, and a pipe that ends the thread. */
    int door, peer, ending[2];
    struct sockaddr_storage master;
    socklen_t master_length;
    /* Whether a command waits for the lock. */
    int waits;
    /* Received and not yet answered [bytes]. */
    uint32_t received;
    uint8_t in[XCP_HEAD + 0xFFFFU];
    xcp_slave slave;
} xcp_service;

/* One command; without a connection only CONNECT is answered. */
static void xcp_command(xcp_service *service, fmu_memory *memory, const uint8_t *command, uint32_t length) {
    uint8_t answer[FMU_XCP_MAX_CTO + 1U];
    uint32_t answer_length;
    if (!service->slave.connected && (command[0] != 0xFFU)) {
        return;
    }
    __atomic_store_n(&service->waits, 1, __ATOMIC_RELEASE);
    (void)pthread_mutex_lock(&service->lock);
    __atomic_store_n(&service->waits, 0, __ATOMIC_RELEASE);
    answer_length = xcp_answer(&service->slave, memory, command, length, answer);
    (void)pthread_mutex_unlock(&service->lock);
    xcp_push(&service->slave, answer, answer_length);
}

/* The master has disconnected. */
static void xcp_leave(xcp_service *service) {
    (void)pthread_mutex_lock(&service->lock);
    xcp_stop_all(&service->slave);
    xcp_free_lists(&service->slave);
    service->slave.connected = 0;
    service->slave.tail = service->slave.head;
    (void)pthread_mutex_unlock(&service->lock);
    if (!service->by_datagrams && (service->peer >= 0)) {
        (void)close(service->peer);
    }
    service->peer = -1;
    service->received = 0U;
    service->slave.pending = 0U;
    service->slave.counter = 0U;
}

/* Space for the answer of one command: a text and the answer. */
#define XCP_ROOM (2U * (XCP_HEAD + FMU_XCP_MAX_CTO + 1U))

/* Executes the complete commands; 0 if the bytes are not a frame. */
static int xcp_receive(xcp_service *service, fmu_memory *memory) {
    uint32_t at = 0U;
    while ((service->received - at >= XCP_HEAD) && (service->slave.pending + XCP_ROOM <= XCP_OUT)) {
        const uint32_t length = xcp_get16(service->in + at);
        if ((length == 0U) || (length > FMU_XCP_MAX_CTO)) {
            return 0;
        }
        if (service->received - at < XCP_HEAD + length) {
            break;
        }
        xcp_command(service, memory, service->in + at + XCP_HEAD, length);
        at += XCP_HEAD + length;
    }
    (void)memmove(service->in, service->in + at, service->received - at);
    service->received -= at;
    return 1;
}

/* Takes measurements out of the ring while there is space: with UDP as many as fit in one datagram. */
static void xcp_fill(xcp_service *service) {
    const uint32_t most = service->by_datagrams ? XCP_HEAD + FMU_XCP_MAX_DTO : XCP_OUT - XCP_ROOM;
    (void)pthread_mutex_lock(&service->lock);
    while (xcp_waiting(&service->slave) > 0U) {
        uint8_t packet[FMU_XCP_MAX_DTO];
        uint8_t length[2];
        const uint32_t begin = service->slave.tail;
        xcp_from_ring(&service->slave, length, 2U);
        if (service->slave.pending + XCP_HEAD + xcp_get16(length) > most) {
            service->slave.tail = begin;
            break;
        }
        xcp_from_ring(&service->slave, packet, xcp_get16(length));
        xcp_push(&service->slave, packet, xcp_get16(length));
    }
    (void)pthread_mutex_unlock(&service->lock);
}

/* Sends pending bytes as far as the socket accepts them; 0 if the master has disconnected. */
static int xcp_send(xcp_service *service) {
    while (service->slave.pending > 0U) {
        const struct sockaddr *master = (const struct sockaddr *)(const void *)&service->master;
        const ssize_t sent =
            service->by_datagrams
                ? sendto(service->door, service->slave.out, service->slave.pending, MSG_NOSIGNAL, master, service->master_length)
                : send(service->peer, service->slave.out, service->slave.pending, MSG_NOSIGNAL);
        if (sent < 0) {
            return (errno == EAGAIN) || (errno == EWOULDBLOCK) || (errno == EINTR) || (errno == ENOBUFS);
        }
        (void)memmove(service->slave.out, service->slave.out + sent, service->slave.pending - (size_t)sent);
        service->slave.pending -= (uint32_t)sent;
    }
    return 1;
}

static int xcp_alike(const struct sockaddr_storage *one, const struct sockaddr_storage *other) {
    if (one->ss_family != other->ss_family) {
        return 0;
    }
    if (one->ss_family == AF_INET) {
        const struct sockaddr_in *a = (const void *)one, *b = (const void *)other;
        return (a->sin_port == b->sin_port) && (a->sin_addr.s_addr == b->sin_addr.s_addr);
    } else {
        const struct sockaddr_in6 *a = (const void *)one, *b = (const void *)other;
        return (a->sin6_port == b->sin6_port) && (memcmp(&a->sin6_addr, &b->sin6_addr, sizeof a->sin6_addr) == 0);
    }
}

/* A datagram: of the master, or of a new master. */
static void xcp_datagram(xcp_service *service, fmu_memory *memory) {
    struct sockaddr_storage from;
    socklen_t length = sizeof from;
    ssize_t got;
    (void)memset(&from, 0, sizeof from);
    got = recvfrom(service->door, service->in, sizeof service->in, 0, (struct sockaddr *)(void *)&from, &length);
    if (got <= 0) {
        return;
    }
    if (service->slave.connected && !xcp_alike(&from, &service->master)) {
        int measures;
        (void)pthread_mutex_lock(&service->lock);
        measures = xcp_runs(&service->slave);
        (void)pthread_mutex_unlock(&service->lock);
        /* A measuring master is not replaced; an idle one may have left without DISCONNECT. */
        if (measures || ((uint32_t)got <= XCP_HEAD) || (service->in[XCP_HEAD] != 0xFFU)) {
            return;
        }
        service->slave.connected = 0;
    }
    if (!service->slave.connected) {
        service->master = from;
        service->master_length = length;
        service->slave.counter = 0U;
        service->slave.pending = 0U;
    }
    service->received = (uint32_t)got;
    /* Invalid frames and frames without space are dropped: a master repeats them. */
    (void)xcp_receive(service, memory);
    service->received = 0U;
}

static void xcp_connection(xcp_service *service, fmu_memory *memory) {
    const ssize_t got =
        recv(service->peer, service->in + service->received, sizeof service->in - service->received, 0);
    if ((got == 0) || ((got < 0) && (errno != EAGAIN) && (errno != EWOULDBLOCK) && (errno != EINTR))) {
        xcp_leave(service);
        return;
    }
    service->received += (got > 0) ? (uint32_t)got : 0U;
    if (!xcp_receive(service, memory)) {
        xcp_leave(service);
    }
}

/* Sends the remaining measurements before the service ends, if the master accepts them within a second. */
static void xcp_finish(xcp_service *service) {
    int tries;
    for (tries = 0; (tries < 1000) && service->slave.connected; tries++) {
        do {
            xcp_fill(service);
            if (!xcp_send(service)) {
                return;
            }
        } while ((service->slave.pending == 0U) && (xcp_waiting(&service->slave) > 0U));
        if (service->slave.pending == 0U) {
            return;
        }
        (void)poll(NULL, 0, 1);
    }
}

typedef struct {
    xcp_service *service;
    fmu_memory *memory;
} xcp_begin_with;

static void *xcp_run(void *with) {
    xcp_service *service = ((xcp_begin_with *)with)->service;
    fmu_memory *memory = ((xcp_begin_with *)with)->memory;
    free(with);
    for (;;) {
        struct pollfd watched[2];
        /* With UDP the master uses the socket itself. */
        const int speaks = service->by_datagrams || (service->peer >= 0);
        int measures;
        (void)pthread_mutex_lock(&service->lock);
        measures = xcp_runs(&service->slave) || (xcp_waiting(&service->slave) > 0U);
        (void)pthread_mutex_unlock(&service->lock);
        watched[0].fd = service->ending[0];
        watched[0].events = POLLIN;
        watched[1].fd = (service->peer >= 0) ? service->peer : service->door;
        /* Commands wait in the socket while there is no space for their answers. */
        watched[1].events = (service->received < sizeof service->in) ? POLLIN : 0;
        if (speaks && (service->slave.pending > 0U)) {
            watched[1].events |= POLLOUT;
        }
        (void)poll(watched, 2, measures ? 2 : -1);
        if ((watched[0].revents & POLLIN) != 0) {
            xcp_finish(service);
            return NULL;
        }
        if ((watched[1].events & POLLIN) && ((watched[1].revents & (POLLIN | POLLHUP | POLLERR)) != 0)) {
            if (service->by_datagrams) {
                xcp_datagram(service, memory);
            } else if (service->peer >= 0) {
                xcp_connection(service, memory);
            } else {
                const int yes = 1;
                service->peer = accept(service->door, NULL, NULL);
                if (service->peer >= 0) {
                    (void)fcntl(service->peer, F_SETFL, O_NONBLOCK);
                    (void)setsockopt(service->peer, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
                }
            }
        }
        if (service->by_datagrams || (service->peer >= 0)) {
            int going = 1;
            do {
                xcp_fill(service);
                going = xcp_send(service) && xcp_receive(service, memory);
            } while (going && (service->slave.pending == 0U) && (xcp_waiting(&service->slave) > 0U));
            if (!going) {
                xcp_leave(service);
            }
        }
    }
}

/* Opens the socket of an address; -1, with `errno`, if it cannot be opened. */
static int xcp_open(const xcp_door *at, int by_datagrams) {
    struct sockaddr_in four;
    struct sockaddr_in6 six;
    const struct sockaddr *address = (const struct sockaddr *)(const void *)&four;
    socklen_t length = sizeof four;
    const int yes = 1;
    int door;
    (void)memset(&four, 0, sizeof four);
    (void)memset(&six, 0, sizeof six);
    four.sin_family = AF_INET;
    four.sin_port = htons((uint16_t)at->port);
    six.sin6_family = AF_INET6;
    six.sin6_port = htons((uint16_t)at->port);
    if (inet_pton(AF_INET, at->address, &four.sin_addr) != 1) {
        if (inet_pton(AF_INET6, at->address, &six.sin6_addr) != 1) {
            errno = EINVAL;
            return -1;
        }
        address = (const struct sockaddr *)(const void *)&six;
        length = sizeof six;
    }
    door = socket(address->sa_family, by_datagrams ? SOCK_DGRAM : SOCK_STREAM, 0);
    if (door < 0) {
        return -1;
    }
    if (!by_datagrams) {
        /* The same port can be used again immediately after a run. */
        (void)setsockopt(door, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    }
    if ((bind(door, address, length) != 0) || (!by_datagrams && (listen(door, 1) != 0)) ||
        (fcntl(door, F_SETFL, O_NONBLOCK) != 0)) {
        const int fault = errno;
        (void)close(door);
        errno = fault;
        return -1;
    }
    return door;
}

static void xcp_close(xcp_service *service) {
    if (service->peer >= 0) {
        (void)close(service->peer);
    }
    if (service->door >= 0) {
        (void)close(service->door);
    }
    (void)close(service->ending[0]);
    (void)close(service->ending[1]);
    (void)pthread_mutex_destroy(&service->lock);
    free(service);
}

/* The service at the address of the options; NULL, with `errno`, if it cannot be started. */
static xcp_service *xcp_begin(const xcp_options *options, fmu_memory *memory) {
    xcp_service *service = calloc(1, sizeof *service);
    xcp_begin_with *with = malloc(sizeof *with);
    pthread_mutexattr_t attributes;
    int fault = ENOMEM;
    if ((service == NULL) || (with == NULL) || (pipe(service->ending) != 0)) {
        free(service);
        free(with);
        errno = fault;
        return NULL;
    }
    service->options = *options;
    service->by_datagrams = !options->doors[0].enable;
    service->peer = -1;
    /* An importer may read a number while a fault is reported to it. */
    (void)pthread_mutexattr_init(&attributes);
    (void)pthread_mutexattr_settype(&attributes, PTHREAD_MUTEX_RECURSIVE);
    (void)pthread_mutex_init(&service->lock, &attributes);
    (void)pthread_mutexattr_destroy(&attributes);
    service->door = xcp_open(&options->doors[service->by_datagrams], service->by_datagrams);
    fault = errno;
    with->service = service;
    with->memory = memory;
    if (service->door >= 0) {
        fault = pthread_create(&service->thread, NULL, xcp_run, with);
        if (fault == 0) {
            return service;
        }
    }
    free(with);
    xcp_close(service);
    errno = fault;
    return NULL;
}

static void xcp_end(xcp_service *service) {
    (void)!write(service->ending[1], "", 1U);
    (void)pthread_join(service->thread, NULL);
    xcp_close(service);
}

/* A waiting command has priority; it is short. */
static void xcp_yield(const xcp_service *service) {
    int tries;
    for (tries = 0; (tries < 1000) && __atomic_load_n(&service->waits, __ATOMIC_ACQUIRE); tries++) {
        (void)sched_yield();
    }
}

#endif /* _WIN32 */

#endif /* FMU_XCP_H */
