//! Keys of hardware models. A default is that of a model file that is silent; in an experiment, the model's own number.

use super::KeyFileKind::Hardware;
use super::{KeyEntry, KeyTable, KeyValues, flag, key, other, real, whole, words};
use crate::lab::config::device::{
    ConductanceFile, DeviceFile, DriftFile, EnduranceFile, FaultsFile, LeakageFile,
    ProgrammingFile, ReadNoiseFile, ResponseFile, SpreadFile, WiresFile,
};
use crate::lab::config::file::{
    AdcTable, CellFile, DriveFile, ErrorFile, HardwareFile, LutFile, NumberFile, TileFile,
    TimingFile, WriteFile,
};

const fn table(
    path: &'static str,
    about: &'static str,
    meanings: &'static [(&'static str, &'static str)],
    entries: &'static [KeyEntry],
) -> KeyTable {
    KeyTable { path, file: Hardware, about, meanings, entries }
}

pub(super) const TABLES: &[KeyTable] = &[
    table("", "The model itself.", HardwareFile::MEANINGS, ROOT),
    table("cell", "Cells.", CellFile::MEANINGS, CELL),
    table("tile", "Physical arrays with their converters.", TileFile::MEANINGS, TILE),
    table("drive", "Row drivers.", DriveFile::MEANINGS, DRIVE),
    table(
        "adc",
        "Column converters: this table, or `adc = \"ideal\"`, which loses nothing.",
        AdcTable::MEANINGS,
        ADC,
    ),
    table("lut", "The table of the activation and its slope.", LutFile::MEANINGS, LUT),
    table("error", "The error bus.", ErrorFile::MEANINGS, ERROR),
    table("write", "How sums become pulses.", WriteFile::MEANINGS, WRITE),
    table(
        "device",
        "What real cells and converters do that ideal ones do not; without a table of it, nothing of the kind.",
        DeviceFile::MEANINGS,
        DEVICE,
    ),
    table(
        "device.response",
        "What a pulse does to a cell: a curve of steps, and noise. What is not said makes every step the mean one.",
        ResponseFile::MEANINGS,
        RESPONSE,
    ),
    table(
        "device.spread",
        "How cells of the device differ, each for good; drawn by the seed of a run.",
        SpreadFile::MEANINGS,
        SPREAD,
    ),
    table(
        "device.faults",
        "Cells that hold one level, whatever is loaded or written: shares of all cells, which add up to at most 1, and a list.",
        FaultsFile::MEANINGS,
        FAULTS,
    ),
    table(
        "device.conductance",
        "What a cell conducts at level 0, where it is not nothing.",
        ConductanceFile::MEANINGS,
        CONDUCTANCE,
    ),
    table(
        "device.wires",
        "What the wires of a tile take of the voltage of its cells, to first order in their resistance; only the ratio of both numbers counts. Drivers stand at the first column, amplifiers at the first row, both without resistance.",
        WiresFile::MEANINGS,
        WIRES,
    ),
    table(
        "device.read_noise",
        "What conversions are off by: a Gaussian number each.",
        ReadNoiseFile::MEANINGS,
        READ_NOISE,
    ),
    table(
        "device.programming",
        "What loads leave beside a level: a Gaussian number a cell.",
        ProgrammingFile::MEANINGS,
        PROGRAMMING,
    ),
    table(
        "device.drift",
        "What time does to levels between programming and reading: `dalean eval RUN --after 1d`. With `update_s` also while a net learns.",
        DriftFile::MEANINGS,
        DRIFT,
    ),
    table(
        "device.endurance",
        "How many pulses cells take. One that has taken them is as a stuck cell to writes and loads.",
        EnduranceFile::MEANINGS,
        ENDURANCE,
    ),
    table(
        "device.leakage",
        "What volatile cells, such as capacitors, forget while others are written; time is counted in writes of their array.",
        LeakageFile::MEANINGS,
        LEAKAGE,
    ),
    table(
        "timing",
        "Cycles of what a tile does, in the words of docs/TILE.md; without it no cycles are counted.",
        TimingFile::MEANINGS,
        TIMING,
    ),
    table(
        "energy.*",
        "One physical number of `[energy]`, `[power]` or `[area]`; the unit is in its key.",
        NumberFile::MEANINGS,
        NUMBER,
    ),
];

