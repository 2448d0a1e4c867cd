//! The verilated tile behind its C interface (hw_models/rtl/shim.cpp).
//!
//! One function is seen from outside for each size; it returns a table of the others. The models are linked into this
//! test. `ED_TILE_LIBRARY` names a shared library whose model of size 8 stands in for the linked one, such as one with a
//! seeded fault; sizes it does not hold are then left out.

use std::env;
use std::ffi::{CStr, CString, c_char, c_int, c_void};

use dalean::chip::engine::tick::{Command, TileAdc, TileConfig};

/// The tile on the other side; never looked into.
#[repr(C)]
struct Raw {
    _private: [u8; 0],
}

#[repr(C)]
struct Inputs {
    valid: u32,
    op: u32,
    row: u32,
    slot: u32,
    shift: u32,
    code: [u32; 2],
    bus_word: i32,
    level: [*const u16; 2],
    dither: [*const u16; 2],
}

/// What the ports of the tile say in a cycle.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Outputs {
    pub(crate) ready: u32,
    pub(crate) bus_index: u32,
    pub(crate) dither_row: u32,
    pub(crate) dither_wanted: u32,
}

/// What shim.cpp gives, in its order.
#[repr(C)]
struct Functions {
    create: unsafe extern "C" fn() -> *mut Raw,
    destroy: unsafe extern "C" fn(*mut Raw),
    reset: unsafe extern "C" fn(*mut Raw),
    configure: unsafe extern "C" fn(*mut Raw, u32, u32),
    write_table: unsafe extern "C" fn(*mut Raw, u32, u32, u32),
    set_inputs: unsafe extern "C" fn(*mut Raw, *const Inputs, *mut Outputs),
    edge: unsafe extern "C" fn(*mut Raw),
    layout: unsafe extern "C" fn(*const Raw) -> *const c_char,
    read_registers: unsafe extern "C" fn(*const Raw, *mut i64),
    write_threshold: unsafe extern "C" fn(*mut Raw, u32, i64),
}

type Entry = unsafe extern "C" fn() -> *const Functions;

unsafe extern "C" {
    fn ed_tile_8x8() -> *const Functions;
    fn ed_tile_16x16() -> *const Functions;
    fn ed_tile_64x64() -> *const Functions;
}

#[link(name = "dl")]
unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// Functions of the model of a size; `None` where there is no such model.
fn functions(size: usize) -> Option<&'static Functions> {
    let entry: Entry = match (env::var_os("ED_TILE_LIBRARY"), size) {
        (Some(path), 8) => {
            let path = CString::new(path.into_encoded_bytes()).expect("a path holds no zero");
            let now = 2; // RTLD_NOW
            // SAFETY: the path ends in a zero, and the library only holds a model, which does nothing when loaded.
            let library = unsafe { dlopen(path.as_ptr(), now) };
            assert!(!library.is_null(), "{path:?} can be loaded");
            // SAFETY: the library is open, and stays so; the name ends in a zero.
            let found = unsafe { dlsym(library, c"ed_tile_8x8".as_ptr()) };
            assert!(!found.is_null(), "the library holds a tile of size 8");
            // SAFETY: shim.cpp defines that name as a function of this type, and a pointer to it is not null.
            unsafe { std::mem::transmute::<*mut c_void, Entry>(found) }
        }
        (None, 8) => ed_tile_8x8,
        (None, 16) => ed_tile_16x16,
        (None, 64) => ed_tile_64x64,
        _ => return None,
    };
    // SAFETY: the function takes nothing and returns the address of a constant of its model.
    let functions = unsafe { entry() };
    // SAFETY: that constant lives as long as the program, and `Functions` here repeats its layout.
    Some(unsafe { &*functions })
}

/// A verilated tile.
pub(crate) struct Rtl {
    functions: &'static Functions,
    raw: *mut Raw,
    columns: usize,
    /// Levels of a row, and draws, at the full width of the ports.
    ports: [Vec<u16>; 4],
    /// All registers, as last read.
    pub(crate) registers: Vec<i64>,
    /// Names and lengths of the registers, in their order.
    pub(crate) layout: Vec<(String, usize)>,
}

impl Rtl {
    /// A tile after reset; `None` where there is no model of the size.
    pub(crate) fn new(size: usize) -> Option<Self> {
        let functions = functions(size)?;
        // SAFETY: takes nothing; what it returns is destroyed once, in `drop`.
        let raw = unsafe { (functions.create)() };
        // SAFETY: `raw` is a live tile; the text lives until this thread asks again, and is copied before.
        let text = unsafe { CStr::from_ptr((functions.layout)(raw)) };
        let line = |line: &str| {
            let (name, length) = line.split_once(' ').expect("a name and a length");
            (name.to_owned(), length.parse().expect("a number"))
        };
        let layout: Vec<_> = text.to_str().expect("names are ASCII").lines().map(line).collect();
        let registers = vec![0; layout.iter().map(|(_, length)| length).sum()];
        let ports = std::array::from_fn(|_| vec![0; size]);
        Some(Self { functions, raw, columns: size, ports, registers, layout })
    }

    /// A cycle of reset; configuration and table stay.
    pub(crate) fn reset(&mut self) {
        // SAFETY: `raw` is a live tile that only this value reaches.
        unsafe { (self.functions.reset)(self.raw) }
    }

