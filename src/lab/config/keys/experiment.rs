//! Keys of experiment files.

use super::KeyFileKind::Experiment;
use super::{KeyEntry, KeyTable, flag, key, other, real, whole, words};
use crate::lab::config::file::{
    DataFile, EnvironmentFile, EvaluationFile, EvolutionFile, ExperimentFile, LearningFile,
    NetworkFile, PpoFile,
};
use crate::lab::config::keys::KeyValues;

pub(super) const TABLES: &[KeyTable] = &[
    KeyTable {
        path: "",
        file: Experiment,
        about: "The file itself.",
        meanings: ExperimentFile::MEANINGS,
        entries: ROOT,
    },
    KeyTable {
        path: "data",
        file: Experiment,
        about: "A known set by name, or files of one's own by `format`.",
        meanings: DataFile::MEANINGS,
        entries: DATA,
    },
    KeyTable {
        path: "network",
        file: Experiment,
        about: "Units and what they are made of.",
        meanings: NetworkFile::MEANINGS,
        entries: NETWORK,
    },
    KeyTable {
        path: "learning",
        file: Experiment,
        about: "Rule, rates, batches, and which state is kept.",
        meanings: LearningFile::MEANINGS,
        entries: LEARNING,
    },
    KeyTable {
        path: "environment",
        file: Experiment,
        about: "What a policy acts on, and for how long.",
        meanings: EnvironmentFile::MEANINGS,
        entries: ENVIRONMENT,
    },
    KeyTable {
        path: "ppo",
        file: Experiment,
        about: "Proximal policy optimisation.",
        meanings: PpoFile::MEANINGS,
        entries: PPO,
    },
    KeyTable {
        path: "es",
        file: Experiment,
        about: "Antithetic evolution strategies with ranks.",
        meanings: EvolutionFile::MEANINGS,
        entries: EVOLUTION,
    },
    KeyTable {
        path: "evaluation",
        file: Experiment,
        about: "Episodes of a policy that are read without learning.",
        meanings: EvaluationFile::MEANINGS,
        entries: EVALUATION,
    },
];

/// Settings that keys of policies stand beside.
const POLICY: &[&str] = &["task=policy"];
const WINDOWS: &[&str] = &["network.channels=[4]"];
const ON_WINDOWS: &str = "with network.channels";
const ON_POLICY: &str = "with task = \"policy\"";
const CONTINUOUS: &[&str] = &["task=policy", "environment.id=Pendulum-v1"];
const ON_CONTINUOUS: &str = "with task = \"policy\" and an environment that takes numbers";
const BY_EVOLUTION: &[&str] = &["task=policy", "learning.rule=es"];
const ON_EVOLUTION: &str = "with task = \"policy\" and rule = \"es\"";

const ROOT: &[KeyEntry] = &[
    words(
        "task",
        &[("classify", "examples with labels"), ("policy", "a policy, by what comes of acting")],
    )
    .default("\"classify\""),
    whole("seed", 0, i64::MAX).default("1"),
    words(
        "preset",
        &[("paper", "sigmoids, one class against all others, units without thresholds and gains")],
    )
    .otherwise("this program's own defaults")
    .law("not with task = \"policy\""),
    other("data", "a table"),
    other("network", "a table"),
    other("learning", "a table"),
    other("environment", "a table").only(ON_POLICY, POLICY),
    other("ppo", "a table").only("with task = \"policy\" and another rule than \"es\"", POLICY),
    other("es", "a table").only(ON_EVOLUTION, BY_EVOLUTION),
    other("evaluation", "a table").only(ON_POLICY, POLICY),
    other("hw", "a table, or the name of a built-in model").otherwise("`hw.model` says which"),
];

const IDX: &[&str] = &["data.format=idx", "data.train=a", "data.train_labels=b"];
const IDX_VALIDATION: &[&str] =
    &["data.format=idx", "data.train=a", "data.train_labels=b", "data.validation=c"];
const IDX_TEST: &[&str] =
    &["data.format=idx", "data.train=a", "data.train_labels=b", "data.test=c"];
