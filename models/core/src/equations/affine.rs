//! Which outputs measure a state: those that are one state plus terms without states.
//!
//! Next file to read: [`super::build`].

use super::node::{Function, Node, Operation};

/// The position of the state that `value` is, up to terms without states, given how names map to states.
pub(super) fn measured(value: &Node, state: &dyn Fn(&str) -> Option<usize>) -> Option<usize> {
    let mut found = None;
    for (term, positive) in terms(value) {
        match term {
            Node::Name(name) if state(&name.text).is_some() => {
                if !positive || found.is_some() {
                    return None;
                }
                found = state(&name.text);
            }
            other => {
                let mut free = true;
                other.walk(&mut |part| free &= part.name().is_none_or(|n| state(&n.text).is_none()));
                if !free {
                    return None;
                }
            }
        }
    }
    found
}

/// The summands of a tree, each with whether it is added.
fn terms(node: &Node) -> Vec<(&Node, bool)> {
    let mut open = vec![(node, true)];
    let mut done = Vec::new();
    while let Some((part, positive)) = open.pop() {
        match part {
            Node::Pair(Operation::Add, a, b) => open.extend([(&**a, positive), (&**b, positive)]),
            Node::Pair(Operation::Sub, a, b) => open.extend([(&**a, positive), (&**b, !positive)]),
            Node::Call(Function::Neg, a) => open.push((a, !positive)),
            other => done.push((other, positive)),
        }
    }
    done
}
