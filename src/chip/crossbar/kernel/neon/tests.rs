//! Where the processor has dot products, products of 16 bits give the same bits: no test of all back ends runs them there.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::*;
use crate::chip::crossbar::kernel::{Backend, Kernel};
use crate::num::draw::{Place, Site};

fn bytes(count: u64, len: usize) -> Vec<u8> {
    let mut bytes = vec![0; len];
    Place::global(5, Site::InitialLevels, count).fill(0, &mut bytes);
    bytes
}

/// Both ways to multiply that this machine has.
fn both() -> Option<[Kernel; 2]> {
    let neon = Neon::detect()?;
    Some([neon, Neon(Products::Long(Long(())))].map(|neon| Kernel::start(Backend::Neon(neon))))
}

#[test]
fn both_ways_to_multiply_give_the_same_bits() {
    let Some(both) = both() else { return };
    for batch in 1..=9 {
        let layout = Layout { rows: 130, columns: 70 };
        let (plane, codes) = (bytes(0, layout.cells_padded()), bytes(1, batch * 192));
        let [a, b] = both.each_ref().map(|kernel| {
            let mut out = vec![7; batch * 32];
            let cells = &plane[..layout.panel_cells()];
            kernel.read(cells, Drives::new(&codes, batch), 0..batch, &mut out);
            out
        });
        assert_eq!(a, b, "a read of {batch} samples");
        let [a, b] = both.each_ref().map(|kernel| {
            let mut out = vec![7; batch * layout.rows_padded()];
            kernel.read_columns(
                &plane,
                layout,
                Drives::new(&codes[..batch * 128], batch),
                &mut out,
            );
            out
        });
        assert_eq!(a, b, "a transposed read of {batch} samples");
        let stride = 4 * batch;
        let gates: Vec<_> = bytes(2, 16 * stride).into_iter().map(u8::cast_signed).collect();
        let [a, b] = both.each_ref().map(|kernel| {
            let mut sums = [7; HALF_CELLS];
            kernel.accumulate(&bytes(3, 64 * stride), stride, &gates, &mut sums);
            sums
        });
        assert_eq!(a, b, "sums of {stride} samples");
    }
}
