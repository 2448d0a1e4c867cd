/* The processor: Bochs in long mode at the privilege of a user, with the hooks it calls.
 *
 * A function of Bochs bears its name in C++ as an assembler label. Those defined here take the place of its own. */
#define _GNU_SOURCE
#include "emulate.h"

#include <dlfcn.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* --- functions of Bochs --- */

void cpu_new(u32 cpu);
void cpu_loop(u32 cpu);
u64 cpu_get_pc(u32 cpu);
void cpu_set_pc(u32 cpu, u64 pc);
u64 cpu_get_reg64(u32 cpu, u32 reg);
void cpu_set_reg64(u32 cpu, u32 reg, u64 value);
u32 cpu_get_eflags(u32 cpu);
void cpu_set_eflags(u32 cpu, u32 flags);
void cpu_set_seg(u32 cpu, u32 seg, u32 present, u16 selector, u64 base, u32 limit, u16 attributes);
void cpu_set_cr0(u32 cpu, u32 value);
void cpu_set_cr3(u32 cpu, u64 value);
void cpu_set_cr4(u32 cpu, u64 value);
void cpu_set_efer(u32 cpu, u32 value);
void cpu_set_xcr0(u32 cpu, u32 value);
void cpu_set_fp_cw(u32 cpu, u16 value);
void cpu_set_fp_tw(u32 cpu, u16 value);
void cpu_set_mxcsr(u32 cpu, u32 value);
u64 cpu_get_cr2(u32 cpu);
void cpu_set_killbit(u32 cpu);
void cpu_clear_killbit(u32 cpu);
void settle_flags(void) __asm__("_ZN8BX_CPU_C11force_flagsEv");
void context_changed(void) __asm__("_ZN8BX_CPU_C22handleCpuContextChangeEv");
void flush_code(void) __asm__("_Z12flushICachesv");
void *sapphire_rapids(void *cpu) __asm__("_Z28create_sapphire_rapids_cpuidP8BX_CPU_C");

/* --- what this build asks of a C library newer than some --- */

/* By their labels: a newer header would turn these names into the ones defined here. */
unsigned long long number_of(const char *text, char **end, int base) __asm__("strtoull");
int scan(const char *text, const char *format, va_list list) __asm__("vsscanf");

unsigned long long wanted_strtoull(const char *text, char **end, int base) __asm__("__isoc23_strtoull");
unsigned long long wanted_strtoull(const char *text, char **end, int base) { return number_of(text, end, base); }

int wanted_sscanf(const char *text, const char *format, ...) __asm__("__isoc23_sscanf");
int wanted_sscanf(const char *text, const char *format, ...)
{
    va_list list;
    va_start(list, format);
    int count = scan(text, format, list);
    va_end(list);
    return count;
}

/* --- functions that take the place of those of Bochs --- */

static const u8 *last; /* the instruction that runs, as decoded */
static u64 left, given; /* instructions before and since the last `run` */
static u64 before;
static bool asked;

static unsigned length(const u8 *instruction) { return instruction[0x12]; }

/* The model this build starts with; its list of names ends before Sapphire Rapids. */
void *model(void *cpu) __asm__("_Z23create_corei3_cnl_cpuidP8BX_CPU_C");
void *model(void *cpu) { return sapphire_rapids(cpu); }

void features(void *self, u32 leaf, u32 part, u32 *answer)
    __asm__("_ZNK17sapphire_rapids_t14get_cpuid_leafEjjP16cpuid_function_t");
void features(void *self, u32 leaf, u32 part, u32 *answer)
{
    static void (*theirs)(void *, u32, u32, u32 *);
    if (!theirs)
        *(void **)&theirs = dlsym(RTLD_NEXT, "_ZNK17sapphire_rapids_t14get_cpuid_leafEjjP16cpuid_function_t");
    theirs(self, leaf, part, answer);
    tile_features(leaf, part, answer);
    if (leaf == 7 && part == 0) { /* `rep movsb` and `rep stosb` are fast on the processor, and slow here */
        answer[1] &= ~(1u << 9);
        answer[3] &= ~(1u << 4);
    }
}

void *host_address(void *cpu, u64 address, u32 access) __asm__("_ZN8BX_MEM_C14getHostMemAddrEP8BX_CPU_Cmj");
void *host_address(void *cpu, u64 address, u32 access)
{
    (void)cpu, (void)access;
    return (void *)address;
}

