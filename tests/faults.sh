#!/usr/bin/env bash
# Plants one fault at a time into a copy of the sources and runs the tests that should notice.
#
#   tests/faults.sh             all faults, one line each: caught, MISSED, NOT PLANTED or NOT JUDGED
#   tests/faults.sh sign "4 "   those whose name holds "sign" or "4 "
#
# A name begins with the number of the law that is to notice (6: convolutions and homeostasis, by unit tests and the oracle),
# or with `run` where tests of run folders are.
# The copy and what is built from it live in a temporary folder (FAULTS_DIR, FAULTS_TARGET_DIR to keep them).
# First all these tests run on sources without a fault: what fails there can catch nothing.
# Ends with 1 unless every fault was caught.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
work=${FAULTS_DIR:-$(mktemp -d)}
mkdir -p "$work/tree"
[[ -n ${FAULTS_DIR:-} ]] || trap 'rm -rf "$work"' EXIT
export CARGO_TARGET_DIR=${FAULTS_TARGET_DIR:-$work/target} CARGO_INCREMENTAL=1
export PROPTEST_MAX_SHRINK_ITERS=0
only=("${@:-}")
status=0
# half of a build is what a debugger would read
build=(cargo test --config profile.dev.package.dalean.debug=0 --config profile.test.package.dalean.debug=0 --lib --test it)

copy() {
    (cd "$root" && tar cf - --exclude=./target --exclude=./.git --exclude=./runs .) |
        tar xf - -C "$work/tree"
    rm -rf "$work/tree/tests/proptest-regressions"
}

say() { printf '%-42s %s\n' "$@"; }

# name, file, what is there (fixed text within a line, once), what is put there, tests that look (filters of the test program)
fault() {
    local name=$1 file=$2 from=$3 to=$4 tests=$5 part chosen=
    for part in "${only[@]}"; do [[ $name != *"$part"* ]] || chosen=yes; done
    [[ -n $chosen ]] || return 0
    copy
    local found text
    found=$(grep -cF -- "$from" "$work/tree/$file" || true)
    if [[ $found != 1 ]]; then
        say "$name" "NOT PLANTED ($found places)"
        status=1
        return 0
    fi
    text=$(<"$work/tree/$file")
    printf '%s\n' "${text/"$from"/"$to"}" >"$work/tree/$file"
    if ! (cd "$work/tree" && "${build[@]}" --no-run) >"$work/log" 2>&1; then
        say "$name" "NOT PLANTED (does not compile, $work/log)"
        status=1
        return 0
    fi
    # shellcheck disable=SC2086
    if (cd "$work/tree" && "${build[@]}" -- $tests) >"$work/log" 2>&1; then
        if ! grep -q '^running [1-9]' "$work/log"; then say "$name" "NOT JUDGED (no test is called $tests)"; else say "$name" MISSED; fi
        status=1
        return 0
    fi
    local by
    by=$(sed -n 's/^test \(.*\) \.\.\. FAILED$/\1/p' "$work/log" | sed 's/.*:://' | paste -sd' ')
    if [[ -z $by ]]; then
        say "$name" "NOT JUDGED (no test failed, $work/log)"
        status=1
    else
        say "$name" "caught by $by"
    fi
}

# touched, so that what an earlier fault left is built again: the copy has the dates of the sources
copy
touch "$work/tree/src/lib.rs"
if ! (cd "$work/tree" && "${build[@]}" -- laws damage golden_run oracle engine:: layer::) >"$work/log" 2>&1; then
    say "none, for control" "FAILS: $(sed -n 's/^test \(.*\) \.\.\. FAILED$/\1/p' "$work/log" | paste -sd' ') ($work/log)"
    exit 1
fi
say "none, for control" "passes"

kernel=src/chip/crossbar/kernel
error=src/chip/engine/error.rs
read=src/chip/engine/read.rs
update=src/chip/engine/update.rs
columns=src/chip/engine/columns.rs
schedule=src/chip/engine/schedule.rs
timing=src/chip/hardware/timing.rs
layer_state=src/chip/layer/state.rs
verify=src/lab/run/verify.rs

fault "1 inhibition is not negated" $kernel/requests.rs \
    'amount: if write.negate { -amount } else { amount },' 'amount,' laws::law_1
fault "1 bound passed by one" $kernel/pulses.rs \
    'let (bound, fraction) = (i64::from(write.increment_max), write.residual_bits);' \
    'let (bound, fraction) = (i64::from(write.increment_max) + 1, write.residual_bits);' laws::law_1
fault "1 remainder lost" $kernel/pulses.rs \
    'residual[at] = u16::try_from(left)' 'residual[at] = u16::try_from(left & !1)' laws::law_1
fault "1 lanes lose a remainder" $kernel/pulses.rs \
    '.min(most_left).max(0) as u16;' '.min(most_left).max(0) as u16 & !1;' laws::law_1
