//! A simply supported plate that has lost stiffness in a patch, struck at a point and watched by sensors.
//!
//! Transverse waves of all modes, exactly coupled by the patch. No shear, no membrane force, no second patch. The stiffness is that
//! of the equation as it is written, D(1 − ε χ) Lap² w: a plate whose bending energy has a local D differs by terms with the slope
//! of D at the patch's edge. Next file to read: `plate/geometry.rs`, then `plate/overlap.rs`, then `plate/model.rs`.

mod damaged;
mod geometry;
mod inspection;
mod layout;
mod least_squares;
mod model;
mod overlap;
mod search;

pub use damaged::Damage;
pub use geometry::{Geometry, Material};
pub use inspection::{Arrangement, Inspection};
pub use layout::Layout;
pub use model::PlateModel;
pub use overlap::{Overlap, Patch};
pub use search::{Dictionary, Located, locate};
