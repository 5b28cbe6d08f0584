//! Which node pressures the ties fix to one another, and whether the network determines every pressure and flow.
//!
//! The ties form a forest. Within one of its trees all pressures follow from one; in the tree with the ground all are known.
//! Each other tree has one unknown pressure, which the flows of the branches that leave it determine: tree and co-tree of
//! a network's state equations (Chua, Desoer & Kuh 1987, ch. 12). Next file to read: [`super::solve`].

use starlings_models_core::layout::fault;
use starlings_models_core::{SetupError, quoted_list};

use super::circuit::{Circuit, Ends, Tie};

/// One tie on the way from a tree's root to its leaves.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hop {
    pub(super) tie: usize,
    pub(super) parent: usize,
    pub(super) child: usize,
    /// 1 where the tie runs from parent to child, −1 where it runs from child to parent.
    pub(super) sign: f64,
}

/// The forest of ties.
#[derive(Clone, Debug)]
pub(super) struct Forest {
    /// Every tie, parents before children.
    pub(super) hops: Vec<Hop>,
    /// For each node its tree; tree 0 holds the ground.
    pub(super) tree: Vec<usize>,
    pub(super) n_tree: usize,
}

impl Forest {
    /// Grows the forest.
    ///
    /// # Errors
    /// When ties form a loop, or a tree has no resistive path to the ground.
    pub(super) fn new(circuit: &Circuit) -> Result<Self, SetupError> {
        let (forest, used) = Self::over(circuit, &|_| true);
        if let Some(closing) = used.iter().position(|used| !used) {
            return Err(loop_of_ties(circuit, closing));
        }
        forest.check_paths(circuit)?;
        Ok(forest)
    }

    /// The forest of those ties that are kept, and which of them belong to it.
    pub(super) fn over(circuit: &Circuit, keep: &dyn Fn(&Tie) -> bool) -> (Self, Vec<bool>) {
        let n = circuit.nodes.len();
        let mut forest = Self { hops: Vec::new(), tree: vec![usize::MAX; n], n_tree: 0 };
        let mut used = vec![false; circuit.ties.len()];
        for root in 0..n {
            if forest.tree[root] == usize::MAX {
                forest.grow(circuit, root, keep, &mut used);
                forest.n_tree += 1;
            }
        }
        (forest, used)
    }

    fn grow(&mut self, circuit: &Circuit, root: usize, keep: &dyn Fn(&Tie) -> bool, used: &mut [bool]) {
        self.tree[root] = self.n_tree;
        let mut reached = vec![root];
        let mut next = 0;
        while let Some(&parent) = reached.get(next) {
            next += 1;
            for (tie, branch) in circuit.ties.iter().enumerate().filter(|(_, tie)| keep(tie)) {
                let Ends { from, to } = branch.ends;
                let (child, sign) = match parent {
                    p if p == from => (to, 1.0),
                    p if p == to => (from, -1.0),
                    _ => continue,
                };
                if self.tree[child] == usize::MAX {
                    self.tree[child] = self.n_tree;
                    used[tie] = true;
                    self.hops.push(Hop { tie, parent, child, sign });
                    reached.push(child);
                }
            }
        }
    }

    /// Refuses a tree that no resistive branches join with the ground's.
    fn check_paths(&self, circuit: &Circuit) -> Result<(), SetupError> {
        let mut joined = vec![false; self.n_tree];
        joined[0] = true;
        for _ in 0..self.n_tree {
            for branch in &circuit.resistive {
                let (a, b) = (self.tree[branch.ends.from], self.tree[branch.ends.to]);
                let either = joined[a] || joined[b];
                (joined[a], joined[b]) = (either, either);
            }
        }
        let loose = |node: usize| !joined[self.tree[node]];
        if (0..circuit.nodes.len()).any(loose) { Err(loose_nodes(circuit, &loose)) } else { Ok(()) }
    }
}

/// The refusal of nodes without a resistive path to the ground.
fn loose_nodes(circuit: &Circuit, loose: &dyn Fn(usize) -> bool) -> SetupError {
    let nodes: Vec<usize> = (0..circuit.nodes.len()).filter(|i| loose(*i)).collect();
    let names: Vec<&str> = nodes.iter().map(|i| circuit.nodes[*i].as_str()).collect();
    let (what, verb) = if names.len() == 1 { ("node", "has") } else { ("nodes", "have") };
    let crossing = |ends: Ends| loose(ends.from) != loose(ends.to);
    let inertances = circuit.inertances.iter().map(|b| (b.ends, b.says.as_str()));
    let injections = circuit.injections.iter().map(|b| (b.ends, b.says.as_str()));
    let cut: Vec<&str> =
        inertances.chain(injections).filter(|(ends, _)| crossing(*ends)).map(|(_, name)| name).collect();
    let names = quoted_list(&names);
    let message = if cut.is_empty() {
        format!(
            "{what} {names} {verb} no path to the ground `0` or to a pressure source: join it by a resistance or a \
             capacitor, or remove its elements"
        )
    } else {
        let cut = quoted_list(&cut);
        format!(
            "only {cut} lead to {what} {names}, and inertances and flow sources prescribe their flow: its pressure is \
             undetermined; add a capacitor to the ground there, or a resistance"
        )
    };
    fault(&circuit.places[nodes[0]], message)
}

/// The refusal of a loop of ties, with the ties on it.
fn loop_of_ties(circuit: &Circuit, closing: usize) -> SetupError {
    let Ends { from, to } = circuit.ties[closing].ends;
    let path = &circuit.ties[closing].path;
    // Peel off ties with a loose end until only loops with the closing tie are left; small networks, so plainly.
    let mut left: Vec<usize> = (0..circuit.ties.len()).collect();
    loop {
        let degree = |node: usize, left: &[usize]| {
            let touches = |tie: &&usize| {
                let ends = circuit.ties[**tie].ends;
                ends.from == node || ends.to == node
            };
            left.iter().filter(touches).count()
        };
        let before = left.len();
        let kept: Vec<usize> = left
            .iter()
            .copied()
            .filter(|tie| {
                let ends = circuit.ties[*tie].ends;
                degree(ends.from, &left) > 1 && degree(ends.to, &left) > 1
            })
            .collect();
        left = kept;
        if left.len() == before {
            break;
        }
    }
    let names: Vec<&str> = left.iter().map(|tie| circuit.ties[*tie].says.as_str()).collect();
    let (names, from, to) = (quoted_list(&names), &circuit.nodes[from], &circuit.nodes[to]);
    fault(
        path,
        format!(
            "{names} form a loop of capacitors and pressure sources, which fixes the pressure between `{from}` and `{to}` \
             twice: put a resistance into the loop"
        ),
    )
}
