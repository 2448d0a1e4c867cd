//! NumPy arrays as numbers of the chip, and back.
//!
//! ```text
//! codes    uint8, other whole numbers: as they are.   floats: floor( x code_max + 1/2 ), x from 0 to 1
//! signed   the same of |x|, in a first phase where x lies above 0, else in a second
//! words    whole numbers
//! ```
//!
//! Whatever an array is like (strides, order of bytes, read-only), it is read as its numbers say, or refused.

use numpy::{Element, PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyAny;

use crate::errors::wrong;

/// Any object as an array of any kind.
fn array<'py>(x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = x.py().import("numpy")?;
    numpy.getattr("asarray")?.call1((x,))
}

/// The numbers of an array in C order, and its shape, if it has this kind.
fn numbers<T: Element + Copy>(x: &Bound<'_, PyAny>) -> Option<PyResult<(Vec<T>, Vec<usize>)>> {
    let array = x.cast::<PyArrayDyn<T>>().ok()?;
    let shape = array.shape().to_vec();
    let read = match array.try_readonly() {
        Ok(read) => read,
        Err(error) => return Some(Err(wrong("an array", &error.to_string(), "give a copy"))),
    };
    if array.is_c_contiguous()
        && let Ok(numbers) = read.as_slice()
    {
        return Some(Ok((numbers.to_vec(), shape)));
    }
    // with strides or out of line: NumPy puts it in order
    Some(in_order(x).and_then(|copy| {
        let copy = copy.cast_into::<PyArrayDyn<T>>()?;
        Ok((copy.try_readonly()?.as_slice()?.to_vec(), shape))
    }))
}

/// Flags of an array of them, whatever bytes it holds.
fn truths(x: &Bound<'_, PyAny>) -> Option<PyResult<(Vec<bool>, Vec<usize>)>> {
    let _ = x.cast::<PyArrayDyn<bool>>().ok()?;
    let bytes = match x.call_method1("view", ("uint8",)) {
        Ok(bytes) => numbers::<u8>(&bytes)?,
        Err(error) => Err(error),
    };
    Some(bytes.map(|(bytes, shape)| (bytes.into_iter().map(|byte| byte != 0).collect(), shape)))
}

/// A copy in C order.
fn in_order<'py>(x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let options = pyo3::types::PyDict::new(x.py());
    options.set_item("order", "C")?;
    x.py().import("numpy")?.getattr("array")?.call((x,), Some(&options))
}

/// What NumPy calls the kind of an array.
fn kind(x: &Bound<'_, PyAny>) -> String {
    x.getattr("dtype").map_or_else(|_| "?".into(), |kind| kind.to_string())
}

/// The same array as another kind, if NumPy says that every number of its kind fits it.
fn cast<'py>(x: &Bound<'py, PyAny>, kind: &str) -> PyResult<Bound<'py, PyAny>> {
    let options = pyo3::types::PyDict::new(x.py());
    options.set_item("casting", "safe")?;
    x.call_method("astype", (kind,), Some(&options))
}

/// Whole numbers of any kind, and their shape.
pub(crate) fn wholes(what: &str, x: &Bound<'_, PyAny>) -> PyResult<(Vec<i64>, Vec<usize>)> {
    if let Some(words) = numbers::<i16>(x) {
        let (words, shape) = words?;
        return Ok((words.into_iter().map(i64::from).collect(), shape));
    }
    let x = array(x)?;
    if let Some(numbers) = numbers::<i64>(&x) {
        return numbers;
    }
    let found = format!("are {}", kind(&x));
    let allowed = "give whole numbers, such as numpy.int16";
    let Ok(cast) = cast(&x, "int64") else { return Err(wrong(what, &found, allowed)) };
    numbers::<i64>(&cast).unwrap_or_else(|| Err(wrong(what, &found, allowed)))
}

fn bytes(what: &str, numbers: &[i64], most: u8) -> PyResult<Vec<u8>> {
    let byte = |(at, &number): (usize, &i64)| {
        u8::try_from(number).ok().filter(|&byte| byte <= most).ok_or_else(|| {
            let found = format!("hold {number} as number {at}");
            wrong(what, &found, &format!("whole numbers lie in 0..={most}"))
        })
    };
    numbers.iter().enumerate().map(byte).collect()
}

fn fractions<F: Copy + Into<f64>>(what: &str, numbers: &[F], most: u8) -> PyResult<Vec<u8>> {
    let code = |(at, &number): (usize, &F)| {
        let number: f64 = number.into();
        if !(0.0..=1.0).contains(&number) {
            let found = format!("hold {number} as number {at}");
            let allowed = "floats lie in 0 to 1: scale them, or give drive codes as numpy.uint8";
            return Err(wrong(what, &found, allowed));
        }
        // whole, and at most `most`
        Ok((number * f64::from(most) + 0.5).floor() as u8)
    };
    numbers.iter().enumerate().map(code).collect()
}

