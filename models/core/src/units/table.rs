//! The symbols of units and prefixes: SI, cgs, and what clinics use.
//!
//! Values: Bureau International des Poids et Mesures, The International System of Units (9th edition, 2019) and, for mmHg and
//! cmH2O, its conventional densities of mercury and water at standard gravity. Next file to read: [`super::labels`].

/// A symbol's value, `mantissa` · 10^`decade`, with its exponents of m, kg, s, A, K, mol, cd.
pub(super) struct Symbol {
    pub(super) mantissa: f64,
    pub(super) decade: i32,
    pub(super) exponents: [i8; 7],
}

/// Symbols, mantissa, decade, exponents, and whether a prefix may stand before it.
type Row = (&'static [&'static str], f64, i32, [i8; 7], bool);

const ROWS: &[Row] = &[
    (&["beat", "beats"], 1.0, 0, [0; 7], false),
    (&["%"], 1.0, -2, [0; 7], false),
    (&["ppm"], 1.0, -6, [0; 7], false),
    (&["rad"], 1.0, 0, [0; 7], true),
    (&["deg", "°"], std::f64::consts::PI / 180.0, 0, [0; 7], false),
    // Base units.
    (&["m"], 1.0, 0, [1, 0, 0, 0, 0, 0, 0], true),
    (&["g"], 1.0, -3, [0, 1, 0, 0, 0, 0, 0], true),
    (&["s", "sec"], 1.0, 0, [0, 0, 1, 0, 0, 0, 0], true),
    (&["A"], 1.0, 0, [0, 0, 0, 1, 0, 0, 0], true),
    (&["K"], 1.0, 0, [0, 0, 0, 0, 1, 0, 0], true),
    (&["°C", "degC"], 1.0, 0, [0, 0, 0, 0, 1, 0, 0], false),
    (&["mol"], 1.0, 0, [0, 0, 0, 0, 0, 1, 0], true),
    (&["cd"], 1.0, 0, [0, 0, 0, 0, 0, 0, 1], true),
    // Derived units.
    (&["Hz", "Bq"], 1.0, 0, [0, 0, -1, 0, 0, 0, 0], true),
    (&["N"], 1.0, 0, [1, 1, -2, 0, 0, 0, 0], true),
    (&["Pa"], 1.0, 0, [-1, 1, -2, 0, 0, 0, 0], true),
    (&["J"], 1.0, 0, [2, 1, -2, 0, 0, 0, 0], true),
    (&["W"], 1.0, 0, [2, 1, -3, 0, 0, 0, 0], true),
    (&["C"], 1.0, 0, [0, 0, 1, 1, 0, 0, 0], true),
    (&["V"], 1.0, 0, [2, 1, -3, -1, 0, 0, 0], true),
    (&["ohm", "Ohm", "Ω", "\u{2126}"], 1.0, 0, [2, 1, -3, -2, 0, 0, 0], true),
    (&["S"], 1.0, 0, [-2, -1, 3, 2, 0, 0, 0], true),
    (&["F"], 1.0, 0, [-2, -1, 4, 2, 0, 0, 0], true),
    (&["Wb"], 1.0, 0, [2, 1, -2, -1, 0, 0, 0], true),
    (&["T"], 1.0, 0, [0, 1, -2, -1, 0, 0, 0], true),
    (&["H"], 1.0, 0, [2, 1, -2, -2, 0, 0, 0], true),
    // Beside the SI.
    (&["min"], 60.0, 0, [0, 0, 1, 0, 0, 0, 0], false),
    (&["h", "hr"], 3600.0, 0, [0, 0, 1, 0, 0, 0, 0], false),
    (&["d", "day"], 86_400.0, 0, [0, 0, 1, 0, 0, 0, 0], false),
    (&["L", "l"], 1.0, -3, [3, 0, 0, 0, 0, 0, 0], true),
    (&["t"], 1.0, 3, [0, 1, 0, 0, 0, 0, 0], false),
    (&["M"], 1.0, 3, [-3, 0, 0, 0, 0, 1, 0], true),
    (&["bar"], 1.0, 5, [-1, 1, -2, 0, 0, 0, 0], true),
    (&["atm"], 101_325.0, 0, [-1, 1, -2, 0, 0, 0, 0], false),
    (&["Torr", "torr"], 101_325.0 / 760.0, 0, [-1, 1, -2, 0, 0, 0, 0], false),
    // Clinical.
    (&["mmHg"], 133.322_387_415, 0, [-1, 1, -2, 0, 0, 0, 0], false),
    (&["cmH2O", "cmH₂O"], 98.0665, 0, [-1, 1, -2, 0, 0, 0, 0], false),
    (&["mmH2O", "mmH₂O"], 9.80665, 0, [-1, 1, -2, 0, 0, 0, 0], false),
    (&["bpm"], 1.0 / 60.0, 0, [0, 0, -1, 0, 0, 0, 0], false),
    (&["cc"], 1.0, -6, [3, 0, 0, 0, 0, 0, 0], false),
    // cgs.
    (&["dyn", "dyne"], 1.0, -5, [1, 1, -2, 0, 0, 0, 0], false),
    (&["erg"], 1.0, -7, [2, 1, -2, 0, 0, 0, 0], false),
    (&["P"], 1.0, -1, [-1, 1, -1, 0, 0, 0, 0], true),
    (&["St"], 1.0, -4, [2, 0, -1, 0, 0, 0, 0], true),
];

/// Prefixes, `da` before `d`.
const PREFIXES: &[(&str, i32)] = &[
    ("da", 1),
    ("Y", 24),
    ("Z", 21),
    ("E", 18),
    ("P", 15),
    ("T", 12),
    ("G", 9),
    ("M", 6),
    ("k", 3),
    ("h", 2),
    ("d", -1),
    ("c", -2),
    ("m", -3),
    ("u", -6),
    ("µ", -6),
    ("μ", -6),
    ("n", -9),
    ("p", -12),
    ("f", -15),
    ("a", -18),
];

/// What a symbol stands for: as it is, or else behind a prefix.
pub(super) fn symbol(text: &str) -> Option<Symbol> {
    let find = |name: &str| ROWS.iter().find(|row| row.0.contains(&name));
    let make = |row: &Row, decade: i32| Symbol { mantissa: row.1, decade: row.2 + decade, exponents: row.3 };
    if let Some(row) = find(text) {
        return Some(make(row, 0));
    }
    PREFIXES.iter().find_map(|(prefix, decade)| {
        let row = find(text.strip_prefix(prefix)?)?;
        row.4.then(|| make(row, *decade))
    })
}
