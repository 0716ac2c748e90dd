/* Ends a process in the middle of its writing, or lets its disk be full. Loaded before the C library. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static char below[PATH_MAX];
static long steps_left = -1, bytes_left = -1;

/* Die at the step after so many (-1: never); a disk takes so many bytes (-1: all). A write has two steps. */
void arm(const char *folder, long steps, long bytes) {
    if (realpath(folder, below) == NULL) abort();
    steps_left = steps;
    bytes_left = bytes;
}

static void step(void) {
    if (steps_left >= 0 && steps_left-- == 0) kill(getpid(), SIGKILL);
}

static int is_below(int fd) {
    char name[64], path[PATH_MAX];
    snprintf(name, sizeof name, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(name, path, sizeof path - 1);
    return length > 0 && *below && strncmp(path, below, strlen(below)) == 0;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define STEPS(kind, name, parameters, arguments) \
    kind name parameters { kind found = REAL(name) arguments; int kept = errno; step(); errno = kept; return found; }

ssize_t write(int fd, const void *data, size_t count) {
    if (!is_below(fd)) return REAL(write)(fd, data, count);
    if (bytes_left >= 0) {
        if (count > 0 && bytes_left == 0) { errno = ENOSPC; return -1; }
        if (count > (size_t)bytes_left) count = bytes_left;
        bytes_left -= count;
    }
    if (steps_left < 0) return REAL(write)(fd, data, count);
    ssize_t half = REAL(write)(fd, data, count / 2);
    step();
    ssize_t rest = REAL(write)(fd, (const char *)data + half, count - half);
    step();
    return rest < 0 ? rest : half + rest;
}

static int opened(int fd, int flags) {
    int kept = errno;
    if (flags & (O_CREAT | O_TRUNC)) step();
    errno = kept;
    return fd;
}

#define MODE(flags, mode) \
    mode_t mode = 0; \
    if (flags & (O_CREAT | __O_TMPFILE)) { va_list rest; va_start(rest, flags); mode = va_arg(rest, mode_t); va_end(rest); }

int open(const char *path, int flags, ...) { MODE(flags, mode) return opened(REAL(open)(path, flags, mode), flags); }
int open64(const char *path, int flags, ...) { MODE(flags, mode) return opened(REAL(open64)(path, flags, mode), flags); }
int openat(int at, const char *path, int flags, ...) { MODE(flags, mode) return opened(REAL(openat)(at, path, flags, mode), flags); }
int openat64(int at, const char *path, int flags, ...) { MODE(flags, mode) return opened(REAL(openat64)(at, path, flags, mode), flags); }

STEPS(int, rename, (const char *from, const char *to), (from, to))
STEPS(int, renameat, (int a, const char *from, int b, const char *to), (a, from, b, to))
STEPS(int, unlink, (const char *path), (path))
STEPS(int, unlinkat, (int at, const char *path, int flags), (at, path, flags))
STEPS(int, rmdir, (const char *path), (path))
STEPS(int, mkdir, (const char *path, mode_t mode), (path, mode))
STEPS(int, mkdirat, (int at, const char *path, mode_t mode), (at, path, mode))
STEPS(int, link, (const char *from, const char *to), (from, to))
STEPS(int, linkat, (int a, const char *from, int b, const char *to, int flags), (a, from, b, to, flags))
STEPS(int, symlink, (const char *to, const char *path), (to, path))
STEPS(int, chmod, (const char *path, mode_t mode), (path, mode))
STEPS(int, fchmod, (int fd, mode_t mode), (fd, mode))
STEPS(int, fsync, (int fd), (fd))
STEPS(int, ftruncate, (int fd, off_t size), (fd, size))
STEPS(int, ftruncate64, (int fd, off64_t size), (fd, size))
