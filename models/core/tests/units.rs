//! Unit labels: what they stand for and what can be read.
// Factors are compared exactly where they are powers of ten or defined numbers.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

use proptest::prelude::*;
use starlings_models_core::units::{Unit, consistent};

fn unit(label: &str) -> Unit {
    Unit::parse(label).unwrap_or_else(|| panic!("`{label}` is not read"))
}

#[test]
fn labels_have_their_exact_factors_and_dimensions() {
    // Label, factor, exponents of m, kg, s, A, K, mol, cd.
    let table: &[(&str, f64, [i32; 7])] = &[
        ("m", 1.0, [1, 0, 0, 0, 0, 0, 0]),
        ("kg", 1.0, [0, 1, 0, 0, 0, 0, 0]),
        ("mg", 1e-6, [0, 1, 0, 0, 0, 0, 0]),
        ("N", 1.0, [1, 1, -2, 0, 0, 0, 0]),
        ("kPa", 1e3, [-1, 1, -2, 0, 0, 0, 0]),
        ("mW", 1e-3, [2, 1, -3, 0, 0, 0, 0]),
        ("J/(kg K)", 1.0, [2, 0, -2, 0, -1, 0, 0]),
        ("kohm", 1e3, [2, 1, -3, -2, 0, 0, 0]),
        ("V/A", 1.0, [2, 1, -3, -2, 0, 0, 0]),
        ("MΩ", 1e6, [2, 1, -3, -2, 0, 0, 0]),
        ("Hz", 1.0, [0, 0, -1, 0, 0, 0, 0]),
        ("µm", 1e-6, [1, 0, 0, 0, 0, 0, 0]),
        ("dam", 10.0, [1, 0, 0, 0, 0, 0, 0]),
        ("mmol/L", 1.0, [-3, 0, 0, 0, 0, 1, 0]),
        ("mM", 1.0, [-3, 0, 0, 0, 0, 1, 0]),
        ("min", 60.0, [0, 0, 1, 0, 0, 0, 0]),
        ("h", 3600.0, [0, 0, 1, 0, 0, 0, 0]),
        ("mL", 1e-6, [3, 0, 0, 0, 0, 0, 0]),
        ("L/min", 1e-3 / 60.0, [3, 0, -1, 0, 0, 0, 0]),
        ("bpm", 1.0 / 60.0, [0, 0, -1, 0, 0, 0, 0]),
        ("beats/min", 1.0 / 60.0, [0, 0, -1, 0, 0, 0, 0]),
        ("mmHg", 133.322_387_415, [-1, 1, -2, 0, 0, 0, 0]),
        ("cmH2O", 98.0665, [-1, 1, -2, 0, 0, 0, 0]),
        ("bar", 1e5, [-1, 1, -2, 0, 0, 0, 0]),
        ("mbar", 1e2, [-1, 1, -2, 0, 0, 0, 0]),
        ("atm", 101_325.0, [-1, 1, -2, 0, 0, 0, 0]),
        ("dyn", 1e-5, [1, 1, -2, 0, 0, 0, 0]),
        ("erg", 1e-7, [2, 1, -2, 0, 0, 0, 0]),
        ("dyn/cm^2", 0.1, [-1, 1, -2, 0, 0, 0, 0]),
        ("dyn s/cm^5", 1e5, [-4, 1, -1, 0, 0, 0, 0]),
        ("dyn·s/cm⁵", 1e5, [-4, 1, -1, 0, 0, 0, 0]),
        ("dyn*s*cm^-5", 1e5, [-4, 1, -1, 0, 0, 0, 0]),
        ("cm^5/dyn", 1e-5, [4, -1, 2, 0, 0, 0, 0]),
        ("mmHg s/mL", 133.322_387_415 * 1e6, [-4, 1, -1, 0, 0, 0, 0]),
        ("mmHg s^2/mL", 133.322_387_415 * 1e6, [-4, 1, 0, 0, 0, 0, 0]),
        ("kg/(m s)", 1.0, [-1, 1, -1, 0, 0, 0, 0]),
        ("cP", 1e-3, [-1, 1, -1, 0, 0, 0, 0]),
        ("m/s/s", 1.0, [1, 0, -2, 0, 0, 0, 0]),
        ("m s⁻²", 1.0, [1, 0, -2, 0, 0, 0, 0]),
        ("m3/s", 1.0, [3, 0, -1, 0, 0, 0, 0]),
        ("kg m-3", 1.0, [-3, 1, 0, 0, 0, 0, 0]),
        ("1/s", 1.0, [0, 0, -1, 0, 0, 0, 0]),
        ("1", 1.0, [0; 7]),
        ("%", 0.01, [0; 7]),
        ("rad", 1.0, [0; 7]),
        ("deg", std::f64::consts::PI / 180.0, [0; 7]),
        ("°C", 1.0, [0, 0, 0, 0, 1, 0, 0]),
        ("m^(2)", 1.0, [2, 0, 0, 0, 0, 0, 0]),
    ];
    for (label, factor, exponents) in table {
        let found = unit(label);
        assert_eq!((found.factor, found.exponents), (*factor, exponents.map(f64::from)), "{label}");
    }
}

