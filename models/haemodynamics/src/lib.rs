//! Built-in models of the circulation: Windkessels, networks of vessels, compliant tubes and arteries, and the small
//! fluid–structure systems and oscillators on which their observers are tried.
//!
//! Each model is one file with its test against a closed form or a published table. Nothing here knows studies, estimation or
//! how a run is made; a layout that a model refuses is a [`starlings_models_core::SetupError`], a run that it cannot finish a
//! [`starlings_models_core::ModelFailure`]. Next file to read: [`windkessel2`] for the smallest model, then [`fsi_tube`].

mod artery_1d;
mod driven_oscillator;
pub mod fsi_tube;
mod oscillator;
pub mod prestress;
mod rcr_network;
mod relaxation;
mod toy_fsi;
mod toy_fsi_stokes;
mod toy_fsi_windkessel;
mod windkessel2;
mod windkessel3;
mod windkessel4;

use starlings_models_core::NativeModel;

pub use artery_1d::Artery1d;
use driven_oscillator::DrivenOscillator;
pub use fsi_tube::FsiTube;
pub use oscillator::Oscillator;
use toy_fsi::ToyFsi;
use toy_fsi_stokes::ToyFsiStokes;
use toy_fsi_windkessel::ToyFsiWindkessel;
pub use windkessel2::Windkessel2;
use windkessel3::Windkessel3;
use windkessel4::Windkessel4;

/// Every model of this family.
pub const MODELS: &[NativeModel] = &[
    NativeModel::fixed::<Windkessel2>("windkessel-2"),
    NativeModel::fixed::<Windkessel3>("windkessel-3"),
    NativeModel::fixed::<Windkessel4>("windkessel-4"),
    NativeModel::fixed::<Oscillator>("oscillator"),
    NativeModel::fixed::<DrivenOscillator>("driven-oscillator"),
    NativeModel::laid_out("fsi-tube", FsiTube::build).of_own_order(),
    NativeModel::laid_out("artery-1d", Artery1d::build).of_own_order(),
    NativeModel::laid_out("toy-fsi", ToyFsi::build),
    NativeModel::laid_out("toy-fsi-windkessel", ToyFsiWindkessel::build),
    NativeModel::laid_out("toy-fsi-stokes", ToyFsiStokes::build),
    NativeModel::laid_out("rcr-network", rcr_network::build),
];

/// Steps of a model's own scheme within one span of linear inputs, at most.
const MOST_STEPS: u64 = 100_000_000;
/// Cells of all vessels together at most: structural observers work with matrices of this size.
const MOST_CELLS: usize = 10_000;
