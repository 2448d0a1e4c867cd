//! Networks with convolutions, as their keys make them.

use crate::chip::layer::{Gain, Homeostasis, LayerSpec, Optimiser, Pool};
use crate::lab::config::{Config, Sources, load};
use crate::num::tables::Activation;
use crate::task::classify::{Coding, Experiment};

fn config(settings: &[&str]) -> Result<Config, String> {
    let settings: Vec<String> = settings.iter().map(ToString::to_string).collect();
    load(&Sources { settings: &settings, ..Sources::default() }).map_err(|e| e.to_string())
}

/// For images of 32 x 32 x 3.
fn colours(settings: &[&str]) -> Result<Experiment, String> {
    let settings: Vec<&str> =
        std::iter::once("data.set=cifar10").chain(settings.iter().copied()).collect();
    let made = config(&settings)?.experiment(3072, 10, Some([32, 32, 3]));
    made.map_err(|error| error.to_string())
}

/// For images of 8 x 8.
fn digits(settings: &[&str]) -> Result<Experiment, String> {
    config(settings)?.experiment(64, 10, Some([8, 8, 1])).map_err(|error| error.to_string())
}

fn sizes(layers: &[LayerSpec]) -> Vec<[usize; 4]> {
    layers
        .iter()
        .map(|one| [one.inputs, one.units, one.positions(), one.sample_outputs()])
        .collect()
}

/// DESIGN 5: what a user gets by saying nothing but channels.
#[test]
fn channels_alone_give_a_network_that_keeps_to_middles() {
    let made = colours(&["network.channels=[20, 40]"]).unwrap();
    let network = &made.network;
    assert_eq!(made.coding, Coding::White { image: [32, 32, 3] });
    assert_eq!(
        sizes(&network.layers),
        [[54, 20, 1024, 5120], [180, 40, 256, 2560], [2560, 160, 1, 160], [160, 10, 1, 10]]
    );
    let cells: usize =
        network.layers.iter().map(|one| one.inputs * one.units * one.wiring.pathways().len()).sum();
    assert_eq!(cells, 1_674_720);
    let log2: Vec<i32> = network.layers.iter().map(|one| one.weight_max_log2).collect();
    assert_eq!(log2, [1, 0, -2, 0]);
    let (output, hidden) = network.layers.split_last().unwrap();
    for one in hidden {
        assert_eq!(one.activation, Activation::Ramp);
        let law = Homeostasis { threshold: true, gain: Gain::Tracking, window_log2: 9 };
        assert_eq!(one.homeostasis, law);
    }
    assert_eq!(hidden.iter().filter(|one| one.pool == Pool::Average { side: 2 }).count(), 2);
    assert_eq!(
        (output.activation, output.homeostasis),
        (Activation::Accumulator, Homeostasis::OFF)
    );
    assert_eq!(network.centred, [true; 4]);
    assert_eq!(network.optimisers, [Optimiser::Rms; 4]);
    assert!(network.rates.iter().all(|rate| rate.get() == 0.1));
    assert_eq!(network.batch.get(), 32);
}

#[test]
fn the_papers_preset_has_sigmoids_one_class_against_others_and_no_middles() {
    let made = colours(&["preset=paper", "network.channels=[20, 40]"]).unwrap();
    assert_eq!(made.coding, Coding::Pixels { image: [32, 32, 3] });
    let alphas = made.network.layers.iter().map(|one| match one.activation {
        Activation::Sigmoid(alpha) => alpha.get(),
        other => panic!("{other:?}"),
    });
    assert_eq!(alphas.collect::<Vec<_>>(), [3.0, 3.0, 6.0, 6.0]);
    assert!(made.network.layers.iter().all(|one| one.homeostasis == Homeostasis::OFF));
    assert_eq!(made.network.centred, [false; 4]);
    assert_eq!(made.network.optimisers, [Optimiser::Plain; 4]);
    let dense = digits(&["preset=paper"]).unwrap();
    let Activation::Sigmoid(alpha) = dense.network.layers[0].activation else { panic!() };
    assert_eq!(alpha.get(), 6.0);
}

