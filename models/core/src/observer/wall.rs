//! What an observer sees of a wall: which observed rows show which nodes, and the innovation on the nodes.
//!
//! What it does with the innovation is each observer's own. Next file to read: [`super::dvf`].

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::measured::{mean_innovation, shown};
use super::{Correction, Wiring, one};
use crate::setup::ObserverDef;
use crate::{Blocks, Model, NativeModels, Spec};
use crate::{SetupError, quoted_list};

/// Which of the wall's outputs an observer takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shown {
    /// The wall displacement.
    Displacement,
    /// The wall velocity.
    Velocity,
}

/// The observed nodes of a wall and where its unknowns stand in the state.
#[derive(Debug)]
pub(super) struct Wall {
    /// Gain, in 1/time.
    pub(super) gain: f64,
    /// Position of the first displacement in the state.
    pub(super) displacement: usize,
    /// Position of the first velocity unknown in the state.
    pub(super) velocity: usize,
    /// Per node the observed rows that show it.
    rows: Vec<Vec<usize>>,
}

/// Observed − predicted on the nodes of a wall.
#[derive(Debug)]
pub(super) struct Innovation {
    /// Whether each node was observed: the diagonal of H.
    pub(super) observed: Vec<bool>,
    /// n, zero where nothing was observed; the mean where several rows show one node.
    pub(super) value: DVector<f64>,
    /// n, the time since each node was observed before; zero where it is not now.
    pub(super) span: DVector<f64>,
}

impl Wall {
    /// Finds the observed nodes.
    ///
    /// # Errors
    /// When the model has no wall, or the output that the observer needs is not observed.
    pub(super) fn new(def: &ObserverDef, wiring: &Wiring<'_>, shown: Shown) -> Result<Self, SetupError> {
        let blocks = hosted(def, wiring, Some)?;
        let outputs = blocks.outputs;
        let field = match shown {
            Shown::Displacement => outputs.displacement,
            Shown::Velocity => outputs.velocity,
        };
        let mut rows = vec![Vec::new(); blocks.n_wall()];
        for (row, node) in components(wiring, field)? {
            rows[node].push(row);
        }
        if rows.iter().all(Vec::is_empty) {
            let other = match shown {
                Shown::Displacement => {
                    format!("where only `{}` is recorded take `dvf`, which observes that", outputs.velocity)
                }
                Shown::Velocity => format!(
                    "a recorded displacement can be differentiated in time, which multiplies its noise by \
                     √2/Δt, or take `sdf`, which observes `{}`",
                    outputs.displacement
                ),
            };
            return Err(SetupError::Invalid(format!(
                "the observer `{}` needs the output `{field}` observed, and no channel has it: add a channel \
                 with `output = \"{field}\"`, or with some of its components; {other}",
                def.kind
            )));
        }
        let (displacement, velocity) = (blocks.displacement, blocks.velocity);
        Ok(Self { gain: def.gain, displacement, velocity, rows })
    }

    /// The innovation of one observation time; `None` when nothing was observed or everything was as predicted.
    pub(super) fn innovation(&self, at: &Correction<'_>) -> Option<Innovation> {
        let means: Vec<Option<(f64, f64)>> = self.rows.iter().map(|rows| mean_innovation(at, rows)).collect();
        let of = |part: fn((f64, f64)) -> f64| {
            DVector::from_iterator(means.len(), means.iter().map(|mean| mean.map_or(0.0, part)))
        };
        let (value, span) = (of(|(mean, _)| mean), of(|(_, span)| span));
        if value.iter().all(|v| *v == 0.0) {
            return None;
        }
        Some(Innovation { observed: means.iter().map(Option::is_some).collect(), value, span })
    }

    /// The rows that show a node.
    pub(super) fn reads(&self) -> Vec<usize> {
        self.rows.iter().flatten().copied().collect()
    }

    /// H of the nodes that the channels can show.
    pub(super) fn observed(&self) -> Vec<bool> {
        self.rows.iter().map(|rows| !rows.is_empty()).collect()
    }
}

impl Innovation {
    /// The innovation as an n × 1 matrix.
    pub(super) fn column(&self) -> DMatrix<f64> {
        DMatrix::from_column_slice(self.value.len(), 1, self.value.as_slice())
    }

    /// The longest time since a node that is observed now was observed before.
    pub(super) fn longest(&self) -> f64 {
        self.span.max()
    }

    /// W N W of a norm N, W² the times since the nodes were observed before over the longest: symmetric where N is.
    pub(super) fn weighed(&self, mut norm: DMatrix<f64>) -> DMatrix<f64> {
        let longest = self.longest();
        for (node, span) in self.span.iter().enumerate() {
            let weight = (span / longest).sqrt();
            norm.row_mut(node).scale_mut(weight);
            norm.column_mut(node).scale_mut(weight);
        }
        norm
    }

    /// The columns of nodes, each times W² of [`Self::weighed`].
    pub(super) fn by_node(&self, mut columns: DMatrix<f64>) -> DMatrix<f64> {
        let longest = self.longest();
        for (mut column, span) in columns.column_iter_mut().zip(self.span.iter()) {
            column.scale_mut(span / longest);
        }
        columns
    }
}

/// The most components of a state field behind blocks: they are dense, 8 MB each at this size, and a correction makes several.
pub(super) const MOST_NODES: usize = 1000;