fault "1 a remainder outlives the floor" $kernel/levels.rs \
    'reached if reached < floor => 0,' 'reached if reached < floor => left,' laws::law_1
fault "1 lanes absorb without a pulse" $kernel/levels.rs \
    'let absorbed = gone | ((pulses[i] != 0) & (level == floor));' \
    'let absorbed = gone | (level == floor);' laws::law_1
fault "1 converter truncates" src/chip/periphery.rs \
    'let steps = rsh(current, self.shift);' 'let steps = current >> self.shift;' laws::law_1
fault "1 stream n not negated" $error \
    'let negate = target == Stream::N && !alike;' 'let negate = alike;' laws::law_1
fault "1 a batch is not divided by its size" src/chip/engine/unit.rs \
    'let m = samples << (9 - bits);' 'let m = 1i64 << (9 - bits);' laws::law_1
fault "1 write count stands still" src/chip/engine/forget.rs \
    '*writes += 1;' '' laws::law_1
fault "1 slices trade weight" $read \
    'let shift = adc.shift + e.slice as u32 * self.dac_bits;' \
    'let shift = adc.shift + e.slice as u32 * (self.dac_bits - 1);' laws::law_1
fault "1 wide slices trade weight" $read \
    'let weight = slice as u32 * self.dac_bits;' \
    'let weight = slice as u32 * (self.dac_bits - 1);' laws::law_1
fault "1 np hears what pp hears" $read \
    'let reads = places.map(reads);' 'let reads = places.map(|_| reads(places[0]));' laws::law_1
fault "1 32-bit sums cut too late" $read \
    'use crate::chip::layer::{CHUNK_BLOCKS, Layer};' \
    'use crate::chip::layer::Layer; const CHUNK_BLOCKS: usize = 1024;' laws::bounds
fault "1 tracking looks at evaluation" src/chip/engine/track.rs \
    'if !self.tracks() || self.phase != Phase::Training {' 'if !self.tracks() {' laws::law_1
fault "1 tracking allows 1 in 32" src/chip/hardware.rs \
    'pub const TRACKING_RARE: u64 = 64;' 'pub const TRACKING_RARE: u64 = 32;' \
    'laws::bounds laws::law_'
fault "1 words read from columns are not kept" $columns \
    'let kept = WORD_BITS * inputs * self.samples as u64;' 'let kept = 0 * WORD_BITS * inputs;' laws::law_1
fault "2 a half dark block is skipped" $kernel/data.rs \
    'codes.chunks(256).any(any)' 'codes.chunks(256).any(|part| any(&part[..32]))' laws::law_2
fault "2 a sum of nothing is all it sees" $kernel/pulses.rs \
    'requests.any(|request| quotient(request, bits) != 0)' \
    'requests.any(|request| quotient(request, bits) > 0)' laws::law_2
fault "2 one back end bounds one side" $kernel/avx2/fused.rs \
    'let pulses_b = _mm256_max_epi16(_mm256_min_epi16(b, most), least);' \
    'let pulses_b = _mm256_min_epi16(b, most);' laws::law_
fault "3 means are not restored" src/chip/engine/unit.rs \
    'self.means = means;' 'let _ = means;' laws::runs
fault "3 write counts are not restored" $layer_state \
    'Section::WriteCounts, self.writes.iter_mut())' \
    'Section::WriteCounts, self.writes.clone().iter_mut())' laws::runs
fault "3 the epoch is not restored" src/task/classify/trainer.rs \
    'self.epoch = u32::try_from(epoch[0]).expect("a visitor keeps to the range");' \
    'let _ = epoch;' laws::runs
fault "3 samples since a look are not restored" src/chip/engine/state.rs \
    'let samples = std::iter::once(&mut self.unlooked);' \
    'let lost = &mut self.unlooked.clone(); let samples = std::iter::once(lost);' laws::runs
fault "3 codes on the rail are not restored" $layer_state \
    'let counts = self.rails.iter_mut().flatten().flatten();' \
    'let mut lost = self.rails.clone(); let counts = lost.iter_mut().flatten().flatten();' laws::runs
fault "3 converter shifts are not restored" $layer_state \
    '*place = u32::try_from(shift).expect("a visitor keeps to the range");' \
    'let _ = (place, shift);' laws::runs
fault "3 an event that tiling moves is hashed" src/chip/ledger.rs \
    '| Self::Holds' '' laws::runs
fault "3 a section has another one's tag" $layer_state \
    '&writes, Section::WriteCounts,' '&writes, Section::Device,' golden_run
fault "3 a draw depends on the tile" $update \
    'layer: this.index,' 'layer: this.index + (self.hardware.tile.rows & 1) as u16,' laws::runs
