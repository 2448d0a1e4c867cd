//! Second step of a write: what an optimiser asks of a cell, before rounding.
//!
//! ```text
//! plain     request = +-sum * mantissa, in units of 2^-(k - F) of a step of the remainder, F of whose bits are a pulse
//! ```
//!
//! The sign is applied before anything is rounded: `-` for inhibitory pathways. An optimiser is a law for one cell and its
//! twin for a lane, and this is where it stands; what follows does not know which one asked. See docs/MODEL.md, 3.3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::WriteLaw;

/// What is asked of one cell: `amount / 2^shift` steps of the remainder.
#[derive(Debug, Clone, Copy)]
pub(super) struct Request {
    pub(super) amount: i64,
    pub(super) shift: i64,
}

/// The law: a request for each sum.
pub(super) fn plain(sum: i64, write: &WriteLaw) -> Request {
    let amount = sum * i64::from(write.mantissa);
    Request {
        amount: if write.negate { -amount } else { amount },
        shift: i64::from(write.shift) - i64::from(write.residual_bits),
    }
}

/// Its twin: the amount of a request for a sum, in lanes of the sum's width.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plain {
    /// The mantissa, with the sign of the pathway.
    factor: i32,
}

impl Plain {
    pub(super) const fn new(write: &WriteLaw) -> Self {
        Self { factor: if write.negate { -write.mantissa } else { write.mantissa } }
    }

    #[inline(always)]
    pub(super) fn narrow(self, sum: i32) -> i32 {
        sum * self.factor
    }

    #[inline(always)]
    pub(super) fn wide(self, sum: i64) -> i64 {
        sum * i64::from(self.factor)
    }
}