    /// Writes all configuration registers, thresholds and the table. The tile has to be idle.
    pub(crate) fn configure(&mut self, config: &TileConfig, table: &[[u8; 2]]) {
        for (address, value) in (0..).zip(configuration(config)) {
            // SAFETY: `raw` is a live tile that only this value reaches; the port cuts what it is given.
            unsafe { (self.functions.configure)(self.raw, address, value) }
        }
        let balance = config.more.balance.as_ref();
        for column in 0..self.columns {
            let thresholds = balance.map_or(&[][..], |balance| &balance.thresholds);
            let threshold = thresholds.get(column).copied().unwrap_or(0);
            // SAFETY: as above.
            unsafe { (self.functions.write_threshold)(self.raw, narrow(column), threshold) }
        }
        for (address, [value, slope]) in (0..).zip(table) {
            let (value, slope) = (u32::from(*value), u32::from(*slope));
            // SAFETY: as above.
            unsafe { (self.functions.write_table)(self.raw, address, value, slope) }
        }
    }

    /// Puts a cycle's inputs on the ports, and returns what the outputs then say.
    pub(crate) fn set_inputs(
        &mut self,
        command: Option<&Command<'_>>,
        bus_word: i16,
        dither: [&[u16]; 2],
    ) -> Outputs {
        let mut inputs = Inputs {
            valid: command.is_some().into(),
            op: 0,
            // what a command has no field for carries something all the same
            row: 1,
            slot: 2,
            shift: 5,
            code: [0xa5, 0x5a],
            bus_word: bus_word.into(),
            level: [std::ptr::null(); 2],
            dither: [std::ptr::null(); 2],
        };
        for (port, draws) in self.ports[2..].iter_mut().zip(dither) {
            port.copy_from_slice(draws);
        }
        match command {
            None => {}
            Some(Command::LoadWeights { row, levels }) => {
                inputs.row = narrow(*row);
                for (port, levels) in self.ports[..2].iter_mut().zip(levels) {
                    // so do the columns that are not in use
                    port.fill(0xabc);
                    port[..levels.len()].copy_from_slice(levels);
                }
            }
            Some(Command::LoadDrives { row, slot, codes }) => {
                inputs.op = 1;
                inputs.row = narrow(*row);
                inputs.slot = narrow(*slot);
                inputs.code = codes.map(u32::from);
            }
            Some(Command::Forward { slot }) => (inputs.op, inputs.slot) = (2, narrow(*slot)),
            Some(Command::Error { slot }) => (inputs.op, inputs.slot) = (3, narrow(*slot)),
            Some(Command::Now { slot, shift }) => {
                (inputs.op, inputs.slot, inputs.shift) = (4, narrow(*slot), *shift);
            }
            Some(Command::Add { slot }) => (inputs.op, inputs.slot) = (5, narrow(*slot)),
            Some(Command::Write { shift }) => (inputs.op, inputs.shift) = (6, *shift),
            Some(Command::Columns { .. }) => panic!("the RTL tile reads rows only"),
        }
        let [level_e, level_i, dither_e, dither_i] = &self.ports;
        assert!(self.ports.iter().all(|port| port.len() == self.columns), "ports keep their width");
        inputs.level = [level_e.as_ptr(), level_i.as_ptr()];
        inputs.dither = [dither_e.as_ptr(), dither_i.as_ptr()];
        let mut outputs = Outputs::default();
        // SAFETY: `raw` is a live tile that only this value reaches; each of the four pointers leads to as many numbers
        // as the model has columns, which `ports` keeps for the length of the call.
        unsafe { (self.functions.set_inputs)(self.raw, &raw const inputs, &raw mut outputs) }
        outputs
    }

    /// An edge of the clock.
    pub(crate) fn edge(&mut self) {
        // SAFETY: `raw` is a live tile that only this value reaches.
        unsafe { (self.functions.edge)(self.raw) }
    }

    /// Reads all registers into `registers`.
    pub(crate) fn read_registers(&mut self) {
        // SAFETY: `raw` is a live tile; `registers` has the length that its layout names, which is what is written.
        unsafe { (self.functions.read_registers)(self.raw, self.registers.as_mut_ptr()) }
    }
}

impl Drop for Rtl {
    fn drop(&mut self) {
        // SAFETY: `raw` came from `create`, and nothing uses it after this.
        unsafe { (self.functions.destroy)(self.raw) }
    }
}

fn narrow<T: TryInto<u32>>(number: T) -> u32 {
    number.try_into().ok().expect("configurations and places are small")
}

/// Configuration registers in the order of docs/TILE.md, section 1.
fn configuration(config: &TileConfig) -> [u32; 27] {
    let (adc, adc_bits, adc_shift) = match config.adc {
        TileAdc::Ideal => (0, 2, 0),
        TileAdc::Digital { bits, shift } => (1, bits, shift),
        TileAdc::Current { bits, shift } => (2, bits, shift),
    };
    // six bits with a sign: the port cuts it
    let lut_shift =
        config.more.balance.as_ref().map_or(config.lut_shift, |own| own.shift.cast_unsigned());
    [
        narrow(config.rows),
        narrow(config.columns),
        narrow(config.settle),
        narrow(config.convert),
        narrow(config.share),
        config.overlap.into(),
        config.slices,
        config.dac_bits,
        narrow(config.tree),
        narrow(config.lanes),
        narrow(config.hops),
        narrow(config.words),
        narrow(config.tap_base),
        narrow(config.pulse),
        adc,
        adc_bits,
        adc_shift,
        config.lut_bits,
        lut_shift,
        config.error_bits,
        config.negate.into(),
        narrow(config.mantissa),
        config.dither_bits,
        narrow(config.increment_max),
        config.floor.into(),
        config.ceiling.into(),
        config.absorbing.into(),
    ]
}
