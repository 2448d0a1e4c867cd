//! Draws of flawed cells and reads against their definitions, on 10^5 of them: tolerances are those of such a sample, four standard
//! deviations, a chance of one in 16,000 each, and the seeds are fixed.

use std::sync::Arc;

use dalean::chip::device::{
    Chance, Direction, Faults, Noise, NoisePlace, Programming, ReadNoise, cell_words,
};
use dalean::num::draw::{Place, Site};
use dalean::num::tables::{DriftLaw, DriftTables, Gaussian, OfLogarithm};

const SIZE: [usize; 2] = [400, 250];
const WINDOW: [u16; 2] = [2, 14];

fn place(seed: u64, layer: u16, pathway: u8) -> Place {
    Place { seed, site: Site::StuckCell, layer, pathway, sub: 0, count: 0 }
}

fn faults() -> Faults {
    Faults { floor: share(0.02), ceiling: share(0.01), any: share(0.1) }
}

fn share(of: f64) -> Chance {
    Chance::new((of * 4_294_967_296.0) as u64).unwrap()
}

/// A share of 10^5 cells within four standard deviations: a chance of one in 16,000 each, and the seeds are fixed.
fn is_near(found: usize, of: f64, wanted: f64) -> bool {
    (found as f64 - of * wanted).abs() < 4.0 * (of * wanted * (1.0 - wanted)).sqrt()
}

/// Fails when a bound is taken from the other kind, when levels are drawn from the word that chose, or when a level of the
/// window is left out.
#[test]
fn shares_of_cells_are_stuck_where_they_are_said_to_be() {
    let cells = faults().stuck(place(1, 0, 0), WINDOW, SIZE);
    let of = 1e5;
    let at = |level: u16| cells.iter().filter(|cell| cell.level == level).count();
    let each = 0.1 / 13.0;
    assert!(is_near(cells.len(), of, 0.13), "{}", cells.len());
    assert!(is_near(at(2), of, 0.02 + each) && is_near(at(14), of, 0.01 + each));
    for level in 3..14 {
        assert!(is_near(at(level), of, each), "{level}: {}", at(level));
    }
}

/// Fails when rows or columns share words: then the cells of a row or a column would stick together.
#[test]
fn faults_are_independent_of_their_neighbours_and_of_other_arrays_and_seeds() {
    let faults = Faults { floor: share(0.3), ..Faults::NONE };
    let map = |place| {
        let mut map = vec![false; SIZE[0] * SIZE[1]];
        for cell in faults.stuck(place, WINDOW, SIZE) {
            map[cell.row as usize * SIZE[1] + cell.column as usize] = true;
        }
        map
    };
    let one = map(place(1, 0, 0));
    let both = |other: &[bool]| one.iter().zip(other).filter(|(a, b)| **a && **b).count();
    for other in [place(2, 0, 0), place(1, 1, 0), place(1, 0, 1)] {
        assert!(is_near(both(&map(other)), 1e5, 0.09));
    }
    for apart in [1, SIZE[1]] {
        let pairs = both(&one[apart..]);
        assert!(is_near(pairs, 1e5 - apart as f64, 0.09), "{apart}: {pairs}");
    }
    let per_column = (0..SIZE[1]).map(|c| (0..SIZE[0]).filter(|r| one[r * SIZE[1] + c]).count());
    let worst = per_column.map(|n| (n as f64 - 120.0).abs()).fold(0.0, f64::max);
    assert!(worst < 4.5 * (400.0f64 * 0.21).sqrt(), "{worst}");
}

