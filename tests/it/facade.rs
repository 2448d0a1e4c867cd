//! No argument of the public face makes a call panic.

use dalean::{
    Backend, Classifier, Config, Data, Examples, ExamplesError, Machine, RunError, Session,
    Sources, Split,
};
use proptest::prelude::*;

mod play;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_argument_of_the_face_makes_a_call_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..1200),
    ) {
        play::play(&bytes);
    }
}

fn config(text: &str) -> Config {
    Config::load(&Sources { experiment: Some(("it", text)), ..Sources::default() }).unwrap()
}

#[test]
fn examples_of_one_class_are_refused_as_a_single_output_answers_two() {
    let set = Examples::new(vec![0, 1, 1, 0, 1, 1], vec![0; 3], 2, 1, 1).unwrap();
    let config = config("network.hidden = [3]\nlearning.taps = 1");
    let mut experiment = config.experiment(2, 2, None).unwrap();
    experiment.network.layers[1].units = 1;
    let refused = Classifier::new(experiment, &set, Backend::best()).unwrap_err();
    assert_eq!(refused.key(), "data.classes");
    let split = Split { train: set.clone(), validation: set.clone(), test: set };
    let data = Data::new("one class", split, None).unwrap();
    let machine = Machine::new(Backend::best(), 1).unwrap();
    let refused = Session::new(&config, data, machine).unwrap_err().to_string();
    assert!(refused.contains("`data.classes` is 1"), "{refused}");
}

#[test]
fn a_step_of_a_table_that_is_too_wide_to_look_up_is_refused() {
    let text = "network = { hidden = [3], alpha = 1e6, weight_max = 0.00390625 }\nhw.lut.bits = 2\n\
                learning.rate = 1e6";
    let refused = config(text).experiment(2, 2, None).unwrap_err().to_string();
    assert!(refused.contains("`network.alpha`") && refused.contains("2^45 units"), "{refused}");
}

#[test]
fn errors_that_a_caller_makes_up_can_be_shown() {
    let label = ExamplesError::Label { example: 0, found: 0, classes: 0 };
    let stopped = RunError::Stopped { epoch: u32::MAX, path: "x".into() };
    assert!(label.to_string().contains("0 classes") && stopped.to_string().contains("epoch"));
}
