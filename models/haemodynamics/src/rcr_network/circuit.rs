//! A network sorted by what each branch prescribes: a pressure difference, a flow, or a law between the two.
//!
//! - Ties fix the difference of their ends' pressures: capacitors by their state, pressure sources by their level.
//! - Resistive branches have a flow that grows with the pressure drop.
//! - Inertances and flow sources prescribe their flow.
//!
//! Positions in θ, in the state and among the signals are resolved; names are gone. Next file to read: [`super::topology`].

/// A loss without a resistance has this part of the smallest one of the network: half of the digits of a number.
const NEGLIGIBLE: f64 = 1e-8;

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
    /// A capacitor under a share of the pressure of a chamber; p(from) − p(to) − share · p is this state.
    Under { state: usize, compliance: usize, share: usize, around: Around },
    /// A chamber; this state is its volume.
    Chamber { state: usize, law: Chamber },
    /// p(to) − p(from) is the level.
    Pressure(Level),
}

/// The chamber around a capacitor: the node that the netlist names, and the chamber's tie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around {
    pub(super) node: usize,
    pub(super) tie: usize,
}

/// Positions in θ and among the signals of what a chamber's pressure follows from; see [`super::laws`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Chamber {
    pub(super) active: usize,
    pub(super) passive: usize,
    pub(super) rest: usize,
    pub(super) rest_active: usize,
    /// Scale and rate of an exponential wall.
    pub(super) wall: Option<[usize; 2]>,
    /// Signal of the activation.
    pub(super) activation: usize,
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
    Valve { open: usize, closed: usize, steepness: f64 },
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
        let chamber = |tie: &Tie| matches!(tie.kind, TieKind::Chamber { .. });
        self.resistive.iter().all(|branch| matches!(branch.law, Law::Linear { .. }))
            && !self.ties.iter().any(chamber)
    }

    /// The resistance that a branch has at least, one of zero among them: far below every other of the network, and far above what rounding hides.
    pub(super) fn least_resistance(&self, theta: &[f64]) -> f64 {
        let of = |law: Law| match law {
            Law::Linear { resistance: at } | Law::Loss { linear: at, .. } => theta[at],
            Law::Diode { .. } | Law::Valve { .. } => 0.0,
        };
        let given = self.resistive.iter().map(|branch| of(branch.law)).filter(|r| *r > 0.0);
        let least = given.fold(f64::INFINITY, f64::min);
        NEGLIGIBLE * if least.is_finite() { least } else { 1.0 }
    }

    /// Positions in θ of the levels of constant sources.
    pub(super) fn constant_levels(&self) -> impl Iterator<Item = usize> + '_ {
        self.ties.iter().filter_map(|tie| match tie.kind {
            TieKind::Pressure(Level::Parameter(at)) => Some(at),
            _ => None,
        })
    }

    /// Whether the rate has a kink at the drop of some valve.
    pub(super) fn has_sharp_valves(&self) -> bool {
        let sharp = |law: Law| matches!(law, Law::Diode { smooth, .. } if smooth <= 0.0);
        self.resistive.iter().any(|branch| sharp(branch.law))
    }
}
