//! What the heads of columns mean: a line each, for pages, where a head leads to its line, and for the terminal.
//!
//! Written once. docs/GLOSSARY.md has the formulas. A head that is not here is a fault that the tests of this room find.

use super::number::escape;

/// What the page of a run calls its columns, and what that means. A head is found by its words.
pub(super) const HEADS: &[(&str, &str)] = &[
    // pathways
    (
        "pathway",
        "Layer, then source and target stream of an unsigned array: pp and nn excite, np and pn inhibit; e and i are the two cells of a differential pair.",
    ),
    ("shape", "Rows (inputs) times columns (outputs) of the array."),
    ("cells", "Devices: each stores an unsigned level."),
    ("on floor", "Cells at the lower end of the programming window, of the cells."),
    ("level 0", "Cells that store 0, of the cells: connection sparsity as NeuroBench defines it."),
    ("pruned", "Cells that an absorbing floor holds for good, of the cells."),
    ("mean level", "Sum of the levels over the number of cells."),
    ("births", "Cells that lay on the floor before the first update and do not now."),
    ("deaths", "Cells that did not lie on the floor before the first update and do now."),
    ("idle rows", "Rows of which every cell lies on the floor, of all rows."),
    ("columns", "Columns of which every cell lies on the floor, of all columns."),
    ("tiles", "Tiles of which every cell lies on the floor, of all tiles."),
    ("pulses", "Pulses given to cells over the whole training, after the bound."),
    (
        "effective",
        "Pulses that moved their cell, of the pulses given; the others met the end of the window or a pruned cell.",
    ),
    ("bounded", "Increments that the bound on pulses cut, of the increments that were not 0."),
    // saturations
    ("Kind", "What has an end that a value can run into."),
    ("total", "How often a clamp changed a value, over the whole run."),
    ("share", "That part of its whole."),
    ("last epoch", "The same in the last epoch alone."),
    ("over epochs", "The same epoch by epoch, as a line from 0."),
    // writes
    ("Whole training", "What learning asked of the cells, and what came of it, over all epochs."),
    ("count", "How often, exactly."),
    // time
    (
        "Phase",
        "What the chip does it for: training, calibration of converters, evaluation on the validation set.",
    ),
    ("of the run", "Share of all cycles of the run, the final test aside."),
    ("of training", "Share of the cycles of training."),
    ("cycles", "Ticks of the clock of the tiles (docs/TILE.md)."),
    ("time", "Cycles over the clock of the chip."),
    (
        "Stage of training",
        "What the chip as a whole is doing; stages follow one another and add up.",
    ),
    (
        "most at work, of the stage",
        "The layer and part that works for most of the stage: what everything waits for.",
    ),
    ("load weights", "Levels of a fresh network are written row by row."),
    ("forward rows", "Reads: rows are driven, columns are read."),
    ("forward columns", "Transposed reads: columns are driven, rows are read."),
    ("error", "Error words arrive and become gates."),
    ("update", "Products are summed, and written as pulses."),
    ("arrays", "Cells settle under the voltage of a slice."),
    ("converters", "Currents of columns become codes."),
    ("tree", "Sums of tiles above one another are added."),
    ("lanes", "Activity and slope are looked up, a few columns a cycle."),
    ("bus", "Error words arrive, one a cycle."),
    ("multipliers", "Words times slopes become gates."),
    ("accumulators", "Products of drives and gates are added to digital sums."),
    ("writers", "Rows are computed, pulsed, verified and turned around."),
    // energy
    ("Component", "What the joules are paid for."),
    ("Operation", "Which of the five operations of a tile."),
    ("Layer", "Layer, from 0 at the input."),
    ("Pathway", "Source and target stream of an array."),
    ("low", "With the low bound of every constant."),
    ("typical", "With the typical value of every constant."),
    ("high", "With the high bound of every constant."),
    (
        "Split",
        "Where in the chip: cells and drivers, converters, digital logic and memory, what is on all the time.",
    ),
    ("An image takes", "Of all images of a phase, the mean."),
    (
        "It takes",
        "To update and to decide, the mean of all updates and of all decisions without learning.",
    ),
    ("how often", "Updates, and decisions without learning, over the whole run."),
    ("images", "Images read in that phase, over the whole run; updates and decisions of policies."),
    ("energy", "With the typical value of every constant."),
    ("device", "Cells, their drivers and pulses."),
    ("converter", "What turns currents into codes, and codes into voltages."),
    ("digital", "Logic and memory beside the arrays."),
    ("static", "What draws power whether anything happens or not."),
    ("Effect", "What real chips have."),
    ("real chips have", "In general; not every chip has it."),
    ("simulated", "What a run has in its place."),
    ("this chip", "What the hardware model says of it, under not_simulated."),
    ("Leans on", "Constants of the hardware model that most of the typical total is made with."),
    ("of the typical total", "Share of the typical total that is made with it."),
    (
        "is",
        "Measured: on silicon or in a cited source that did. Fitted: adjusted to a published result. Assumed: a guess, a memory or another chip's.",
    ),
];

