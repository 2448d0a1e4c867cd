//! Tests of arrays: every type, every order, every lie of a header.

use proptest::prelude::*;

use super::*;

/// A version 1 file.
pub(crate) fn file(descr: &str, fortran: &str, shape: &str, elements: &[u8]) -> Vec<u8> {
    let dict = format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}\n");
    let length = u16::try_from(dict.len()).unwrap().to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], dict.as_bytes(), elements].concat()
}

fn values(descr: &str, elements: &[u8], count: usize) -> Result<Vec<u8>, String> {
    let bytes = file(descr, "False", &format!("({count},)"), elements);
    super::values(&bytes, 255).map(|a| a.data).map_err(|e| e.to_string())
}

#[test]
fn integers_of_every_width_and_end_are_read() {
    assert_eq!(values("'|u1'", &[0, 255], 2), Ok(vec![0, 255]));
    assert_eq!(values("'|b1'", &[0, 1], 2), Ok(vec![0, 1]));
    assert_eq!(values("'<i2'", &[3, 0, 255, 0], 2), Ok(vec![3, 255]));
    assert_eq!(values("'>i2'", &[0, 3, 0, 255], 2), Ok(vec![3, 255]));
    assert_eq!(values("'<i8'", &7i64.to_le_bytes(), 1), Ok(vec![7]));
    assert_eq!(values("'>u4'", &7u32.to_be_bytes(), 1), Ok(vec![7]));
    let refused = [
        values("'|i1'", &[0, 0xff], 2),
        values("'<i4'", &(-1i32).to_le_bytes(), 1),
        values("'<u2'", &256u16.to_le_bytes(), 1),
        values("'<u8'", &u64::MAX.to_le_bytes(), 1),
        values("'<i8'", &i64::MIN.to_le_bytes(), 1),
    ];
    let found = ["from -1 to 0,", "from -1 to -1,", "up to 256,", "up to 18446744073709552000,"];
    let found = found.iter().chain(&["from -9223372036854776000 to"]);
    for (refused, found) in refused.into_iter().zip(found) {
        assert!(refused.as_ref().unwrap_err().contains(found), "{refused:?}");
    }
}

#[test]
fn floats_round_half_up_and_only_the_unit_interval_passes() {
    let half = |n: f64| (n / 510.0).to_le_bytes();
    let x = [half(0.0), half(255.0), half(509.0), half(510.0)].concat();
    assert_eq!(values("'<f8'", &x, 4), Ok(vec![0, 128, 255, 255]));
    assert_eq!(values("'>f4'", &1.0f32.to_be_bytes(), 1), Ok(vec![255]));
    assert_eq!(values("'<f4'", &(-0.0f32).to_le_bytes(), 1), Ok(vec![0]));
    let bad = [f32::NAN, f32::INFINITY, -1e-9, 1.0 + f32::EPSILON, f32::MIN];
    for x in bad {
        let half = 0.5f32.to_le_bytes();
        let both = [x.to_le_bytes(), half].concat();
        let error = values("'<f4'", &both, 2).unwrap_err();
        assert!(error.starts_with("has values that "), "{error}");
    }
    let whole = [0.0f32, 16.0].map(f32::to_le_bytes).concat();
    assert_eq!(values("'<f4'", &whole, 2), Ok(vec![0, 16]));
}

