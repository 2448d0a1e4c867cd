/* Runs on the emulated processor: instructions with known answers, and ends of a program that must be told apart.
 *
 *   known                  features, products of bytes, permutations, tiles, threads: prints what differs, ends with 1
 *   known null | undefined | shapes | abort | wait
 *                          ends as its name says; tests/emulate.sh knows with what */
#define _GNU_SOURCE
#include <immintrin.h>
#include <pthread.h>
#include <sched.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>

#define VECTORS __attribute__((target("avx512f,avx512bw,avx512vl,avx512vnni,avx512vbmi")))
#define TILES __attribute__((target("amx-tile,amx-int8")))

static int failures;

static void expect(const char *what, int holds)
{
    if (!holds)
        printf("known: %s: WRONG\n", what), failures++;
}

static uint32_t state = 1;
static void fill(void *to, unsigned size)
{
    for (unsigned i = 0; i < size; i++) {
        state = state * 1664525 + 1013904223;
        ((uint8_t *)to)[i] = i % 7 ? state >> 24 : 0x80; /* many of the lowest signed byte */
    }
}

/* --- vectors --- */

VECTORS static void products(const uint8_t *a, const int8_t *b, int32_t *sums)
{
    __m512i sum = _mm512_loadu_si512(sums);
    _mm512_storeu_si512(sums, _mm512_dpbusd_epi32(sum, _mm512_loadu_si512(a), _mm512_loadu_si512(b)));
}

VECTORS static void permutation(const uint8_t *low, const uint8_t *at, const uint8_t *high, uint8_t *out)
{
    _mm512_storeu_si512(out,
        _mm512_permutex2var_epi8(_mm512_loadu_si512(low), _mm512_loadu_si512(at), _mm512_loadu_si512(high)));
}

VECTORS static uint64_t over(const uint8_t *a, uint8_t bound)
{
    return _mm512_cmpgt_epu8_mask(_mm512_loadu_si512(a), _mm512_set1_epi8(bound));
}

static void check_vectors(void)
{
    uint8_t bytes[3][64], out[64];
    int32_t sums[16], want[16];
    fill(bytes, sizeof bytes);
    fill(sums, sizeof sums);
    for (int i = 0; i < 16; i++) {
        uint32_t sum = sums[i];
        for (int j = 0; j < 4; j++)
            sum += bytes[0][4 * i + j] * (int8_t)bytes[1][4 * i + j];
        want[i] = sum;
    }
    products(bytes[0], (int8_t *)bytes[1], sums);
    expect("vpdpbusd", !memcmp(sums, want, sizeof want));
    permutation(bytes[0], bytes[1], bytes[2], out);
    for (int i = 0; i < 64; i++)
        expect("vpermi2b", out[i] == bytes[bytes[1][i] & 64 ? 2 : 0][bytes[1][i] & 63]);
    for (int i = 0; i < 64; i++)
        expect("vpcmpub", (over(bytes[0], 100) >> i & 1) == (bytes[0][i] > 100));
}

/* --- tiles --- */

struct shape {
    uint8_t palette, start, none[14];
    uint16_t columns[8], no_columns[8];
    uint8_t rows[8], no_rows[8];
};

/* C of m x n words, A of m x k words of bytes, B of k x n words of bytes. */
TILES static void shape_tiles(int m, int n, int k)
{
    struct shape shape = { .palette = 1, .columns = { 4 * n, 4 * k, 4 * n }, .rows = { m, m, k } }, read;
    _tile_loadconfig(&shape);
    _tile_storeconfig(&read);
    expect("sttilecfg", !memcmp(&shape, &read, sizeof shape));
}

#define PRODUCT(name)                                                                   \
    TILES static void name(void *c, const void *a, const void *b, long stride)          \
    {                                                                                   \
        _tile_loadd(0, c, stride);                                                      \
        _tile_loadd(1, a, stride);                                                      \
        _tile_stream_loadd(2, b, stride);                                               \
        _tile_##name(0, 1, 2);                                                          \
        _tile_stored(0, c, stride);                                                     \
    }
PRODUCT(dpbuud)
PRODUCT(dpbusd)
PRODUCT(dpbsud)
PRODUCT(dpbssd)

static int wide(uint8_t byte, int is_signed) { return is_signed ? (int8_t)byte : byte; }

static void check_product(void (*run)(void *, const void *, const void *, long), const char *name, int m, int n, int k)
{
    enum { ROW = 80 };
    uint8_t a[16][ROW], b[16][ROW];
    int32_t c[16][ROW / 4], want[16][ROW / 4];
    fill(a, sizeof a);
    fill(b, sizeof b);
    fill(c, sizeof c);
    memcpy(want, c, sizeof c);
    for (int i = 0; i < m; i++)
        for (int j = 0; j < n; j++)
            for (int at = 0; at < 4 * k; at++)
                want[i][j] = (uint32_t)want[i][j]
                    + wide(a[i][at], name[3] == 's') * wide(b[at / 4][4 * j + at % 4], name[4] == 's');
    shape_tiles(m, n, k);
    run(c, a, b, ROW);
    expect(name, !memcmp(c, want, sizeof c));
}