const PROVENANCE: [KeyEntry; 2] = [
    other("source", "text").otherwise("a model file that lacks it is refused"),
    words(
        "kind",
        &[
            ("measured", "on silicon, or read from a cited source that did"),
            ("fitted", "adjusted until a model met a published result"),
            ("assumed", "a guess, a memory, or a number of another chip"),
        ],
    )
    .otherwise("a model file that lacks it is refused"),
];

const ROOT: &[KeyEntry] = &[
    other("model", "a name of `dalean hw list`, or a path").default("\"ideal\""),
    other("name", "text"),
    other("summary", "text"),
    other("cell", "a table"),
    other("tile", "a table"),
    other("drive", "a table"),
    other("adc", "\"ideal\" or a table").default("\"ideal\""),
    other("lut", "a table"),
    other("error", "a table"),
    other("write", "a table"),
    other("device", "a table").otherwise("cells and reads are ideal"),
    other("timing", "a table").otherwise("no cycles are counted"),
    other("energy", "a table of physical numbers").otherwise("no energy is reckoned"),
    other("power", "a table of physical numbers"),
    other("area", "a table of physical numbers"),
    other("node_nm", "nanometres"),
    other("constants_for", "a table of settings").otherwise("numbers are for the chip as it is"),
    other("modes", "a table of lists of settings, such as \"drive.bits=4\""),
    other("not_simulated", "a table of texts"),
];

const CELL: &[KeyEntry] = &[
    whole("level_bits", 1, 12).unit("bits").default("8"),
    whole("floor", 0, 254).law("below the ceiling").unit("levels").default("0"),
    whole("ceiling", 1, 255)
        .law("above the floor, at most 2^level_bits - 1")
        .unit("levels")
        .otherwise("2^level_bits - 1"),
    words(
        "floor_kind",
        &[
            ("recoverable", "a cell on the floor is programmed as any other"),
            ("absorbing", "a cell that reaches the floor is pruned: it stays there"),
        ],
    )
    .default("\"recoverable\""),
    PROVENANCE[0],
    PROVENANCE[1],
];

