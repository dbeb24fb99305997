/* Delays the discovery of subscribers in a process of Fast DDS: load it by LD_PRELOAD, with FASTDDS_BUILTIN_TRANSPORTS=UDPv4.
 *
 * While the file $LATE_DISCOVERY exists, what other participants announce of their readers is lost, as on a network that drops
 * it. It is announced again until it is acknowledged. Source: RTPS 2.5, 9.4 (submessages) and 9.3.1.3 (ids of built-in endpoints).
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

enum { HEADER = 20, HEARTBEAT = 0x07, GAP = 0x08, DATA = 0x15 };
static const uint8_t SUBSCRIPTIONS_WRITER[4] = {0x00, 0x00, 0x04, 0xc2};

/* Where the id of the writer is in a submessage, counted from its start; 0 where it names none. */
static size_t writer_at(uint8_t kind)
{
    return kind == DATA ? 12 : kind == HEARTBEAT || kind == GAP ? 8 : 0;
}

static void spoil(uint8_t *data, ssize_t length)
{
    const char *hold = getenv("LATE_DISCOVERY");
    size_t size = length > 0 ? (size_t)length : 0, at = HEADER;

    if (size < HEADER || memcmp(data, "RTPS", 4) || !hold || access(hold, F_OK))
        return;
    while (at + 4 <= size) {
        size_t body = data[at + 1] & 1 ? data[at + 2] | data[at + 3] << 8 : data[at + 2] << 8 | data[at + 3];
        size_t id = writer_at(data[at]);

        if (id && at + id + 4 <= size && !memcmp(data + at + id, SUBSCRIPTIONS_WRITER, 4)) {
            memset(data, 'X', 4);  /* no message of RTPS any more */
            return;
        }
        if (!body)
            return;
        at += 4 + body;
    }
}

ssize_t recvmsg(int socket, struct msghdr *message, int flags)
{
    static ssize_t (*real)(int, struct msghdr *, int);
    ssize_t length;

    if (!real)
        real = (ssize_t (*)(int, struct msghdr *, int))dlsym(RTLD_NEXT, "recvmsg");
    length = real(socket, message, flags);
    if (length > 0 && message->msg_iovlen == 1)
        spoil(message->msg_iov[0].iov_base, length);
    return length;
}

ssize_t recvfrom(int socket, void *data, size_t size, int flags, struct sockaddr *from, socklen_t *from_size)
{
    static ssize_t (*real)(int, void *, size_t, int, struct sockaddr *, socklen_t *);
    ssize_t length;

    if (!real)
        real = (ssize_t (*)(int, void *, size_t, int, struct sockaddr *, socklen_t *))dlsym(RTLD_NEXT, "recvfrom");
    length = real(socket, data, size, flags, from, from_size);
    spoil(data, length);
    return length;
}