/// Mean, variance and tails on 10^5 conversions, within four of the standard deviations that such a sample has.
#[test]
fn conversions_have_the_moments_and_tails_of_a_gaussian() {
    let sd = ReadNoise { sigma: 1 << 12 }.sd(255, 255);
    let table = Arc::new(Gaussian::new());
    let noise = Noise::new(table, sd, (7, 1), (2, 0), (Direction::Columns, 1));
    let at = NoisePlace { pathway: 2, slice: 3, phase: 1, read: 4, tile: 0 };
    let mut all: Vec<f64> = Vec::new();
    for read in 0..100 {
        noise.each(NoisePlace { read, ..at }, 0..1000, |_, more| all.push(more as f64));
    }
    let (n, sd) = (all.len() as f64, 255.0 * 255.0 / 16.0);
    let mean = all.iter().sum::<f64>() / n;
    let variance = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    assert!(mean.abs() < 4.0 * sd / n.sqrt(), "{mean}");
    let wanted = sd * sd;
    assert!((variance / wanted - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{}", variance / wanted);
    for (beyond, share) in [(1.0, 0.31731), (2.0, 0.0455), (3.0, 0.0027)] {
        let found = all.iter().filter(|x| x.abs() > beyond * sd).count() as f64;
        let off = (found - n * share).abs();
        assert!(off < 4.0 * (n * share * (1.0 - share)).sqrt() + 30.0, "{beyond}: {found}");
    }
    // neighbours in a read, and the same line of the next
    for apart in [1, 1000] {
        let sum: f64 = all.iter().zip(&all[apart..]).map(|(a, b)| a * b).sum();
        let r = sum / (variance * (n - apart as f64));
        assert!(r.abs() < 4.0 / n.sqrt(), "{apart}: {r}");
    }
}

/// PCM as of Nandakumar et al., ICECS 2019: 0.26348, 1.9650 and -1.1731 uS of 25.
fn pcm() -> Programming {
    let share = |microsiemens: f64| (microsiemens / 25.0 * 16_777_216.0).round() as i64;
    Programming { coefficients: [share(0.26348), share(1.9650), share(-1.1731), 0] }
}

#[test]
fn the_deviation_is_the_polynomial() {
    for level in [0u16, 1, 64, 128, 200, 255] {
        let g = f64::from(level) / 255.0;
        let exact = (0.26348 + 1.9650 * g - 1.1731 * g * g) / 25.0 * 255.0;
        let found = pcm().sd(level, 255) as f64 / 256.0;
        assert!((found - exact).abs() < 0.01, "{level}: {found} {exact}");
    }
    assert_eq!(Programming { coefficients: [-1, 0, 0, 0] }.sd(3, 15), 0, "no less than none");
    let cube = Programming { coefficients: [0, 0, 0, 1 << 24] };
    assert_eq!([0, 5, 10].map(|level| cube.sd(level, 10)), [0, 320, 2560]);
}

/// Mean, variance and tails over 10^5 cells, within four of the deviations that such a sample has.
#[test]
fn what_a_load_leaves_has_the_mean_and_the_deviation_of_its_law() {
    let gaussian = Gaussian::new();
    let words = cell_words(Place { site: Site::ProgrammingNoise, ..place(3, 1, 2) }, SIZE);
    let all = words.iter().map(|&words| pcm().left(&gaussian, 128, words, [0, 255]));
    let all: Vec<f64> = all.map(f64::from).collect();
    let (n, sd) = (1e5, pcm().sd(128, 255) as f64 / 256.0);
    // rounding with a draw: a sixth of a level squared where the fraction is as likely as any
    let variance = sd * sd + 1.0 / 6.0;
    let mean = all.iter().sum::<f64>() / n;
    let found = all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    assert!((mean - 128.0).abs() < 4.0 * (variance / n).sqrt(), "{mean}");
    assert!((found / variance - 1.0).abs() < 4.0 * (2.0f64 / n).sqrt(), "{found} {variance}");
    let far = all.iter().filter(|x| (**x - 128.0).abs() > 3.0 * variance.sqrt()).count();
    assert!((150..400).contains(&far), "{far}");
    let r = all.windows(2).map(|p| (p[0] - mean) * (p[1] - mean)).sum::<f64>() / (n * found);
    assert!(r.abs() < 4.0 / f64::sqrt(n), "{r}");
}

fn words(sub: u32, count: usize) -> Vec<u16> {
    let place = Place { seed: 5, site: Site::Drift, layer: 0, pathway: 0, sub, count: 0 };
    let mut bytes = vec![0; count.div_ceil(32) * 64];
    place.columns(count, 0..1, 2, &mut bytes);
    bytes.as_chunks::<2>().0.iter().take(count).map(|b| u16::from_le_bytes(*b)).collect()
}

fn pcm_drift() -> DriftLaw {
    DriftLaw::Power {
        exponent: OfLogarithm { slope: -0.0155, offset: 0.0244, least: 0.049, most: 0.1 },
        spread: OfLogarithm { slope: -0.0125, offset: -0.0059, least: 0.008, most: 0.045 },
    }
}

/// Mean and variance over 10^5 cells of one level, within four of the deviations that such a sample has; fails when rounding
/// leans, when the exponent has no spread, or when time is not a logarithm.
#[test]
fn a_level_falls_by_the_power_of_time_with_its_spread() {
    let gaussian = Gaussian::new();
    let (g, r) = (words(0, 100_000), words(1, 100_000));
    for (level, ratio, nu, sd) in
        [(200u16, 4320.0, 0.049, 0.008), (60, 1.5e6, 0.046_827, 0.012_187)]
    {
        let nu = f64::max(nu, 0.049);
        let tables = DriftTables::new(pcm_drift(), [255; 2], ratio);
        let aged =
            g.iter().zip(&r).map(|(&g, &r)| f64::from(tables.aged(&gaussian, level, [g, r], 255)));
        let aged: Vec<f64> = aged.collect();
        let n = aged.len() as f64;
        let mean = aged.iter().sum::<f64>() / n;
        let var = aged.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        // log-normal, and rounding: a fraction p of a level has variance p (1 - p), a sixth on average
        let s = sd * f64::ln(ratio);
        let median = f64::from(level) * f64::powf(ratio, -nu);
        let wanted = median * (s * s / 2.0).exp();
        let spread = wanted * wanted * ((s * s).exp() - 1.0) + 1.0 / 6.0;
        assert!((mean - wanted).abs() < 4.0 * (spread / n).sqrt() + 0.02, "{mean} {wanted}");
        assert!((var / spread - 1.0).abs() < 0.04, "{var} {spread}");
    }
}

#[test]
fn nothing_has_moved_at_the_start_and_no_level_leaves_its_range() {
    let gaussian = Gaussian::new();
    let log = DriftLaw::Log { change: -0.01, spread: 0.5 };
    for law in [pcm_drift(), log] {
        let (now, late) =
            (DriftTables::new(law, [255; 2], 1.0), DriftTables::new(law, [255; 2], 1e12));
        for level in 0..=255 {
            for word in (0..=u16::MAX).step_by(257) {
                assert_eq!(now.aged(&gaussian, level, [word, !word], 255), level);
                assert!(late.aged(&gaussian, level, [word, word], 255) <= 255);
            }
        }
    }
}

#[test]
fn a_logarithm_moves_all_levels_alike() {
    let tables = DriftTables::new(DriftLaw::Log { change: -0.01, spread: 0.0 }, [100; 2], 1000.0);
    let gaussian = Gaussian::new();
    let aged = [0, 2, 50, 100].map(|level| tables.aged(&gaussian, level, [9, 0], 100));
    assert_eq!(aged, [0, 0, 47, 97]);
}
