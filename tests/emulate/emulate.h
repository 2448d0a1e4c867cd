/* Runs a Linux program for x86-64 on an emulated Sapphire Rapids.
 *
 * The processor is Bochs, as a Python wheel carries it (tests/emulate.sh fetches it); Python itself is not used. This
 * program is linked with that library and defines some of its functions anew: the loader takes ours (machine.c).
 *
 * Memory     An address means the same to the guest, to the emulated processor and to this process: pages of 1 GiB map
 *            the lowest TiB to itself, and what the guest maps is mapped here, in that TiB. So a system call takes
 *            pointers as they are, and what this process may not touch, the guest may not either.
 * Calls      `syscall` leaves the loop of the processor; most calls go to the host with the same arguments (calls.c).
 * Threads    One runs at a time, in turns of a fixed number of instructions (threads.c).
 * Tiles      This build of Bochs has AVX-512, but neither AMX nor its bits of `cpuid`: amx.c has both.
 *
 * Left out on purpose: signals to the guest (handlers are noted, never called), new processes, sockets, the vdso,
 * protection keys, pages that must not be executed (they are), tiles of bf16, tiles in `xsave`. A call that is left out
 * answers ENOSYS with a line on standard error; an instruction that is ends the program with its place. */
#ifndef EMULATE_H
#define EMULATE_H

#include <stdbool.h>
#include <stdint.h>

typedef uint8_t u8;
typedef uint16_t u16;
typedef uint32_t u32;
typedef uint64_t u64;

enum { RAX, RCX, RDX, RBX, RSP, RBP, RSI, RDI, R8, R9, R10, R11, R12, R13, R14, R15 };
enum { PAGE = 4096 };

/* Bounds of what the guest maps: above whatever a small program has low, below 40 bits, all this Bochs can address. */
#define FLOOR 0x1000000000ull
#define CEILING 0x10000000000ull

/* --- machine.c: the processor --- */

void start_machine(void);
/* Runs until the guest asks for a system call (true), or `turn` instructions are over (false). */
bool run(u64 turn);
u64 executed(void);
u64 get(int reg);
void set(int reg, u64 value);
u64 get_pc(void);
void set_pc(u64 pc);
void set_fs(u64 base);
u64 get_fs(void);
u32 get_flags(void);
void set_flags(u32 flags);
/* Vectors, masks and the rest of the extended state but tiles, to or from a page of the guest. */
void save_vectors(void *page);
void restore_vectors(const void *page);
/* Forgets decoded instructions: code may have changed behind the processor. */
void forget_code(void);
/* Says what happened and where, and ends with 128 + `signal`. */
__attribute__((noreturn)) void fault(int signal, const char *what, u64 address);
__attribute__((noreturn)) void leave(int code);
__attribute__((noreturn, format(printf, 1, 2))) void die(const char *format, ...);

/* --- amx.c: tiles --- */

/* State of the matrix unit of one thread. Palette 0: not configured. */
struct tiles {
    u8 palette, start_row, rows[8];
    u16 columns[8]; /* in bytes */
    u8 data[8][16][64];
};
extern struct tiles tiles;
/* Carries out the instruction at `pc` if it is one of tiles: its length, 0 if not, -1 if it must fault. */
int tile_instruction(u64 pc);
void tile_features(u32 leaf, u32 part, u32 answer[4]);

/* --- program.c: a program and its first stack --- */

/* Maps the program and what interprets it; sets the first instruction and the stack. */
void load(char **arguments, char **environment);
extern char program_path[4096];

/* --- calls.c: system calls --- */

#define BLOCK INT64_MIN /* no answer yet: try again later */
long call(u64 number, const u64 *arguments);
long map(u64 address, u64 size, int protection, int flags, int fd, u64 offset);

/* --- threads.c: who runs --- */

struct thread {
    struct thread *next; /* in a ring */
    int id;
    u64 registers[16], pc, fs;
    u32 flags;
    void *vectors;       /* a page of the guest */
    struct tiles tiles;  /* unless it runs */
    bool waits;          /* for `call` to have an answer */
    u64 number, arguments[6];
    u64 deadline;        /* of that call, in ns of the monotonic clock; 0: none yet */
    u64 futex;           /* waits for a wake of this address */
    u32 bits;
    u64 clear;           /* to zero at the end */
    u64 mask;            /* of signals */
    u64 stack[3];        /* for signals */
};
extern struct thread *current;
void start_threads(void);
__attribute__((noreturn)) void schedule(void);
bool alone(void);
u64 now(void);
long new_thread(u64 flags, u64 stack, u64 parent, u64 child, u64 fs);
__attribute__((noreturn)) void lost_thread(void);
void end_thread(void);
long wait_futex(u64 address, u32 value, u32 bits, u64 deadline);
long wake_futex(u64 address, u64 most, u32 bits);

#endif