/// What the columns of a sweep mean, by name.
pub(super) const COLUMNS: &[(&str, &str)] = &[
    ("point", "Number of the point in the order of the sweep file, from 1."),
    ("seed", "Seed of all draws; points that differ in it alone are repetitions of one setting."),
    (
        "test_accuracy",
        "Right answers of the test set, of all; it is read once, at the end, by the state that was chosen.",
    ),
    (
        "validation_accuracy",
        "Right answers of the validation set by the state that read the test set. Whatever is chosen is chosen by it.",
    ),
    (
        "train_accuracy",
        "Right answers given while learning in the last epoch, each before its example was learnt from.",
    ),
    (
        "return_mean",
        "Mean return of the episodes of the final test, by the last state; they are played once, at the end.",
    ),
    ("return_least", "Of these episodes, the least."),
    ("return_most", "Of these episodes, the greatest."),
    (
        "return_evaluated",
        "Mean return of the episodes after the last epoch, without learning. Whatever is chosen is chosen by it.",
    ),
    (
        "return_learning",
        "Mean return of the episodes that ended in the last epoch, with actions drawn.",
    ),
    ("steps", "Steps of all environments that were learnt from."),
    ("entropy", "Entropy of what the actor puts out, mean of the last epoch, in nats."),
    (
        "explained_variance",
        "1 less the share of the variance of value targets that the critic leaves, of the last rollout.",
    ),
    ("test_epoch", "After which epoch the state stood that read the test set."),
    ("epochs", "Passes over the training examples; of policies, so many rollouts each."),
    ("updates", "Learning steps."),
    ("cells", "Devices, each with an unsigned level."),
    (
        "floor_fraction",
        "Cells at the lower end of the programming window after the last epoch, of the cells.",
    ),
    ("pruned_fraction", "Cells that an absorbing floor holds for good, of the cells."),
    (
        "worn_fraction",
        "Cells that have taken all pulses they take (hw.device.endurance), of the cells.",
    ),
    (
        "pulses_a_cell",
        "Pulses given over the whole training, after the bound, over the cells: what endurance is asked for.",
    ),
    ("ei_ratio", "Sum of excitatory levels over sum of inhibitory levels, all layers."),
    ("pulses_attempted", "Pulses given to cells over the whole training, after the bound."),
    ("pulses_effective", "Of these, pulses that moved their cell."),
    (
        "bounded_fraction",
        "Increments that the bound on pulses cut, of the increments that were not 0.",
    ),
    (
        "saturated_fraction",
        "Conversions while learning whose current lay beyond the range of the converter, of all.",
    ),
    ("cycles", "Ticks of the chip's clock over the run, the final test aside."),
    ("chip_seconds", "Those cycles over the clock of the chip."),
    (
        "joules",
        "Counts of the ledger times typical constants of the chip, over the run, the final test aside.",
    ),
    ("joules_low", "The same with the low bound of every constant."),
    ("joules_high", "The same with the high bound of every constant."),
    ("joules_assumed", "Typical joules that lean on assumed constants, of all."),
    (
        "parts_priced",
        "Components that did something and have a price, of those that did something: where it is not all, the energy has no total.",
    ),
    (
        "learn_joules",
        "Energy to learn from an image: that of the training over its images. Empty where parts have no price.",
    ),
    ("learn_joules_device", "Of that, what cells, their lines, light and heat take."),
    ("learn_joules_converter", "Of that, what row drivers, converters and receivers take."),
    ("learn_joules_digital", "Of that, what adders, tables, multipliers, buses and memories take."),
    ("learn_joules_static", "Of that, what is on whether anything happens or not."),
    ("learn_seconds", "Time to learn from an image: that of the training over its images."),
    (
        "read_joules",
        "Energy to read an image: that of the evaluation over its images. Empty where parts have no price.",
    ),
    ("read_joules_device", "Of that, what cells, their lines, light and heat take."),
    ("read_joules_converter", "Of that, what row drivers, converters and receivers take."),
    ("read_joules_digital", "Of that, what adders, tables, multipliers, buses and memories take."),
    ("read_joules_static", "Of that, what is on whether anything happens or not."),
    ("read_seconds", "Time to read an image: that of the evaluation over its images."),
    (
        "update_joules",
        "Energy of an update of both networks: that of the training, its rollouts included, over the updates. Empty where parts have no price.",
    ),
    ("update_seconds", "Time of an update: that of the training over the updates."),
    (
        "decision_joules",
        "Energy of a decision: that of the evaluation over its steps. Empty where parts have no price.",
    ),
    ("decision_joules_device", "Of that, what cells, their lines, light and heat take."),
    ("decision_joules_converter", "Of that, what row drivers, converters and receivers take."),
    (
        "decision_joules_digital",
        "Of that, what adders, tables, multipliers, buses and memories take.",
    ),
    ("decision_joules_static", "Of that, what is on whether anything happens or not."),
    ("decision_seconds", "Time of a decision: that of the evaluation over its steps."),
    ("converters_mm2", "Area of all converters of the tiles that the network takes, typical."),
    ("status", "Finished, planned, or refused: the configuration fits neither chip nor data."),
    ("hardware", "Name of the chip, and of what was changed of it."),
    ("state_hash", "BLAKE3 of levels and counters after the last epoch: the same on any machine."),
    ("data_hash", "BLAKE3 of the data that was learnt from."),
    ("key", "Address of the run in the store: a hash of all that decides its result."),
    ("run", "The report of the run itself."),
];

