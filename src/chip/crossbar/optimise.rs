//! Writing of sums that were formed: those of an optimiser that looks at them before it asks, or that are not asked for as
//! they are. Where they are of many reads they are kept from one pass to the next; of few, they are formed again.
//!
//! ```text
//! sums   [half block, in the order of levels][64 rows][16 columns]       i32, of the panels of a strip
//! ```
//!
//! What is kept is 0 where rows and columns do not exist. See docs/MODEL.md, 3.10.
#![deny(clippy::float_arithmetic, clippy::disallowed_types, clippy::disallowed_methods)]

mod adam;
mod momentum;

pub use adam::Adam;
pub use momentum::Momentum;

use super::StripMut;
use super::form::{Form, Former, LongSums, place};
use super::kernel::{Answers, Draws, Half, Kernel, SignLaw, WriteCounts, WriteLaw};
use super::layout::HALF_COLUMNS;
use super::pulses::Collector;
use super::words::Words;
use super::write::{WriteRequest, Written};
use crate::chip::hardware::DitherBits;

/// What is asked for by sums that were formed.
#[derive(Debug)]
pub enum Asks<'a> {
    /// A pulse towards each that is loud, with a chance. Words are of 16 bits, whatever the chip rounds with. Beside it what is
    /// loud among sums that 32 bits do not hold.
    Signs(SignLaw, u64),
    /// Nothing.
    Nothing,
    /// As many pulses as they are rounded to. They may be 16 times as large as those of a batch.
    Sums,
    /// The same, of sums that are not.
    Narrow,
    /// What comes of accumulators of the cells, which lie as sums do.
    Momentum(Momentum, &'a mut [i64]),
    /// What comes of two means of the cells, which lie as sums do.
    Adam(Adam, [&'a mut [i64]; 2]),
}

impl Asks<'_> {
    /// Bits of a word.
    const fn bits(&self, rounding: DitherBits) -> DitherBits {
        match self {
            Self::Signs(..) => DitherBits::Sixteen,
            _ => rounding,
        }
    }

    /// What the sums of the half block at a place ask to be rounded, in 64 bits: a mantissa may take them beyond 32.
    fn requests(&mut self, mut requests: Half<i64>, at: usize) -> Half<i64> {
        match self {
            Self::Signs(..) | Self::Nothing | Self::Narrow | Self::Sums => {}
            Self::Momentum(momentum, moments) => {
                for (request, moment) in requests.iter_mut().zip(&mut moments[at..]) {
                    *moment = momentum.after(*moment, *request);
                    *request = *moment;
                }
            }
            Self::Adam(adam, [first, second]) => {
                let means = first[at..].iter_mut().zip(&mut second[at..]);
                for (request, (first, second)) in requests.iter_mut().zip(means) {
                    *request = adam.request([first, second], *request);
                }
            }
        }
        requests
    }
}

impl StripMut<'_> {
    /// Programs sums that were kept.
    pub fn write_kept(
        &mut self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        (sums, long): (&[i32], &LongSums),
        asks: Asks<'_>,
    ) -> Written {
        let blocks = self.layout.blocks();
        let mut pass = Pass::new(self, request, asks);
        if pass.is_idle() {
            return pass.end(kernel);
        }
        for block in 0..blocks {
            for half in 0..self.halves() {
                let at = place(half, block, blocks);
                let beyond = long.iter().find(|(place, _)| *place == at).map(|(_, sums)| &**sums);
                let sums: &Half<i32> = sums[at..].first_chunk().expect("a half block");
                pass.program(kernel, self, (half, block), (sums, beyond));
            }
        }
        pass.end(kernel)
    }

    /// Forms the sums of these panels and programs them. `gates` are those of a [`StripMut::write`].
    pub fn write_formed(
        &mut self,
        kernel: &Kernel,
        request: &WriteRequest<'_>,
        (gates, form): (&[i8], Form<'_>),
        asks: Asks<'_>,
    ) -> Written {
        let mut pass = Pass::new(self, request, asks);
        if pass.is_idle() {
            return pass.end(kernel);
        }
        let mut former = Former::new(kernel, self, request, gates, form);
        let together = former.together();
        for block in 0..self.layout.blocks() {
            for first in (0..self.halves()).step_by(together) {
                former.form(kernel, block, first..first + together);
                for half in first..first + together {
                    let beyond = former.long.iter().find(|(at, _)| *at == half);
                    let sums = (&former.sums[half], beyond.map(|(_, sums)| &**sums));
                    pass.program(kernel, self, (half, block), sums);
                }
            }
        }
        pass.end(kernel)
    }
}

/// What goes from one half block of a write to the next.
struct Pass<'a> {
    request: WriteRequest<'a>,
    asks: Asks<'a>,
    words: Words,
    /// Of pulses, where cells are not ideal.
    answers: Option<Box<Answers>>,
    collector: Collector,
    counts: WriteCounts,
    /// First column.
    column: usize,
}

