/* System calls of the guest. Most go to the host as they are; those about memory, threads and signals are answered
 * here. A call that would block while other threads exist answers BLOCK, and is asked again. */
#define _GNU_SOURCE
#include "emulate.h"

#include <asm/prctl.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static long answer(long result) { return result == -1 ? -errno : result; }

static long host(u64 number, const u64 *a) { return answer(syscall(number, a[0], a[1], a[2], a[3], a[4], a[5])); }

/* --- memory --- */

static u64 whole_pages(u64 size) { return (size + PAGE - 1) & ~(u64)(PAGE - 1); }

long map(u64 address, u64 size, int protection, int flags, int fd, u64 offset)
{
    static u64 next = FLOOR;
    if (protection & PROT_EXEC)
        forget_code();
    flags &= ~MAP_32BIT;
    if (flags & (MAP_FIXED | MAP_FIXED_NOREPLACE)) {
        if (size > CEILING || address > CEILING - size)
            return -ENOMEM;
        return answer(syscall(SYS_mmap, address, size, protection, flags, fd, offset));
    }
    if (!size || size > CEILING - FLOOR)
        return size ? -ENOMEM : -EINVAL;
    for (bool again = false;; next += whole_pages(size)) {
        if (next + size > CEILING && again)
            return -ENOMEM;
        if (next + size > CEILING)
            next = FLOOR, again = true;
        long result = answer(syscall(SYS_mmap, next, size, protection, flags | MAP_FIXED_NOREPLACE, fd, offset));
        if (result == -EEXIST)
            continue;
        next += result < 0 ? 0 : whole_pages(size);
        return result;
    }
}

