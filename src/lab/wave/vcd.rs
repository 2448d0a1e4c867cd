//! Registers of a tile as a value change dump. Only what changed in a cycle is written.

use vcd::{IdCode, TimescaleUnit, Value, VarType};

use super::NUMBERS_MAX;

/// A register: its names in the file and what it held last.
struct Register {
    codes: Vec<IdCode>,
    width: usize,
    last: Vec<Option<i64>>,
}

/// Writes a dump, cycle by cycle.
pub(super) struct Writer {
    out: vcd::Writer<Vec<u8>>,
    registers: Option<Vec<Option<Register>>>,
    clock: Option<IdCode>,
    /// Picoseconds of a cycle.
    period: u64,
    all: bool,
}

impl Writer {
    pub(super) fn new(clock_khz: u64, all: bool) -> Self {
        let period = (1_000_000_000 / clock_khz.max(1)).max(2);
        Self { out: vcd::Writer::new(Vec::new()), registers: None, clock: None, period, all }
    }

    /// One cycle has ended, with these registers.
    pub(super) fn cycle(&mut self, cycle: u64, registers: &[(&'static str, Vec<i64>)]) {
        self.write(cycle, registers).expect("memory takes what is written");
    }

    fn write(&mut self, cycle: u64, registers: &[(&'static str, Vec<i64>)]) -> std::io::Result<()> {
        if self.registers.is_none() {
            self.header(registers)?;
        }
        let clock = self.clock.expect("made with the header");
        self.out.timestamp(cycle * self.period)?;
        self.out.change_scalar(clock, Value::V1)?;
        let known = self.registers.as_mut().expect("made with the header");
        for (register, (_, numbers)) in known.iter_mut().zip(registers) {
            let Some(register) = register else { continue };
            for ((code, last), &number) in
                register.codes.iter().zip(&mut register.last).zip(numbers)
            {
                if *last != Some(number) {
                    *last = Some(number);
                    let bit = |bit: usize| Value::from(number >> bit & 1 == 1);
                    if register.width == 1 {
                        self.out.change_scalar(*code, bit(0))?;
                    } else {
                        self.out.change_vector(*code, (0..register.width).rev().map(bit))?;
                    }
                }
            }
        }
        self.out.timestamp(cycle * self.period + self.period / 2)?;
        self.out.change_scalar(clock, Value::V0)
    }

    fn header(&mut self, registers: &[(&'static str, Vec<i64>)]) -> std::io::Result<()> {
        self.out.comment("registers of docs/TILE.md; a number is in two's complement")?;
        self.out.timescale(1, TimescaleUnit::PS)?;
        self.out.add_module("tile")?;
        self.clock = Some(self.out.add_wire(1, "clock")?);
        let mut known = Vec::new();
        for (name, numbers) in registers {
            if numbers.len() > NUMBERS_MAX && !self.all {
                known.push(None);
                continue;
            }
            let width = width(name);
            let mut codes = Vec::new();
            for at in 0..numbers.len() {
                let name = if numbers.len() == 1 { (*name).into() } else { format!("{name}_{at}") };
                codes.push(self.out.add_var(
                    VarType::Reg,
                    u32::try_from(width).expect("few bits"),
                    &name,
                    None,
                )?);
            }
            known.push(Some(Register { last: vec![None; numbers.len()], codes, width }));
        }
        self.registers = Some(known);
        self.out.upscope()?;
        self.out.enddefinitions()
    }

    /// The text so far.
    pub(super) fn finish(&mut self) -> Vec<u8> {
        std::mem::take(self.out.writer())
    }
}

/// Bits of a register in the file.
fn width(name: &str) -> usize {
    match name {
        _ if name.ends_with("busy") || name.starts_with("pruned") || name == "tree_valid" => 1,
        "drive_e" | "drive_i" | "value" | "slope" | "pulse_e" | "pulse_i" | "gate" => 8,
        "level_e" | "level_i" => 12,
        "error" => 16,
        _ => 32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vcd::Command;

    #[test]
    fn what_is_written_is_read_back_with_its_times_and_signs() {
        let mut writer = Writer::new(1_000_000, false);
        let registers = |gate: i64, busy: i64| {
            vec![("gate", vec![gate, 3]), ("err_busy", vec![busy]), ("sum_e", vec![0; 600])]
        };
        writer.cycle(1, &registers(-2, 0));
        writer.cycle(2, &registers(-2, 1));
        let bytes = writer.finish();
        let mut parser = vcd::Parser::new(&bytes[..]);
        let header = parser.parse_header().unwrap();
        let gate = header.find_var(&["tile", "gate_0"]).unwrap().code;
        let busy = header.find_var(&["tile", "err_busy"]).unwrap().code;
        assert!(header.find_var(&["tile", "sum_e_0"]).is_none(), "too large to be shown");
        let (mut time, mut seen) = (0, vec![]);
        for command in parser.map(Result::unwrap) {
            match command {
                Command::Timestamp(at) => time = at,
                Command::ChangeVector(code, bits) if code == gate => {
                    seen.push((time, bits.to_string()));
                }
                Command::ChangeScalar(code, bit) if code == busy => {
                    seen.push((time, bit.to_string()));
                }
                _ => {}
            }
        }
        let text = |at: u64, what: &str| (at, what.to_owned());
        assert_eq!(seen, [text(1000, "11111110"), text(1000, "0"), text(2000, "1")]);
    }
}
