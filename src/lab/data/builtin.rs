//! Sets that need no fetching: the embedded digits, exclusive or, parity.
//!
//! The digits are the UCI set "Optical Recognition of Handwritten Digits" (E. Alpaydin and C. Kaynak, 1998,
//! DOI 10.24432/C50P49, CC BY 4.0): 3,823 and 1,797 pictures of 8 x 8 pixels 0 to 16, the second half by
//! other writers. They are kept as four gzip IDX files.
//!
//! ```text
//! parity:  example e of 0 ..= 2^n - 1 has bit i of e as value i, label = sum of the bits mod 2
//! ```

use super::{
    idx,
    source::{ImageShape, ParityBits},
};
use crate::task::classify::{Examples, Split};

const TRAIN_VALUES: &[u8] = include_bytes!("optdigits/train-images-idx3-ubyte.gz");
const TRAIN_LABELS: &[u8] = include_bytes!("optdigits/train-labels-idx1-ubyte.gz");
const TEST_VALUES: &[u8] = include_bytes!("optdigits/test-images-idx3-ubyte.gz");
const TEST_LABELS: &[u8] = include_bytes!("optdigits/test-labels-idx1-ubyte.gz");

/// Terms of use of the embedded digits.
pub(crate) const OPTDIGITS_LICENCE: &str =
    "CC BY 4.0 (E. Alpaydin, C. Kaynak; UCI, 10.24432/C50P49)";
/// Shape of an embedded digit.
pub(crate) const OPTDIGITS_IMAGE: ImageShape = ImageShape { height: 8, width: 8, channels: 1 };

/// The training and the test half of the embedded digits.
pub(crate) fn optdigits() -> [Examples; 2] {
    [(TRAIN_VALUES, TRAIN_LABELS), (TEST_VALUES, TEST_LABELS)].map(|(values, labels)| {
        let [values, labels] = [values, labels].map(|file| {
            idx::read(file).expect("the embedded files are whole: a test reads them").data
        });
        Examples::new(values, labels, 64, 16, 10).expect("the embedded digits are 0..=16 and 0..=9")
    })
}

/// Whether an odd number of `bits` is set, for all numbers of that many bits. All parts are the same.
pub(crate) fn parity(bits: ParityBits) -> Split {
    let bits = bits.get();
    let numbers = 0..1u32 << bits;
    let values = numbers.clone().flat_map(|n| (0..bits).map(move |i| u8::from(n >> i & 1 == 1)));
    let labels = numbers.map(|n| u8::from(n.count_ones() % 2 == 1));
    let all = Examples::new(values.collect(), labels.collect(), usize::from(bits), 1, 2)
        .expect("bits are 0 or 1");
    Split { train: all.clone(), validation: all.clone(), test: all }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::data::md5::Md5;

    /// MD5 of UCI's own files, made anew: a line of 64 values and the label, joined by commas.
    fn table_hash(set: &Examples) -> String {
        let mut hash = Md5::default();
        for example in 0..set.len() {
            let fields = set.values(example).iter().chain(&set.labels()[example..=example]);
            let line = fields.map(u8::to_string).collect::<Vec<_>>().join(",");
            hash.update(format!("{line}\n").as_bytes());
        }
        hash.hex()
    }

    #[test]
    fn the_embedded_digits_are_the_published_tables() {
        let [train, test] = optdigits();
        assert_eq!((train.len(), test.len()), (3823, 1797));
        assert_eq!(train.values(0)[..10], [0, 1, 6, 15, 12, 1, 0, 0, 0, 7]);
        assert_eq!((train.labels()[..5].to_vec(), test.labels()[0]), (vec![0, 0, 7, 4, 6], 0));
        assert_eq!(table_hash(&train), "268ce7771f3f15afbc54402478b1d454");
        assert_eq!(table_hash(&test), "a0339c30a8a5312a1b6f9e5c719dcce5");
        let count = |set: &Examples, class| set.labels().iter().filter(|&&l| l == class).count();
        assert_eq!([0, 1, 9].map(|c| count(&train, c)), [376, 389, 382]);
        assert_eq!([0, 1, 9].map(|c| count(&test, c)), [178, 182, 180]);
    }

    #[test]
    fn parity_of_two_bits_is_exclusive_or() {
        let xor = parity(ParityBits::new(2).unwrap()).train;
        assert_eq!(xor.all_values(), [0, 0, 1, 0, 0, 1, 1, 1]);
        assert_eq!(xor.labels(), [0, 1, 1, 0]);
        let eight = parity(ParityBits::new(8).unwrap()).test;
        assert_eq!((eight.len(), eight.features(), eight.labels()[255]), (256, 8, 0));
    }
}