fault "4 layers wait for one another" $schedule \
    '(*again).max(shape.turns * front).max(shape.stage)' '*again + shape.turns * front + shape.stage' laws::law_4
fault "4 updates one after the other" $schedule \
    'self.longest = self.longest.max(cycles);' 'self.longest += cycles;' laws::law_4
fault "4 all words are shared" $schedule \
    'round.join(Doing::Hearing, layer, one, !shared);' \
    'round.join(Doing::Hearing, layer, one, false);' laws::law_4
fault "4 words are formed in no time" $schedule \
    'round.passed[Interval::Error as usize] += shape.form;' '' laws::law_4
fault "4 dense words take no time" $schedule \
    'form: timing.form(layer.delivery.terms() as u64),' \
    'form: timing.form(layer.delivery.terms() as u64 * u64::from(!matches!(layer.delivery.source, crate::chip::layer::WordSource::Signed { .. }))),' \
    laws::law_4
fault "4 samples are written in any order" $schedule \
    '*columns || sample < written[layer] || sample < *last' \
    '*columns || sample < written[layer]' laws::law_4
fault "4 a row does not turn around" $timing \
    '2 * self.beat * rows + passes * self.pass()' 'self.beat * rows + passes * self.pass()' laws::law_4
fault "4 verifying takes no time" $timing \
    'self.pulse + if self.verify { self.settle + self.conversion() } else { 0 }' \
    'self.pulse' laws::law_4
fault "4 slow lanes hold nothing up" src/chip/hardware/read_time.rs \
    'if front > lanes { front } else { lanes }' 'if front > lanes { front } else { front }' laws::law_4
fault "4 trains fire in one phase" $timing \
    '2 * slots * self.pulse' 'slots * self.pulse' laws::law_4
fault "4 the current has no limit" src/chip/engine/passes.rs \
    'u64::from(cells).div_ceil(together)' 'u64::from(cells.min(1)) * together.min(1)' laws::law_4
fault "5 a tile loses its last row" src/chip/engine/read/tiles.rs \
    'codes[to..].fill(0);' 'codes[to - 1..].fill(0);' laws::product
fault "5 transposed banks add" $columns \
    'arrays.iter().zip([false, true])' 'arrays.iter().zip([false, false])' laws::product
fault "run verify ignores the ledger" $verify \
    'same(names::LEDGER, kept, &ledger)?;' 'let _ = (kept, &ledger);' damage
fault "run verify ignores records" $verify \
    'same(&format!("record of epoch {epoch} in {}", names::METRICS), line, &record)?;' 'let _ = line;' damage
fault "run verify ignores the last state" $verify \
    'Some(kept) if kept != state && !seen =>' 'Some(kept) if kept.is_empty() =>' damage
fault "run a lost count is no difference" src/lab/run/proof.rs \
    'counted && !kept.contains_key(*name) && !is_nothing(value)' 'false && counted && is_nothing(value)' damage
fault "run a mute layer may be left out" src/lab/store/folder.rs \
    '(known || told > 0) && told < record.layers.len()' 'known && told > record.layers.len()' damage
fault "run eval ignores the rates of a receipt" src/lab/run/proof.rs \
    'receipt.rates != session.rates()' 'false' damage
fault "run a state need not be what it says" src/lab/store/checkpoint.rs \
    'checked.same("state_hash", &hash::state(state))' 'Ok(())' damage
fault "run an address has constants in it" src/lab/config/given.rs \
    'Ok(classify(&experiment, self.train_on, self.select))' \
    'Ok([classify(&experiment, self.train_on, self.select), vec![("constants".into(), format!("{:?}", self.constants))]].concat())' \
    golden_run
window=src/chip/engine/window.rs
back=src/chip/engine/window/back.rs
homeostasis=src/chip/engine/homeostasis.rs
balance=src/chip/layer/homeostasis.rs

fault "6 a mean of four truncates" $window \
    '((sum + 2) >> 2) as u8' '(sum >> 2) as u8' 'engine::window oracle::conv'
fault "6 a mean of nine truncates" $window \
    '(2 * sum + cells) / (2 * cells)' '2 * sum / (2 * cells)' 'engine::window oracle::conv'
fault "6 an image is not framed above" $window \
    '((y + shape.pad) * shape.padded()[1] + shape.pad)' '(y * shape.padded()[1] + shape.pad)' 'engine::window oracle::conv'
fault "6 a pool leaves the last column" $window \
    '&codes[row..row + side]' '&codes[row..row + side.max(2) - 1]' 'engine::window oracle::conv'
fault "6 a map is flattened one unit off" $window \
    'let codes = &codes[first.min(last)..last];' \
    'let codes = &codes[first.min(last).saturating_sub(usize::from(first > 0))..last - usize::from(first > 0)];' 'engine::window oracle::conv'
fault "6 what comes back forgets the stride" $back \
    'let first = position * shape.stride;' 'let first = position;' engine::window::back