#[test]
fn each_convolution_has_its_own_window_where_a_list_says_so() {
    let made = digits(&[
        "network.channels=[4, 6]",
        "network.kernel=[5, 2]",
        "network.stride=[1, 2]",
        "network.padding=[\"same\", 0]",
        "network.pool=[\"max\", \"none\"]",
        "network.input=on_off",
        "network.hidden=[]",
    ])
    .unwrap();
    assert_eq!(made.coding, Coding::OnOff { image: [8, 8, 1] });
    // 8 x 8 x 2, windows of 5 x 5 with a border of 2, pooled: 4 x 4 x 4; windows of 2 x 2, every second: 2 x 2 x 6
    let wanted = [[50, 4, 64, 64], [16, 6, 4, 24], [24, 10, 1, 10]];
    assert_eq!(sizes(&made.network.layers), wanted);
    assert_eq!(made.network.layers[0].pool, Pool::Max { side: 2 });
    assert_eq!(made.network.layers[1].pool, Pool::None);
}

#[test]
fn a_resolved_configuration_says_everything_and_is_read_again() {
    for settings in [
        &["network.channels=[4]"][..],
        &["network.channels=[4, 8]", "preset=paper", "network.padding=1"],
        &["network.channels=[4]", "network.pool=none", "network.gain=fixed"],
        &["network.threshold=true", "learning.centred=true"],
        &["network.activation=ramp", "learning.rate=0.3", "network.gain_spread=1"],
        &["network.input=on_off"],
    ] {
        let first = config(settings).unwrap();
        let text = first.to_toml();
        let again = load(&Sources { experiment: Some(("resolved", &text)), ..Sources::default() });
        assert_eq!(again.unwrap().to_toml(), text, "{settings:?}");
    }
    let text = config(&["network.channels=[4]"]).unwrap().to_toml();
    for line in [
        "kernel = 3",
        "stride = 1",
        "padding = \"same\"",
        "pool = \"average\"",
        "pool_side = 2",
        "copies = 1",
        "input = \"raw\"",
        "activation = \"ramp\"",
        "threshold = true",
        "gain = \"tracking\"",
        "homeostasis_window = 512",
        "error = \"softmax\"",
        "centred = true",
        "optimiser = \"rms\"",
        "flip = false",
        "hidden = [160]",
    ] {
        assert!(text.contains(line), "{line} in {text}");
    }
    assert!(!text.contains("alpha"), "no layer is a sigmoid");
}

#[test]
fn what_a_name_of_a_run_says_is_what_was_said() {
    let name = |settings: &[&str]| config(settings).unwrap().run_name();
    assert_eq!(name(&["network.channels=[4, 8]"]), "optdigits-ed-channels4x8-seed1");
    let paper = name(&["network.channels=[4]", "preset=paper"]);
    assert_eq!(paper, "optdigits-ed-channels4-preset-paper-seed1");
    let plain = name(&["network.channels=[4]", "learning.optimiser=plain"]);
    assert_eq!(plain, "optdigits-ed-optimiser-plain-channels4-seed1");
}

