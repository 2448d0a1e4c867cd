/* A program as Linux starts it: segments of the file and of its interpreter, and the first stack. */
#define _GNU_SOURCE
#include "emulate.h"

#include <elf.h>
#include <fcntl.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <sys/mman.h>
#include <unistd.h>

enum { STACK = 8 << 20 };

char program_path[4096];

struct image {
    u64 base, entry, headers, header_count;
    char interpreter[PATH_MAX];
};

static u64 page_of(u64 address) { return address & ~(u64)(PAGE - 1); }

static void read_all(int fd, const char *path, void *to, u64 size, u64 offset)
{
    if (pread(fd, to, size, offset) != (ssize_t)size)
        die("%s: cut short", path);
}

/* Maps the part of the file, then zeros up to the end of the segment. */
static void map_segment(int fd, const char *path, u64 base, const Elf64_Phdr *segment)
{
    int protection = (segment->p_flags & PF_R ? PROT_READ : 0) | (segment->p_flags & PF_W ? PROT_WRITE : 0)
        | (segment->p_flags & PF_X ? PROT_EXEC : 0);
    u64 from = base + page_of(segment->p_vaddr), file_end = base + segment->p_vaddr + segment->p_filesz,
        end = base + segment->p_vaddr + segment->p_memsz, zeros = page_of(file_end + PAGE - 1);
    long done = 0;
    if (segment->p_filesz)
        done |= map(from, file_end - from, protection, MAP_PRIVATE | MAP_FIXED, fd, page_of(segment->p_offset));
    else
        zeros = from;
    if (end > zeros)
        done |= map(zeros, end - zeros, protection, MAP_PRIVATE | MAP_FIXED | MAP_ANONYMOUS, -1, 0);
    if (done < 0)
        die("%s: a segment cannot be mapped", path);
    if (end > file_end && zeros > file_end)
        memset((void *)file_end, 0, zeros - file_end);
}

static struct image map_image(const char *path)
{
    struct image image = { 0 };
    Elf64_Ehdr header;
    Elf64_Phdr segments[64];
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        die("%s: cannot be read", path);
    read_all(fd, path, &header, sizeof header, 0);
    bool ours = !memcmp(header.e_ident, ELFMAG, SELFMAG) && header.e_ident[EI_CLASS] == ELFCLASS64
        && header.e_machine == EM_X86_64 && (header.e_type == ET_DYN || header.e_type == ET_EXEC)
        && header.e_phnum <= 64 && header.e_phentsize == sizeof *segments;
    if (!ours)
        die("%s: not a program for x86-64", path);
    read_all(fd, path, segments, header.e_phnum * sizeof *segments, header.e_phoff);
    u64 end = 0;
    for (int i = 0; i < header.e_phnum; i++)
        if (segments[i].p_type == PT_LOAD && segments[i].p_vaddr + segments[i].p_memsz > end)
            end = segments[i].p_vaddr + segments[i].p_memsz;
    if (header.e_type == ET_DYN) {
        long base = map(0, end, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (base < 0)
            die("%s: no room", path);
        image.base = base;
    }
    for (int i = 0; i < header.e_phnum; i++) {
        const Elf64_Phdr *segment = &segments[i];
        if (segment->p_type == PT_LOAD)
            map_segment(fd, path, image.base, segment);
        if (segment->p_type == PT_LOAD && header.e_phoff - segment->p_offset < segment->p_filesz)
            image.headers = image.base + segment->p_vaddr + header.e_phoff - segment->p_offset;
        if (segment->p_type == PT_INTERP && segment->p_filesz <= sizeof image.interpreter)
            read_all(fd, path, image.interpreter, segment->p_filesz, segment->p_offset);
    }
    close(fd);
    image.entry = image.base + header.e_entry;
    image.header_count = header.e_phnum;
    return image;
}

static u64 push(u64 *top, const void *bytes, u64 size)
{
    *top -= size;
    memcpy((void *)*top, bytes, size);
    return *top;
}

static u64 push_text(u64 *top, const char *text) { return push(top, text, strlen(text) + 1); }

static u64 count(char **list)
{
    u64 many = 0;
    while (list[many])
        many++;
    return many;
}

void load(char **arguments, char **environment)
{
    if (!realpath(arguments[0], program_path))
        die("%s: not found", arguments[0]);
    struct image program = map_image(program_path), interpreter = { 0 };
    if (program.interpreter[0])
        interpreter = map_image(program.interpreter);

    long stack = map(0, STACK, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (stack < 0)
        die("no room for a stack");
    u64 top = stack + STACK - 16, many = count(arguments), settings = count(environment);
    u64 words[many + settings + 64], *word = words;
    u64 path = push_text(&top, program_path), platform = push_text(&top, "x86_64");
    static const u8 seed[16] = "the same always";
    u64 random = push(&top, seed, sizeof seed);
    *word++ = many;
    for (u64 i = 0; i < many; i++)
        *word++ = push_text(&top, arguments[i]);
    *word++ = 0;
    for (u64 i = 0; i < settings; i++)
        *word++ = push_text(&top, environment[i]);
    *word++ = 0;
    const u64 table[][2] = {
        { AT_PHDR, program.headers }, { AT_PHENT, sizeof(Elf64_Phdr) }, { AT_PHNUM, program.header_count },
        { AT_PAGESZ, PAGE }, { AT_BASE, interpreter.base }, { AT_FLAGS, 0 }, { AT_ENTRY, program.entry },
        { AT_UID, getuid() }, { AT_EUID, geteuid() }, { AT_GID, getgid() }, { AT_EGID, getegid() }, { AT_SECURE, 0 },
        { AT_CLKTCK, 100 }, { AT_HWCAP, 0xbfebfbff }, { AT_HWCAP2, 2 }, { AT_RANDOM, random },
        { AT_PLATFORM, platform }, { AT_EXECFN, path }, { AT_NULL, 0 },
    };
    memcpy(word, table, sizeof table);
    word += sizeof table / sizeof *word;
    u64 size = (word - words) * sizeof *words;
    top = (top - size) & ~15ull;
    memcpy((void *)top, words, size);
    set(RSP, top);
    set_pc(program.interpreter[0] ? interpreter.entry : program.entry);
}
