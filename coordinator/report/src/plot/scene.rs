//! A scene is two axes and the marks on them, set into a page so that text has one size whatever the width.
//!
//! Axes are plain elements of the page beside a drawing that stretches; the vertical axis' label stands above it, which stays
//! readable on a narrow screen. A scene has no legend; its figure names the colours. Next file to read: `drawing.rs`.

use std::fmt::Write as _;

use super::axis::{Axis, Tick};
use super::drawing::{SIZE, content};
use super::figure::Key;
use super::mark::Mark;
use super::svg::{escape, head, short};

/// Width of a letter on an axis, px.
const LETTER: f64 = 6.8;

/// Two axes and what is drawn on them.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// What the figure shows, in a few words: the name that assistive technology reads.
    pub(crate) title: String,
    /// What can be seen in it.
    pub(crate) description: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) marks: Vec<Mark>,
}

impl Scene {
    /// The scene as elements of a page; `class` says how high it is.
    pub(crate) fn html(&self, keys: &[Key], class: &str) -> String {
        self.html_with(keys, class, self.left())
    }

    /// The same with so much room for the labels of the vertical axis, px: plots that stand below one another share it.
    pub(crate) fn html_with(&self, keys: &[Key], class: &str, left: f64) -> String {
        let (width, height) = SIZE;
        let view = format!("class=\"drawing\" viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\"");
        let drawing = head(&view, &self.title, &self.description) + &content(self, keys) + "</svg>";
        let mut text = format!(
            "<div class=\"plot {class}\" style=\"--left:{}px\"><div class=\"y-label\">{}</div><div class=\"frame\">{drawing}",
            short(left),
            escape(&self.y.label)
        );
        for (share, tick) in shares(&self.x, 5) {
            let _ = write!(
                text,
                "<span class=\"x\" style=\"left:{}%\">{}</span>",
                short(100.0 * share),
                escape(&tick.text)
            );
        }
        for (share, tick) in shares(&self.y, 5) {
            let _ = write!(
                text,
                "<span class=\"y\" style=\"bottom:{}%\">{}</span>",
                short(100.0 * share),
                escape(&tick.text)
            );
        }
        for mark in &self.marks {
            if let Mark::Heading { x, text: words, colour } = mark {
                let share = short(100.0 * self.share(*x));
                let _ = write!(
                    text,
                    "<span class=\"heading c {}\" style=\"left:{share}%\">{}</span>",
                    colour.name,
                    escape(words)
                );
            }
        }
        text + "</div><div class=\"x-label\">" + &escape(&self.x.label) + "</div></div>"
    }

    /// The scene as a part of a picture that stands alone, in a rectangle of it.
    pub(crate) fn standalone(&self, (x, y): (f64, f64), (width, height): (f64, f64)) -> String {
        let (left, top) = (x + self.left(), y + 24.0);
        let (wide, high) = (width - self.left() - 12.0, height - 24.0 - 40.0);
        let mut text = format!(
            "<svg x=\"{left}\" y=\"{top}\" width=\"{wide}\" height=\"{high}\" viewBox=\"0 0 {} {}\" preserveAspectRatio=\"none\">{}</svg>\
             <path class=\"axis\" d=\"M{left} {top}V{}H{}\"/><text x=\"{x}\" y=\"{}\">{}</text>",
            SIZE.0,
            SIZE.1,
            content(self, &[]),
            top + high,
            left + wide,
            y + 14.0,
            escape(&self.y.label)
        );
        for (share, tick) in shares(&self.x, 6) {
            let at = short(left + share * wide);
            let _ = write!(
                text,
                "<text class=\"tick\" text-anchor=\"middle\" x=\"{at}\" y=\"{}\">{}</text>",
                top + high + 17.0,
                escape(&tick.text)
            );
        }
        for (share, tick) in shares(&self.y, 5) {
            let at = short(top + (1.0 - share) * high + 4.0);
            let _ = write!(
                text,
                "<text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{at}\">{}</text>",
                left - 6.0,
                escape(&tick.text)
            );
        }
        for mark in &self.marks {
            if let Mark::Heading { x, text: words, colour } = mark {
                let at = short(left + self.share(*x) * wide + 4.0);
                let _ = write!(
                    text,
                    "<text fill=\"{}\" x=\"{at}\" y=\"{}\">{}</text>",
                    colour.hex,
                    top + 14.0,
                    escape(words)
                );
            }
        }
        let end = left + wide;
        text + &format!(
            "<text text-anchor=\"end\" x=\"{end}\" y=\"{}\">{}</text>",
            top + high + 35.0,
            escape(&self.x.label)
        )
    }

    /// Where a value stands on the horizontal axis, as a share of its length.
    fn share(&self, x: f64) -> f64 {
        let (lo, hi) = self.x.ends();
        ((self.x.at(x) - lo) / (hi - lo)).clamp(0.0, 1.0)
    }

    /// Room for the labels of the vertical axis, px.
    pub(crate) fn left(&self) -> f64 {
        let longest = self.y.ticks(5).iter().map(|tick| tick.text.chars().count()).max().unwrap_or(1);
        LETTER.mul_add(longest as f64, 12.0)
    }
}

/// The ticks of an axis with their place as a share of its length.
fn shares(axis: &Axis, count: usize) -> Vec<(f64, Tick)> {
    let (lo, hi) = axis.ends();
    axis.ticks(count)
        .into_iter()
        .map(|tick| ((0.5 * tick.at - 0.5 * lo) / (0.5 * hi - 0.5 * lo), tick))
        .collect()
}
