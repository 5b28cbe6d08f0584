//! Direct velocity feedback in the norm of solid and added mass: [`super::dvf`] with Ms + MA in place of Ms.
//!
//! Under full observation every mode decays with γ/2, however heavy the fluid. The added mass couples all nodes, so with a
//! part of the wall observed the gain is lost again on modes that live elsewhere. Next file to read: [`super::sdf`].

use super::Kind;
use super::dvf::VelocityFeedback;

/// The entry of the observer list.
pub(super) const KIND: Kind = Kind {
    kind: "dvf-am",
    says: "Observed wall velocities damp the error, weighed by the mass of the wall and of the fluid that moves with it.",
    build: |def, wiring| {
        let norm = |blocks: &crate::Blocks| &blocks.solid_mass + &blocks.added_mass;
        Ok(Box::new(VelocityFeedback::new(def, wiring, norm)?))
    },
};
