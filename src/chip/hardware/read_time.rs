//! How long a read takes whose slices take times of their own.
//!
//! ```text
//! A_s, conv_s          settle and sample, and all conversions, of slice s              conv_s = S C_s
//! period_s             A_s + max(0, conv_s - A_next)      samples and holds overlapped; next: slice s + 1, or the first
//!                      A_s + conv_s                       not overlapped
//! FWD                  sum of the periods but the last  +  A + conv of the last  +  T_tree + NG
//! until the next FWD   max(sum of the periods, NG)
//! ```
//!
//! A converter is free when the next slice is sampled, so nothing waits. With slices alike these are the forms of
//! `timing`: `period = max(T_A, conv)`. Reads from the columns go through all slices twice. See docs/MODEL.md, 4.5.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

use super::timing::{CYCLES_MAX, Timing};
use super::{Hardware, HardwareError, between};

/// What a slice takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SliceTime {
    /// Cycles to settle and sample.
    pub settle: u64,
    /// Cycles of a conversion.
    pub convert: u64,
}

/// What every slice of a read takes, the first one first. A drive code has at most eight.
///
/// ```
/// use dalean::hardware::{SliceTime, SliceTimes};
///
/// let times = [SliceTime { settle: 15, convert: 11 }, SliceTime { settle: 7, convert: 7 }];
/// assert_eq!(SliceTimes::new(&times)?.iter().nth(1), Some(times[1]));
/// assert!(SliceTimes::new(&[]).is_err());
/// # Ok::<(), dalean::HardwareError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SliceTimes {
    count: usize,
    times: [SliceTime; SliceTimes::MAX],
}

impl SliceTimes {
    /// Slices of a drive code, at most: one a bit.
    pub const MAX: usize = 8;

    /// Takes over the times of 1 to 8 slices.
    ///
    /// # Errors
    /// When there are none or too many, or one takes no time or too much.
    pub fn new(slices: &[SliceTime]) -> Result<Self, HardwareError> {
        between("timing.slices", slices.len() as u64, [1, Self::MAX as u64])?;
        for slice in slices {
            between("timing.settle_cycles", slice.settle, [1, 2 * CYCLES_MAX])?;
            between("timing.convert_cycles", slice.convert, [1, CYCLES_MAX])?;
        }
        let mut times = [slices[0]; Self::MAX];
        times[..slices.len()].copy_from_slice(slices);
        Ok(Self { count: slices.len(), times })
    }

    /// The slices.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = SliceTime> + '_ {
        self.times[..self.count].iter().copied()
    }

    /// That the first one takes what the timing says of it.
    pub(super) fn check(&self, settle: u64, convert: u64) -> Result<(), HardwareError> {
        if self.times[0] == (SliceTime { settle, convert }) {
            return Ok(());
        }
        let found = format!("begin with {:?}", self.times[0]);
        let allowed = format!("the first one takes settle {settle} and convert {convert}");
        Err(HardwareError { key: "timing.slices", found, allowed })
    }
}

/// Closed forms of reads.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ReadTime {
    timing: Timing,
    /// Sums over all slices: settling, converting, periods.
    pub(crate) arrays: u64,
    pub(crate) converters: u64,
    front: u64,
    /// From the start of the last slice: until the next one could start, and until its last conversion is done.
    last: [u64; 2],
    pub(crate) slices: u64,
}

impl ReadTime {
    /// Reads of a chip.
    pub(crate) fn new(hardware: &Hardware, timing: Timing) -> Self {
        Self::of(timing, hardware.slices().into())
    }

    /// Reads in so many slices; those that the timing does not tell apart are alike.
    pub(crate) fn of(timing: Timing, slices: u64) -> Self {
        let first = SliceTime { settle: timing.settle, convert: timing.convert };
        let own = timing.slices.filter(|own| own.iter().len() as u64 == slices);
        let (times, repeats) = match &own {
            Some(own) => (own.iter().collect(), 1),
            None => (vec![first], slices),
        };
        let conversion = |slice: SliceTime| timing.share * slice.convert;
        let period = |at: usize| {
            let (this, next) = (times[at], times[(at + 1) % times.len()]);
            let waits = if timing.overlapped { next.settle } else { 0 };
            this.settle + conversion(this).saturating_sub(waits)
        };
        let sum = |of: &dyn Fn(usize) -> u64| repeats * (0..times.len()).map(of).sum::<u64>();
        let end = times.len() - 1;
        Self {
            timing,
            arrays: sum(&|at| times[at].settle),
            converters: sum(&|at| conversion(times[at])),
            front: sum(&period),
            last: [period(end), times[end].settle + conversion(times[end])],
            slices,
        }
    }