static long move(u64 address, u64 old_size, u64 size, int flags, u64 to)
{
    if (flags & MREMAP_FIXED)
        return to > CEILING - size ? -ENOMEM : answer(syscall(SYS_mremap, address, old_size, size, flags, to));
    long result = answer(syscall(SYS_mremap, address, old_size, size, flags & ~MREMAP_MAYMOVE));
    if (result != -ENOMEM || !(flags & MREMAP_MAYMOVE))
        return result;
    long place = map(0, size, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return place < 0 ? place : answer(syscall(SYS_mremap, address, old_size, size, flags | MREMAP_FIXED, place));
}

static long set_break(u64 wanted)
{
    static const u64 START = FLOOR / 2, MOST = 1ull << 34;
    static u64 end = FLOOR / 2;
    if (wanted < START || wanted > START + MOST)
        return end;
    u64 from = whole_pages(end), to = whole_pages(wanted);
    if (to < from)
        munmap((void *)to, from - to);
    if (to > from
        && map(from, to - from, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0) < 0)
        return end;
    return end = wanted;
}

/* --- waiting --- */

static u64 nanoseconds(const struct timespec *time) { return time->tv_sec * 1000000000ull + time->tv_nsec; }

/* When `time` from now is, or when `time` itself is on that clock; for ever without one. */
static u64 deadline(const struct timespec *time, bool absolute, clockid_t clock)
{
    if (!time)
        return UINT64_MAX;
    struct timespec reading;
    clock_gettime(clock, &reading);
    u64 at = nanoseconds(time), here = nanoseconds(&reading), most = 1ull << 62;
    u64 wait = !absolute ? at : at > here ? at - here : 0;
    return now() + (wait < most ? wait : most);
}

static void wait_until(u64 when)
{
    if (!current->waits)
        current->deadline = when;
}

static long futex(const u64 *a)
{
    int operation = a[1] & ~(FUTEX_PRIVATE_FLAG | FUTEX_CLOCK_REALTIME);
    bool absolute = operation == FUTEX_WAIT_BITSET;
    switch (operation) {
    case FUTEX_WAIT:
    case FUTEX_WAIT_BITSET:
        wait_until(deadline((void *)a[3], absolute,
            absolute && a[1] & FUTEX_CLOCK_REALTIME ? CLOCK_REALTIME : CLOCK_MONOTONIC));
        return wait_futex(a[0], a[2], absolute ? a[5] : ~0u, current->deadline);
    case FUTEX_WAKE:
        return wake_futex(a[0], a[2], ~0u);
    case FUTEX_WAKE_BITSET:
        return wake_futex(a[0], a[2], a[5]);
    }
    dprintf(2, "emulate: no futex operation %d\n", operation);
    return -ENOSYS;
}

static long sleep_until(u64 when)
{
    wait_until(when);
    return now() < current->deadline ? BLOCK : 0;
}

static long poll_files(const u64 *a)
{
    if (alone())
        return host(SYS_poll, a);
    struct timespec time = { (int)a[2] / 1000, (int)a[2] % 1000 * 1000000 };
    wait_until(deadline((int)a[2] < 0 ? NULL : &time, false, CLOCK_MONOTONIC));
    int ready = poll((void *)a[0], a[1], 0);
    return ready == 0 && now() < current->deadline ? BLOCK : answer(ready);
}

static long read_file(u64 number, const u64 *a)
{
    struct pollfd file = { .fd = a[0], .events = POLLIN };
    if (!alone() && !(fcntl(a[0], F_GETFL) & O_NONBLOCK) && poll(&file, 1, 0) == 0)
        return BLOCK;
    return host(number, a);
}

/* --- signals: noted, never delivered --- */

struct action {
    u64 words[4];
};

static long set_action(int number, const struct action *next, struct action *before)
{
    static struct action actions[65];
    if (number < 1 || number > 64)
        return -EINVAL;
    if (before)
        *before = actions[number];
    if (!next)
        return 0;
    actions[number] = *next;
    if (number == SIGPIPE && next->words[0] <= 1)
        signal(SIGPIPE, next->words[0] ? SIG_IGN : SIG_DFL); /* or writing to a closed pipe ends the emulator */
    return 0;
}

static long set_mask(int how, const u64 *next, u64 *before)
{
    u64 mask = current->mask;
    if (before)
        *before = mask;
    if (next)
        current->mask = how == SIG_BLOCK ? mask | *next : how == SIG_UNBLOCK ? mask & ~*next : *next;
    return 0;
}

static long set_signal_stack(const u64 *next, u64 *before)
{
    if (before)
        memcpy(before, current->stack, sizeof current->stack);
    if (next)
        memcpy(current->stack, next, sizeof current->stack);
    return 0;
}

static long send_signal(int number)
{
    if (!number)
        return 0;
    dprintf(2, "emulate: the program sends itself signal %d\n", number);
    fault(number, "signal", 0);
}

/* --- names --- */

static long read_link(u64 number, const u64 *a, const char *path, char *to, u64 size)
{
    if (strcmp(path, "/proc/self/exe"))
        return host(number, a);
    u64 length = strlen(program_path);
    length = length < size ? length : size;
    memcpy(to, program_path, length);
    return length;
}

static long set_thread_state(const u64 *a)
{
    enum { GET_PERMITTED = 0x1022, REQUEST = 0x1023, TILE_DATA = 18 };
    switch (a[0]) {
    case ARCH_SET_FS:
        set_fs(a[1]);
        return 0;
    case ARCH_GET_FS:
        *(u64 *)a[1] = get_fs();
        return 0;
    case GET_PERMITTED:
        *(u64 *)a[1] = 0x600e7;
        return 0;
    case REQUEST:
        return a[1] == TILE_DATA ? 0 : -EINVAL;
    }
    return -EINVAL;
}

static long unknown(u64 number)
{
    static bool said[1024];
    if (number >= 1024 || !said[number])
        dprintf(2, "emulate: no system call %lu\n", number);
    if (number < 1024)
        said[number] = true;
    return -ENOSYS;
}

long call(u64 number, const u64 *a)
{
    switch (number) {
    case SYS_mmap:
        return map(a[0], a[1], a[2], a[3], a[4], a[5]);
    case SYS_mprotect:
        if (a[2] & PROT_EXEC)
            forget_code();
        return host(number, a);
    case SYS_mremap:
        return move(a[0], a[1], a[2], a[3], a[4]);
    case SYS_brk:
        return set_break(a[0]);

    case SYS_read: case SYS_readv: case SYS_recvfrom: case SYS_recvmsg:
        return read_file(number, a);
    case SYS_poll:
        return poll_files(a);
    case SYS_futex:
        return futex(a);
    case SYS_nanosleep:
        return sleep_until(deadline((void *)a[0], false, CLOCK_MONOTONIC));
    case SYS_clock_nanosleep:
        return sleep_until(deadline((void *)a[2], a[1] & TIMER_ABSTIME, a[0]));

    case SYS_rt_sigaction:
        return set_action(a[0], (void *)a[1], (void *)a[2]);
    case SYS_rt_sigprocmask:
        return set_mask(a[0], (void *)a[1], (void *)a[2]);
    case SYS_sigaltstack:
        return set_signal_stack((void *)a[0], (void *)a[1]);
    case SYS_kill:
        return (int)a[0] == getpid() ? send_signal(a[1]) : host(number, a);
    case SYS_tkill:
        return send_signal(a[1]);
    case SYS_tgkill:
        return send_signal(a[2]);

    case SYS_arch_prctl:
        return set_thread_state(a);
    case SYS_clone:
        return new_thread(a[0], a[1], a[2], a[3], a[4]);
    case SYS_clone3: case SYS_rseq: /* the C library goes on without them */
        return -ENOSYS;
    case SYS_set_robust_list:
        return 0;
    case SYS_set_tid_address:
        current->clear = a[0];
        return current->id;
    case SYS_gettid:
        return current->id;
    case SYS_exit:
        end_thread();
        return 0;
    case SYS_exit_group:
        leave(a[0] & 0xff);

    case SYS_readlink:
        return read_link(number, a, (char *)a[0], (char *)a[1], a[2]);
    case SYS_readlinkat:
        return read_link(number, a, (char *)a[1], (char *)a[2], a[3]);

    /* files */
    case SYS_write: case SYS_open: case SYS_close: case SYS_stat: case SYS_fstat: case SYS_lstat: case SYS_lseek:
    case SYS_ioctl: case SYS_pread64: case SYS_pwrite64: case SYS_writev: case SYS_access: case SYS_pipe: case SYS_dup:
    case SYS_dup2: case SYS_fcntl: case SYS_flock: case SYS_fsync: case SYS_fdatasync: case SYS_truncate:
    case SYS_ftruncate: case SYS_getcwd: case SYS_chdir: case SYS_rename: case SYS_mkdir: case SYS_rmdir: case SYS_link:
    case SYS_unlink: case SYS_symlink: case SYS_chmod: case SYS_fchmod: case SYS_chown: case SYS_fchown: case SYS_umask:
    case SYS_statfs: case SYS_fstatfs: case SYS_getdents64: case SYS_openat: case SYS_mkdirat: case SYS_newfstatat:
    case SYS_unlinkat: case SYS_renameat: case SYS_linkat: case SYS_symlinkat: case SYS_fchmodat: case SYS_faccessat:
    case SYS_utimensat: case SYS_fallocate: case SYS_eventfd2: case SYS_dup3: case SYS_pipe2: case SYS_renameat2:
    case SYS_memfd_create: case SYS_copy_file_range: case SYS_statx: case SYS_faccessat2: case SYS_sendfile:
    case SYS_fadvise64:
    /* what the process is, and the time */
    case SYS_getpid: case SYS_getppid: case SYS_getuid: case SYS_geteuid: case SYS_getgid: case SYS_getegid:
    case SYS_uname: case SYS_getrlimit: case SYS_prlimit64: case SYS_getrusage: case SYS_sysinfo: case SYS_times:
    case SYS_time: case SYS_gettimeofday: case SYS_clock_gettime: case SYS_clock_getres: case SYS_getrandom:
    case SYS_sched_yield: case SYS_sched_getaffinity: case SYS_membarrier: case SYS_prctl:
    /* memory */
    case SYS_munmap: case SYS_madvise: case SYS_mincore: case SYS_msync:
        return host(number, a);
    }
    return unknown(number);
}
