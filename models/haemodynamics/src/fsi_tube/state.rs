//! The parts of the tube's state.
//!
//! Next file to read: [`super::midpoint`].

/// Displacement and velocity of the wall, one per cell, and the pressure of the Windkessel.
pub(super) struct State<'a> {
    pub(super) eta: &'a mut [f64],
    pub(super) w: &'a mut [f64],
    pub(super) pi: &'a mut f64,
}

impl<'a> State<'a> {
    /// Splits 2N + 1 values.
    pub(super) fn of(x: &'a mut [f64]) -> Self {
        let Some((pi, wall)) = x.split_last_mut() else {
            unreachable!("a tube's state holds at least its Windkessel");
        };
        let (eta, w) = wall.split_at_mut(wall.len() / 2);
        Self { eta, w, pi }
    }
}