/// Refuses states that are named for an observer which knows its own.
pub(super) fn names_no_states(def: &ObserverDef) -> Result<(), SetupError> {
    if !def.corrects.is_empty() {
        return Err(SetupError::Invalid(format!(
            "the observer `{}` knows which states it corrects: remove `corrects`, or take `nudging`, which uses it",
            def.kind
        )));
    }
    Ok(())
}

/// The part of the model's blocks that an observer stands on.
///
/// # Errors
/// When the model has none: which models have, and what to do instead; when it is too large for dense blocks.
pub(super) fn hosted<T>(
    def: &ObserverDef,
    wiring: &Wiring<'_>,
    part: fn(Blocks) -> Option<T>,
) -> Result<T, SetupError> {
    names_no_states(def)?;
    let largest = wiring.spec.states.iter().map(|q| q.size).max().unwrap_or(0);
    if largest > MOST_NODES {
        return Err(SetupError::Invalid(format!(
            "the observer `{}` works with dense matrices of a wall of at most {MOST_NODES} nodes, and `{}` has a state \
             of {largest} components: make it coarser in `[model.layout]`, or take `nudging`, which needs no matrix",
            def.kind, wiring.spec.kind
        )));
    }
    if let Some(part) = wiring.model.blocks(wiring.theta).and_then(part) {
        return Ok(part);
    }
    let hosts = hosts(def, wiring.native)?;
    let hosts = if hosts.is_empty() { "none of the built-in models".to_owned() } else { quoted_list(hosts) };
    Err(SetupError::Invalid(format!(
        "the observer `{}` cannot be hosted by the model `{}`, which lacks the part of a fluid–structure system \
         that it corrects; models that can host it: {hosts}; with any model the observer `nudging` pulls observed \
         states, and `none` leaves the state free",
        def.kind, wiring.spec.kind
    )))
}

/// The kinds of the models that host an observer when all of their outputs are observed: those against which it can be built.
///
/// # Errors
/// When a model refuses its own default layout, which is a defect.
pub(super) fn hosts(def: &ObserverDef, native: NativeModels) -> Result<Vec<String>, SetupError> {
    let hosts = |model: &dyn Model| {
        let (spec, theta) = (model.spec(), vec![1.0; model.spec().parameters.len()]);
        let outputs: Vec<String> = spec.outputs.iter().map(|q| q.name.clone()).collect();
        // No list to name others from: what does not fit is asked no further.
        let native = NativeModels::NONE;
        one(def, Wiring { spec, outputs: &outputs, model, theta: &theta, native }).is_ok()
    };
    Ok(native.all()?.iter().filter(|model| hosts(&***model)).map(|model| model.spec().kind.clone()).collect())
}

/// Every observed row that shows the output `field` or one of its components, with the component.
///
/// # Errors
/// When an observed output is unknown.
pub(super) fn components(wiring: &Wiring<'_>, field: &str) -> Result<Vec<(usize, usize)>, SetupError> {
    let outputs = &wiring.spec.outputs;
    let whole = Spec::range_of(outputs, field).unwrap_or_default();
    let mut row = 0;
    let mut found = Vec::new();
    for name in wiring.outputs {
        let Some(part) = shown(wiring.spec, name)? else {
            row += 1;
            continue;
        };
        let n = part.len();
        let inside = part.enumerate().filter(|(_, at)| whole.contains(at));
        found.extend(inside.map(|(i, at)| (row + i, at - whole.start)));
        row += n;
    }
    Ok(found)
}

/// H N H: the rows and columns of unobserved nodes are zero.
pub(super) fn restricted(mut norm: DMatrix<f64>, observed: &[bool]) -> DMatrix<f64> {
    for (node, _) in observed.iter().enumerate().filter(|(_, seen)| !**seen) {
        norm.row_mut(node).fill(0.0);
        norm.column_mut(node).fill(0.0);
    }
    norm
}

/// Eᵀ f: what forces (or columns of forces) on the wall are to the velocity unknowns.
pub(super) fn on_velocity(trace: Option<&DMatrix<f64>>, force: DMatrix<f64>) -> DMatrix<f64> {
    match trace {
        Some(trace) => trace.tr_mul(&force),
        None => force,
    }
}

/// N E: a matrix on the wall as one on the velocity unknowns.
pub(super) fn of_velocity(trace: Option<&DMatrix<f64>>, wall: DMatrix<f64>) -> DMatrix<f64> {
    match trace {
        Some(trace) => wall * trace,
        None => wall,
    }
}

/// M⁻¹ b; not-a-number where M is not positive definite, which the run then reports.
pub(super) fn solve(mass: DMatrix<f64>, mut right: DMatrix<f64>) -> DMatrix<f64> {
    match Cholesky::<f64, Dyn>::new(mass) {
        Some(factor) => factor.solve_mut(&mut right),
        None => right.fill(f64::NAN),
    }
    right
}

/// Adds to the state components from `first` on.
pub(super) fn add(x: &mut [f64], first: usize, by: &[f64]) {
    for (x, by) in x[first..].iter_mut().zip(by) {
        *x += by;
    }
}

/// A feedback matrix with one block, its top left entry at (row, column).
pub(super) fn feedback(model: &dyn Model, at: (usize, usize), block: &DMatrix<f64>) -> DMatrix<f64> {
    let n = model.spec().n_state();
    let mut feedback = DMatrix::zeros(n, n);
    feedback.view_mut(at, block.shape()).copy_from(block);
    feedback
}