fault "6 all that are greatest hear the word" $back \
    'std::mem::take(&mut left[unit])' 'left[unit]' engine::window::back
fault "6 a mean hands one place its word" $back \
    'square().for_each(|at| heard[at] = *word);' 'square().take(1).for_each(|at| heard[at] = *word);' engine::window::back
fault "6 a threshold is added" $homeostasis \
    'let left = *sum - self.offsets[at + column];' 'let left = *sum + self.offsets[at + column];' 'engine::homeostasis oracle::conv'
fault "6 evaluation moves thresholds" $homeostasis \
    'Mode::Hardware if self.phase == Phase::Training => Notes {' 'Mode::Hardware => Notes {' 'engine::homeostasis oracle::conv'
fault "6 thresholds move twice as fast" $balance \
    'sum << THRESHOLD_BITS, reads, window)' 'sum << THRESHOLD_BITS, reads, window - 1)' 'engine::homeostasis oracle::conv'
fault "6 positions are not counted in a window" $balance \
    'self.law.window_log2 + self.positions_log2)' 'self.law.window_log2)' 'engine::homeostasis oracle::conv'
fault "6 a step grows and its variance stays" $balance \
    '(shift + 1, variance >> 2)' '(shift + 1, variance)' 'layer::homeostasis engine::homeostasis oracle::conv'
fault "6 means are of images, not of pixels" src/chip/engine/optimise.rs \
    'next_mean(mean, codes, samples, window + pixels_log2)' 'next_mean(mean, codes, samples, window)' 'engine::window engine::optimise oracle::conv'
fault "6 a constant row has the mean of one" src/chip/engine/optimise.rs \
    'let constant = pixels * i64::from(self.hardware.drive.bits.code_max());' 'let constant = pixels;' 'engine::window oracle::conv'
fault "6 a scale follows an eighth of the way" src/chip/layer/requests/rms.rs \
    'rsh(now - self.power, 4)' 'rsh(now - self.power, 3)' 'layer::requests oracle::conv'
fault "6 one position is read" $schedule \
    'cycles.occupy(layer, During::ForwardRows, count * front);' \
    'cycles.occupy(layer, During::ForwardRows, samples as u64 * front);' 'tick::network oracle::conv'
fault "6 positions are read at once" $schedule \
    '*again = (*again).max(shape.turns * front).max(shape.stage);' '*again = (*again).max(front).max(shape.stage);' 'tick::network oracle::conv'
fault "6 a pool takes no time" $schedule \
    '*latency += one + shape.stage;' '*latency += one;' 'tick::network oracle::conv'
fault "6 gates of one position are formed" $schedule \
    't.error(shape.words, shape.columns, shape.positions)' 't.error(shape.words, shape.columns, 1)' 'tick::network oracle::conv'
fault "6 columns are read at one position" $schedule \
    'cycles.occupy(layer, During::ForwardColumns, count * front);' \
    'cycles.occupy(layer, During::ForwardColumns, samples as u64 * front);' 'tick::network engine::window'
fault "6 thresholds move in no time" $schedule \
    'longest = longest.max(one);' 'longest = longest.max(0 * one);' 'engine::homeostasis oracle::conv'
fault "6 copies share out no reads" $schedule \
    'turns: layer.spec.turns() as u64,' 'turns: layer.spec.positions() as u64,' tick::network
fault "6 a turn of fewer reads takes no time" src/chip/layer/stage.rs \
    'self.positions().div_ceil(self.copies.max(1))' 'self.positions() / self.copies.max(1)' tick::network
fault "6 rows of one copy are pulsed" $update \
    'let count = copies * passes.by_target[target.index()];' 'let count = passes.by_target[target.index()];' tick::network
fault "6 cells of one copy are pulsed" $update \
    '(copies - 1) * counts.attempted' '0 * counts.attempted' tick::network
fault "6 one copy is verified" $update \
    'copies * verified(self.hardware.timing, counts)' 'verified(self.hardware.timing, counts)' tick::network
fault "6 one copy is loaded" src/chip/engine/deploy.rs \
    'let others = self.copies_of(layer) - 1;' 'let others = 0 * self.copies_of(layer);' tick::network
fault "6 a chip has the cells of one copy" src/lab/price/plan.rs \
    'self.layers.iter().map(|l| l.copies * l.cells()).sum()' 'self.layers.iter().map(|l| l.cells()).sum()' price::plan
fault "6 a chip has the tiles of one copy" src/lab/price/plan.rs \
    'l.copies * l.targets * l.rows.div_ceil(rows)' 'l.targets * l.rows.div_ceil(rows)' price::plan
fault "6 cells that answer by draws have copies" src/chip/hardware/cells.rs \
    '(self.device.is_some(), "hw.device.response"),' '(false, "hw.device.response"),' check::window
exit $status
