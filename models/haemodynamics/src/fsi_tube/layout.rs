//! How a tube is cut: cells, regions of one stiffness each, the longest step, where a run starts.
//!
//! Values that can be estimated are parameters and not here. Next file to read: [`super::quantities`].

use std::fmt;

use serde::Deserialize;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserializer, SeqAccess, Visitor};
use starlings_models_core::SetupError;
use starlings_models_core::layout::fault;

/// Most cells: a million is a state of 16 MB; more would be a slip.
const MOST_CELLS: usize = 1_000_000;

/// Shortest accepted step in s: in it a wave of 10 m/s passes 10 µm, less than any cell that the model is meant for, and a
/// second of recording takes a million steps; shorter ones would keep a long recording running without end.
const SHORTEST_STEP: f64 = 1e-6;

/// Lowest accepted pressure of an image in dyn/cm², 7.5 mmHg: below it the number is of another unit.
const LOWEST_IMAGE_PRESSURE: f64 = 1e4;

/// Ends of regions closer than this, relative to the tube's length, are one point.
const SAME: f64 = 1e-9;

/// `[model.layout]` of the tube.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Layout {
    /// Number of cells N, all of one length.
    pub cells: usize,
    /// Regions of one Young's modulus each.
    pub regions: Regions,
    /// Longest time step in s, 1e-6 or more.
    pub step: f64,
    /// Where a run starts.
    pub start: Start,
    /// Pressure of the image in which the radius is R, in dyn/cm²; zero where R is the radius without load.
    pub image_pressure: f64,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            cells: 25,
            regions: Regions::Equal(5),
            step: 1e-3,
            start: Start::Equilibrium,
            image_pressure: 0.0,
        }
    }
}

/// Where a run starts: at rest, under the initial pressure of the Windkessel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Every region in equilibrium with its own stiffness.
    Equilibrium,
    /// Every region displaced as if its Young's modulus were the reference.
    Reference,
}

/// Regions along the tube, in the order of their parameters `E1`, `E2`, ...
#[derive(Clone, Debug, PartialEq)]
pub enum Regions {
    /// So many of equal length.
    Equal(usize),
    /// Each with its ends.
    Listed(Vec<Region>),
}

/// One region of a list.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Name, for the text about its parameter.
    pub name: String,
    /// Start along the tube in cm.
    pub from: f64,
    /// End along the tube in cm.
    pub to: f64,
}

impl<'de> Deserialize<'de> for Regions {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(CountOrList)
    }
}

/// Reads a number of regions or a list of them.
struct CountOrList;

impl<'de> Visitor<'de> for CountOrList {
    type Value = Regions;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number of equal regions, or a list of { name, from, to }")
    }

    fn visit_u64<E>(self, n: u64) -> Result<Regions, E> {
        Ok(Regions::Equal(usize::try_from(n).unwrap_or(usize::MAX)))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Regions, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(Regions::Listed)
    }
}

/// One region in words, and the cells that it holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) says: String,
    pub(super) n_cell: usize,
}

impl Layout {
    /// The regions along a tube of this length in cm, in order; their cells, counted from the inlet, follow each other.
    ///
    /// # Errors
    /// When a number is not usable, regions overlap or leave a gap, or one is too short to hold a cell's centre.
    pub(super) fn parts(&self, length: f64) -> Result<Vec<Part>, SetupError> {
        if self.cells == 0 || self.cells > MOST_CELLS {
            return Err(fault("cells", format!("{} cells: give 1 to {MOST_CELLS}", self.cells)));
        }
        if !self.step.is_finite() || self.step < SHORTEST_STEP {
            let message = format!("a step of {} s: give a time of {SHORTEST_STEP:e} s or more", self.step);
            return Err(fault("step", message));
        }
        check_image(self.image_pressure)?;
        match &self.regions {
            Regions::Equal(n) => self.equal(*n, length),
            Regions::Listed(regions) => self.listed(regions, length),
        }
    }