impl<'a> Pass<'a> {
    fn new(strip: &StripMut<'_>, request: &WriteRequest<'a>, asks: Asks<'a>) -> Self {
        let columns = strip.columns();
        let collector = Collector::new(request.collect, strip.layout, columns.clone());
        let dither_bits = asks.bits(request.dither_bits);
        let request = WriteRequest { dither_bits, ..*request };
        let draws = Draws::new(request.place, strip.layout.rows);
        let (column, counts) = (columns.start, WriteCounts::default());
        let words = Words::new(&request, draws, columns);
        let answers = strip.answers(request.place);
        Self { request, asks, words, answers, collector, counts, column }
    }

    /// Whether nothing is asked for, whatever the sums.
    const fn is_idle(&self) -> bool {
        matches!(self.asks, Asks::Nothing | Asks::Signs(SignLaw { chance: 0, .. }, _))
    }

    fn end(self, kernel: &Kernel) -> Written {
        let mut counts = self.counts;
        if let Some(sent) = self.answers.as_ref().and_then(|answers| answers.verified) {
            counts.attempted = sent;
        }
        Written { counts, collected: self.collector.finish(kernel) }
    }

    /// Programs a half block of a strip: its sums, and beside them what 32 bits do not hold.
    fn program(
        &mut self,
        kernel: &Kernel,
        strip: &mut StripMut<'_>,
        (half, block): (usize, usize),
        (mut sums, beyond): (&Half<i32>, Option<&Half<i64>>),
    ) {
        let Self { request, asks, words, answers, collector, counts, .. } = self;
        let (bits, write) = (request.dither_bits.get(), &request.write);
        let column = self.column + half * HALF_COLUMNS;
        let held = beyond.map(|beyond| held(beyond, asks));
        if let Some(held) = &held {
            sums = held;
        }
        let at = place(half, block, strip.layout.blocks());
        let answering = strip.answering(half, block, answers.as_deref_mut());
        let mut cells = strip.half(half, block);
        cells.answering = answering;
        cells.pulses = collector.half(kernel, (column, block));
        let groups = if let &mut Asks::Signs(law, _) = asks {
            // what is held is loud, or 0
            let least = if beyond.is_some() { 1 } else { law.least };
            let law = SignLaw { least, ..law };
            let groups = kernel.loud(sums, law.least);
            if groups != 0 {
                let law = SignLaw { groups, ..law };
                let words =
                    if law.is_certain() { None } else { words.draw_halves(kernel, column, block) };
                *counts += kernel.program_signs(cells, sums, &law, words, write.ends());
            }
            groups
        } else if matches!(asks, Asks::Narrow)
            || (matches!(asks, Asks::Sums) && beyond.is_none() && fits(kernel, sums, request))
        {
            let groups = kernel.may_move(sums, write, bits);
            if groups != 0 {
                let law = WriteLaw { groups, ..*write };
                let words = words.draw(kernel, column, block);
                *counts += kernel.program(cells, sums, &law, words);
            }
            groups
        } else {
            let requests = asks.requests(beyond.map_or_else(|| sums.map(i64::from), |b| *b), at);
            let groups = kernel.may_move(&requests, write, bits);
            if groups != 0 {
                let law = WriteLaw { groups, ..*write };
                let words = words.draw(kernel, column, block);
                *counts += kernel.program(cells, &requests, &law, words);
            }
            groups
        };
        if groups != 0 {
            collector.take(kernel, (column, block), groups);
        }
    }
}

/// What stands for sums beyond 32 bits where only their sign, and whether they are loud, is asked for.
fn held(beyond: &Half<i64>, asks: &Asks<'_>) -> Half<i32> {
    let least = if let Asks::Signs(_, least) = asks { *least } else { 0 };
    beyond.map(|sum| match sum.unsigned_abs() >= least {
        true => i32::try_from(sum.signum()).expect("-1..=1") * i32::MAX,
        false => 0,
    })
}

/// Whether sums times their mantissa fit 32 bits, and so does their shift.
fn fits(kernel: &Kernel, sums: &Half<i32>, request: &WriteRequest<'_>) -> bool {
    request.write.shift <= 31 && kernel.loud(sums, 1 << 27) == 0
}
