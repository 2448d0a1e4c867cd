//! Normalisation of a stream by its root mean square: what takes the place of a table.
//!
//! ```text
//! v_j    = max(acc_j, 0)                                     unit j of the N units of a stream, of one sample
//! Q      = sum_j v_j^2                                       u128
//! m      = max( 1, isqrt( floor(Q / N) ) )
//! rc     = floor( 2^45 / m )
//! code   = min( (v rc + 2^39) >> 40, 255 )                   root mean square 1 is code 32; 255 is 8.0
//! a'     = 255 where acc > 0, else 0                         the Jacobian is ignored
//! ```
//!
//! A code that its bound changed counts as a saturated look-up. With `Q < N (m + 1)^2` every `v <= 2 sqrt(N) m`, so `v rc <=
//! 2^46 sqrt(N) < 2^54` for as many units as a plan allows: 64 bits hold all of it but `Q`. See docs/MODEL.md, 2.3.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

/// `rc` of a sum of squares of so many units.
#[inline]
#[must_use]
pub const fn reciprocal(squares: u128, units: u64) -> u64 {
    // a division of 64 bits wherever it does
    let root = if squares >> 64 == 0 {
        let squares = squares as u64;
        let mean = if units.is_power_of_two() {
            squares >> units.trailing_zeros()
        } else {
            squares / units
        };
        mean.isqrt()
    } else {
        (squares / units as u128).isqrt() as u64
    };
    (1 << 45) / if root == 0 { 1 } else { root }
}

/// Code of an accumulator, and whether its bound changed it.
#[inline]
#[must_use]
pub const fn code(accumulator: i64, reciprocal: u64) -> (u8, bool) {
    if accumulator <= 0 {
        return (0, false);
    }
    let code = (accumulator.unsigned_abs() * reciprocal + (1 << 39)) >> 40;
    if code > 255 { (255, true) } else { (code as u8, false) }
}

/// Slope of a unit.
#[inline]
#[must_use]
pub const fn slope(accumulator: i64) -> u8 {
    if accumulator > 0 { 255 } else { 0 }
}

/// Adds the squares of what excites units.
#[must_use]
pub fn squares(accumulators: impl Iterator<Item = i64>) -> u128 {
    accumulators.map(|acc| u128::from(acc.max(0).unsigned_abs()).pow(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The law as it is written, on numbers without an end: `isqrt` by halving.
    fn plain(accumulators: &[i64]) -> Vec<(u8, bool)> {
        let v: Vec<u128> = accumulators.iter().map(|&acc| acc.max(0) as u128).collect();
        let mean = v.iter().map(|v| v * v).sum::<u128>() / v.len() as u128;
        let (mut low, mut high) = (0u128, 1 << 63);
        while low < high {
            let middle = (low + high).div_ceil(2);
            if middle * middle <= mean { low = middle } else { high = middle - 1 }
        }
        let rc = (1u128 << 45) / low.max(1);
        v.iter().map(|v| (v * rc + (1 << 39)) >> 40).map(|c| (c.min(255) as u8, c > 255)).collect()
    }

    fn all(accumulators: &[i64]) -> Vec<(u8, bool)> {
        let rc = reciprocal(squares(accumulators.iter().copied()), accumulators.len() as u64);
        accumulators.iter().map(|&acc| code(acc, rc)).collect()
    }

    #[test]
    fn units_at_the_root_mean_square_are_code_32() {
        assert_eq!(all(&[1000, 1000, 1000]), [(32, false); 3]);
        assert_eq!(all(&[0, -5]), [(0, false); 2]);
        // one of 64 alone: sqrt(64) = 8 is 256, which 255 bounds; of 63 it is not
        let alone = |units: usize| {
            let mut accumulators = vec![-1; units];
            accumulators[3] = 1 << 20;
            all(&accumulators)[3]
        };
        assert_eq!((alone(64), alone(63)), ((255, true), (254, false)));
        assert_eq!([-1, 0, 1].map(slope), [0, 0, 255]);
    }

    proptest! {
        #[test]
        fn codes_are_those_of_the_law(
            accumulators in prop_oneof![
                prop::collection::vec(-20i64..20, 1..80),
                prop::collection::vec(-(1i64 << 24)..1 << 24, 1..300),
                prop::collection::vec(-(1i64 << 50)..1 << 50, 1..80),
            ],
        ) {
            prop_assert_eq!(all(&accumulators), plain(&accumulators));
        }
    }
}
