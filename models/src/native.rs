//! The built-in models: one file each, and the list that makes them known.
//!
//! Being listed here is being in the catalogue and in every family test. Next file to read: [`windkessel2`] for the
//! smallest model, then [`crate::catalogue`].

pub mod artery_1d;
pub mod driven_oscillator;
pub mod fsi_tube;
pub mod oscillator;
pub mod rcr_network;
pub mod relaxation;
pub mod toy_fsi;
pub mod toy_fsi_stokes;
pub mod toy_fsi_windkessel;
pub mod windkessel2;
pub mod windkessel3;
pub mod windkessel4;

use crate::SetupError;
use crate::setup::ModelDef;
use crate::{Model, layout};

pub use artery_1d::Artery1d;
pub use driven_oscillator::DrivenOscillator;
pub use fsi_tube::FsiTube;
pub use oscillator::Oscillator;
pub use rcr_network::RcrNetwork;
pub use toy_fsi::ToyFsi;
pub use toy_fsi_stokes::ToyFsiStokes;
pub use toy_fsi_windkessel::ToyFsiWindkessel;
pub use windkessel2::Windkessel2;
pub use windkessel3::Windkessel3;
pub use windkessel4::Windkessel4;

/// Steps of a model's own scheme within one span of linear inputs, at most.
const MOST_STEPS: u64 = 100_000_000;
/// Cells of all vessels together at most: structural observers work with matrices of this size.
const MOST_CELLS: usize = 10_000;

/// One built-in model of the list.
pub struct Kind {
    /// The `kind` by which a study names it.
    pub kind: &'static str,
    /// Makes it; without a layout, in its default one.
    pub build: fn(&ModelDef) -> Result<Box<dyn Model>, SetupError>,
}

/// Every built-in model.
pub fn kinds() -> Vec<Kind> {
    vec![
        Kind { kind: "windkessel-2", build: fixed::<Windkessel2> },
        Kind { kind: "windkessel-3", build: fixed::<Windkessel3> },
        Kind { kind: "windkessel-4", build: fixed::<Windkessel4> },
        Kind { kind: "oscillator", build: fixed::<Oscillator> },
        Kind { kind: "driven-oscillator", build: fixed::<DrivenOscillator> },
        Kind { kind: "fsi-tube", build: FsiTube::build },
        Kind { kind: "artery-1d", build: Artery1d::build },
        Kind { kind: "toy-fsi", build: ToyFsi::build },
        Kind { kind: "toy-fsi-windkessel", build: ToyFsiWindkessel::build },
        Kind { kind: "toy-fsi-stokes", build: ToyFsiStokes::build },
        Kind { kind: "rcr-network", build: rcr_network::build },
    ]
}

/// Every built-in model in its default layout.
///
/// # Errors
/// When a model refuses its own default, which is a defect.
pub fn all() -> Result<Vec<Box<dyn Model>>, SetupError> {
    kinds()
        .into_iter()
        .map(|kind| (kind.build)(&ModelDef { kind: kind.kind.to_owned(), ..ModelDef::default() }))
        .collect()
}

/// Builds a model that has no layout.
fn fixed<M: Model + Default + 'static>(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
    layout::none(def)?;
    Ok(Box::new(M::default()))
}