#[test]
fn what_means_nothing_or_does_not_fit_is_refused_with_its_key() {
    for (settings, key, words) in [
        (&["network.kernel=3"][..], "network.kernel", "no convolution"),
        (&["network.pool_side=2"], "network.pool_side", "no convolution"),
        (&["network.channels=[4]", "network.kernel=[3, 3]"], "network.kernel", "has 2 values"),
        (&["network.channels=[4]", "network.kernel=4"], "network.padding", "odd"),
        (&["network.channels=[4]", "network.padding=much"], "network.padding", "\"much\""),
        (
            &["network.channels=[4]", "network.padding=3"],
            "network.channels",
            "wider than the border",
        ),
        (
            &["network.channels=[4]", "network.kernel=9", "network.padding=0"],
            "network.channels",
            "fits the image",
        ),
        (&["network.channels=[4]", "network.kernel=0"], "network.padding", "odd"),
        (&["network.channels=[4]", "network.stride=0"], "network.channels", "every size"),
        (&["network.channels=[0]"], "network.channels", "at least 1"),
        (&["network.channels=[4]", "network.pool_side=3"], "network.channels", "without a rest"),
        (&["network.channels=[4, 4, 4, 4]"], "network.channels", "layer 3"),
        (
            &["network.channels=[4]", "network.pool=none", "network.pool_side=2"],
            "network.pool_side",
            "pooled",
        ),
        (&["network.channels=[4]", "network.pool=mean"], "network.pool", "average"),
        (&["network.channels=[4]", "network.alpha=4"], "network.alpha", "no layer"),
        (&["network.copies=2"], "network.copies", "no convolution"),
        (&["network.channels=[4]", "network.copies=[2, 2]"], "network.copies", "has 2 values"),
        (&["network.channels=[4]", "network.copies=0"], "network.copies", "once at least"),
        (&["network.channels=[4]", "network.copies=65"], "network.copies", "give it 64 or fewer"),
        (
            &["network.channels=[4]", "network.copies=2", "hw.device.faults.stuck_any=0.01"],
            "network.copies",
            "take hw.device.faults out",
        ),
        (
            &["network.channels=[4]", "network.copies=2", "hw.device.response.curve=linear"],
            "network.copies",
            "hw.device.response",
        ),
        (
            &["network.channels=[4]", "network.copies=64", "hw.tile.count=99"],
            "hw.tile.count",
            "2 x 64 copies",
        ),
        (&["task=policy", "network.copies=2"], "network.copies", "dense"),
        (&["network.channels=[4]", "network.input=white"], "network.input", "three colours"),
        (&["network.input=split"], "network.input", "policy"),
        (&["network.input=signed"], "network.input", "policy"),
        (&["network.gain_spread=1"], "network.gain_spread", "fixed"),
        (&["network.homeostasis_window=512"], "network.homeostasis_window", "take it out"),
        (
            &["network.threshold=true", "network.homeostasis_window=500"],
            "network.homeostasis_window",
            "power of two",
        ),
        (&["network.threshold=true", "network.hidden=[]"], "network.threshold", "no hidden"),
        (&["data.set=xor", "network.channels=[4]"], "network.channels", "data.shape"),
        (&["data.shape=[8, 8, 1]"], "data.shape", "data.format"),
        (&["preset=papers"], "preset", "paper"),
        (&["task=policy", "network.channels=[4]"], "network.channels", "dense"),
        (&["task=policy", "network.input=white"], "network.input", "split, offset or signed"),
        (&["task=policy", "learning.flip=true"], "learning.flip", "no images"),
        (&["task=policy", "preset=paper"], "preset", "examples"),
    ] {
        let error = digits(settings).map(drop).unwrap_err();
        assert!(
            error.contains(&format!("`{key}`")) && error.contains(words),
            "{settings:?}: {error}"
        );
    }
    // pictures of other sizes than those the network was made for
    let other = config(&["network.channels=[4]"]).unwrap();
    for image in [None, Some([4, 16, 1])] {
        let error = other.experiment(64, 10, image).unwrap_err().to_string();
        assert!(error.contains("data.shape"), "{error}");
    }
    for settings in [&["learning.flip=true"][..], &["network.input=on_off"]] {
        let error = config(settings).unwrap().experiment(64, 10, None).unwrap_err().to_string();
        assert!(error.contains("no images") || error.contains("holds none"), "{error}");
    }
}

#[test]
fn the_examples_are_what_they_say() {
    for (text, image, cells) in [
        (include_str!("../../../../examples/cifar10_conv.toml"), [32, 32, 3], 1_740_960),
        (include_str!("../../../../examples/mnist_conv.toml"), [28, 28, 1], 3_159_680),
    ] {
        let made = load(&Sources { experiment: Some(("example", text)), ..Sources::default() });
        let features = image.iter().product();
        let made = made.unwrap().experiment(features, 10, Some(image)).unwrap();
        let all = made.network.layers.iter();
        let found: usize =
            all.map(|one| one.inputs * one.units * one.wiring.pathways().len()).sum();
        assert_eq!(found, cells);
    }
}
