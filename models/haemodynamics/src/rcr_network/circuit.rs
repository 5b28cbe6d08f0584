//! A network sorted by what each branch prescribes: a pressure difference, a flow, or a law between the two.
//!
//! - Ties fix the difference of their ends' pressures: capacitors by their state, pressure sources by their level.
//! - Resistive branches have a flow that grows with the pressure drop.
//! - Inertances and flow sources prescribe their flow.
//!
//! Positions in θ, in the state and among the signals are resolved; names are gone. Next file to read: [`super::topology`].

/// The two nodes of a branch; node 0 is the ground. Flow counts from the first to the second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ends {
    pub(super) from: usize,
    pub(super) to: usize,
}

/// A branch that fixes p(from) − p(to).
#[derive(Clone, Debug)]
pub(super) struct Tie {
    pub(super) ends: Ends,
    pub(super) kind: TieKind,
    /// Names of its elements, for messages.
    pub(super) says: String,
    /// Where the first of them is written.
    pub(super) path: String,
}

/// What fixes the difference.
#[derive(Clone, Debug)]
pub(super) enum TieKind {
    /// Capacitors side by side; the difference is this state.
    Capacitors { state: usize, parts: Vec<Capacitor> },
    /// p(to) − p(from) is the level.
    Pressure(Level),
}

/// One capacitor of a tie: q = C d(p(from) − p(to) − p_out)/dt.
#[derive(Clone, Debug)]
pub(super) struct Capacitor {
    /// Position of C in θ.
    pub(super) compliance: usize,
    /// Signal of the pressure outside, p_out.
    pub(super) outside: Option<usize>,
    /// −1 where the element is written against the tie's direction.
    pub(super) sign: f64,
}

/// The level of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Level {
    Signal(usize),
    Parameter(usize),
}

impl Level {
    pub(super) fn value(self, theta: &[f64], signals: &[f64]) -> f64 {
        match self {
            Self::Signal(at) => signals[at],
            Self::Parameter(at) => theta[at],
        }
    }
}

/// A branch whose flow is a law of its pressure drop.
#[derive(Clone, Debug)]
pub(super) struct Resistive {
    pub(super) ends: Ends,
    pub(super) law: Law,
    /// Position in θ of a pressure that the flow has to overcome at the far end.
    pub(super) against: Option<usize>,
}

/// Positions in θ of the values of a law; see [`super::laws`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Law {
    Linear { resistance: usize },
    Loss { linear: usize, quadratic: usize },
    Diode { open: usize, closed: usize, smooth: f64 },
}

/// L dq/dt = p(from) − p(to).
#[derive(Clone, Debug)]
pub(super) struct Inertance {
    pub(super) ends: Ends,
    /// Position of L in θ.
    pub(super) value: usize,
    /// Position of the flow in the state.
    pub(super) state: usize,
    pub(super) says: String,
}

/// A branch with a given flow.
#[derive(Clone, Debug)]
pub(super) struct Injection {
    pub(super) ends: Ends,
    pub(super) signal: usize,
    pub(super) says: String,
}

/// Where the flow of an element is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FlowOf {
    Resistive(usize),
    Tie(usize),
    Capacitor(usize, usize),
    Inertance(usize),
    Injection(usize),
}

/// The network.
#[derive(Clone, Debug, Default)]
pub(super) struct Circuit {
    /// Names of the nodes, the ground first.
    pub(super) nodes: Vec<String>,
    /// Where each node is named first.
    pub(super) places: Vec<String>,
    pub(super) n_state: usize,
    pub(super) n_signal: usize,
    pub(super) ties: Vec<Tie>,
    pub(super) resistive: Vec<Resistive>,
    pub(super) inertances: Vec<Inertance>,
    pub(super) injections: Vec<Injection>,
}

impl Circuit {
    /// Whether the rate of the state is affine in state and signals.
    pub(super) fn is_linear(&self) -> bool {
        self.resistive.iter().all(|branch| matches!(branch.law, Law::Linear { .. }))
    }
}