/// Drive codes of at most `most`, and their shape.
pub(crate) fn codes(what: &str, x: &Bound<'_, PyAny>, most: u8) -> PyResult<(Vec<u8>, Vec<usize>)> {
    // what is given most often comes first
    if let Some(codes) = numbers::<u8>(x) {
        return codes;
    }
    let x = array(x)?;
    if let Some(codes) = numbers::<u8>(&x) {
        return codes;
    }
    if let Some(numbers) = numbers::<f32>(&x) {
        let (numbers, shape) = numbers?;
        return Ok((fractions(what, &numbers, most)?, shape));
    }
    if let Some(numbers) = numbers::<f64>(&x) {
        let (numbers, shape) = numbers?;
        return Ok((fractions(what, &numbers, most)?, shape));
    }
    if let Some(flags) = truths(&x) {
        let (flags, shape) = flags?;
        return Ok((flags.into_iter().map(|flag| u8::from(flag) * most).collect(), shape));
    }
    if let Ok(cast) = cast(&x, "int64") {
        let (numbers, shape) = wholes(what, &cast)?;
        return Ok((bytes(what, &numbers, most)?, shape));
    }
    // other floats, such as halves
    if let Some((numbers, shape)) = cast(&x, "float64").ok().and_then(|x| numbers::<f64>(&x)?.ok())
    {
        return Ok((fractions(what, &numbers, most)?, shape));
    }
    let allowed = "give drive codes as numpy.uint8, or floats from 0 to 1";
    Err(wrong(what, &format!("are {}", kind(&x)), allowed))
}

/// Numbers with a sign, whole ones up to `most` or floats up to 1, as whole numbers up to `most`, and their shape.
pub(crate) fn signed(
    what: &str,
    x: &Bound<'_, PyAny>,
    most: u8,
) -> PyResult<(Vec<i64>, Vec<usize>)> {
    let (x, most) = (array(x)?, i64::from(most));
    if let Ok(cast) = cast(&x, "int64") {
        let (numbers, shape) = wholes(what, &cast)?;
        return match numbers.iter().position(|&number| !(-most..=most).contains(&number)) {
            None => Ok((numbers, shape)),
            Some(at) => {
                let found = format!("hold {} as number {at}", numbers[at]);
                Err(wrong(what, &found, &format!("whole numbers lie in -{most}..={most}")))
            }
        };
    }
    let Some(floats) = cast(&x, "float64").ok().and_then(|x| numbers::<f64>(&x)) else {
        let allowed = "give floats from -1 to 1, or whole numbers";
        return Err(wrong(what, &format!("are {}", kind(&x)), allowed));
    };
    let (floats, shape) = floats?;
    let code = |(at, &number): (usize, &f64)| {
        if !(-1.0..=1.0).contains(&number) {
            let found = format!("hold {number} as number {at}");
            return Err(wrong(what, &found, "floats lie in -1 to 1: scale them"));
        }
        // whole, and at most `most`
        let size = (number.abs() * most as f64 + 0.5).floor() as i64;
        Ok(if number < 0.0 { -size } else { size })
    };
    Ok((floats.iter().enumerate().map(code).collect::<PyResult<_>>()?, shape))
}

/// Codes of numbers with a sign: of each sample what lies above 0, then what lies below.
pub(crate) fn two_phases(numbers: &[i64], width: usize) -> Vec<u8> {
    let phase = |sample: &[i64], sign: i64| -> Vec<u8> {
        let side = |&number: &i64| u8::try_from((sign * number).max(0)).expect("at most a code");
        sample.iter().map(side).collect()
    };
    let both = |sample: &[i64]| [phase(sample, 1), phase(sample, -1)].concat();
    numbers.chunks_exact(width).flat_map(both).collect()
}

/// Numbers of any kind as doubles, and how many there are.
pub(crate) fn reals(what: &str, x: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    if let Some(numbers) = numbers::<f32>(x) {
        return Ok(numbers?.0.into_iter().map(f64::from).collect());
    }
    if let Some(numbers) = numbers::<f64>(x) {
        return Ok(numbers?.0);
    }
    let x = array(x)?;
    let found = || format!("are {}", kind(&x));
    let allowed = "give numbers";
    let cast = cast(&x, "float64").or_else(|_| cast_same(&x));
    let Ok(cast) = cast else { return Err(wrong(what, &found(), allowed)) };
    match numbers::<f64>(&cast) {
        Some(numbers) => Ok(numbers?.0),
        None => Err(wrong(what, &found(), allowed)),
    }
}

/// 64-bit whole numbers as doubles: rewards of an environment, which are small.
fn cast_same<'py>(x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let options = pyo3::types::PyDict::new(x.py());
    options.set_item("casting", "same_kind")?;
    x.call_method("astype", ("float64",), Some(&options))
}

/// Flags, one an environment.
pub(crate) fn flags(what: &str, x: &Bound<'_, PyAny>) -> PyResult<Vec<bool>> {
    if let Some(flags) = truths(x) {
        return Ok(flags?.0);
    }
    let x = array(x)?;
    match truths(&x) {
        Some(flags) => Ok(flags?.0),
        None => Err(wrong(what, &format!("are {}", kind(&x)), "give True or False of each")),
    }
}

/// Numbers as an array `[sample][unit]`.
pub(crate) fn table<'py, T: Element>(
    py: Python<'py>,
    numbers: Vec<T>,
    shape: [usize; 2],
) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape)?.into_any())
}

/// The samples of an array of `width` numbers each; one sample may come without its axis.
pub(crate) fn rows(what: &str, shape: &[usize], width: usize) -> PyResult<usize> {
    match *shape {
        [samples, columns] if columns == width => Ok(samples),
        [columns] if columns == width => Ok(1),
        _ => {
            let found = format!("have the shape {shape:?}");
            Err(wrong(what, &found, &format!("give an array of shape [samples, {width}]")))
        }
    }
}
