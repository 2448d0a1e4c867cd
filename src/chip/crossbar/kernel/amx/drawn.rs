//! Sums of a half block, and between its products the words that they will be rounded with.
//!
//! A product occupies the matrix unit for 16 cycles, and only a few wait in line: a block that began with all of them
//! would hold back what follows. Spread among 512-bit instructions, one for every 36 of them, products cost next to
//! nothing. Tiles are stored last: a vector that is stored behind one, and loaded soon, would wait for it (100 ns).
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use std::arch::asm;

use super::Tiles;
use crate::chip::crossbar::kernel::chacha::Counter;
use crate::chip::crossbar::kernel::{Draws, Half};
use crate::chip::crossbar::layout::{BLOCK_ROWS, HALF_COLUMNS};

/// A step of quarter rounds: state words a, b, c, d of each; `$between` stands after each quarter of the step.
macro_rules! quarters {
    ($([$a:literal $b:literal $c:literal $d:literal])*; $k1:literal $k2:literal $k3:literal $k4:literal) => {
        concat!(
            add_xor_turn!(16 $([$a $b $d])*), $k1, "\n",
            add_xor_turn!(12 $([$c $d $b])*), $k2, "\n",
            add_xor_turn!(8 $([$a $b $d])*), $k3, "\n",
            add_xor_turn!(7 $([$c $d $b])*), $k4, "\n",
        )
    };
}

/// `a += b; d ^= a; d <<<= by`, for each.
macro_rules! add_xor_turn {
    ($by:literal $([$a:literal $b:literal $d:literal])*) => {
        concat!(
            $("vpaddd zmm", $a, ", zmm", $a, ", zmm", $b, "\n",)*
            $("vpxord zmm", $d, ", zmm", $d, ", zmm", $a, "\n",)*
            $("vprold zmm", $d, ", zmm", $d, ", ", $by, "\n",)*
        )
    };
}

/// Starts ChaCha: word i of all lanes, where columns 1, 2 and 3 of the first round are done.
macro_rules! start {
    ($([$word:literal $at:literal])*) => {
        concat!($("vpbroadcastd zmm", $word, ", dword ptr [{states} + 64 + ", $at, "]\n",)*)
    };
}

/// Ends ChaCha: adds where word i of all lanes started, and stores it.
macro_rules! finish {
    ($([$word:literal $at:literal $to:literal])*) => {
        concat!($(
            "vpaddd zmm", $word, ", zmm", $word, ", dword ptr [{states} + ", $at, "]{{1to16}}\n",
            "vmovdqu64 [{words} + ", $to, "], zmm", $word, "\n",
        )*)
    };
}