const TILE: &[KeyEntry] = &[
    whole("rows", 1, 32_768).unit("rows").default("256"),
    whole("columns", 1, 32_768).unit("columns").default("256"),
    whole("count", 1, 1 << 30)
        .law("the network has to fit")
        .unit("tiles")
        .otherwise("as many as it takes"),
    flag("transposed_read").default("false"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const PULSE_WIDTH: &[&str] = &["hw.drive.mode=pulse_width"];

const DRIVE: &[KeyEntry] =
    &[
        whole("bits", 1, 8).unit("bits").default("8"),
        words(
            "mode",
            &[
                ("voltage", "slices of `dac_bits`, one after the other"),
                ("pulse_width", "a pulse as long as the code, phase by phase"),
                ("amplitude", "the amplitude of light: the whole code at once"),
            ],
        )
        .default("\"voltage\""),
        whole("dac_bits", 1, 8).law("at most drive.bits").unit("bits").default("8").otherwise(
            "drive.bits, whatever that is; with \"pulse_width\" it follows from `phases`",
        ),
        whole("slots", 255, 100_000_000)
            .law("at least 2^(bits of a phase) - 1")
            .unit("slots")
            .only("with drive.mode = \"pulse_width\"", PULSE_WIDTH)
            .otherwise("2^(bits of a phase) - 1"),
        whole("slot_cycles", 1, 392_156)
            .law("a phase takes at most 100000000 cycles")
            .unit("cycles")
            .default("1")
            .only("with drive.mode = \"pulse_width\"", PULSE_WIDTH),
        whole("phases", 1, 8)
            .law("at most drive.bits")
            .default("1")
            .only("with drive.mode = \"pulse_width\"", PULSE_WIDTH),
        PROVENANCE[0],
        PROVENANCE[1],
    ];

const FINITE: &[&str] = &["hw.adc.bits=8"];
const CALIBRATED: &[&str] = &["hw.adc.bits=8", "hw.adc.range=calibrated"];

const STEPS: &[&str] = &["hw.adc.bits=8", "hw.adc.converter=sar"];
const PHASES: &[&str] =
    &["hw.adc.bits=8", "hw.adc.converter=sar", "hw.drive.mode=pulse_width", "hw.drive.phases=2"];

const ADC: &[KeyEntry] = &[
    whole("bits", 2, 16).unit("bits").otherwise("the table needs it"),
    other("range", "\"tracking\", \"calibrated\", \"full\", or a shift in 0..=40")
        .default("\"tracking\"")
        .only("", FINITE),
    whole("headroom", 0, 16)
        .unit("bits")
        .default("4")
        .otherwise("3 up to 6 bits")
        .only("with adc.range = \"calibrated\"", CALIBRATED),
    words(
        "recalibrate",
        &[("never", "once, before the first update"), ("epoch", "before each epoch")],
    )
    .default("\"never\"")
    .only("with adc.range = \"calibrated\"", CALIBRATED),
    words(
        "subtract",
        &[
            ("digital", "each bank is converted, codes are subtracted"),
            ("current", "the difference of the banks is converted"),
        ],
    )
    .default("\"digital\"")
    .only("", FINITE),
    words(
        "converter",
        &[
            ("fixed", "takes `timing.convert_cycles`, whatever its bits"),
            ("sar", "bits + 1 steps: a comparison a bit, and one to sample"),
            ("counter", "2^bits steps: counts"),
            ("ramp", "2^bits steps: compares with a rising reference"),
            ("flash", "one step: a comparator a code"),
        ],
    )
    .otherwise("fixed")
    .only("", FINITE),
    whole("step_cycles", 1, 100_000_000)
        .unit("cycles")
        .default("1")
        .only("with an adc.converter that steps", STEPS),
    words(
        "phase_bits",
        &[
            ("owed", "the bits of the output that earlier phases have not carried, at least one"),
            ("all", "all bits, in each phase"),
        ],
    )
    .default("\"owed\"")
    .only("with such a converter and several drive.phases", PHASES),
    PROVENANCE[0],
    PROVENANCE[1],
];

const LUT: &[KeyEntry] =
    &[whole("bits", 2, 14).unit("bits").default("10"), PROVENANCE[0], PROVENANCE[1]];

const ERROR: &[KeyEntry] =
    &[whole("bits", 2, 9).unit("bits").default("8"), PROVENANCE[0], PROVENANCE[1]];

const WRITE: &[KeyEntry] = &[
    whole("increment_max", 1, 127).unit("pulses").default("7"),
    key("dither_bits", KeyValues::Choice(&[0, 8, 16]))
        .unit("bits")
        .default("8")
        .otherwise("0 rounds halves up"),
    words(
        "dither",
        &[
            ("per_cell", "a word for each cell"),
            ("separable", "a word for each row and each column, added"),
        ],
    )
    .default("\"per_cell\"")
    .only("with write.dither_bits above 0", &["hw.write.dither_bits=8"]),
    whole("residual_bits", 0, 15).unit("bits").default("0"),
    words(
        "scheme",
        &[
            ("rounded", "sums are shifted and rounded with a random word"),
            ("rank1", "coincidences of two random trains, one sample at a time"),
        ],
    )
    .default("\"rounded\""),
    key("train_slots", KeyValues::PowerOfTwo(1, 4))
        .law("at most write.increment_max")
        .unit("slots")
        .default("4")
        .otherwise("the greatest power of two up to write.increment_max, at most 32")
        .only("with write.scheme = \"rank1\"", &["hw.write.scheme=rank1", "learning.mode=replay"]),
    PROVENANCE[0],
    PROVENANCE[1],
];

const DEVICE: &[KeyEntry] = &[
    other("response", "a table").otherwise("a pulse moves a cell by one level"),
    other("spread", "a table").otherwise("cells are alike"),
    other("faults", "a table").otherwise("every cell works"),
    other("conductance", "a table").otherwise("level 0 conducts nothing"),
    other("wires", "a table").otherwise("wires have no resistance"),
    other("read_noise", "a table").otherwise("reads are free of noise"),
    other("programming", "a table").otherwise("loads are exact"),
    other("drift", "a table").otherwise("a level stays as it was written"),
    other("endurance", "a table").otherwise("cells take any number of pulses"),
    other("leakage", "a table").otherwise("cells forget nothing while they learn"),
];

const LINES: &[&str] = &["hw.device.response.curve=linear"];
const EXPONENTIAL: &[&str] = &["hw.device.response.curve=exponential"];

const RESPONSE: &[KeyEntry] = &[
    words(
        "curve",
        &[
            ("linear", "a straight line from `up[0]` and `down[0]` at the floor to the second at the ceiling"),
            ("soft_bounds", "steps shrink in proportion to what is left of the window"),
            ("exponential", "1 - amplitude exp(growth z) mean steps, where that is above 0"),
            ("neurosim", "the curves of MLP+NeuroSim, by their nonlinearity labels"),
            ("table", "straight lines between steps at equally spaced places"),
            ("measured", "straight lines between given points"),
        ],
    )
    .otherwise("linear"),
    whole("states", 1, 65_536).unit("pulses").otherwise("as many as the window has levels"),
    other("up", "a list of one or two numbers, 2 to 64 of a table, 0 to 1000")
        .unit("mean steps")
        .otherwise("[1, 1], of soft_bounds [2]")
        .only("with curve = \"linear\", \"soft_bounds\" or \"table\"", LINES),
    other("down", "a list of one or two numbers, 2 to 64 of a table, 0 to 1000")
        .unit("mean steps")
        .otherwise("[1, 1], of soft_bounds [2]")
        .only("with curve = \"linear\", \"soft_bounds\" or \"table\"", LINES),
    other("amplitude", "a list of two numbers, -1000 to 1000")
        .otherwise("[0, 0]")
        .only("with curve = \"exponential\"", EXPONENTIAL),
    other("growth", "a list of two numbers, -100 to 100")
        .otherwise("[1, 1]")
        .only("with curve = \"exponential\"", EXPONENTIAL),
    other("z", "a list of two numbers, -5 to 5")
        .otherwise("[0, 1]")
        .only("with curve = \"exponential\"", EXPONENTIAL),
    other("labels", "a list of two numbers, -9 to 9")
        .otherwise("[0, 0]")
        .only("with curve = \"neurosim\"", &["hw.device.response.curve=neurosim"]),
    other("points", "rows of three numbers: 0 to 1 and rising, and two steps")
        .unit("windows")
        .otherwise("the mean step at both ends")
        .only("with curve = \"measured\"", &["hw.device.response.curve=measured"]),
    other("asymmetry", "a number between -1 and 1").otherwise("0"),
    real("noise", 1e-6, 100.0).law("at most 1 of the window").otherwise("none"),
    words(
        "noise_of",
        &[("step", "of the cell's own step there"), ("window", "of the chip's window")],
    )
    .otherwise("step")
    .only("with device.response.noise", &["hw.device.response.noise=0.5"]),
    real("write_noise", 1e-6, 1.0).unit("windows").otherwise("none"),
    whole("tries", 1, 16)
        .law("at most 127 / write.increment_max")
        .unit("pulses")
        .only("with timing.verify", &["hw.timing.verify=true", "hw.timing.clock_mhz=1000"])
        .otherwise("4"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const SPREAD: &[KeyEntry] = &[
    real("step", 1e-6, 2.0).otherwise("none"),
    words(
        "step_law",
        &[
            ("normal", "1 + deviation x Gaussian, 0 where that is below"),
            ("log_normal", "exp(deviation x Gaussian)"),
        ],
    )
    .otherwise("normal")
    .only("with device.spread.step", &["hw.device.spread.step=0.1"]),
    real("asymmetry", 1e-6, 1.0).otherwise("none"),
    real("ceiling", 1e-6, 1.0).unit("windows").otherwise("none"),
    real("floor", 1e-6, 1.0).unit("windows").otherwise("none"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const COUNTED: &[&str] = &["hw.timing.clock_mhz=1000"];

const TIMING: &[KeyEntry] = &[
    real("clock_mhz", 0.001, 1e6).unit("MHz").otherwise("the table needs it"),
    whole("settle_cycles", 1, 100_000_000)
        .law("0 too with drive.mode = \"pulse_width\"")
        .unit("cycles")
        .default("1")
        .only("", COUNTED),
    whole("convert_cycles", 1, 100_000_000)
        .law("of fixed converters: others have adc.step_cycles")
        .unit("cycles")
        .default("1")
        .only("", COUNTED),
    whole("columns_per_adc", 1, 32_768).unit("columns").default("1").only("", COUNTED),
    flag("overlap").default("false").only("", COUNTED),
    whole("lanes", 1, 32_768).unit("columns").default("1").only("", COUNTED),
    whole("bus_hops", 0, 1_000_000).unit("cycles").default("0").only("", COUNTED),
    whole("pulse_cycles", 1, 100_000_000).unit("cycles").default("1").only("", COUNTED),
    words(
        "pulses",
        &[
            ("unary", "as many pulses as levels, one after the other"),
            ("amplitude", "one pulse whose height is the number of levels"),
        ],
    )
    .default("\"unary\"")
    .only("", COUNTED),
    flag("verify").default("false").only("", COUNTED),
    whole("write_active_max", 1, 65_536)
        .unit("cells")
        .only("", COUNTED)
        .otherwise("a whole row of both banks"),
    whole("beat_cycles", 1, 1_000_000).unit("cycles").default("1").only("", COUNTED),
    PROVENANCE[0],
    PROVENANCE[1],
];

const FAULTS: &[KeyEntry] = &[
    real("stuck_floor", 1e-9, 1.0).unit("of the cells").otherwise("none"),
    real("stuck_ceiling", 1e-9, 1.0).unit("of the cells").otherwise("none"),
    real("stuck_any", 1e-9, 1.0).unit("of the cells").otherwise("none"),
    other("map", "a path").only("without `cells`", &[]).otherwise("none"),
    other("cells", "a list of texts, such as [\"0,pp,3,5,floor\"]").otherwise("none"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const RATIO: &[&str] = &["hw.device.conductance.on_off=10"];

const CONDUCTANCE: &[KeyEntry] = &[
    other("on_off", "a number of 1.1 or more")
        .law("at most 2^9 times the greatest level: beyond that level 0 conducts nothing")
        .otherwise("the table needs it"),
    words(
        "reference",
        &[
            ("none", "nothing: it stays in the sums, and cancels where both banks have the same drives"),
            (
                "column",
                "a column of cells at level 0 in each bank of a tile, whose current is taken off the others' before they are \
                 converted",
            ),
        ],
    )
    .otherwise("none")
    .only("", RATIO),
    PROVENANCE[0],
    PROVENANCE[1],
];

const WIRES: &[KeyEntry] = &[
    other("segment_ohm", "a number above 0")
        .law("1e-12 to 1 of cell_on_ohm")
        .unit("ohm")
        .otherwise("the table needs it")
        .only("", &["hw.device.wires.cell_on_ohm=1e5"]),
    other("cell_on_ohm", "a number above 0")
        .unit("ohm")
        .otherwise("the table needs it")
        .only("", &["hw.device.wires.segment_ohm=1"]),
    PROVENANCE[0],
    PROVENANCE[1],
];

const READ_NOISE: &[KeyEntry] = &[
    real("sigma_cells", 1e-4, 16.0).unit("cells").otherwise("the table needs it"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const PROGRAMMING: &[KeyEntry] = &[
    other("sigma", "a list of 1 to 4 numbers").otherwise("the table needs it"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const POWER: &[&str] = &["hw.device.drift.start_s=20", "hw.device.drift.exponent=[0.05]"];
const LEARNING: &[&str] = &[
    "hw.device.drift.start_s=20",
    "hw.device.drift.exponent=[0.05]",
    "hw.device.drift.update_s=1",
];
const LOGARITHM: &[&str] = &["hw.device.drift.start_s=1", "hw.device.drift.change=-0.01"];

const DRIFT: &[KeyEntry] = &[
    real("start_s", 1e-9, 1e12)
        .unit("s")
        .otherwise("the table needs it")
        .only("", &["hw.device.drift.exponent=[0.05]"]),
    other("exponent", "a list of 1 or 4 numbers").only("without `change`", POWER),
    other("exponent_spread", "a list of 1 or 4 numbers")
        .only("with `exponent`", POWER)
        .otherwise("none"),
    other("change", "a number in -1..=1").only("without `exponent`", LOGARITHM),
    other("change_spread", "a number in 0..=1").only("with `change`", LOGARITHM).otherwise("none"),
    real("update_s", 1e-12, 1e12)
        .unit("s")
        .only("", POWER)
        .otherwise("a training takes no time in which levels drift"),
    whole("every", 1, 1_048_576)
        .unit("writes")
        .only("with `update_s`", LEARNING)
        .otherwise("100 with `update_s`"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const LASTING: &[&str] = &["hw.device.endurance.pulses=1000"];

const ENDURANCE: &[KeyEntry] = &[
    real("pulses", 1.0, 4_294_967_295.0)
        .law("a whole number")
        .unit("pulses")
        .otherwise("the table needs it"),
    real("spread", 1e-6, 2.0).only("", LASTING).otherwise("cells take as many"),
    words(
        "worn",
        &[("level", "where it is"), ("floor", "at its floor"), ("ceiling", "at its ceiling")],
    )
    .only("", LASTING)
    .otherwise("level"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const VOLATILE: &[&str] = &["hw.device.leakage.lifetime=1000"];

const LEAKAGE: &[KeyEntry] = &[
    real("lifetime", 0.1, 1e11).unit("writes").otherwise("the table needs it"),
    whole("every", 1, 1_048_576).unit("writes").only("", VOLATILE).otherwise("100"),
    real("rest", 1e-6, 1.0).unit("windows").only("", VOLATILE).otherwise("the floor"),
    real("spread", 1e-6, 1.0).only("", VOLATILE).otherwise("cells forget alike"),
    PROVENANCE[0],
    PROVENANCE[1],
];

const NUMBER: &[KeyEntry] = &[
    other("low", "a number of 0 or more").law("low <= typical <= high"),
    other("typical", "a number of 0 or more").law("low <= typical <= high"),
    other("high", "a number of 0 or more").law("low <= typical <= high"),
    PROVENANCE[0],
    PROVENANCE[1],
    other("scales", "a law, or a table of laws by setting: constant, linear, walden, schreier, comparators, steps")
        .otherwise("at another setting it prices nothing"),
    other("at", "a table of settings, such as { adc_bits = 8 }").otherwise("those of its model"),
    other("node_nm", "nanometres").otherwise("those of its model"),
];