    fn equal(&self, n: usize, length: f64) -> Result<Vec<Part>, SetupError> {
        if n == 0 || n > self.cells {
            let message = format!("{n} regions for {} cells: give 1 to {}", self.cells, self.cells);
            return Err(fault("regions", message));
        }
        let region = |i: usize| {
            let (from, to) = (length * i as f64 / n as f64, length * (i + 1) as f64 / n as f64);
            Part {
                says: format!("{from} to {to} cm"),
                n_cell: self.cells_up_to(i + 1, n) - self.cells_up_to(i, n),
            }
        };
        Ok((0..n).map(region).collect())
    }

    /// Cells whose centre lies before `i` of `n` equal parts of the tube.
    fn cells_up_to(&self, i: usize, n: usize) -> usize {
        // (j + 1/2)/N < i/n, in whole numbers.
        (2 * self.cells * i).saturating_sub(n).div_ceil(2 * n)
    }

    fn listed(&self, regions: &[Region], length: f64) -> Result<Vec<Part>, SetupError> {
        check(regions, length)?;
        let before = |x: f64| {
            let centre = |j: usize| (j as f64 + 0.5) * length / self.cells as f64;
            (0..self.cells).take_while(|&j| centre(j) < x - SAME * length).count()
        };
        let mut first = 0;
        let mut parts = Vec::with_capacity(regions.len());
        for (i, region) in regions.iter().enumerate() {
            let end = if i + 1 == regions.len() { self.cells } else { before(region.to) };
            if end == first {
                let message = format!(
                    "`{}` is too short to hold the centre of one of {} cells: give more cells or a longer region",
                    region.name, self.cells
                );
                return Err(fault(&format!("regions[{i}]"), message));
            }
            let says = format!("`{}`, {} to {} cm", region.name, region.from, region.to);
            parts.push(Part { says, n_cell: end - first });
            first = end;
        }
        Ok(parts)
    }
}

/// Refuses a pressure that no vessel is imaged under.
fn check_image(pressure: f64) -> Result<(), SetupError> {
    if !pressure.is_finite() || pressure < 0.0 {
        let message = format!("an image under {pressure} dyn/cm^2: give zero or above");
        return Err(fault("image_pressure", message));
    }
    if pressure > 0.0 && pressure < LOWEST_IMAGE_PRESSURE {
        let message = format!(
            "an image under {pressure} dyn/cm^2 is hardly under pressure: give dyn/cm^2, that is mmHg x 1333.22; 0 for the \
             radius without load"
        );
        return Err(fault("image_pressure", message));
    }
    Ok(())
}

/// Refuses regions that do not cover the tube once, from the inlet to the outlet.
fn check(regions: &[Region], length: f64) -> Result<(), SetupError> {
    let Some(last) = regions.last() else {
        return Err(fault("regions", "no regions: give at least one, or a number of equal ones"));
    };
    let same = |a: f64, b: f64| (a - b).abs() <= SAME * length;
    let mut end = 0.0;
    for (i, region) in regions.iter().enumerate() {
        let Region { name, from, to } = region;
        let at = |key: &str| format!("regions[{i}].{key}");
        if regions[..i].iter().any(|other| other.name == *name) {
            return Err(fault(&at("name"), format!("two regions are named `{name}`")));
        }
        if !(from.is_finite() && to.is_finite() && from < to) {
            return Err(fault(&at("to"), format!("`{name}` ends at {to} cm and starts at {from} cm")));
        }
        if !same(*from, end) {
            let what = if *from > end { "no region covers" } else { "two regions cover" };
            let (a, b) = (end.min(*from), end.max(*from));
            let remedy = format!("start `{name}` at {end}, or put the regions in order along the tube");
            return Err(fault(&at("from"), format!("{what} {a} to {b} cm: {remedy}")));
        }
        end = *to;
    }
    if !same(end, length) {
        let message = format!(
            "the last region, `{}`, ends at {end} cm and the tube at L = {length} cm: both must be the same",
            last.name
        );
        return Err(fault(&format!("regions[{}].to", regions.len() - 1), message));
    }
    Ok(())
}