void read_memory(void *cpu, u64 address, u32 size, void *to) __asm__("_ZN8BX_MEM_C16readPhysicalPageEP8BX_CPU_CmjPv");
void read_memory(void *cpu, u64 address, u32 size, void *to)
{
    (void)cpu;
    memcpy(to, (void *)address, size);
}

void write_memory(void *cpu, u64 address, u32 size, void *from)
    __asm__("_ZN8BX_MEM_C17writePhysicalPageEP8BX_CPU_CmjPv");
void write_memory(void *cpu, u64 address, u32 size, void *from)
{
    (void)cpu;
    memcpy((void *)address, from, size);
}

/* A handler that returns, and does not call the next one, is followed by a look at what stops the loop. */
void system_call(void *instruction) __asm__("_ZN8BX_CPU_C7SYSCALLEP15bxInstruction_c");
void system_call(void *instruction)
{
    (void)instruction;
    asked = true;
    cpu_set_killbit(0);
}

void undefined(const u8 *instruction) __asm__("_ZN8BX_CPU_C7BxErrorEP15bxInstruction_c");
void undefined(const u8 *instruction)
{
    u64 pc = cpu_get_pc(0) - length(instruction);
    int size = tile_instruction(pc);
    if (size <= 0)
        fault(SIGILL, size ? "instruction of tiles against their shape" : "undefined instruction", pc);
    cpu_set_pc(0, pc + size);
}

void bx_instr_before_execution(u32 cpu, const u8 *instruction);
void bx_instr_before_execution(u32 cpu, const u8 *instruction)
{
    last = instruction;
    if (!--left)
        cpu_set_killbit(cpu);
}

void bx_instr_exception(u32 cpu, u32 vector, u32 code);
void bx_instr_exception(u32 cpu, u32 vector, u32 code)
{
    static const int signals[32] = { [0] = SIGFPE, [1] = SIGTRAP, [3] = SIGTRAP, [6] = SIGILL, [16] = SIGFPE,
        [19] = SIGFPE };
    char what[64];
    snprintf(what, sizeof what, "exception %u (code %#x)", vector, code);
    fault(vector < 32 && signals[vector] ? signals[vector] : SIGSEGV, what, vector == 14 ? cpu_get_cr2(cpu) : 0);
}

extern u8 bx_pc_system[];
static u32 *ticks_left(void) { return (u32 *)(bx_pc_system + 0x1638); }

/* No device waits for its time. The library says 1 here, and so never goes from one trace of instructions straight to
 * the next. */
void countdown(void) __asm__("_ZN14bx_pc_system_c14countdownEventEv");
void countdown(void) { *ticks_left() = ~0u; }

/* Hooks that Bochs calls often and that have nothing to do here. */
#define NOTHING(name) void name(void); void name(void) { }
NOTHING(bx_instr_after_execution)
NOTHING(bx_instr_cnear_branch_taken)
NOTHING(bx_instr_cnear_branch_not_taken)
NOTHING(bx_instr_ucnear_branch)
NOTHING(bx_instr_far_branch)
NOTHING(bx_instr_lin_access)
NOTHING(bx_instr_phy_access)
NOTHING(bx_instr_opcode)
NOTHING(bx_instr_repeat_iteration)
NOTHING(bx_instr_prefetch_hint)

/* --- ends --- */

/* The line of /proc/self/maps that holds `address`. */
static void print_mapping(const char *name, u64 address)
{
    FILE *maps = fopen("/proc/self/maps", "r");
    char line[4352];
    while (maps && fgets(line, sizeof line, maps)) {
        u64 from, to, offset;
        int path = 0;
        if (sscanf(line, "%lx-%lx %*s %lx %*s %*s %n", &from, &to, &offset, &path) == 3 && path
            && address >= from && address < to)
            dprintf(2, "emulate: %s %#lx is %#lx of %s", name, address, address - from + offset,
                line[path] ? line + path : "memory without a name\n");
    }
    if (maps)
        fclose(maps);
}

void fault(int signal, const char *what, u64 address)
{
    static const char names[16][4] = { "rax", "rcx", "rdx", "rbx", "rsp", "rbp", "rsi", "rdi", "r8", "r9", "r10", "r11",
        "r12", "r13", "r14", "r15" };
    struct sigaction usual = { .sa_handler = SIG_DFL };
    sigaction(SIGSEGV, &usual, NULL);
    sigaction(SIGBUS, &usual, NULL);
    u64 pc = cpu_get_pc(0);
    dprintf(2, "emulate: %s at %#lx; rip %#lx, after an instruction of %u bytes\n", what, address, pc,
        last ? length(last) : 0);
    print_mapping("rip", pc);
    if (address)
        print_mapping("address", address);
    for (int i = 0; i < 16; i++)
        dprintf(2, "%s %016lx%c", names[i], get(i), i % 4 == 3 ? '\n' : ' ');
    leave(128 + signal);
}

