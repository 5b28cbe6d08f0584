//! How often what was told with a probability is so: a table, and the picture of it (the reliability diagram of Murphy and Winkler
//! 1977, Appl. Stat. 26, 41).
//!
//! Next file to read: [`crate::case`].

use std::fmt::Write as _;

use starlings_estimators::quantiles::wilson;

use crate::case::{Kind, Result};

/// Ends of the intervals of told probabilities.
const TOLD: [f64; 7] = [0.0, 0.01, 0.1, 0.5, 0.9, 0.99, 1.0];
/// Share of the cases whose truth is in no list, as the tool takes it before any data.
const LEFT_OUT: f64 = 0.1;
/// Share of the others in which two effects are missing at once, as the tool takes it.
const PAIRS: f64 = 0.25;

/// The answers that were told with a probability in one interval.
pub struct Answers {
    /// The interval.
    pub told: [f64; 2],
    /// Number of answers.
    pub n: usize,
    /// Mean of what was told.
    pub mean: f64,
    /// Share that is so.
    pub so: f64,
    /// As many answers of equal weight would tell that share as well.
    effective: f64,
}

impl Answers {
    /// The 95 % interval of the share (Wilson 1927).
    fn interval(&self) -> [f64; 2] {
        wilson(self.so, self.effective)
    }
}

/// The answers by the probability that was told, where one truth in ten is in no list and one in four of the others has two effects.
pub fn reliability(results: &[Result]) -> Vec<Answers> {
    let weights = Weights::of(results);
    let told =
        results.iter().flat_map(|r| r.told.iter().map(|(p, so)| (weights.of_kind(r.case.kind), *p, *so)));
    let told: Vec<(f64, f64, bool)> = told.filter(|(weight, ..)| *weight > 0.0).collect();
    let of = |ends: &[f64]| {
        let inside: Vec<_> = told.iter().filter(|(_, p, _)| (ends[0]..ends[1]).contains(p)).collect();
        let sum: f64 = inside.iter().map(|(weight, ..)| weight).sum();
        let squares: f64 = inside.iter().map(|(weight, ..)| weight * weight).sum();
        let mean = inside.iter().map(|(weight, p, _)| weight * p).sum::<f64>() / sum;
        let so = inside.iter().map(|(weight, _, so)| if *so { *weight } else { 0.0 }).sum::<f64>() / sum;
        Answers { told: [ends[0], ends[1]], n: inside.len(), mean, so, effective: sum * sum / squares }
    };
    TOLD.windows(2).map(of).filter(|answers| answers.n > 0).collect()
}

/// What a case of each kind counts, so that the kinds have their shares however many cases they have.
struct Weights {
    library: f64,
    pair: f64,
    left_out: f64,
}

impl Weights {
    fn of(results: &[Result]) -> Self {
        let count = |kind: Kind| results.iter().filter(|r| r.case.kind == kind).count() as f64;
        let each = |share: f64, kind: Kind| if count(kind) > 0.0 { share / count(kind) } else { 0.0 };
        let pairs = if count(Kind::Pair) > 0.0 { PAIRS } else { 0.0 };
        Self {
            library: each((1.0 - pairs) * (1.0 - LEFT_OUT), Kind::Library),
            pair: each(pairs * (1.0 - LEFT_OUT), Kind::Pair),
            left_out: each(LEFT_OUT, Kind::LeftOut),
        }
    }

    fn of_kind(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Library => self.library,
            Kind::Pair => self.pair,
            Kind::LeftOut => self.left_out,
            _ => 0.0,
        }
    }
}

/// The same as a table.
pub fn table(results: &[Result]) -> String {
    let mut text = String::from(
        "| told, % | answers | told, mean | so | 95 % interval of it |\n|---|---|---|---|---|\n",
    );
    for answers in reliability(results) {
        let Answers { told: [lo, hi], n, mean, so, .. } = answers;
        let [from, to] = answers.interval();
        let told = format!("{:.0} to {:.0}", 100.0 * lo, 100.0 * hi);
        writeln!(text, "| {told} | {n} | {mean:.3} | {so:.3} | {from:.3} to {to:.3} |").unwrap();
    }
    text
}

/// Left and upper end of the frame, and the length of its sides, in pixels.
const FRAME: [f64; 3] = [60.0, 30.0, 300.0];

/// Where a probability that was told and a share that is so stand in the picture.
fn at(told: f64, so: f64) -> [f64; 2] {
    let [left, top, side] = FRAME;
    [left + side * told, top + side * (1.0 - so)]
}

/// The picture: a dot at what was told and the share that is so, with its interval and the number of answers; on the diagonal both
/// are equal.
pub fn picture(results: &[Result]) -> String {
    let mut text = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 420 390\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <title>How often what was told as probable is so</title>\n<rect width=\"420\" height=\"390\" fill=\"white\"/>\n",
    );
    axes(&mut text);
    for answers in reliability(results) {
        let ([lo, hi], [x, y]) = (answers.interval(), at(answers.mean, answers.so));
        let [[_, lower], [_, upper]] = [at(answers.mean, lo), at(answers.mean, hi)];
        let ends = format!("x1=\"{x:.1}\" y1=\"{lower:.1}\" x2=\"{x:.1}\" y2=\"{upper:.1}\"");
        writeln!(text, "<line {ends} stroke=\"#3b62a8\" stroke-width=\"1.6\"/>").unwrap();
        writeln!(text, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"#3b62a8\"/>").unwrap();
        // Beside the dot, inside the frame.
        let (anchor, off) = if answers.mean > 0.8 { ("end", -7.0) } else { ("start", 7.0) };
        let place = format!("x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\"", x + off, y + 4.0);
        writeln!(text, "<text {place}>{}</text>", answers.n).unwrap();
    }
    text + "</svg>\n"
}

/// Frame, diagonal, ticks and labels.
fn axes(text: &mut String) {
    let [left, top, side] = FRAME;
    let ([x1, y1], [x2, y2]) = (at(0.0, 0.0), at(1.0, 1.0));
    let ends = format!("x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"");
    writeln!(text, "<line {ends} stroke=\"#888\" stroke-dasharray=\"4 3\"/>").unwrap();
    let frame = format!("x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\"");
    writeln!(text, "<rect {frame} fill=\"none\" stroke=\"#888\"/>").unwrap();
    let mut write = |x: f64, y: f64, style: &str, words: &str| {
        writeln!(text, "<text x=\"{x:.1}\" y=\"{y:.1}\" {style}>{words}</text>").unwrap();
    };
    for tick in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let [x, y] = at(tick, tick);
        write(x, y1 + 14.0, "text-anchor=\"middle\"", &tick.to_string());
        write(left - 5.0, y + 4.0, "text-anchor=\"end\"", &tick.to_string());
    }
    let (x, y) = (left - 40.0, top + 0.5 * side);
    write(left + 0.5 * side, y1 + 32.0, "text-anchor=\"middle\"", "probability told");
    let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 {x} {y})\"");
    write(x, y, &turned, "share that is so");
}