    /// Busy cycles of a read that goes through all slices so many times, of so many lines, whose tiles are added in
    /// `levels` steps.
    pub(crate) const fn read(&self, times: u64, lines: u64, levels: u64) -> u64 {
        let [period, end] = self.last;
        let tail = self.timing.beat * (levels + self.timing.groups(lines));
        times * self.front - period + end + tail
    }

    /// Busy cycles until the front end takes the next read.
    pub(crate) const fn again(&self, times: u64, lines: u64) -> u64 {
        let (front, lanes) = (times * self.front, self.timing.beat * self.timing.groups(lines));
        if front > lanes { front } else { lanes }
    }
}

#[cfg(test)]
mod tests {
    use super::super::PulseCode;
    use super::*;

    const TIMING: Timing = Timing {
        clock_khz: 1_000_000,
        beat: 1,
        settle: 10,
        convert: 2,
        share: 8,
        overlapped: true,
        lanes: 4,
        hops: 3,
        pulse: 5,
        pulse_code: PulseCode::Unary,
        verify: false,
        active_max: None,
        slices: None,
    };

    #[test]
    fn a_read_is_what_the_formula_says() {
        let of = |timing| ReadTime::of(timing, 4);
        // conv 16 > settle 10: 10 + 3 x 16 + 16 + 2 + ceil(18 / 4)
        assert_eq!(of(TIMING).read(1, 18, 2), 10 + 48 + 16 + 2 + 5);
        assert_eq!(of(TIMING).again(1, 18), 64);
        let apart = Timing { overlapped: false, ..TIMING };
        assert_eq!((of(apart).read(1, 18, 2), of(apart).again(1, 18)), (4 * 26 + 2 + 5, 4 * 26));
        let analog = Timing { settle: 20, ..TIMING };
        assert_eq!((of(analog).read(1, 18, 2), of(analog).again(1, 18)), (20 + 60 + 16 + 7, 80));
        // one lane for 100 columns is slower than one slice
        let slow = ReadTime::of(Timing { lanes: 1, ..TIMING }, 1);
        assert_eq!((slow.again(1, 16), slow.again(1, 17)), (16, 17));
    }

    /// Two phases as NeuRRAM reads them: four bits and eleven steps, then three bits and seven.
    #[test]
    fn unequal_phases_add_up() {
        let phases = [SliceTime { settle: 15, convert: 11 }, SliceTime { settle: 7, convert: 7 }];
        let slices = Some(SliceTimes::new(&phases).unwrap());
        let apart =
            Timing { settle: 15, convert: 11, share: 1, overlapped: false, slices, ..TIMING };
        let time = ReadTime::of(apart, 2);
        assert_eq!((time.arrays, time.converters), (22, 18));
        assert_eq!((time.read(1, 4, 0), time.again(1, 4)), (15 + 11 + 7 + 7 + 1, 40));
        // overlapped: the second phase settles while the first is converted, 4 cycles longer than it settles
        let overlapped = ReadTime::of(Timing { overlapped: true, ..apart }, 2);
        assert_eq!(overlapped.read(1, 4, 0), 15 + 11 + 7 + 1);
        assert_eq!(overlapped.again(1, 4), 15 + 4 + 7);
        assert_eq!(overlapped.read(2, 4, 0), 26 + 15 + 11 + 7 + 1);
    }

    #[test]
    fn slices_that_do_not_begin_as_the_timing_says_are_refused() {
        let phases = [SliceTime { settle: 9, convert: 2 }, SliceTime { settle: 5, convert: 2 }];
        let times = SliceTimes::new(&phases).unwrap();
        let error = Timing { slices: Some(times), ..TIMING }.check().unwrap_err();
        assert_eq!(error.key, "timing.slices");
        assert!(Timing { settle: 9, slices: Some(times), ..TIMING }.check().is_ok());
        let none = SliceTime { settle: 0, convert: 1 };
        assert_eq!(SliceTimes::new(&[none]).unwrap_err().key, "timing.settle_cycles");
        assert!(SliceTimes::new(&[phases[0]; 9]).is_err());
    }
}
