//! `[infer]` of a study: which coefficients are unknown, and how they are found.
//!
//! Next file to read: [`crate::check`].

use std::ops::Range;

use toml::Spanned;
use toml::de::DeValue;

use super::Named;
use super::table::{Table, named_texts, number, text, wrong_type};
use crate::problem::Source;

/// `[infer]`.
#[derive(Debug)]
pub(crate) struct InferSection {
    pub(crate) span: Range<usize>,
    pub(crate) parameters: Vec<Spanned<String>>,
    pub(crate) basis: Option<Spanned<String>>,
    pub(crate) degree: Option<Spanned<u64>>,
    pub(crate) constant: Option<Spanned<bool>>,
    pub(crate) functions: Vec<Spanned<String>>,
    pub(crate) diffusion: Option<Spanned<String>>,
    pub(crate) rule: Rules,
    pub(crate) prefactor: Option<Spanned<bool>>,
    pub(crate) measurement_noise: Option<Spanned<WordOrNumber>>,
    pub(crate) richardson: Option<Spanned<bool>>,
    pub(crate) block: Option<Spanned<u64>>,
    pub(crate) step: Option<Spanned<f64>>,
    pub(crate) resample: Option<Spanned<f64>>,
    pub(crate) gaps: Option<Spanned<String>>,
    pub(crate) reduced: Option<ReducedSection>,
    pub(crate) candidates: Option<CandidatesSection>,
    pub(crate) follow: Option<FollowSection>,
}

/// `rule = "ito"`, or one per name.
#[derive(Debug)]
pub(crate) enum Rules {
    /// One for all; `None` where nothing is said.
    All(Option<Spanned<String>>),
    /// By state, parameter or function.
    ByName(Named<String>),
}

/// A word or a number.
#[derive(Debug)]
pub(crate) enum WordOrNumber {
    Word(String),
    Number(f64),
}

/// `[infer.reduced]`.
#[derive(Debug)]
pub(crate) struct ReducedSection {
    pub(crate) span: Range<usize>,
    pub(crate) start: Named<f64>,
    pub(crate) define: Named<String>,
    pub(crate) coefficients: Named<String>,
}

/// `[infer.candidates]`.
#[derive(Debug)]
pub(crate) struct CandidatesSection {
    pub(crate) span: Range<usize>,
    pub(crate) degree: Option<Spanned<u64>>,
    pub(crate) functions: Vec<Spanned<String>>,
    pub(crate) false_alarm: Option<Spanned<f64>>,
    pub(crate) most: Option<Spanned<u64>>,
}

/// `[infer.follow]`.
#[derive(Debug)]
pub(crate) struct FollowSection {
    pub(crate) block: Option<Spanned<u64>>,
    pub(crate) recent: Option<Spanned<u64>>,
    pub(crate) window: Option<Spanned<u64>>,
    pub(crate) least: Option<Spanned<u64>>,
    pub(crate) rate: Option<Spanned<f64>>,
}

const KEYS: [&str; 17] = [
    "parameters",
    "basis",
    "degree",
    "constant",
    "functions",
    "diffusion",
    "rule",
    "prefactor",
    "measurement_noise",
    "richardson",
    "block",
    "step",
    "resample",
    "gaps",
    "reduced",
    "candidates",
    "follow",
];

/// Reads the section; `None` where the file has none.
pub(crate) fn read(source: &Source, root: &Table<'_>) -> Option<InferSection> {
    let t = root.table("infer", "[infer]", &KEYS)?;
    Some(InferSection {
        span: t.span.clone(),
        parameters: t.texts("parameters"),
        basis: t.text("basis"),
        degree: t.count("degree"),
        constant: t.flag("constant"),
        functions: t.texts("functions"),
        diffusion: t.text("diffusion"),
        rule: rules(source, &t),
        prefactor: t.flag("prefactor"),
        measurement_noise: measurement_noise(source, &t),
        richardson: t.flag("richardson"),
        block: t.count("block"),
        step: t.number("step"),
        resample: t.number("resample"),
        gaps: t.text("gaps"),
        reduced: reduced(source, &t),
        candidates: candidates(&t),
        follow: follow(&t),
    })
}

fn rules(source: &Source, t: &Table<'_>) -> Rules {
    match t.get("rule").map(Spanned::get_ref) {
        Some(DeValue::Table(_)) => Rules::ByName(named_texts(source, &t.free_entries("rule"))),
        _ => Rules::All(t.text("rule")),
    }
}

fn measurement_noise(source: &Source, t: &Table<'_>) -> Option<Spanned<WordOrNumber>> {
    let node = t.get("measurement_noise")?;
    let what = "`measurement_noise`";
    let read = match node.get_ref() {
        DeValue::String(_) => WordOrNumber::Word(text(source, node, what)?.into_inner()),
        DeValue::Integer(_) | DeValue::Float(_) => {
            WordOrNumber::Number(number(source, node, what)?.into_inner())
        }
        _ => {
            wrong_type(source, node, what, "\"auto\", \"none\" or a standard deviation");
            return None;
        }
    };
    Some(Spanned::new(node.span(), read))
}

fn reduced(source: &Source, t: &Table<'_>) -> Option<ReducedSection> {
    let t = t.table("reduced", "[infer.reduced]", &["start", "define", "coefficients"])?;
    for (key, expected) in [
        ("start", "the unknowns with a first guess, such as `{ k = 1.0 }`"),
        ("coefficients", "coefficients as expressions of the unknowns, such as `{ \"x:x\" = \"-k\" }`"),
    ] {
        if t.get(key).is_none() {
            t.missing(key, expected);
        }
    }
    let start = t.free_entries("start");
    let value = |(key, node): &(Spanned<String>, &super::table::Node<'_>)| {
        number(source, node, &format!("`{}`", key.get_ref())).map(|value| (key.clone(), value))
    };
    Some(ReducedSection {
        span: t.span.clone(),
        start: start.iter().filter_map(value).collect(),
        define: named_texts(source, &t.free_entries("define")),
        coefficients: named_texts(source, &t.free_entries("coefficients")),
    })
}

fn candidates(t: &Table<'_>) -> Option<CandidatesSection> {
    let keys = ["degree", "functions", "false_alarm", "most"];
    let t = t.table("candidates", "[infer.candidates]", &keys)?;
    Some(CandidatesSection {
        span: t.span.clone(),
        degree: t.count("degree"),
        functions: t.texts("functions"),
        false_alarm: t.number("false_alarm"),
        most: t.count("most"),
    })
}

fn follow(t: &Table<'_>) -> Option<FollowSection> {
    let t = t.table("follow", "[infer.follow]", &["block", "recent", "window", "least", "rate"])?;
    Some(FollowSection {
        block: t.count("block"),
        recent: t.count("recent"),
        window: t.count("window"),
        least: t.count("least"),
        rate: t.number("rate"),
    })
}
