/* Threads of the guest: one runs, in turns of a fixed number of instructions. A call that would block is asked again
 * whenever no thread can run, so that one never keeps the others from running. */
#define _GNU_SOURCE
#include "emulate.h"

#include <errno.h>
#include <limits.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

enum { TURN = 1 << 18, PAUSE_NS = 200000 };

struct thread *current;
static struct thread *running; /* whose state the processor holds */

bool alone(void) { return current->next == current; }

u64 now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000000000ull + time.tv_nsec;
}

static struct thread *create(int id)
{
    struct thread *thread = calloc(1, sizeof *thread);
    long page = map(0, PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (!thread || page < 0)
        die("no room for a thread");
    thread->id = id;
    thread->vectors = (void *)page;
    thread->stack[1] = 2; /* none: SS_DISABLE */
    return thread;
}

void start_threads(void)
{
    current = running = create(getpid());
    current->next = current;
}

/* --- state --- */

static void store(struct thread *thread)
{
    for (int reg = 0; reg < 16; reg++)
        thread->registers[reg] = get(reg);
    thread->pc = get_pc();
    thread->flags = get_flags();
    thread->fs = get_fs();
    thread->tiles = tiles;
    save_vectors(thread->vectors);
}

static void resume(struct thread *thread)
{
    if (running == thread)
        return;
    if (running)
        store(running);
    restore_vectors(thread->vectors);
    for (int reg = 0; reg < 16; reg++)
        set(reg, thread->registers[reg]);
    set_pc(thread->pc);
    set_flags(thread->flags);
    set_fs(thread->fs);
    tiles = thread->tiles;
    running = thread;
}

/* --- beginning and end --- */

long new_thread(u64 flags, u64 stack, u64 parent, u64 child, u64 fs)
{
    static int created;
    if ((flags & (CLONE_VM | CLONE_THREAD | CLONE_SETTLS)) != (CLONE_VM | CLONE_THREAD | CLONE_SETTLS)) {
        dprintf(2, "emulate: no new processes\n");
        return -ENOSYS;
    }
    struct thread *thread = create(current->id + ++created);
    store(thread);
    thread->registers[RAX] = 0;
    thread->registers[RSP] = stack;
    thread->fs = fs;
    thread->mask = current->mask;
    thread->clear = flags & CLONE_CHILD_CLEARTID ? child : 0;
    if (flags & CLONE_PARENT_SETTID)
        *(u32 *)parent = thread->id;
    if (flags & CLONE_CHILD_SETTID)
        *(u32 *)child = thread->id;
    thread->next = current->next;
    current->next = thread;
    return thread->id;
}

void end_thread(void)
{
    struct thread *gone = current, *previous = gone;
    if (alone())
        leave(0);
    if (gone->clear) {
        *(u32 *)gone->clear = 0;
        wake_futex(gone->clear, 1, ~0u);
    }
    while (previous->next != gone)
        previous = previous->next;
    previous->next = gone->next;
    current = previous;
    running = NULL;
    munmap(gone->vectors, PAGE);
    free(gone);
}

/* --- futexes --- */

long wait_futex(u64 address, u32 value, u32 bits, u64 deadline)
{
    if (!current->waits) {
        if (*(volatile u32 *)address != value)
            return -EAGAIN;
        current->futex = address;
        current->bits = bits;
        return BLOCK;
    }
    if (!current->futex)
        return 0;
    if (now() < deadline)
        return BLOCK;
    current->futex = 0;
    return -ETIMEDOUT;
}

long wake_futex(u64 address, u64 most, u32 bits)
{
    u64 woken = 0;
    for (struct thread *thread = current->next; woken < most; thread = thread->next) {
        if (thread->futex == address && thread->bits & bits) {
            thread->futex = 0;
            woken++;
        }
        if (thread == current)
            break;
    }
    return woken;
}

/* --- turns --- */

/* Asks the call of the current thread; true when it has an answer. */
static bool answered(void)
{
    struct thread *asking = current;
    long answer = call(asking->number, asking->arguments);
    if (current != asking)
        return false; /* the thread is no more */
    asking->waits = answer == BLOCK;
    if (asking->waits)
        return false;
    asking->deadline = 0;
    if (running == asking)
        set(RAX, answer);
    else
        asking->registers[RAX] = answer;
    return true;
}

/* Every thread waits for another: nothing will ever happen. */
static bool stuck(void)
{
    struct thread *thread = current;
    do {
        if (!thread->futex || thread->deadline != UINT64_MAX)
            return false;
        thread = thread->next;
    } while (thread != current);
    return true;
}

static void next_thread(void)
{
    struct thread *first = current;
    for (;;) {
        current = current->next;
        if (!current->waits || answered())
            return;
        if (current != first)
            continue;
        if (stuck())
            die("every thread waits for another one");
        nanosleep(&(struct timespec){ .tv_nsec = PAUSE_NS }, NULL);
    }
}

void schedule(void)
{
    for (;;) {
        resume(current);
        bool asks = run(TURN);
        if (!asks) {
            next_thread();
            continue;
        }
        static const int order[6] = { RDI, RSI, RDX, R10, R8, R9 };
        current->number = get(RAX);
        for (int i = 0; i < 6; i++)
            current->arguments[i] = get(order[i]);
        set(RCX, get_pc());
        set(R11, get_flags());
        if (!answered() || current->number == SYS_sched_yield)
            next_thread();
    }
}