static void on_signal(int signal, siginfo_t *info, void *context)
{
    (void)context;
    fault(signal, signal == SIGSEGV ? "segmentation fault" : "bus error", (u64)info->si_addr);
}

void die(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    dprintf(2, "emulate: ");
    vdprintf(2, format, list);
    dprintf(2, "\n");
    va_end(list);
    _exit(125);
}

/* --- state --- */

u64 get(int reg) { return cpu_get_reg64(0, reg); }
void set(int reg, u64 value) { cpu_set_reg64(0, reg, value); }
u64 get_pc(void) { return cpu_get_pc(0); }
void set_pc(u64 pc) { cpu_set_pc(0, pc); }
void set_flags(u32 flags) { cpu_set_eflags(0, flags); }
void forget_code(void) { flush_code(); }

u32 get_flags(void)
{
    settle_flags();
    return cpu_get_eflags(0);
}

static u64 fs_base;
u64 get_fs(void) { return fs_base; }

static void set_data_segment(int seg, u64 base) { cpu_set_seg(0, seg, 1, 0x2b, base, ~0u, 0xc0f3); }

void set_fs(u64 base)
{
    fs_base = base;
    set_data_segment(4, base);
}

u64 executed(void) { return before + given - left; }

bool run(u64 turn)
{
    before = executed();
    given = left = turn;
    asked = false;
    cpu_clear_killbit(0);
    while (!asked && left)
        cpu_loop(0);
    return asked;
}

/* `xsave64 [rdi]`, `xrstor64 [rdi]`, each with a call that comes back here. */
static const u8 STUBS[] = { 0x48, 0x0f, 0xae, 0x27, 0x0f, 0x05, 0x48, 0x0f, 0xae, 0x2f, 0x0f, 0x05 };
static u8 *stubs;

static void run_stub(u64 pc, const void *page)
{
    u64 kept[] = { get(RAX), get(RDX), get(RDI), get_pc() };
    set(RAX, 0xe7);
    set(RDX, 0);
    set(RDI, (u64)page);
    set_pc(pc);
    if (!run(16))
        die("the state of a thread cannot be moved");
    set(RAX, kept[0]);
    set(RDX, kept[1]);
    set(RDI, kept[2]);
    set_pc(kept[3]);
}

void save_vectors(void *page) { run_stub((u64)stubs, page); }
void restore_vectors(const void *page) { run_stub((u64)stubs + 6, page); }

void start_machine(void)
{
    cpu_new(0);
    stubs = (u8 *)map(0, PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    memcpy(stubs, STUBS, sizeof STUBS);
    u64 *tables = (u64 *)map(0, 3 * PAGE, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    for (u64 i = 0; i < CEILING >> 39; i++) {
        u64 *lower = tables + 512 * (i + 1);
        tables[i] = (u64)lower | 0x27; /* present, writable, for users, accessed */
        for (u64 j = 0; j < 512; j++)
            lower[j] = i << 39 | j << 30 | 0xe7; /* the same, written to, a page of 1 GiB */
    }
    cpu_set_cr0(0, 0x80010033);  /* paging, write protection, floating point, protected mode */
    cpu_set_cr3(0, (u64)tables);
    cpu_set_cr4(0, 0x506a0);     /* long page tables, SSE, XSAVE, rdfsbase */
    cpu_set_efer(0, 0xd01);      /* long mode, `syscall` */
    cpu_set_xcr0(0, 0x600e7);    /* x87, SSE, AVX, AVX-512, tiles */
    cpu_set_fp_cw(0, 0x37f);
    cpu_set_fp_tw(0, 0xffff);
    cpu_set_mxcsr(0, 0x1f80);
    cpu_set_eflags(0, 0x202);
    cpu_set_seg(0, 1, 1, 0x33, 0, ~0u, 0xa0fb); /* 64-bit code of a user */
    for (int seg = 0; seg < 6; seg++)
        if (seg != 1)
            set_data_segment(seg, 0);
    context_changed();
    struct sigaction action = { .sa_sigaction = on_signal, .sa_flags = SA_SIGINFO };
    sigaction(SIGSEGV, &action, NULL);
    sigaction(SIGBUS, &action, NULL);
}
