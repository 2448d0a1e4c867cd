//! What tests hold tables against: the same functions in integers alone, from their series, with 56 bits behind the point.
//!
//! ```text
//! exp x  = 2^n sum r^k / k!,  x = n ln 2 + r             ln m = n ln 2 + 2 sum t^(2k+1) / (2k+1),  t = (m - 1) / (m + 1)
//! tanh x = 1 - 2 / (exp 2x + 1)                          1 - Phi(z) = 1/2 - phi(z) sum z^(2k+1) / (2k+1)!!     z < 2
//! phi(z) = exp(-z^2 / 2) / sqrt(2 pi)                               = phi(z) / (z + 1 / (z + 2 / (z + ..)))    z >= 2
//! ```
//!
//! Off by some 2^-50, relative to the result where it is above 1. No floats: not the machine's, nor `libm`'s.

/// Bits behind the point.
pub(crate) const BITS: u32 = 56;
/// One.
pub(crate) const ONE: i128 = 1 << BITS;

/// A product below 2^15.
pub(crate) fn mul(a: i128, b: i128) -> i128 {
    (a * b) >> BITS
}

/// A quotient; `a` below 2^14.
pub(crate) fn div(a: i128, b: i128) -> i128 {
    (a << BITS) / b
}

fn ln2() -> i128 {
    let third = ONE / 3;
    2 * atanh(third)
}

fn atanh(t: i128) -> i128 {
    let (mut sum, mut power) = (0, t);
    for k in 0..40 {
        sum += power / (2 * k + 1);
        power = mul(mul(power, t), t);
    }
    sum
}

/// Of -70 to 20.
pub(crate) fn exp(x: i128) -> i128 {
    let n = x.div_euclid(ln2());
    let r = x - n * ln2();
    let (mut sum, mut term) = (0, ONE);
    for k in 1..30 {
        sum += term;
        term = mul(term, r) / k;
    }
    if n < 0 { sum >> -n } else { sum << n }
}

/// Of what is above 0.
pub(crate) fn ln(m: i128) -> i128 {
    let n = i128::from(127 - m.leading_zeros()) - i128::from(BITS);
    let m = if n < 0 { m << -n } else { m >> n };
    n * ln2() + 2 * atanh(div(m - ONE, m + ONE))
}

/// Of at most 9.
pub(crate) fn tanh(x: i128) -> i128 {
    let e = exp(2 * x.abs());
    (ONE - (ONE << (BITS + 1)) / (e + ONE)) * x.signum()
}

/// What of the normal distribution lies above `z`, to 2^-54 up to `z` = 6.5.
pub(crate) fn tail(z: i128) -> i128 {
    if z < 0 {
        return ONE - tail(-z);
    }
    let density = mul(exp(-mul(z, z) / 2), 398_942_280_401_432_678 * ONE / 10i128.pow(18));
    if z < 2 * ONE {
        let (mut sum, mut term) = (0, z);
        for k in 1..60 {
            sum += term;
            term = mul(mul(term, z), z) / (2 * k + 1);
        }
        return ONE / 2 - mul(density, sum);
    }
    let mut fraction = z;
    for k in (1..200).rev() {
        fraction = z + div(k * ONE, fraction);
    }
    div(density, fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Digits behind the point, as printed in tables.
    fn digits(x: i128) -> i128 {
        (x * 10i128.pow(12)) >> BITS
    }

    #[test]
    fn the_reference_has_the_digits_of_printed_tables() {
        assert_eq!(digits(exp(ONE)), 2_718_281_828_459);
        assert_eq!(digits(exp(-3 * ONE)), 49_787_068_367);
        assert_eq!(digits(ln(10 * ONE)), 2_302_585_092_994);
        assert_eq!(digits(ln(ONE / 8)), -2_079_441_541_680);
        assert_eq!(digits(tanh(ONE / 2)), 462_117_157_260);
        assert_eq!(digits(tail(ONE)), 158_655_253_931);
        assert_eq!(digits(tail(-ONE)), 841_344_746_068);
        assert_eq!(digits(tail(3 * ONE)), 1_349_898_031);
        assert_eq!(digits(tail(6 * ONE)), 986);
    }
}
