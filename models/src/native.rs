//! The built-in models: one file each, and the list that makes them known.
//!
//! Being listed here is being in the catalogue and in every family test. Next file to read: [`windkessel2`] for the
//! smallest model, then [`crate::catalogue`].

pub mod driven_oscillator;
pub mod oscillator;
pub mod relaxation;
pub mod windkessel2;
pub mod windkessel3;
pub mod windkessel4;

use crate::Model;

pub use driven_oscillator::DrivenOscillator;
pub use oscillator::Oscillator;
pub use windkessel2::Windkessel2;
pub use windkessel3::Windkessel3;
pub use windkessel4::Windkessel4;

/// Every built-in model.
pub fn all() -> Vec<Box<dyn Model>> {
    vec![
        Box::new(Windkessel2::default()),
        Box::new(Windkessel3::default()),
        Box::new(Windkessel4::default()),
        Box::new(Oscillator::default()),
        Box::new(DrivenOscillator::default()),
    ]
}