#[test]
fn what_cannot_be_read_or_is_ambiguous_is_only_a_label() {
    let labels = [
        "",
        " ",
        "PRU",
        "volts",
        "J/kg K",
        "m/",
        "/s",
        "m^",
        "m^x",
        "(m",
        "m)",
        "kmin",
        "mmmHg",
        "0 m",
        "m--1",
        "m**2",
        "beats per minute",
        "((((((((((m))))))))))",
        "m^(1/",
        "a.u.",
        "10^400 m",
    ];
    for label in labels {
        assert_eq!(Unit::parse(label), None, "`{label}`");
    }
}

proptest! {
    #[test]
    fn no_text_breaks_the_reader(text in "[a-zA-Z0-9 */^().·²⁻µ%°-]{0,12}") {
        // What is read has a factor that can be compared.
        prop_assert!(Unit::parse(&text).is_none_or(|unit| unit.factor.is_normal()));
    }
}

#[test]
fn a_unit_is_told_by_a_familiar_label_or_in_base_units() {
    let cases = [
        ("kg m/s^2", "N"),
        ("dyn s/cm5", "dyn s/cm^5"),
        ("1/s", "1/s"),
        ("kg/(m^2 s^2)", "kg/(m^2 s^2)"),
        ("g mol", "0.001 kg mol"),
        ("%", "0.01"),
        ("1", "a plain number"),
        ("m^0.5", "m^0.5"),
        ("mmHg/mL", "133322000 kg/(m^4 s^2)"),
    ];
    for (label, text) in cases {
        assert_eq!(unit(label).text(), text, "{label}");
    }
}

#[test]
fn one_consistent_system_is_recognised_and_a_mixture_is_not() {
    let pairs = |list: &[(&str, &str)]| -> Vec<(Unit, Unit)> {
        list.iter().map(|(given, model)| (unit(given), unit(model))).collect()
    };
    let time = ("s", "s");
    let (r, c, p) = ("mmHg s/mL", "mL/mmHg", "mmHg");
    assert!(consistent(&pairs(&[("dyn s/cm^5", r), ("cm^5/dyn", c), ("dyn/cm^2", p), time])));
    assert!(consistent(&pairs(&[("kPa s/L", r), ("L/kPa", c), ("kPa", p), time])));
    assert!(consistent(&pairs(&[("dyn s/cm^5", r), time])), "one label alone contradicts nothing");
    assert!(!consistent(&pairs(&[("dyn s/cm^5", r), ("mL/mmHg", c), time])));
    assert!(consistent(&pairs(&[("dyn s/cm^5", r), ("mL/mmHg", c)])), "unless time may be scaled");
    assert!(!consistent(&pairs(&[("Pa", p), ("kPa", p)])));
    assert!(!consistent(&pairs(&[("%", "1")])), "no system scales a number");
}
