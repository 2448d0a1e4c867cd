//! No argument of the public face makes a call panic.

use proptest::prelude::*;

mod play;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_argument_of_the_face_makes_a_call_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..600),
    ) {
        play::play(&bytes);
    }
}