const NPZ: &[&str] = &["data.format=npz", "data.train=a"];
const CSV: &[&str] = &["data.format=csv", "data.train=a"];

const NPZ_VALIDATION: &[&str] = &["data.format=npz", "data.train=a", "data.validation_array=b"];
const NPZ_TEST: &[&str] = &["data.format=npz", "data.train=a", "data.test_array=b"];

const fn array(name: &'static str, beside: &'static [&'static str]) -> KeyEntry {
    other(name, "the name of an array")
        .only("with data.format = \"npz\"", beside)
        .otherwise("known names")
}

const DATA: &[KeyEntry] = &[
    words(
        "set",
        &[
            ("optdigits", "handwritten digits, 8 x 8, built in"),
            ("mnist", "handwritten digits, 28 x 28"),
            ("fashion-mnist", "pieces of clothing, 28 x 28"),
            ("cifar10", "small photographs, 32 x 32 in three colours"),
            ("xor", "the exclusive or of two bits"),
            ("parity2", "whether the number of ones of 2 bits is odd"),
            ("parity3", "of 3 bits"),
            ("parity4", "of 4 bits"),
            ("parity5", "of 5 bits"),
            ("parity6", "of 6 bits"),
            ("parity7", "of 7 bits"),
            ("parity8", "of 8 bits"),
        ],
    )
    .default("\"optdigits\"")
    .otherwise("none beside `data.format`"),
    words(
        "format",
        &[
            ("idx", "the format of MNIST: values and labels in files of their own"),
            ("npz", "NumPy's archive"),
            ("csv", "a table of text"),
        ],
    )
    .otherwise("a set is named")
    .only("without data.set", &["data.train=a"]),
    other("train", "a path").only("with data.format", CSV),
    other("train_labels", "a path")
        .only("with data.format = \"idx\" or \"npz\"", IDX)
        .otherwise("in NPZ, the archive of the examples"),
    other("validation", "a path")
        .only("with data.format", CSV)
        .otherwise("cut from the training part"),
    other("validation_labels", "a path")
        .only("with data.format = \"idx\" or \"npz\", and data.validation", IDX_VALIDATION),
    other("test", "a path").only("with data.format", CSV).otherwise("cut from the training part"),
    other("test_labels", "a path")
        .only("with data.format = \"idx\" or \"npz\", and data.test", IDX_TEST),
    whole("full_scale", 1, 255)
        .only("with data.format", CSV)
        .otherwise("follows from the training values"),
    whole("classes", 2, 256).only("with data.format", CSV).otherwise("follows from the labels"),
    other("shape", "[height, width, channels], each 1..=4096")
        .only("with data.format", CSV)
        .otherwise("what the file says; a table says nothing"),
    other("middle", "[rows, pixels of a row], each 1 to what a picture has")
        .otherwise("whole pictures")
        .law("needs pictures: a set of them, or files that tell their sides"),
    other("label_column", "`first`, `last`, a number from 0, or a header")
        .only("with data.format = \"csv\"", CSV)
        .otherwise("told from the table, and said"),
    other("ignore_columns", "a list of columns, each a number from 0 or a header")
        .only("with data.format = \"csv\"", CSV)
        .otherwise("columns without a name that number the rows"),
    flag("header").only("with data.format = \"csv\"", CSV).otherwise("told from the table"),
    words("separator", &[(",", "commas"), (";", "semicolons"), ("tab", "tabs"), ("|", "bars")])
        .only("with data.format = \"csv\"", CSV)
        .otherwise("what cuts the first lines into equally many fields"),
    array("examples_array", NPZ),
    array("labels_array", NPZ),
    array("train_array", NPZ),
    array("train_labels_array", NPZ),
    array("validation_array", NPZ),
    array("validation_labels_array", NPZ_VALIDATION),
    array("test_array", NPZ),
    array("test_labels_array", NPZ_TEST),
];

const NETWORK: &[KeyEntry] = &[
    other("channels", "a list of whole numbers, each 1..=65535")
        .default("[]")
        .otherwise("no convolution; policies have none")
        .law("needs images whose sizes are known: a set of pictures, or data.shape"),
    other("kernel", "a whole number, 1..=4096")
        .windows()
        .unit("pixels")
        .default("3")
        .law("no more than the image with its border")
        .only(ON_WINDOWS, WINDOWS),
    other("stride", "a whole number, 1..=4096")
        .windows()
        .unit("pixels")
        .default("1")
        .only(ON_WINDOWS, WINDOWS),
    other("padding", "`same`, or a number of pixels, less than the kernel")
        .windows()
        .default("\"same\"")
        .law("`same`: half of an odd kernel, rounded down, so that a map is as large as what is below it at a stride of 1")
        .only(ON_WINDOWS, WINDOWS),
    words(
        "pool",
        &[
            ("average", "the mean of a square's codes, halves up"),
            ("max", "the greatest code of a square"),
            ("none", "every code"),
        ],
    )
    .windows()
    .default("\"average\"")
    .only(ON_WINDOWS, WINDOWS),
    other("pool_side", "a whole number, 1..=4096")
        .windows()
        .unit("pixels")
        .default("2")
        .law("squares cover a map without a rest")
        .only("with network.channels and a pool", WINDOWS),
    other("copies", "a whole number from 1")
        .windows()
        .default("1")
        .law("no more than positions of a map; not with cells that differ: device.response, faults, programming, leakage, drift, endurance.spread")
        .only(ON_WINDOWS, WINDOWS),
    other("hidden", "a list of whole numbers, each 1..=65535")
        .unit("units")
        .default("[256]")
        .otherwise("[160] behind convolutions; [64, 64] with task = \"policy\""),
    other("critic_hidden", "a list of whole numbers, each 1..=65535")
        .unit("units")
        .default("[64, 64]")
        .otherwise("those of `hidden`")
        .law("as many as `hidden` has; not with rule = \"es\"")
        .only(ON_POLICY, POLICY),
    whole("outputs", 1, 65_535)
        .unit("units")
        .law("the number of classes, or 1 for two classes")
        .otherwise("the number of classes; 1 with rule = \"kaneko\"; policies have one an action"),
    words(
        "input",
        &[
            ("raw", "values as they are"),
            ("on_off", "what is above the mean of its channel over the training part, and what is below, of images"),
            ("white", "what a fixed filter leaves that takes from a pixel what its neighbours tell, above 0 and below, of images with three channels"),
            ("split", "two rows a number: what is above 0, and what is below, of policies"),
            ("offset", "one row a number, half the scale added, of policies; needs a constant row"),
            (
                "signed",
                "one row a number, driven with what is above 0 and then with what is below, of policies; reads of the first \
                 layer and products of its updates cost twice as much",
            ),
        ],
    )
    .default("\"raw\"")
    .otherwise(
        "\"white\" where convolutions see three channels, but with preset = \"paper\"; \"split\" with task = \"policy\", \
         whose lines that are on or off need none",
    ),
    words(
        "activation",
        &[
            ("sigmoid", "1 / (1 + exp(-2z / alpha))"),
            ("relu", "max(z, 0)"),
            ("identity", "z, cut off at 0 and 1"),
            ("rms", "max(z, 0) over its root mean square in the layer and stream"),
            ("ramp", "a straight line from 0, cut off at 3 standard deviations"),
        ],
    )
    .default("\"sigmoid\"")
    .otherwise("\"ramp\" with convolutions, but with preset = \"paper\"; \"rms\" with task = \"policy\""),
    real("alpha", 1e-6, 1e6)
        .layers()
        .default("4.0")
        .otherwise("6.0 with other data than the built-in digits, with preset = \"paper\" and with policies, which have it with \
             activation = \"sigmoid\" alone; 3.0 of convolutions; 1.0 with rule = \"ed_seed\"; none where no layer is a sigmoid",
        ),
    flag("threshold")
        .default("false")
        .otherwise("true with convolutions whose units are ramps, but with preset = \"paper\"")
        .law("not with rule = \"es\""),
    words(
        "gain",
        &[
            ("table", "by the activation, once and for all"),
            ("fixed", "so that a standard deviation of what is read before the first update is 128 indices"),
            ("tracking", "so at first, and then by a power of two that follows what is read"),
        ],
    )
    .default("\"table\"")
    .otherwise("\"tracking\" in nets with convolutions whose units are ramps, \"fixed\" in others whose units are ramps")
    .law("with rule = \"es\" not \"tracking\""),
    whole("gain_spread", 0, 2)
        .unit("bits")
        .default("0")
        .only("with gain = \"fixed\"", &["network.activation=ramp", "network.gain=fixed"]),
    key("homeostasis_window", KeyValues::PowerOfTwo(1, 1 << 24))
        .unit("samples")
        .default("512")
        .law("no fewer than a batch")
        .only("with thresholds, or a gain that tracks", &["network.threshold=true"]),
    key("weight_max", KeyValues::Lawful(1.0 / 256.0, 256.0, "a power of two"))
        .layers()
        .default("2.0")
        .otherwise(
            "4.0 with other data than the built-in digits; with convolutions, in each layer the one nearest to 13 / sqrt(inputs); \
             0.5, and 0.25 in the output layer, or 1.0 behind ramps, with task = \"policy\"",
        ),
    words(
        "bias",
        &[
            ("none", "no bias"),
            ("input_row", "a constant row in the array that reads data"),
            ("rows", "a constant row in each array"),
        ],
    )
    .default("\"none\"")
    .otherwise("\"input_row\" with task = \"policy\""),
    words(
        "readout",
        &[
            ("p", "outputs are the p stream's activities"),
            ("p-n", "outputs are sums, p less n, of policies alone"),
        ],
    )
    .default("\"p\"")
    .otherwise("\"p-n\" with task = \"policy\""),
    other("init_gain", "two multiples of 1/64, up to 16")
        .default("[1.5, 0.5]")
        .otherwise("[1.0, 1.0] with rule = \"ed_seed\", \"dfa\" or \"bp\"; policies start with an absolute Gaussian"),
    other("init_gain_output", "two multiples of 1/64, up to 16")
        .default("[1.0, 1.0]")
        .otherwise("policies start with an absolute Gaussian"),
];

const LEARNING: &[KeyEntry] = &[
    words(
        "rule",
        &[
            ("ed", "error diffusion under Dale's law"),
            ("ed_seed", "the same as the paper's seed rule: width 1, raw errors, symmetric gains"),
            ("ed_non_dalean", "the same on differential pairs in two populations: what Dale's law costs"),
            ("kaneko", "Kaneko's original, which only potentiates: one output, two classes"),
            ("dfa", "direct feedback alignment on differential pairs"),
            ("bp", "back-propagation on differential pairs, by transposed reads"),
            ("es", "evolution strategies, of policies alone: candidates in pairs, ranked"),
        ],
    )
    .default("\"ed\""),
    whole("epochs", 0, 4_294_967_295)
        .unit("epochs")
        .default("40")
        .otherwise("20 with other data than the built-in digits; of policies environment.steps says it"),
    whole("batch", 1, 4096)
        .unit("samples")
        .default("16")
        .otherwise("32 with other data than the built-in digits; 256 with task = \"policy\""),
    words(
        "mode",
        &[
            ("accumulate", "sums over the batch in digital accumulators, written once"),
            ("replay", "one forward pass, then one write a sample"),
            ("online", "a forward pass and a write a sample"),
        ],
    )
    .default("\"accumulate\""),
    words(
        "optimiser",
        &[
            ("plain", "the sum over the batch, shifted"),
            ("sign", "one pulse in the direction of the sum, by chance"),
            ("rms", "the sum, scaled by the root mean square over the layer"),
            ("momentum", "an accumulator a cell that forgets a part of itself at a write, an eighth by default"),
            ("adam_fx", "the mean sum of a cell in units of its root mean square, over 8 and 256 writes by default"),
        ],
    )
    .default("\"plain\"")
    .otherwise("\"rms\" with convolutions, but with preset = \"paper\"; \"sign\" with task = \"policy\""),
    flag("dead_zone")
        .default("false")
        .otherwise("true with task = \"policy\"")
        .only("with optimiser = \"sign\"", &["learning.optimiser=sign"]),
    whole("momentum_shift", 1, 8)
        .unit("bits")
        .default("3")
        .only("with optimiser = \"momentum\"", &["learning.optimiser=momentum"]),
    other("adam_shifts", "two whole numbers, each 1..=8")
        .unit("bits")
        .default("[3, 8]")
        .only("with optimiser = \"adam_fx\"", &["learning.optimiser=adam_fx"]),
    flag("centred")
        .default("false")
        .otherwise("true with convolutions, but with preset = \"paper\", and with task = \"policy\""),
    real("rate", 1e-6, 1e6).default("18.0").otherwise(
        "20.0 with other data than the built-in digits, 7.5 with fashion-mnist; with a batch below the default one less, in proportion; 0.25 \
         with optimiser = \"sign\" (0.5 of policies with rule = \"dfa\" or \"bp\"), 0.002 with \"rms\" and \"adam_fx\"; 0.1 with convolutions and \"rms\", 0.3 with convolutions and \
         others, but with preset = \"paper\"; 1.0 of policies with others",
    ),
    real("rate_multipliers", 1e-6, 1e6).layers().default("[1.0, 0.25]").otherwise(
        "1 in every layer, 0.25 in the last one of the built-in digits (1.0 with other data); behind more than 256 \
         hidden units times 256 / units; 1 with convolutions; 2.0 in the last one of policies with \
         optimiser = \"sign\"",
    ),
    whole("rate_mantissa", 1, 15)
        .layers()
        .default("1")
        .law("or `auto`: in each layer the one whose rate comes nearest"),
    words(
        "decay",
        &[
            ("cosine", "falls to 0 over the run as half a cosine"),
            ("linear", "falls to 0 over the run in a straight line"),
            ("constant", "stays"),
        ],
    )
    .default("\"cosine\"")
    .otherwise("\"linear\" with task = \"policy\""),
    words(
        "error",
        &[
            ("one_vs_all", "255 of the class and 0 of others, less what an output puts out"),
            ("softmax", "the same less its share of all outputs"),
        ],
    )
    .default("\"one_vs_all\"")
    .otherwise("\"softmax\" with convolutions, but with preset = \"paper\"; policies have errors of their own"),
    real("temperature", 1e-6, 1e6)
        .default("1.0")
        .only("with error = \"softmax\"", &["learning.error=softmax"]),
    words(
        "centre",
        &[
            ("none", "raw errors"),
            ("batch", "the mean of the batch; needs a batch of two or more"),
            ("running", "a running mean of each output"),
        ],
    )
    .default("\"batch\"")
    .otherwise(
        "\"running\" with a batch of one or mode = \"online\"; \"none\" with rule = \"kaneko\" or \"ed_seed\", and of \
         policies",
    ),
    words(
        "control",
        &[
            ("none", "nothing"),
            ("frozen_hidden", "hidden layers hear no error and are not written: outputs alone learn"),
            ("same_sign_hidden", "in hidden layers stream n hears errors as stream p does, not negated"),
            ("same_sign", "the same in all layers"),
        ],
    )
    .default("\"none\""),
    whole("refresh", 1, u32::MAX as i64).unit("updates").otherwise("never"),
    words(
        "route",
        &[
            ("modulo", "deterministic taps: unit j hears word j mod outputs, and `taps` - 1 more"),
            ("random_sparse", "one word a unit, drawn once"),
            ("scalar_broadcast", "the sum of all words, for all units"),
            ("random_dense", "a sum of all words with random signs a unit"),
        ],
    )
    .default("\"modulo\"")
    .otherwise("\"random_dense\" with rule = \"dfa\"; none with \"bp\""),
    whole("taps", 1, 4)
        .law("at most the number of outputs")
        .unit("words")
        .default("3")
        .otherwise("1 with other data than the built-in digits, with convolutions and with preset = \"paper\"")
        .only("with route = \"modulo\"", &["learning.route=modulo"]),
    whole("tap_shift", 0, 16)
        .unit("bits")
        .only(
            "with route = \"modulo\" and two taps or more",
            &["learning.route=modulo", "learning.taps=2"],
        )
        .otherwise("ceil(log2 taps)"),
    whole("shift_pixels", 0, 7)
        .unit("pixels")
        .default("0")
        .law("less than the sides of the images; needs images"),
    flag("flip").default("false").law("needs images"),
    words(
        "train_on",
        &[
            ("train", "training examples"),
            ("all", "training and validation examples, once everything is chosen"),
        ],
    )
    .default("\"train\""),
    words(
        "select",
        &[
            ("best_validation", "the one with the best validation score, the earliest on ties"),
            ("last", "the last one"),
        ],
    )
    .default("\"last\"")
    .otherwise(
        "\"best_validation\" with other data than the built-in digits, unless train_on = \"all\"; policies have the last",
    ),
    #[cfg(feature = "grown")]
    whole("grown", i64::MIN, i64::MAX).default("0"),
];

const ENVIRONMENT: &[KeyEntry] = &[
    other("id", "the name of an environment, such as Acrobot-v1; a wrong one is answered with all there are")
    .default("\"CartPole-v1\"")
    .only(ON_POLICY, POLICY),
    whole("count", 1, 1024).default("16").only(ON_POLICY, POLICY),
    whole("steps", 1, 1 << 40).unit("steps").default("500000").only(ON_POLICY, POLICY),
    whole("horizon", 1, 65_536)
        .unit("steps")
        .default("128")
        .law("times `count` at most 4194304")
        .only(ON_POLICY, POLICY),
    whole("rollouts", 1, 4_294_967_295)
        .default("5")
        .otherwise("so many that a run has about 50 epochs")
        .only(ON_POLICY, POLICY),
];

const PPO: &[KeyEntry] = &[
    whole("passes", 1, 1000).default("10").only(ON_POLICY, POLICY),
    other("gamma", "a number, 0 to 1")
        .default("0.99")
        .otherwise("0.95 of Pendulum-v1, 0.98 of Foray-v0")
        .only(ON_POLICY, POLICY),
    other("lambda", "a number, 0 to 1").default("0.95").only(ON_POLICY, POLICY),
    real("clip", 1e-3, 1.0).default("0.2").only(ON_POLICY, POLICY),
    other("entropy", "a number, 0 to 1")
        .default("0.01")
        .otherwise("0.0 where actions are numbers, 0.03 of Foray-v0")
        .only(ON_POLICY, POLICY),
    other("log_sigma", "a number, -4 to 1").default("0.0").only(ON_CONTINUOUS, CONTINUOUS),
    other("log_sigma_rate", "a number, 0 to 1").default("0.003").only(ON_CONTINUOUS, CONTINUOUS),
    whole("noise_steps", 1, 1024).unit("steps").default("1").only(ON_CONTINUOUS, CONTINUOUS),
];

const EVOLUTION: &[KeyEntry] = &[
    whole("pairs", 1, 4096).default("16").only(ON_EVOLUTION, BY_EVOLUTION),
    whole("step", 1, 4095).unit("levels").default("16").only(ON_EVOLUTION, BY_EVOLUTION),
    whole("shift", 0, 16).unit("bits").default("4").only(ON_EVOLUTION, BY_EVOLUTION),
];

const EVALUATION: &[KeyEntry] = &[
    whole("episodes", 1, 10_000).default("8").only(ON_POLICY, POLICY),
    whole("final_episodes", 1, 10_000).default("100").only(ON_POLICY, POLICY),
    flag("deterministic").default("true").otherwise("false of Foray-v0").only(ON_POLICY, POLICY),
];
