use super::*;
use proptest::prelude::*;

/// Whether squares are fewer than those of `count` numbers of twice the mean square of a deviation, of a table of so many bits.
fn hold(squares: u128, count: u64, lut_bits: u32, shift: i32) -> bool {
    // in 2^-17, so that every power is whole; 2^107 is more than all squares here
    let log2 = 2 * (lut_bits as i32 + shift) - 5 + 17;
    log2 >= 107 || squares << 17 < u128::from(count) << log2
}

proptest! {
    #[test]
    fn a_mean_stays_among_what_it_is_of_and_comes_nearer(
        from in -(1i64 << 40)..1 << 40,
        sums in prop::collection::vec(-(1i64 << 30)..1 << 30, 1..40),
        spare in 0u32..10,
    ) {
        let reads = sums.len() as i64;
        let window = log2_ceil(reads as u64) + spare;
        let sum = sums.iter().sum::<i64>() << THRESHOLD_BITS;
        let to = moved(from, sum, reads, window);
        let off = |mean: i64| (i128::from(mean) * i128::from(reads) - i128::from(sum)).abs();
        // what is less than half of what moves it by one does not
        prop_assert!(off(to) <= off(from).max(i128::from(reads)), "{from} {to}");
        prop_assert!(off(from) < 1i128 << window >> 1 || to != from || off(from) == 1i128 << window >> 1);
        let least = from.min(sums.iter().min().unwrap() << THRESHOLD_BITS);
        let most = from.max(sums.iter().max().unwrap() << THRESHOLD_BITS);
        prop_assert!((least..=most).contains(&to));
        let first = first_threshold(sum >> THRESHOLD_BITS, reads as u64);
        prop_assert!(2 * off(first) <= i128::from(reads));
    }

    #[test]
    fn a_first_step_is_the_least_that_holds_the_deviation(
        squares in prop_oneof![0u128..1 << 20, 0u128..1 << 90], count in 1u64..1 << 20, bits in 2u32..=14,
    ) {
        let shift = first_shift(squares, count, bits);
        prop_assert!(shift == 47 || hold(squares, count, bits, shift));
        prop_assert!(shift == -8 || !hold(squares, count, bits, shift - 1));
    }

    #[test]
    fn a_step_never_flaps(shift in -8i32..=47, variance in 0i64..1 << 50, units in 1i64..1000, bits in 2u32..=14) {
        let (to, left) = stepped(shift, variance, units, bits);
        prop_assert!((to - shift).abs() <= 1 && STEP_SHIFTS.contains(&to));
        if to != shift {
            // what moved by one step does not move back at once
            let back = stepped(to, left, units, bits).0;
            prop_assert!(back == to || (back > to) == (to > shift), "{shift} {to} {back}");
        }
    }
}

#[test]
fn a_step_moves_where_the_law_says() {
    // 10 bits, 3 units: up from 3 2^19, down below 3 3 2^15
    let of = |variance| stepped(5, variance, 3, 10);
    assert_eq!(of(3 << 19), (6, 3 << 17));
    assert_eq!(of((3 << 19) - 1), (5, (3 << 19) - 1));
    assert_eq!(of(9 << 15), (5, 9 << 15));
    assert_eq!(of((9 << 15) - 1), (4, ((9 << 15) - 1) << 2));
    // and never beyond its ends
    assert_eq!(stepped(47, 3 << 30, 3, 10), (47, 3 << 30));
    assert_eq!(stepped(-8, 0, 3, 10), (-8, 0));
}

#[test]
fn first_steps_by_hand() {
    // two numbers of 100: a mean square of 10,000 lies below 2^15 4^-0, and below 2^15 4^-1 = 8,192 it does not
    assert_eq!(first_shift(20_000, 2, 10), 0);
    assert_eq!(first_shift(2 * 8_191, 2, 10), -1);
    assert_eq!(first_shift(2 << 15, 2, 10), 1);
    assert_eq!(first_shift(0, 2, 10), -8);
    assert_eq!(first_shift(u128::MAX, 1, 2), 47);
}

#[test]
fn shifts_to_the_left_are_exact() {
    assert_eq!([-3, 0, 2].map(|shift| shifted(-6, shift)), [-48, -6, -1]);
}