#[test]
fn labels_are_whole_numbers_of_any_type_or_strings() {
    let labels = |descr: &str, shape: &str, fortran: &str, elements: &[u8]| {
        super::labels(&file(descr, fortran, shape, elements))
            .map(|(_, l)| {
                let name = |&at: &u32| l.distinct[at as usize].to_string();
                l.of.iter().map(name).collect::<Vec<_>>()
            })
            .map_err(|e| e.to_string())
    };
    let signed = [-1i64, 1].map(i64::to_le_bytes).concat();
    assert_eq!(labels("'<i8'", "(2,)", "False", &signed).unwrap(), ["-1", "1"]);
    let floats = [3.0f32, 0.0].map(f32::to_be_bytes).concat();
    assert_eq!(labels("'>f4'", "(2, 1)", "True", &floats).unwrap(), ["3", "0"]);
    assert_eq!(labels("'|b1'", "(2,)", "False", &[1, 0]).unwrap(), ["1", "0"]);
    assert_eq!(labels("'|S3'", "(2,)", "False", b"dogca\0").unwrap(), ["dog", "ca"]);
    let wide = ['é', 'x', 'b', '\0'].map(|c| u32::from(c).to_le_bytes()).concat();
    assert_eq!(labels("'<U2'", "(2,)", "False", &wide).unwrap(), ["éx", "b"]);
    for (descr, elements, wanted) in [
        ("'<f4'", 0.5f32.to_le_bytes(), "has the label 0.5 (element 0"),
        ("'<f4'", f32::NAN.to_le_bytes(), "has the label NaN"),
        ("'<U1'", [0; 4], "an empty or broken string"),
        ("'<U1'", [0xff; 4], "an empty or broken string"),
        ("'|S4'", [0xff; 4], "an empty or broken string"),
    ] {
        let error = labels(descr, "(1,)", "False", &elements).unwrap_err();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn fortran_order_is_turned() {
    let c = super::values(&file("'|u1'", "False", "(2, 3)", &[1, 2, 3, 4, 5, 6]), 1);
    let f = super::values(&file("'|u1'", "True", "(2, 3)", &[1, 4, 2, 5, 3, 6]), 1);
    assert_eq!(c.unwrap(), f.unwrap());
}

#[test]
fn lengths_and_sizes_are_checked_before_anything_is_kept() {
    let lie = |shape: &str| super::values(&file("'<f8'", "False", shape, &[0; 8]), 1);
    assert!(matches!(lie("(2,)"), Err(NpyError::Length { found: 8, wanted: 16 })));
    assert!(matches!(lie("(0,)"), Err(NpyError::Size { .. })));
    assert!(matches!(lie("()"), Err(NpyError::Size { .. })));
    assert!(matches!(lie("(4294967296, 4294967296)"), Err(NpyError::Size { .. })));
    assert!(matches!(lie("(1,1,1,1,1,1,1,1,1)"), Err(NpyError::Size { .. })));
}

#[test]
fn headers_are_read_in_any_order_and_spacing_and_every_version() {
    let wanted = (vec![1, 2], vec![0, 255], NumberKind::Fraction);
    let elements = [0.0f32.to_le_bytes(), 1.0f32.to_le_bytes()].concat();
    let texts = [
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }      \n",
        "{\"shape\":(1,2,),\"descr\":\"<f4\",\"fortran_order\":False}",
    ];
    for text in texts {
        let length = u8::try_from(text.len()).unwrap();
        for version in 1..=3 {
            let head = [b"\x93NUMPY", &[version, 0, length][..], &[0; 3]].concat();
            let head = &head[..if version == 1 { 10 } else { 12 }];
            let bytes = [head, text.as_bytes(), &elements].concat();
            let array = super::values(&bytes, 255).unwrap();
            assert_eq!((array.dims, array.data, array.kind), wanted);
            for cut in 0..bytes.len() {
                assert!(super::values(&bytes[..cut], 255).is_err(), "{cut}");
            }
        }
    }
    assert!(super::values(b"\x93NUMPY\x04\x00\x00\x00\x00\x00", 1).is_err());
}

fn refused(text: &str) -> NpyError {
    let length = u16::try_from(text.len()).unwrap().to_le_bytes();
    let bytes = [b"\x93NUMPY\x01\x00", &length[..], text.as_bytes(), &[0; 4]].concat();
    super::values(&bytes, 1).unwrap_err()
}

#[test]
fn strange_headers_are_errors() {
    let strange = [
        "",
        "{",
        "{}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1,)} x",
        "{'descr': '<f4' 'fortran_order': False, 'shape': (1,)}",
        "{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (1,)}",
        "{'descr': '<f4', 'fortran_order': 0, 'shape': (1,)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (0x7fffffffffffffff, 0x7f)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (,)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (1,), 'more': 1}",
        "{'descr': '|u2', 'fortran_order': False, 'shape': (1,)}",
        "{'descr': '', 'fortran_order': False, 'shape': (1,)}",
        "{'descr': 'é', 'fortran_order': False, 'shape': (1,)}",
    ];
    for text in strange {
        assert!(matches!(refused(text), NpyError::Header(_)), "{text}: {}", refused(text));
    }
    for descr in ["'<f2'", "'|O'", "'<U1'", "'<m8[ns]'", "[('a', '<i4')]"] {
        let text = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': (1,)}}");
        assert!(matches!(refused(&text), NpyError::Type { .. }), "{text}: {}", refused(&text));
    }
}

#[test]
fn a_header_that_asks_for_the_world_gets_an_error_at_once() {
    let shapes = ["(1000000000000000000,)", "(99999999999999999999,)", "(9999999999, 9999999999)"];
    for shape in shapes {
        let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}}}");
        let error = refused(&text);
        assert!(matches!(error, NpyError::Size { .. }), "{error}");
        assert!(error.to_string().contains(shape.trim_matches(['(', ')'])), "{error}");
    }
    for nest in ["[", "(", "{"] {
        let text = format!("{{'descr': {}", nest.repeat(5000));
        assert!(!refused(&text).to_string().is_empty(), "{nest}");
    }
    let long = [&b"\x93NUMPY\x02\x00\xff\xff\xff\xff"[..], &[b' '; 64]].concat();
    assert!(matches!(super::values(&long, 1), Err(NpyError::Header(_))));
}

#[test]
fn a_boolean_is_0_or_1() {
    let error = values("'|b1'", &[1, 2], 2).unwrap_err();
    assert!(error.starts_with("element 1 cannot be read: invalid value for bool: 2;"), "{error}");
}

proptest! {
    #[test]
    fn any_bytes_are_an_array_or_an_error(bytes: Vec<u8>, keep in 0usize..90) {
        let mut bytes = bytes;
        bytes.resize(bytes.len().max(keep), 0);
        for (to, from) in bytes.iter_mut().zip(file("'<f4'", "True", "(1, 3)", &[])).take(keep) {
            *to = from;
        }
        if let Ok((dims, labels)) = super::labels(&bytes) {
            prop_assert_eq!(dims.iter().product::<usize>(), labels.of.len());
        }
        if let Ok(array) = super::values(&bytes, 16) {
            prop_assert_eq!(array.dims.iter().product::<usize>(), array.data.len());
            prop_assert!(array.kind == NumberKind::Whole || array.data.iter().all(|&v| v <= 16));
        }
    }
}
