//! One run, as a program outside is asked for it.

use crate::effect::Addition;
use crate::{ObserverDef, Stop, Window};

/// One run, as the program is asked for it.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// Index of the sigma point.
    pub particle: u32,
    /// Index of the record.
    pub record: u32,
    /// Parameters in the order and the units of the description.
    pub parameters: &'a [f64],
    /// Initial values that are estimated or fixed, by the name of the state's component; for runs without `state`.
    pub initial: &'a [(String, f64)],
    /// Names of the outputs that are asked for; a field takes as many rows as it has components.
    pub outputs: &'a [String],
    /// Start, times and inputs; the observed values are those of `outputs`.
    pub window: &'a Window,
    /// The observer.
    pub observer: &'a ObserverDef,
    /// State at the start, in the order of the description.
    pub state: Option<&'a [f64]>,
    /// Terms added to the rates of hosted states.
    pub terms: &'a [Addition],
    /// Values of names in the terms that are no quantities of the program.
    pub constants: &'a [(String, f64)],
    /// Tells when nobody wants the answer any more; the program is then ended.
    pub stop: Option<&'a Stop>,
    /// Where the run belongs in a trace, `traceparent` of the W3C recommendation "Trace Context".
    pub traceparent: Option<&'a str>,
}