fn find(all: &'static [(&'static str, &'static str)], name: &str) -> Option<&'static str> {
    all.iter().find(|(word, _)| *word == name).map(|(_, meaning)| *meaning)
}

/// What a column of a sweep means; none of an axis, which means what its key does.
pub(super) fn of_column(name: &str) -> Option<&'static str> {
    find(COLUMNS, name)
}

/// The anchor of a head.
fn anchor(head: &str) -> String {
    let kept = head.chars().filter(|c| c.is_ascii_alphanumeric() || *c == ' ');
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Markup in which every head of a column that is known leads to its line, and says it to pointer and keyboard.
pub(super) fn linked(markup: &str) -> String {
    let mut out = String::with_capacity(markup.len());
    let mut rest = markup;
    while let Some(start) = rest.find("<thead>") {
        let end = rest[start..].find("</thead>").map_or(rest.len(), |end| start + end);
        out += &rest[..start];
        for piece in rest[start..end].split_inclusive("</th>") {
            out += &head(piece).unwrap_or_else(|| piece.to_owned());
        }
        rest = &rest[end..];
    }
    out + rest
}

/// `...<th ...>words</th>` with a link around the words.
fn head(piece: &str) -> Option<String> {
    let before = piece.strip_suffix("</th>")?;
    let open = before.rfind("<th")?;
    let at = open + before[open..].find('>')? + 1;
    let (before, words) = before.split_at(at);
    let meaning = find(HEADS, words)?;
    Some(format!(
        "{before}<a class=\"term\" href=\"#word-{}\" data-tip=\"{}\">{words}</a></th>",
        anchor(words),
        escape(meaning)
    ))
}

/// The lines that the heads of a page lead to, as a list; each once, in the order of the table above.
pub(super) fn list(body: &str) -> String {
    let used = |head: &&(&str, &str)| body.contains(&format!("href=\"#word-{}\"", anchor(head.0)));
    let line = |(head, meaning): &(&str, &str)| {
        format!(
            "<div id=\"word-{}\"><dt>{head}</dt><dd>{}</dd></div>",
            anchor(head),
            escape(meaning)
        )
    };
    HEADS.iter().filter(used).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_is_linked_once_and_its_line_is_listed() {
        let table = "<table><thead><tr><th scope=\"col\">births</th><th></th><th>what?</th></tr></thead><th>births</th>";
        let linked = linked(table);
        assert_eq!(linked.matches("href=\"#word-births\"").count(), 1);
        assert!(linked.contains("<th scope=\"col\"><a ") && linked.contains("<th>what?</th>"));
        let list = list(&linked);
        assert_eq!((list.matches("<dt>").count(), list.contains("id=\"word-births\"")), (1, true));
    }

    #[test]
    fn no_two_heads_share_an_anchor() {
        let mut anchors: Vec<_> = HEADS.iter().map(|(head, _)| anchor(head)).collect();
        anchors.sort();
        assert!(anchors.windows(2).all(|pair| pair[0] != pair[1]), "{anchors:?}");
    }
}