/// Numbers of the lanes.
static LANES: Lanes = Lanes([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);

#[repr(align(64))]
struct Lanes(#[expect(dead_code, reason = "assembly reads them")] [i32; 16]);

/// What a half block is summed from: drives of 64 rows, gates of 16 columns.
#[derive(Clone, Copy)]
pub(super) struct Factors<'a> {
    pub(super) turned: &'a [u8],
    pub(super) gates: &'a [u8],
}

/// Sums of a half block, as [`super::product::half_block`], and meanwhile its 8-bit words: ChaCha8 of 16 blocks that
/// start from `draws`, with word 12 by lane. `prefetch` is fetched meanwhile.
pub(super) fn half_block_drawn(
    tiles: &Tiles,
    factors: Factors<'_>,
    sums: &mut Half<i32>,
    (draws, counter): (&Draws, Counter),
    words: &mut Half<u8>,
    prefetch: &Half<u8>,
) {
    let stride = factors.turned.len() / BLOCK_ROWS;
    assert!(stride > 0 && stride.is_multiple_of(64), "there is something to multiply");
    assert!(factors.turned.len() == BLOCK_ROWS * stride, "every row of A is there");
    assert!(factors.gates.len() == HALF_COLUMNS * stride, "every B is there");
    match stride / 64 {
        1 => last_step(tiles, factors, 0, sums, (draws, counter), words, prefetch),
        steps => last_two_steps(tiles, factors, steps - 2, sums, (draws, counter), words, prefetch),
    }
}

/// `$steps` steps of products among the rounds, after `before` steps on their own.
macro_rules! drawn {
    ($name:ident, $steps:literal, [$($a:literal)*] [$($b:literal)*] [$($c:literal)*] [$($d:literal)*]
        [$($e:literal)*] [$($f:literal)*] [$($g:literal)*]) => {
        fn $name(
            _: &Tiles,
            Factors { turned, gates }: Factors<'_>,
            before: usize,
            sums: &mut Half<i32>,
            (draws, counter): (&Draws, Counter),
            words: &mut Half<u8>,
            prefetch: &Half<u8>,
        ) {
            let stride = turned.len() / BLOCK_ROWS;
            assert!((before + $steps) * 64 == stride, "all steps are taken");
            // SAFETY: a `Tiles` says that tiles of this thread have 16 rows of 64 bytes and that the processor has
            // AVX-512 F. Tile rows read at turned + step * 64 + row * stride (row < 64) and gates + step * 1024 +
            // 64 * row (row < 16), for the steps `before` and `$steps` more, lie inside the slices by the assertions
            // here and of the only caller; the 64 rows of 64 bytes written are all of `sums`, and 16 vectors of 64
            // bytes all of `words`; 64 bytes are read of `LANES` and of each of the two states of `draws`. Fetching reads nothing.
            // All registers used are named; a build with frame pointers has fourteen general ones.
            unsafe {
                asm!(
                    zero_sums!(),
                    "test {steps}, {steps}",
                    "jz 3f",
                    "2:",
                    half_step!(),
                    "dec {steps}",
                    "jnz 2b",
                    "3:",
                    start!([0 0][1 4][2 8][3 12][4 16][5 20][6 24][7 28]),
                    start!([8 32][9 36][10 40][11 44][13 52][14 56][15 60]),
                    "vpbroadcastd zmm12, {counter:e}",
                    "shr {counter}, 32",
                    "vpbroadcastd zmm16, {counter:e}",
                    "vpmulld zmm16, zmm16, [rip + {lanes}]",
                    "vpaddd zmm16, zmm12, zmm16",
                    "vmovdqa64 zmm12, zmm16",
                    quarters!([0 4 8 12]; "" "" "" ""),
                    quarters!([0 5 10 15][1 6 11 12][2 7 8 13][3 4 9 14]; $($a)*),
                    quarters!([0 4 8 12][1 5 9 13][2 6 10 14][3 7 11 15]; $($b)*),
                    quarters!([0 5 10 15][1 6 11 12][2 7 8 13][3 4 9 14]; $($c)*),
                    quarters!([0 4 8 12][1 5 9 13][2 6 10 14][3 7 11 15]; $($d)*),
                    quarters!([0 5 10 15][1 6 11 12][2 7 8 13][3 4 9 14]; $($e)*),
                    quarters!([0 4 8 12][1 5 9 13][2 6 10 14][3 7 11 15]; $($f)*),
                    quarters!([0 5 10 15][1 6 11 12][2 7 8 13][3 4 9 14]; $($g)*),
                    "vpaddd zmm12, zmm12, zmm16",
                    finish!([0 0 0][1 4 64][2 8 128][3 12 192][4 16 256][5 20 320][6 24 384][7 28 448]),
                    finish!([8 32 512][9 36 576][10 40 640][11 44 704][13 52 832]),
                    "vmovdqu64 [{words} + 768], zmm12",
                    finish!([14 56 896][15 60 960]),
                    "tilestored [{c} + {row}], tmm0",
                    "tilestored [{c} + {row} + 1024], tmm1",
                    "tilestored [{c} + {row} + 2048], tmm2",
                    "tilestored [{c} + {row} + 3072], tmm3",
                    steps = inout(reg) before => _,
                    a0 = inout(reg) turned.as_ptr() => _,
                    a1 = inout(reg) turned[16 * stride..].as_ptr() => _,
                    a2 = inout(reg) turned[32 * stride..].as_ptr() => _,
                    a3 = inout(reg) turned[48 * stride..].as_ptr() => _,
                    b = inout(reg) gates.as_ptr() => _,
                    c = in(reg) sums.as_mut_ptr(),
                    row = in(reg) 64usize,
                    stride = in(reg) stride,
                    states = in(reg) draws.states().as_ptr(),
                    counter = inout(reg) counter.joined() => _,
                    lanes = sym LANES,
                    words = in(reg) words.as_mut_ptr(),
                    prefetch = in(reg) prefetch.as_ptr(),
                    out("zmm0") _, out("zmm1") _, out("zmm2") _, out("zmm3") _, out("zmm4") _,
                    out("zmm5") _, out("zmm6") _, out("zmm7") _, out("zmm8") _, out("zmm9") _,
                    out("zmm10") _, out("zmm11") _, out("zmm12") _, out("zmm13") _, out("zmm14") _,
                    out("zmm15") _, out("zmm16") _,
                    out("tmm0") _, out("tmm1") _, out("tmm2") _, out("tmm3") _,
                    out("tmm4") _, out("tmm5") _, out("tmm6") _, out("tmm7") _,
                    options(nostack),
                );
            }
        }
    };
}

drawn!(
    last_step, 1,
    [
        "tileloadd tmm7, [{b} + {row}]\ntileloadd tmm4, [{a0} + {stride}]\ntdpbusd tmm0, tmm4, tmm7\nprefetcht0 [{b} + 1024]"
        "prefetcht0 [{b} + 1088]"
        "prefetcht0 [{b} + 1152]"
        "tileloadd tmm5, [{a1} + {stride}]\nprefetcht0 [{b} + 1216]"
    ]
    [
        "prefetcht0 [{b} + 1280]"
        "tdpbusd tmm1, tmm5, tmm7\nprefetcht0 [{b} + 1344]"
        "prefetcht0 [{b} + 1408]"
        "prefetcht0 [{b} + 1472]"
    ]
    [
        "tileloadd tmm4, [{a2} + {stride}]\nprefetcht0 [{prefetch} + 0]\nprefetcht0 [{b} + 1536]"
        "prefetcht0 [{prefetch} + 64]\nprefetcht0 [{b} + 1600]"
        "tdpbusd tmm2, tmm4, tmm7\nprefetcht0 [{prefetch} + 128]\nprefetcht0 [{b} + 1664]"
        "prefetcht0 [{prefetch} + 192]\nprefetcht0 [{b} + 1728]"
    ]
    [
        "prefetcht0 [{prefetch} + 256]\nprefetcht0 [{b} + 1792]"
        "tileloadd tmm5, [{a3} + {stride}]\nprefetcht0 [{prefetch} + 320]\nprefetcht0 [{b} + 1856]"
        "prefetcht0 [{prefetch} + 384]\nprefetcht0 [{b} + 1920]"
        "tdpbusd tmm3, tmm5, tmm7\nprefetcht0 [{prefetch} + 448]\nprefetcht0 [{b} + 1984]"
    ]
    [
        "prefetcht0 [{prefetch} + 512]"
        "prefetcht0 [{prefetch} + 576]"
        "prefetcht0 [{prefetch} + 640]"
        "prefetcht0 [{prefetch} + 704]"
    ]
    [
        "prefetcht0 [{prefetch} + 768]"
        "prefetcht0 [{prefetch} + 832]"
        "prefetcht0 [{prefetch} + 896]"
        "prefetcht0 [{prefetch} + 960]"
    ]
    [
        ""
        ""
        ""
        ""
    ]
);

drawn!(
    last_two_steps, 2,
    [
        "tileloadd tmm7, [{b} + {row}]\ntileloadd tmm4, [{a0} + {stride}]\ntdpbusd tmm0, tmm4, tmm7\nprefetcht0 [{b} + 2048]\nprefetcht0 [{b} + 2112]"
        "tileloadd tmm5, [{a1} + {stride}]\nprefetcht0 [{b} + 2176]"
        "prefetcht0 [{b} + 2240]"
        "tdpbusd tmm1, tmm5, tmm7\nprefetcht0 [{b} + 2304]"
    ]
    [
        "tileloadd tmm4, [{a2} + {stride}]\nprefetcht0 [{b} + 2368]"
        "prefetcht0 [{b} + 2432]"
        "tdpbusd tmm2, tmm4, tmm7\nprefetcht0 [{b} + 2496]\nprefetcht0 [{b} + 2560]"
        "tileloadd tmm5, [{a3} + {stride}]\nprefetcht0 [{b} + 2624]"
    ]
    [
        "prefetcht0 [{prefetch} + 0]\nprefetcht0 [{b} + 2688]"
        "tdpbusd tmm3, tmm5, tmm7\nprefetcht0 [{prefetch} + 64]\nprefetcht0 [{b} + 2752]"
        "tileloadd tmm6, [{b} + {row} + 1024]\ntileloadd tmm4, [{a0} + {stride} + 64]\nprefetcht0 [{prefetch} + 128]\nprefetcht0 [{b} + 2816]"
        "prefetcht0 [{prefetch} + 192]\nprefetcht0 [{b} + 2880]"
    ]
    [
        "tdpbusd tmm0, tmm4, tmm6\nprefetcht0 [{prefetch} + 256]\nprefetcht0 [{b} + 2944]"
        "tileloadd tmm5, [{a1} + {stride} + 64]\nprefetcht0 [{prefetch} + 320]\nprefetcht0 [{b} + 3008]\nprefetcht0 [{b} + 3072]"
        "prefetcht0 [{prefetch} + 384]\nprefetcht0 [{b} + 3136]"
        "tdpbusd tmm1, tmm5, tmm6\nprefetcht0 [{prefetch} + 448]\nprefetcht0 [{b} + 3200]"
    ]
    [
        "tileloadd tmm4, [{a2} + {stride} + 64]\nprefetcht0 [{prefetch} + 512]\nprefetcht0 [{b} + 3264]"
        "prefetcht0 [{prefetch} + 576]\nprefetcht0 [{b} + 3328]"
        "tdpbusd tmm2, tmm4, tmm6\nprefetcht0 [{prefetch} + 640]\nprefetcht0 [{b} + 3392]"
        "tileloadd tmm5, [{a3} + {stride} + 64]\nprefetcht0 [{prefetch} + 704]\nprefetcht0 [{b} + 3456]"
    ]
    [
        "prefetcht0 [{prefetch} + 768]\nprefetcht0 [{b} + 3520]\nprefetcht0 [{b} + 3584]"
        "tdpbusd tmm3, tmm5, tmm6\nprefetcht0 [{prefetch} + 832]\nprefetcht0 [{b} + 3648]"
        "prefetcht0 [{prefetch} + 896]\nprefetcht0 [{b} + 3712]"
        "prefetcht0 [{prefetch} + 960]\nprefetcht0 [{b} + 3776]"
    ]
    [
        "prefetcht0 [{b} + 3840]"
        "prefetcht0 [{b} + 3904]"
        "prefetcht0 [{b} + 3968]"
        "prefetcht0 [{b} + 4032]"
    ]
);
