#!/usr/bin/env bash
# Plants one fault at a time into a copy of the sources and runs the laws that should notice.
#
#   tests/faults.sh          all faults, one line each: caught, MISSED, or NOT PLANTED
#   tests/faults.sh sign     those whose name holds "sign"
#
# The copy and what is built from it live in a temporary folder (FAULTS_DIR to keep them).
# Ends with 1 when a fault was missed or could not be planted.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
work=${FAULTS_DIR:-$(mktemp -d)}
mkdir -p "$work/tree"
[[ -n ${FAULTS_DIR:-} ]] || trap 'rm -rf "$work"' EXIT
export CARGO_TARGET_DIR=${FAULTS_TARGET_DIR:-$work/target} CARGO_INCREMENTAL=1
export PROPTEST_MAX_SHRINK_ITERS=0
only=${1:-}
status=0

copy() {
    (cd "$root" && tar cf - --exclude=./target --exclude=./.git --exclude=./runs .) |
        tar xf - -C "$work/tree"
    rm -rf "$work/tree/tests/proptest-regressions"
}

# name, file, what is there (a fixed line, once), what is put there, laws that look
fault() {
    local name=$1 file=$2 from=$3 to=$4 laws=$5
    [[ $name == *"$only"* ]] || return 0
    copy
    local found
    found=$(grep -cF -- "$from" "$work/tree/$file" || true)
    if [[ $found != 1 ]]; then
        printf '%-34s NOT PLANTED (%s places)\n' "$name" "$found"
        status=1
        return 0
    fi
    local escaped_from escaped_to
    escaped_from=$(printf '%s' "$from" | sed 's/[][\.*^$|]/\\&/g')
    escaped_to=$(printf '%s' "$to" | sed 's/[&|\]/\\&/g')
    sed -i "s|$escaped_from|$escaped_to|" "$work/tree/$file"
    if ! (cd "$work/tree" && cargo test --test it --no-run) >"$work/log" 2>&1; then
        printf '%-34s NOT PLANTED (does not compile, %s)\n' "$name" "$work/log"
        status=1
        return 0
    fi
    # shellcheck disable=SC2086
    if (cd "$work/tree" && cargo test --test it -- $laws) >"$work/log" 2>&1; then
        printf '%-34s MISSED\n' "$name"
        status=1
    else
        local by
        by=$(sed -n 's/^test laws::\(.*\) \.\.\. FAILED$/\1/p' "$work/log" | sed 's/.*:://' | paste -sd' ')
        printf '%-34s caught by %s\n' "$name" "$by"
    fi
}

scalar=src/chip/crossbar/kernel/scalar.rs
error=src/chip/engine/error.rs
read=src/chip/engine/read.rs
update=src/chip/engine/update.rs

fault "1 inhibition is not negated" $scalar \
    'let sum = if write.negate { -sum } else { sum };' 'let sum = sum;' laws::law_1
fault "1 bound passed by one" $scalar \
    'let bound = i64::from(write.increment_max);' \
    'let bound = i64::from(write.increment_max) + 1;' laws::law_1
fault "1 remainder lost" $scalar \
    'residual[at] = u16::try_from(left)' 'residual[at] = u16::try_from(left & !1)' laws::law_1
fault "1 converter truncates" src/chip/periphery.rs \
    'let steps = rsh(current, self.shift);' 'let steps = current >> self.shift;' laws::law_1
fault "1 stream n not negated" $error \
    'let negate = target == Stream::N;' 'let negate = false;' laws::law_1
fault "1 write count stands still" $update \
    'self.layers[layer].writes.iter_mut().for_each(|writes| *writes += 1);' '' laws::law_1
fault "1 slices trade weight" $read \
    'let shift = adc.shift + e.slice as u32 * self.dac_bits;' \
    'let shift = adc.shift + e.slice as u32 * (self.dac_bits - 1);' laws::law_1
fault "1 wide slices trade weight" $read \
    'let weight = slice as u32 * self.dac_bits;' \
    'let weight = slice as u32 * (self.dac_bits - 1);' laws::law_1
fault "1 np hears what pp hears" $read \
    'reads: places.map(reads),' 'reads: places.map(|_| reads(places[0])),' laws::law_1
fault "1 32-bit sums cut too late" src/chip/layer.rs \
    'pub const CHUNK_BLOCKS: usize = 512;' \
    'pub const CHUNK_BLOCKS: usize = 1024;' laws::bounds
fault "2 a half dark block is skipped" src/chip/crossbar/kernel/data.rs \
    'codes.chunks(256).any(any)' 'codes.chunks(256).any(|part| any(&part[..32]))' laws::law_2
fault "2 a sum of nothing is all it sees" $scalar \
    'quotient(sum, shift, bits) != 0' \
    'quotient(sum, shift, bits) > 0' laws::law_2
fault "2 one back end bounds one side" src/chip/crossbar/kernel/avx2/program.rs \
    'let pulses_b = _mm256_max_epi16(_mm256_min_epi16(b, most), least);' \
    'let pulses_b = _mm256_min_epi16(b, most);' laws::law_
fault "3 means are not restored" src/chip/engine/unit.rs \
    'self.means = means;' '' laws::runs
fault "3 write counts are not restored" src/lab/store/checkpoint.rs \
    '*writes = positive(&name, number)?;' 'positive(&name, number)?;' laws::runs
fault "3 a draw depends on the tile" $update \
    'layer: index,' 'layer: index + (hardware.tile.rows & 1) as u16,' laws::runs
schedule=src/chip/engine/schedule.rs
timing=src/chip/hardware/timing.rs
fault "4 layers wait for one another" $schedule \
    '*again = (*again).max(front);' '*again += front;' laws::law_4
fault "4 updates one after the other" $schedule \
    'self.longest = self.longest.max(cycles);' 'self.longest += cycles;' laws::law_4
fault "4 all words are shared" $schedule \
    'round.join(Doing::Hearing, layer, one, !shared);' \
    'round.join(Doing::Hearing, layer, one, false);' laws::law_4
fault "4 words are formed in no time" $schedule \
    'round.passed[Interval::Error as usize] += shape.form;' '' laws::law_4
fault "4 samples are written in any order" $schedule \
    '*columns || sample < written[layer] || sample < *last' \
    '*columns || sample < written[layer]' laws::law_4
fault "4 a row does not turn around" $timing \
    '2 * self.beat * rows + passes * self.pass()' 'self.beat * rows + passes * self.pass()' laws::law_4
fault "4 verifying takes no time" $timing \
    'self.pulse + if self.verify { self.settle + self.conversion() } else { 0 }' \
    'self.pulse' laws::law_4
fault "4 slow lanes hold nothing up" $timing \
    'if front > lanes { front } else { lanes }' 'if front > lanes { front } else { front }' laws::law_4
fault "4 trains fire in one phase" $timing \
    '2 * slots * self.pulse' 'slots * self.pulse' laws::law_4
fault "4 the current has no limit" src/chip/engine/passes.rs \
    'u64::from(cells).div_ceil(together)' 'u64::from(cells.min(1)) * together.min(1)' laws::law_4
fault "5 a tile loses its last row" $read \
    'codes[to..].fill(0);' 'codes[to - 1..].fill(0);' laws::product
fault "5 transposed banks add" src/chip/engine/columns.rs \
    'backward.extend(rows.map(|(e, i)| e - i));' \
    'backward.extend(rows.map(|(e, i)| e + i));' laws::product
exit $status
