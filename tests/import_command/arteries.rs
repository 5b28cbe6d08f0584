//! Outlets and tapering vessels of openBF.

use tempfile::TempDir;

use super::{file, import};

/// The aorta of the files with these changes: the text of its study, and the notes.
fn aorta(changes: &[(&str, &str)]) -> (String, String) {
    let folder = TempDir::new().unwrap();
    let mut text = std::fs::read_to_string(file("openbf/uta.yaml")).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    std::fs::copy(file("openbf/uta_inlet.dat"), folder.path().join("uta_inlet.dat")).unwrap();
    let (path, out) = (folder.path().join("uta.yaml"), folder.path().join("uta"));
    std::fs::write(&path, text).unwrap();
    let notes = import(&path, &out)["notes"].to_string();
    (std::fs::read_to_string(out.join("study.toml")).unwrap(), notes)
}

/// The number behind a text.
fn number(study: &str, before: &str) -> f64 {
    let (_, rest) = study.split_once(before).unwrap_or_else(|| panic!("no {before} in {study}"));
    rest.split([',', '\n']).next().unwrap().trim().parse().unwrap()
}

#[test]
fn one_resistance_stands_before_the_compliance_and_less_the_impedance_behind_it() {
    let (study, notes) = aorta(&[("R1: 1.1752e7", "R1: 1.0e8"), ("    R2: 1.1167e8\n", "")]);
    assert!((number(&study, "R_p = ") - 1000.0).abs() < 1e-9, "{study}");
    // ρc/A₀ with c² = (2/3) E h / (ρ R) in the units of the file, in cgs units.
    let impedance = 1e-5 * (1060.0 * 2.0 / 3.0 * 400.0e3 * 0.82e-3 / 9.87e-3_f64).sqrt()
        / (std::f64::consts::PI * 9.87e-3_f64.powi(2));
    let distal = number(&study, "median = ");
    assert!((distal - (1000.0 - impedance)).abs() < 1e-6 * distal, "{distal} {impedance}");
    assert!(notes.contains("has R1 and no R2"), "{notes}");
}

#[test]
fn the_pressure_behind_an_outlet_is_read_and_a_taper_is_told() {
    let (study, notes) = aorta(&[]);
    assert!(number(&study, "p_venous = ").abs() < 1e-12);
    assert!(!notes.contains("tapers"), "{notes}");
    let (study, notes) = aorta(&[
        ("Cc: 1.0163e-8", "Cc: 1.0163e-8\n    Pout: 500.0"),
        ("R0: 9.87e-3", "Rp: 9.87e-3\n    Rd: 9.0e-3"),
    ]);
    assert!((number(&study, "p_venous = ") - 5000.0).abs() < 1e-9);
    assert!(notes.contains("`upper_thoracic_aorta` tapers: openBF"), "{notes}");
}
