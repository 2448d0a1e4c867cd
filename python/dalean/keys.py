"""Every key of an experiment with what it takes, for type checkers and editors; `docs/CONFIG.md` is made of the same.
Made by `stubs.py` from `dalean keys --json`.
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict

Keys = TypedDict(
    "Keys",
    {
        # Who makes the error words. Default: "classify".
        "task": Literal["classify", "policy"],
        # Seed of all draws. Default: 1.
        "seed": int,
        # Whose defaults the keys have that the file is silent about; without it, this program's.
        "preset": Literal["paper"],
        # What is learnt.
        "data": Any,
        # Layers and units.
        "network": Any,
        # Rule, rate, batch, epochs.
        "learning": Any,
        # Policies: what is acted on, and for how long.
        "environment": Any,
        # Policies: proximal policy optimisation.
        "ppo": Any,
        # Policies: evolution strategies.
        "es": Any,
        # Policies: episodes that are read without learning.
        "evaluation": Any,
        # The chip: a model and what differs from it.
        "hw": Any,
        # A set that this program knows. Default: "optdigits".
        "data.set": Literal["optdigits", "mnist", "fashion-mnist", "cifar10", "xor", "parity2", "parity3", "parity4", "parity5", "parity6", "parity7", "parity8"],
        # What files of one's own are.
        "data.format": Literal["idx", "npz", "csv"],
        # File of the training examples; paths in a file are relative to that file.
        "data.train": Any,
        # IDX, NPZ: file of the training labels, where they have one of their own.
        "data.train_labels": Any,
        # File of the validation examples; default: every 12th training example.
        "data.validation": Any,
        # IDX, NPZ: file of their labels.
        "data.validation_labels": Any,
        # File of the test examples; default: every 6th example of the training file.
        "data.test": Any,
        # IDX, NPZ: file of their labels.
        "data.test_labels": Any,
        # Greatest value; default: the greatest training value, or 255 for fractions.
        "data.full_scale": int,
        # Number of classes; default: as many as there are different labels.
        "data.classes": int,
        # Height, width and channels of examples that are pictures; a table's values lie row after row, the channels of a pixel side by side.
        "data.shape": Any,
        # Pictures: rows and pixels of a row that are kept of their middle.
        "data.middle": Any,
        # CSV: `first`, `last`, a number from 0, or a header; default: told from the table, and said.
        "data.label_column": Any,
        # CSV: columns left out, each a number from 0 or a header; default: those without a name that number the rows.
        "data.ignore_columns": Any,
        # CSV: whether the first line names the columns; default: told from the table.
        "data.header": bool,
        # CSV: `,`, `;`, `tab`, `|`; default: what cuts the first lines alike.
        "data.separator": Literal[",", ";", "tab", "|"],
        # NPZ: name of the array of examples of every part (default: known names, such as `x` or `x_train`).
        "data.examples_array": Any,
        # NPZ: name of the array of labels of every part.
        "data.labels_array": Any,
        # NPZ: array of the training examples.
        "data.train_array": Any,
        # NPZ: array of the training labels.
        "data.train_labels_array": Any,
        # NPZ: array of the validation examples; in the training file, unless `validation` names another.
        "data.validation_array": Any,
        # NPZ: array of the validation labels.
        "data.validation_labels_array": Any,
        # NPZ: array of the test examples; in the training file, unless `test` names another.
        "data.test_array": Any,
        # NPZ: array of the test labels.
        "data.test_labels_array": Any,
        # Output channels of each convolution; convolutions come before the hidden layers. Default: [].
        "network.channels": Any,
        # Convolutions: rows and columns of the window. [pixels] Default: 3.
        "network.kernel": Any,
        # Convolutions: pixels from a window to the next. [pixels] Default: 1.
        "network.stride": Any,
        # Convolutions: pixels of border on each side of the image, which are 0. Default: "same".
        "network.padding": Any,
        # Convolutions: what is handed on of each square of their map. Default: "average".
        "network.pool": Literal["average", "max", "none"] | list[Literal["average", "max", "none"]],
        # Convolutions: rows and columns of such a square. [pixels] Default: 2.
        "network.pool_side": Any,
        # Convolutions: how often their arrays stand on the chip, each written, to read as many positions at a time. Default: 1.
        "network.copies": Any,
        # Units of each hidden layer; of policies, of the network that acts. [units] Default: [256].
        "network.hidden": Any,
        # Policies: units of each hidden layer of the network that says what a state is worth. [units] Default: [64, 64].
        "network.critic_hidden": Any,
        # Output units. [units]
        "network.outputs": int,
        # How values become drives, which have no sign. Default: "raw".
        "network.input": Literal["raw", "on_off", "white", "split", "offset", "signed"],
        # Function of hidden units, convolutions among them; outputs are sigmoid, sums with `softmax` and of policies. Default: "sigmoid".
        "network.activation": Literal["sigmoid", "relu", "identity", "rms", "ramp"],
        # Sigmoid width of each layer. Default: 4.0.
        "network.alpha": float | list[float],
        # Whether each hidden unit takes the running mean of its own sum off it. Default: false.
        "network.threshold": bool,
        # How the step of the table of hidden units is found. Default: "table".
        "network.gain": Literal["table", "fixed", "tracking"],
        # Gain `fixed`: the table reaches 2^gain_spread times as far. [bits] Default: 0.
        "network.gain_spread": int,
        # Samples after which thresholds and gains have come all the way, were they not to turn. [samples] Default: 512.
        "network.homeostasis_window": int,
        # Weight of the level after the greatest, of each layer. Default: 2.0.
        "network.weight_max": float | list[float],
        # Whether a constant input is learnt from. Default: "none".
        "network.bias": Literal["none", "input_row", "rows"],
        # Which outputs are read. Default: "p".
        "network.readout": Literal["p", "p-n"],
        # Initial gain of excitatory and inhibitory arrays of hidden layers. Default: [1.5, 0.5].
        "network.init_gain": Any,
        # The same of the output layer. Default: [1.0, 1.0].
        "network.init_gain_output": Any,
        # The learning rule. Default: "ed".
        "learning.rule": Literal["ed", "ed_seed", "ed_non_dalean", "kaneko", "dfa", "bp", "es"],
        # Passes over the training set. [epochs] Default: 40.
        "learning.epochs": int,
        # Samples of an update; of policies, steps of a minibatch. [samples] Default: 16.
        "learning.batch": int,
        # When a batch is written. Default: "accumulate".
        "learning.mode": Literal["accumulate", "replay", "online"],
        # What is asked of a cell, given its sum. Default: "plain".
        "learning.optimiser": Literal["plain", "sign", "rms", "momentum", "adam_fx"],
        # Optimiser `sign`: sums below the root mean square of their layer ask for nothing. Default: false.
        "learning.dead_zone": bool,
        # Optimiser `momentum`: what an accumulator forgets of itself at a write, as 2^-shift. [bits] Default: 3.
        "learning.momentum_shift": int,
        # Optimiser `adam_fx`: what the mean of sums and the mean of their squares forget of themselves at a write, as 2^-shift. [bits] Default: [3, 8].
        "learning.adam_shifts": Any,
        # Whether layers learn from what differs from the mean of each row; of policies, hidden layers of the network that acts. Default: false.
        "learning.centred": bool,
        # Rate, before multipliers; of the optimiser `sign` the probability of a pulse, of `rms` and `adam_fx` a step of weights. Default: 18.0.
        "learning.rate": float,
        # Factor of the rate of each layer. Default: [1.0, 0.25].
        "learning.rate_multipliers": float | list[float],
        # Small factor beside the shift of each layer. Default: 1.
        "learning.rate_mantissa": int | list[int],
        # How the rate falls over the run. Default: "cosine".
        "learning.decay": Literal["cosine", "linear", "constant"],
        # What the error of an output is. Default: "one_vs_all".
        "learning.error": Literal["one_vs_all", "softmax"],
        # Error `softmax`: what outputs are divided by before they share. Default: 1.0.
        "learning.temperature": float,
        # What is subtracted from errors. Default: "batch".
        "learning.centre": Literal["none", "batch", "running"],
        # What is taken away, to see whether it is needed. Default: "none".
        "learning.control": Literal["none", "frozen_hidden", "same_sign_hidden", "same_sign"],
        # Updates after which, again and again, what both cells of a pair hold is taken off both by loads: for cells that only rise. [updates]
        "learning.refresh": int,
        # How errors reach hidden units. Default: "modulo".
        "learning.route": Literal["modulo", "random_sparse", "scalar_broadcast", "random_dense"],
        # Words a hidden unit adds. [words] Default: 3.
        "learning.taps": int,
        # Shift of the sum of words. [bits]
        "learning.tap_shift": int,
        # Training images move by up to so many pixels. [pixels] Default: 0.
        "learning.shift_pixels": int,
        # Whether left and right of training images are exchanged, each time with a chance of a half. Default: false.
        "learning.flip": bool,
        # What is learnt from. Default: "train".
        "learning.train_on": Literal["train", "all"],
        # The epoch whose state reads the test set. Default: "last".
        "learning.select": Literal["best_validation", "last"],
        # What it is called. Default: "CartPole-v1".
        "environment.id": Any,
        # How many run side by side. Default: 16.
        "environment.count": int,
        # Steps of all of them together, at least: whole epochs are done. [steps] Default: 500000.
        "environment.steps": int,
        # Steps of one in a rollout; with evolution, of an episode at most. [steps] Default: 128.
        "environment.horizon": int,
        # Rollouts, or generations of evolution, of an epoch: as often is a record written and the policy evaluated. Default: 5.
        "environment.rollouts": int,
        # Passes over a rollout. Default: 10.
        "ppo.passes": int,
        # Discount of rewards. Default: 0.99.
        "ppo.gamma": Any,
        # Decay of advantage estimates: 0 looks one step ahead, 1 to the end. Default: 0.95.
        "ppo.lambda": Any,
        # How far a ratio may go before it is clipped. Default: 0.2.
        "ppo.clip": float,
        # What entropy is worth. Default: 0.01.
        "ppo.entropy": Any,
        # Continuous actions: logarithm of their spread at the start. Default: 0.0.
        "ppo.log_sigma": Any,
        # Continuous actions: how far that logarithm moves in an update for a mean error of 1. Default: 0.003.
        "ppo.log_sigma_rate": Any,
        # Continuous actions: steps for which what was drawn stands. [steps] Default: 1.
        "ppo.noise_steps": int,
        # Pairs of candidates in a generation. Default: 16.
        "es.pairs": int,
        # Levels by which the cells of a candidate differ, up and down. [levels] Default: 16.
        "es.step": int,
        # A cell moves by a level with a probability of 2^-shift times the sum of ranks that ask for it. [bits] Default: 4.
        "es.shift": int,
        # Episodes after every epoch. Default: 8.
        "evaluation.episodes": int,
        # Episodes of the final test. Default: 100.
        "evaluation.final_episodes": int,
        # Whether the likeliest action is taken, and not one that is drawn. Default: true.
        "evaluation.deterministic": bool,
        # Name of a built-in model or path of a model file (experiments only). Default: "ideal".
        "hw.model": Any,
        # What it is called (model files).
        "hw.name": Any,
        # One sentence (model files).
        "hw.summary": Any,
        # Cells.
        "hw.cell": Any,
        # Physical arrays.
        "hw.tile": Any,
        # Row drivers.
        "hw.drive": Any,
        # Column converters. Default: "ideal".
        "hw.adc": Any,
        # Activation table.
        "hw.lut": Any,
        # Error bus.
        "hw.error": Any,
        # Programming.
        "hw.write": Any,
        # What real cells and converters do that ideal ones do not.
        "hw.device": Any,
        # Cycles of what a tile does; without it no cycles are counted.
        "hw.timing": Any,
        # Joules of an event, by quantity and unit.
        "hw.energy": Any,
        # Watts that flow whatever happens.
        "hw.power": Any,
        # Sizes of parts.
        "hw.area": Any,
        # Nanometres of the node that its numbers are of, unless they say another.
        "hw.node_nm": Any,
        # Settings of the model that its numbers are for, where the chip has others. Written by the program.
        "hw.constants_for": Any,
        # Ways to use the chip, for `hw peak --modes` (model files): name and settings.
        "hw.modes": Any,
        # What the chip has of what this program does not simulate, by the names that `dalean hw show` lists.
        "hw.not_simulated": Any,
        # Bits of a stored level. [bits] Default: 8.
        "hw.cell.level_bits": int,
        # Least level: floor over ceiling is the conductance of an off cell over that of an on cell. [levels] Default: 0.
        "hw.cell.floor": int,
        # Greatest level. [levels]
        "hw.cell.ceiling": int,
        # What becomes of a cell on the floor. Default: "recoverable".
        "hw.cell.floor_kind": Literal["recoverable", "absorbing"],
        # Where the numbers come from.
        "hw.cell.source": Any,
        # How far to trust the numbers.
        "hw.cell.kind": Literal["measured", "fitted", "assumed"],
        # Rows of a tile. [rows] Default: 256.
        "hw.tile.rows": int,
        # Columns of a tile. [columns] Default: 256.
        "hw.tile.columns": int,
        # Tiles on the chip. [tiles]
        "hw.tile.count": int,
        # Whether rows can be read while columns are driven. Default: false.
        "hw.tile.transposed_read": bool,
        # Where the numbers come from.
        "hw.tile.source": Any,
        # How far to trust the numbers.
        "hw.tile.kind": Literal["measured", "fitted", "assumed"],
        # Bits of a drive code. [bits] Default: 8.
        "hw.drive.bits": int,
        # How a drive code is put on a row. Default: "voltage".
        "hw.drive.mode": Literal["voltage", "pulse_width", "amplitude"],
        # Bits a DAC applies at a time. [bits] Default: 8.
        "hw.drive.dac_bits": int,
        # Pulse width: time slots of a phase. [slots]
        "hw.drive.slots": int,
        # Pulse width: cycles of a slot. [cycles] Default: 1.
        "hw.drive.slot_cycles": int,
        # Pulse width: phases a drive code is read in. Default: 1.
        "hw.drive.phases": int,
        # Where the numbers come from.
        "hw.drive.source": Any,
        # How far to trust the numbers.
        "hw.drive.kind": Literal["measured", "fitted", "assumed"],
        # Resolution. [bits]
        "hw.adc.bits": int,
        # Where the range of a converter lies. Default: "tracking".
        "hw.adc.range": Any,
        # Shift added to the calibrated one. [bits] Default: 4.
        "hw.adc.headroom": int,
        # When it is calibrated again. Default: "never".
        "hw.adc.recalibrate": Literal["never", "epoch"],
        # Where the banks are subtracted. Default: "digital".
        "hw.adc.subtract": Literal["digital", "current"],
        # Cycles of a conversion: `fixed` (as `timing.convert_cycles` says), `sar` (bits + 1 steps), `counter` and `ramp` (2^bits steps), `flash` (one step).
        "hw.adc.converter": Literal["fixed", "sar", "counter", "ramp", "flash"],
        # Cycles of a step, where bits decide how many there are; default 1. [cycles] Default: 1.
        "hw.adc.step_cycles": int,
        # Bits that a phase is converted to: `owed` (those that earlier phases left) or `all`. Of several phases of `pulse_width` alone. Default: "owed".
        "hw.adc.phase_bits": Literal["owed", "all"],
        # Where the numbers come from.
        "hw.adc.source": Any,
        # How far to trust the numbers.
        "hw.adc.kind": Literal["measured", "fitted", "assumed"],
        # Bits of the table index. [bits] Default: 10.
        "hw.lut.bits": int,
        # Where the numbers come from.
        "hw.lut.source": Any,
        # How far to trust the numbers.
        "hw.lut.kind": Literal["measured", "fitted", "assumed"],
        # Bits of an error word. [bits] Default: 8.
        "hw.error.bits": int,
        # Where the numbers come from.
        "hw.error.source": Any,
        # How far to trust the numbers.
        "hw.error.kind": Literal["measured", "fitted", "assumed"],
        # Most pulses a write gives a cell. [pulses] Default: 7.
        "hw.write.increment_max": int,
        # Random bits of rounding. [bits] Default: 8.
        "hw.write.dither_bits": int,
        # Where the random bits of a cell come from. Default: "per_cell".
        "hw.write.dither": Literal["per_cell", "separable"],
        # Bits of the digital remainder behind a cell. [bits] Default: 0.
        "hw.write.residual_bits": int,
        # How sums become pulses. Default: "rounded".
        "hw.write.scheme": Literal["rounded", "rank1"],
        # Slots of a train. [slots] Default: 4.
        "hw.write.train_slots": int,
        # Where the numbers come from.
        "hw.write.source": Any,
        # How far to trust the numbers.
        "hw.write.kind": Literal["measured", "fitted", "assumed"],
        # What a pulse does to a cell.
        "hw.device.response": Any,
        # How cells differ.
        "hw.device.spread": Any,
        # Cells that hold one level.
        "hw.device.faults": Any,
        # What cells conduct at level 0.
        "hw.device.conductance": Any,
        # What wires take.
        "hw.device.wires": Any,
        # Noise of conversions.
        "hw.device.read_noise": Any,
        # Noise of loads.
        "hw.device.programming": Any,
        # What time does to levels, between programming and reading (`dalean eval --after`).
        "hw.device.drift": Any,
        # How many pulses cells take.
        "hw.device.endurance": Any,
        # What volatile cells forget while they learn.
        "hw.device.leakage": Any,
        # How the step of a pulse depends on where the cell lies in its window.
        "hw.device.response.curve": Literal["linear", "soft_bounds", "exponential", "neurosim", "table", "measured"],
        # Pulses of mean length across the window. Levels are the resolution that the cell is simulated with; rates count pulses. [pulses]
        "hw.device.response.states": int,
        # Steps up, in mean steps: at the floor and at the ceiling (linear), at the floor alone (soft_bounds), at equally spaced places from the floor to the ceiling (table). [mean steps]
        "hw.device.response.up": Any,
        # Steps down, in mean steps: at the floor and at the ceiling (linear), at the ceiling alone (soft_bounds), at equally spaced places from the floor to the ceiling (table). [mean steps]
        "hw.device.response.down": Any,
        # Of steps up and down: how much the exponential part takes off the mean step.
        "hw.device.response.amplitude": Any,
        # Of steps up and down: how fast the exponential part grows.
        "hw.device.response.growth": Any,
        # The argument of the exponential part at the floor and at the ceiling.
        "hw.device.response.z": Any,
        # Nonlinearity labels of rising and of falling pulses, as MLP+NeuroSim has them.
        "hw.device.response.labels": Any,
        # Rows of three: where a cell lies, 0 to 1 of the window and rising, and its steps up and down in windows. [windows]
        "hw.device.response.points": Any,
        # By which share steps up are longer than the curve says, and steps down shorter.
        "hw.device.response.asymmetry": Any,
        # Standard deviation of a step from pulse to pulse.
        "hw.device.response.noise": float,
        # What that is a share of.
        "hw.device.response.noise_of": Literal["step", "window"],
        # Standard deviation of what a write leaves beside the level that its pulses reached, in windows: reads see it, and the next pulse begins where pulses had left the cell. [windows]
        "hw.device.response.write_noise": float,
        # Where pulses are verified (`timing.verify`): pulses that a cell is given at most for each that is asked for. It gets no more once it has moved as far as pulses of mean length would take it, to half of one. [pulses]
        "hw.device.response.tries": int,
        # Where the numbers come from.
        "hw.device.response.source": Any,
        # How far to trust the numbers.
        "hw.device.response.kind": Literal["measured", "fitted", "assumed"],
        # Standard deviation of the factor of a cell's steps, or of its logarithm.
        "hw.device.spread.step": float,
        # The law of that factor, whose median is 1.
        "hw.device.spread.step_law": Literal["normal", "log_normal"],
        # Standard deviation of the share by which a cell's steps up are longer, and its steps down shorter.
        "hw.device.spread.asymmetry": float,
        # Standard deviation of a cell's ceiling, in windows. What would lie beyond the levels there are lies on their end: leave room. [windows]
        "hw.device.spread.ceiling": float,
        # Standard deviation of a cell's floor, in windows. [windows]
        "hw.device.spread.floor": float,
        # Where the numbers come from.
        "hw.device.spread.source": Any,
        # How far to trust the numbers.
        "hw.device.spread.kind": Literal["measured", "fitted", "assumed"],
        # Share of the cells that are stuck at the floor. [of the cells]
        "hw.device.faults.stuck_floor": float,
        # Share of the cells that are stuck at the ceiling. [of the cells]
        "hw.device.faults.stuck_ceiling": float,
        # Share of the cells that are stuck at any level of the window, each level as often as any other. [of the cells]
        "hw.device.faults.stuck_any": float,
        # A CSV file that lists stuck cells, `layer,pathway,row,column,state`, in a file relative to that file; state is a level, `floor` or `ceiling`. Listed cells are stuck on every chip, whatever is drawn.
        "hw.device.faults.map": Any,
        # The same lines in place, as a run keeps them.
        "hw.device.faults.cells": Any,
        # Where the numbers come from.
        "hw.device.faults.source": Any,
        # How far to trust the numbers.
        "hw.device.faults.kind": Literal["measured", "fitted", "assumed"],
        # Conductance of a cell at the ceiling over that at level 0. Levels lie evenly between: level 0 no longer conducts nothing.
        "hw.device.conductance.on_off": Any,
        # What takes off what cells conduct at level 0.
        "hw.device.conductance.reference": Literal["none", "column"],
        # Where the numbers come from.
        "hw.device.conductance.source": Any,
        # How far to trust the numbers.
        "hw.device.conductance.kind": Literal["measured", "fitted", "assumed"],
        # Resistance of the wire from one cell to the next, along rows and along columns. [ohm]
        "hw.device.wires.segment_ohm": Any,
        # Resistance of a cell at the ceiling, with what selects it. [ohm]
        "hw.device.wires.cell_on_ohm": Any,
        # Where the numbers come from.
        "hw.device.wires.source": Any,
        # How far to trust the numbers.
        "hw.device.wires.kind": Literal["measured", "fitted", "assumed"],
        # Standard deviation of a conversion, in currents of one cell at the ceiling under the greatest slice of a drive. [cells]
        "hw.device.read_noise.sigma_cells": float,
        # Where the numbers come from.
        "hw.device.read_noise.source": Any,
        # How far to trust the numbers.
        "hw.device.read_noise.kind": Literal["measured", "fitted", "assumed"],
        # Standard deviation of what a load leaves, in shares of the greatest conductance: coefficients of a polynomial in the conductance as a share of the greatest, the constant first.
        "hw.device.programming.sigma": Any,
        # Where the numbers come from.
        "hw.device.programming.source": Any,
        # How far to trust the numbers.
        "hw.device.programming.kind": Literal["measured", "fitted", "assumed"],
        # Seconds after programming that levels are of, as they are loaded or learnt. [s]
        "hw.device.drift.start_s": float,
        # Mean exponent: a number, or slope, offset, least and most of `clamp(slope ln g + offset, least, most)`, g the conductance as a share of the greatest.
        "hw.device.drift.exponent": Any,
        # Its standard deviation from cell to cell, in the same form.
        "hw.device.drift.exponent_spread": Any,
        # Mean change a decade of time, in shares of the greatest conductance.
        "hw.device.drift.change": Any,
        # Its standard deviation from cell to cell.
        "hw.device.drift.change_spread": Any,
        # Seconds from one write of an array to the next while a net learns: levels drift meanwhile, each since the write that last pulsed its cell. [s]
        "hw.device.drift.update_s": float,
        # Writes of an array from one look to the next: levels are brought to where they have drifted to. [writes]
        "hw.device.drift.every": int,
        # Where the numbers come from.
        "hw.device.drift.source": Any,
        # How far to trust the numbers.
        "hw.device.drift.kind": Literal["measured", "fitted", "assumed"],
        # Pulses that a cell takes before it moves no more: of the cell in the middle, where they differ. A load counts as a pulse. [pulses]
        "hw.device.endurance.pulses": float,
        # Standard deviation of the logarithm of that number, from cell to cell.
        "hw.device.endurance.spread": float,
        # Where a cell stays that is worn out.
        "hw.device.endurance.worn": Literal["level", "floor", "ceiling"],
        # Where the numbers come from.
        "hw.device.endurance.source": Any,
        # How far to trust the numbers.
        "hw.device.endurance.kind": Literal["measured", "fitted", "assumed"],
        # Writes of an array after which a cell that is not pulsed has lost 1 - 1/e of its distance to where it rests. [writes]
        "hw.device.leakage.lifetime": float,
        # Writes of an array from one look to the next: what was lost in between is taken off at once. [writes]
        "hw.device.leakage.every": int,
        # Where cells come to rest: 0 is the floor, 1 the ceiling of a cell. [windows]
        "hw.device.leakage.rest": float,
        # Standard deviation of what is lost, from cell to cell, in parts of the mean.
        "hw.device.leakage.spread": float,
        # Where the numbers come from.
        "hw.device.leakage.source": Any,
        # How far to trust the numbers.
        "hw.device.leakage.kind": Literal["measured", "fitted", "assumed"],
        # Megahertz of the clock that counts cycles. [MHz]
        "hw.timing.clock_mhz": float,
        # `T_A`: cycles to settle and sample; with `pulse_width`, cycles beside the slots of a phase. [cycles] Default: 1.
        "hw.timing.settle_cycles": int,
        # `T_C`: cycles of a conversion of `fixed` converters; others have `adc.step_cycles`. [cycles] Default: 1.
        "hw.timing.convert_cycles": int,
        # `S`: columns of a bank that share a converter. [columns] Default: 1.
        "hw.timing.columns_per_adc": int,
        # Whether a slice settles while the one before is converted. Default: false.
        "hw.timing.overlap": bool,
        # `U`: columns looked up, multiplied or accumulated at a time. [columns] Default: 1.
        "hw.timing.lanes": int,
        # `H`: cycles before the first error word arrives. [cycles] Default: 0.
        "hw.timing.bus_hops": int,
        # `T_W`: cycles of a pulse. [cycles] Default: 1.
        "hw.timing.pulse_cycles": int,
        # How many pulses a number of levels takes. Default: "unary".
        "hw.timing.pulses": Literal["unary", "amplitude"],
        # Whether every pulse is followed by a read of what it did. Default: false.
        "hw.timing.verify": bool,
        # `W`: cells that can be pulsed at a time. [cells]
        "hw.timing.write_active_max": int,
        # Cycles of a digital action: 1, or the symbols of a digital clock on an optical chip. [cycles] Default: 1.
        "hw.timing.beat_cycles": int,
        # Where the numbers come from.
        "hw.timing.source": Any,
        # How far to trust the numbers.
        "hw.timing.kind": Literal["measured", "fitted", "assumed"],
        # The least that is credible.
        "hw.energy.*.low": Any,
        # What is reckoned with.
        "hw.energy.*.typical": Any,
        # The most that is credible.
        "hw.energy.*.high": Any,
        # Where the numbers come from.
        "hw.energy.*.source": Any,
        # How far to trust the numbers.
        "hw.energy.*.kind": Literal["measured", "fitted", "assumed"],
        # How it follows the settings it belongs to: a law (`walden`, `linear`, ...), or one a setting.
        "hw.energy.*.scales": Any,
        # Settings it stands for, where they are not those of its model.
        "hw.energy.*.at": Any,
        # Nanometres of the node it is of, where it is not the model's.
        "hw.energy.*.node_nm": Any,
        # An event `dac_slices`; on any chip it lies in 1e-17 to 1e-10 J: a 1-bit driver takes 0.4 pJ in 100 ns, an 8-bit one at 14 GS/s 3.6 pJ; a public table has 0.5 nJ by a missing 1e-3
        "hw.energy.dac_slice_{aj|fj|pj|nj|uj}": Any,
        # An event `cell_reads`; on any chip it lies in 1e-18 to 1e-10 J: V^2 G t lies between 0.1 V, 10 nS, 1 ns and 0.5 V, 0.2 mS, 1 us
        "hw.energy.cell_read_{aj|fj|pj|nj|uj}": Any,
        # An event `holds`; on any chip it lies in 1e-18 to 1e-12 J: C V^2 of some femtofarads
        "hw.energy.hold_{aj|fj|pj|nj|uj}": Any,
        # An event `conversions`; on any chip it lies in 1e-14 to 1e-10 J: published converters of 4 to 9 bits lie between 0.05 and 20 pJ
        "hw.energy.conversion_{aj|fj|pj|nj|uj}": Any,
        # An event `shift_adds`; on any chip it lies in 1e-16 to 1e-11 J: an adder of 8 to 32 bits takes 1 fJ to 1 pJ
        "hw.energy.shift_add_{aj|fj|pj|nj|uj}": Any,
        # An event `look_ups`; on any chip it lies in 1e-16 to 1e-10 J: a read of a small memory
        "hw.energy.look_up_{aj|fj|pj|nj|uj}": Any,
        # An event `multiplies`; on any chip it lies in 1e-16 to 1e-11 J: 8 x 8 bits take 10 fJ to 0.4 pJ
        "hw.energy.multiply_{aj|fj|pj|nj|uj}": Any,
        # An event `bus_words`; on any chip it lies in 1e-16 to 1e-10 J: 8 wires over up to centimetres, 0.1 pJ a bit and millimetre
        "hw.energy.bus_word_{aj|fj|pj|nj|uj}": Any,
        # An event `accumulates`; on any chip it lies in 1e-16 to 1e-11 J: a multiplication and an addition, without the memory
        "hw.energy.accumulate_{aj|fj|pj|nj|uj}": Any,
        # An event `delta_computations`; on any chip it lies in 1e-16 to 1e-11 J: a shift, an addition of a random word and a clamp
        "hw.energy.delta_{aj|fj|pj|nj|uj}": Any,
        # An event `cell_loads`; on any chip it lies in 1e-18 to 1e-6 J: one gate charge, or a hundred verified pulses of phase change
        "hw.energy.cell_load_{aj|fj|pj|nj|uj}": Any,
        # An event `pulses_attempted`; on any chip it lies in 1e-18 to 1e-7 J: from a FeFET's gate charge (35 aJ) to a phase-change pulse (29 nJ)
        "hw.energy.cell_pulse_{aj|fj|pj|nj|uj}": Any,
        # An event `row_pulses`; on any chip it lies in 1e-16 to 1e-8 J: C V^2 of a row line and of the columns it crosses
        "hw.energy.row_pulse_{aj|fj|pj|nj|uj}": Any,
        # An event `verify_reads`; on any chip it lies in 1e-18 to 1e-9 J: a read of one cell with its conversion
        "hw.energy.verify_read_{aj|fj|pj|nj|uj}": Any,
        # An event `sram_bits`; on any chip it lies in 1e-17 to 1e-11 J: 7 fJ (2 Mb at 7 nm) to 160 fJ (8 KB at 45 nm) a bit
        "hw.energy.sram_bit_{aj|fj|pj|nj|uj}": Any,
        # An event `squares`; on any chip it lies in 1e-14 to 1e-10 J: a product of 32 bits and an addition of 64
        "hw.energy.square_{aj|fj|pj|nj|uj}": Any,
        # An event `roots`; on any chip it lies in 1e-14 to 1e-9 J: a root and a division, bit by bit
        "hw.energy.root_{aj|fj|pj|nj|uj}": Any,
        # An event `scalings`; on any chip it lies in 1e-14 to 1e-10 J: a product of 32 and 46 bits, and a shift
        "hw.energy.scaling_{aj|fj|pj|nj|uj}": Any,
        # An event `row_means`; on any chip it lies in 1e-16 to 1e-11 J: a product, a shift and an addition
        "hw.energy.row_mean_{aj|fj|pj|nj|uj}": Any,
        # An event `sum_squares`; on any chip it lies in 1e-14 to 1e-10 J: a product of 32 bits and an addition of more than 64
        "hw.energy.sum_square_{aj|fj|pj|nj|uj}": Any,
        # An event `optimiser_steps`; on any chip it lies in 1e-16 to 1e-11 J: a comparison, a random word and a pulse or none; more with words of its own
        "hw.energy.optimiser_step_{aj|fj|pj|nj|uj}": Any,
        # An event `pooled`; on any chip it lies in 1e-16 to 1e-11 J: an addition or a comparison of 8 to 16 bits
        "hw.energy.pooling_{aj|fj|pj|nj|uj}": Any,
        # An event `threshold_subtractions`; on any chip it lies in 1e-16 to 1e-11 J: a register of 32 bits is read, and a subtraction of 32 bits
        "hw.energy.threshold_subtraction_{aj|fj|pj|nj|uj}": Any,
        # An event `statistic_adds`; on any chip it lies in 1e-16 to 1e-11 J: an addition to a register of 64 bits, and a square of 10 bits for a gain
        "hw.energy.statistic_add_{aj|fj|pj|nj|uj}": Any,
        # An event `softmax_look_ups`; on any chip it lies in 1e-16 to 1e-11 J: an entry of 8 to 16 bits out of a table of 1,024
        "hw.energy.softmax_look_up_{aj|fj|pj|nj|uj}": Any,
        # The chip; on any chip it lies in 1e-9 to 1e3 W: leakage, clocks and references of a chip
        "hw.power.static_{nw|uw|mw|w}": Any,
        # A tile in use; on any chip it lies in 1e-12 to 1e2 W: leakage and bias of a tile
        "hw.power.tile_static_{nw|uw|mw|w}": Any,
        # A tile in use; on any chip it lies in 1e-6 to 1e2 W: light for a tile, at the wall plug
        "hw.power.laser_{nw|uw|mw|w}": Any,
        # A cell of the network; on any chip it lies in 1e-12 to 1e-1 W: a micro-mechanical shifter holds with nanowatts, a thermal one with 30 mW
        "hw.power.heater_{nw|uw|mw|w}": Any,
        # A column of a bank of a tile in use; on any chip it lies in 1e-9 to 1e-1 W: a photodiode and its amplifier take some milliwatts
        "hw.power.receiver_{nw|uw|mw|w}": Any,
        # A cell of the network; on any chip it lies in 1e-16 to 1e-7 m2: from 10 nm squared to an interferometer
        "hw.area.cell_{um2|mm2}": Any,
        # A converter of a tile in use; on any chip it lies in 1e-12 to 1e-6 m2: published converters take 500 to 10000 um2
        "hw.area.adc_{um2|mm2}": Any,
        # A row driver of a bank of a tile in use; on any chip it lies in 1e-13 to 1e-6 m2: a driver of one bit up to a fast 8-bit converter
        "hw.area.dac_{um2|mm2}": Any,
        # A tile in use; on any chip it lies in 1e-12 to 1e-4 m2: what a tile has beside cells and converters
        "hw.area.tile_{um2|mm2}": Any,
    },
    total=False,
)