TILES static void check_tiles(void)
{
    static const int sizes[][3] = { { 16, 16, 16 }, { 1, 1, 1 }, { 5, 9, 13 }, { 16, 3, 7 } };
    for (int i = 0; i < 4; i++) {
        const int *size = sizes[i];
        check_product(dpbuud, "dpbuud", size[0], size[1], size[2]);
        check_product(dpbusd, "dpbusd", size[0], size[1], size[2]);
        check_product(dpbsud, "dpbsud", size[0], size[1], size[2]);
        check_product(dpbssd, "dpbssd", size[0], size[1], size[2]);
    }
    int32_t zeros[16][16], cells[16][16];
    fill(cells, sizeof cells);
    shape_tiles(16, 16, 16);
    _tile_loadd(0, cells, 64);
    _tile_zero(0);
    _tile_stored(0, zeros, 64);
    for (int i = 0; i < 256; i++)
        expect("tilezero", !zeros[i / 16][i % 16]);
    _tile_release();
    struct shape shape, none = { 0 };
    _tile_storeconfig(&shape);
    expect("tilerelease", !memcmp(&shape, &none, sizeof none));
}

/* --- threads --- */

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static uint64_t total;

/* Whether the flags of a comparison with 2 hold through `turns` jumps that do not touch them. */
static int flags_hold(uint64_t value, uint64_t turns)
{
    uint8_t zero, carry;
    __asm__ volatile("cmp $2, %[value]\n"
                     "1: jrcxz 2f\n"
                     "lea -1(%%rcx), %%rcx\n"
                     "jmp 1b\n"
                     "2: setz %[zero]\n"
                     "setc %[carry]\n"
                     : [zero] "=&q"(zero), [carry] "=&q"(carry), "+c"(turns)
                     : [value] "r"(value)
                     : "cc");
    return zero == (value == 2) && carry == (value < 2);
}

/* Holds a tile, a vector, a mask and flags while others run. */
__attribute__((target("amx-tile,avx512f"))) static void *work(void *argument)
{
    uint8_t mine[64], after[64], row[64];
    memset(mine, 1 + (intptr_t)argument, sizeof mine);
    struct shape shape = { .palette = 1, .columns = { 64 }, .rows = { 1 } };
    _tile_loadconfig(&shape);
    _tile_loadd(0, mine, 64);
    register __m512i vector __asm__("zmm31") = _mm512_loadu_si512(mine);
    uint64_t mask = (uintptr_t)argument;
    __asm__ volatile("kmovw %k1, %%k7" : "+v"(vector) : "r"((uint32_t)mask) : "k7");
    for (int i = 0; i < 300; i++) {
        pthread_mutex_lock(&lock);
        total += i;
        pthread_mutex_unlock(&lock);
        if (i % 50 == 0)
            syscall(SYS_sched_yield);
        for (volatile int spin = 0; spin < 1000; spin++)
            ;
    }
    int held = flags_hold(mask, 300000);
    uint32_t mask_after = 0;
    __asm__ volatile("kmovw %%k7, %k1" : "+v"(vector), "=r"(mask_after));
    _mm512_storeu_si512(after, vector);
    _tile_stored(0, row, 64);
    _tile_release();
    held &= !memcmp(mine, after, 64) && !memcmp(mine, row, 64) && mask_after == mask;
    return (void *)(intptr_t)held;
}

static void check_threads(void)
{
    pthread_t threads[4];
    for (intptr_t i = 0; i < 4; i++)
        expect("pthread_create", !pthread_create(&threads[i], NULL, work, (void *)i));
    for (int i = 0; i < 4; i++) {
        void *held = NULL;
        pthread_join(threads[i], &held);
        expect("state of a thread", held != NULL);
    }
    expect("sum of threads", total == 4 * 299 * 300 / 2);
}

static void check_features(void)
{
#define HAS(feature) expect(feature, __builtin_cpu_supports(feature) != 0)
    HAS("avx2");
    HAS("avx512f");
    HAS("avx512bw");
    HAS("avx512vl");
    HAS("avx512vnni");
    HAS("avx512vbmi");
    HAS("bmi2");
    HAS("popcnt");
    unsigned a, b, c, d, low, high;
    __asm__("cpuid" : "=a"(a), "=b"(b), "=c"(c), "=d"(d) : "a"(7), "c"(0));
    expect("AMX-TILE and AMX-INT8", (d >> 24 & 3) == 3);
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    expect("XCR0", low == 0x600e7 && !high);
    expect("permission of tiles", !syscall(SYS_arch_prctl, 0x1023, 18));
}

/* --- ends --- */

TILES static void end(const char *how)
{
    if (!strcmp(how, "null"))
        *(volatile int *)8 = 1;
    if (!strcmp(how, "undefined"))
        __asm__ volatile("ud2");
    if (!strcmp(how, "shapes")) {
        shape_tiles(16, 16, 8);
        _tile_dpbuud(0, 2, 1);
    }
    if (!strcmp(how, "abort"))
        abort();
    if (!strcmp(how, "wait")) {
        pthread_mutex_lock(&lock);
        pthread_mutex_lock(&lock);
    }
    printf("known: %s went on\n", how);
}

int main(int count, char **arguments)
{
    if (count > 1) {
        end(arguments[1]);
        return 0;
    }
    check_features();
    check_vectors();
    check_tiles();
    check_threads();
    if (!failures)
        puts("known: all answers are right");
    return failures != 0;
}
