//! Inertances whose flow a source prescribes.
//!
//! In `rcr-network` both would fix a flow. The pressure across such an inertance is L dQ/dt, which the file's flow gives: an input of its
//! own stands in its place. Next file to read: [`super::network`].

use super::super::plan::Samples;
use super::network::{GROUND, Kind, Network, Node};

impl Network {
    /// Puts the pressure across every inertance in a row behind a flow source in its place, and gives the inputs for that.
    pub(super) fn prescribe(&mut self, courses: &[Samples]) -> Vec<Samples> {
        let mut inputs = Vec::new();
        for source in 0..self.elements.len() {
            let element = &self.elements[source];
            let course = courses.iter().find(|course| course.name == element.name);
            let Some(course) = course.filter(|course| matches!(element.kind, Kind::Flow) && varies(course))
            else {
                continue;
            };
            let (name, inlet) = (element.name.clone(), self.root(element.from) == GROUND);
            let (start, flow) = if inlet { (element.to, 1.0) } else { (element.from, -1.0) };
            for (at, forwards) in self.row(source, start) {
                let Kind::Inertance(inertance) = self.elements[at].kind else { continue };
                // The pressure of a source counts from its start to its end, against the drop.
                let factor = -inertance * flow * if forwards { 1.0 } else { -1.0 };
                let driven = self.elements[at].name.clone();
                inputs.push(Samples {
                    name: driven.clone(),
                    times: course.times.clone(),
                    values: rates(course).into_iter().map(|rate| factor * rate).collect(),
                });
                self.elements[at].kind = Kind::Pressure;
                self.notes.push(format!(
                    "the source `{name}` prescribes the flow through the inertance `{driven}`: the pressure across it, {inertance:?} times \
                     the rate of that flow, is an input of this name"
                ));
            }
        }
        inputs
    }

    /// The elements that the whole flow of a source passes one after another from a node on, each with whether it enters at its start.
    fn row(&self, source: usize, start: Node) -> Vec<(usize, bool)> {
        let (mut row, mut last, mut node) = (Vec::new(), source, self.root(start));
        while node != GROUND && row.len() < self.elements.len() {
            let touches = |at: &usize| {
                let element = &self.elements[*at];
                *at != last && [element.from, element.to].into_iter().any(|end| self.root(end) == node)
            };
            let others: Vec<usize> = (0..self.elements.len()).filter(touches).collect();
            let [next] = others[..] else { break };
            let element = &self.elements[next];
            if !matches!(
                element.kind,
                Kind::Resistance(_) | Kind::Loss { .. } | Kind::Inertance(_) | Kind::Valve { .. }
            ) {
                break;
            }
            let forwards = self.root(element.from) == node;
            row.push((next, forwards));
            (last, node) = (next, self.root(if forwards { element.to } else { element.from }));
        }
        row
    }
}

/// Whether it is not the same all the time.
fn varies(course: &Samples) -> bool {
    course.values.iter().any(|value| value.to_bits() != course.values[0].to_bits())
}

/// Derivatives at the samples, of the parabola through each and its two neighbours: to second order, as the program's own steps.
fn rates(course: &Samples) -> Vec<f64> {
    let n = course.times.len() - 1;
    let pair = |k: usize| (course.times[k + 1] - course.times[k], course.values[k + 1] - course.values[k]);
    let between = |(left, rise): (f64, f64), (right, climb): (f64, f64)| {
        (right * rise / left + left * climb / right) / (left + right)
    };
    // The end of a period is the start of the next, unless it jumps there.
    let ends = if course.jumps() {
        [pair(0), pair(n - 1)].map(|(step, rise)| rise / step)
    } else {
        [between(pair(n - 1), pair(0)); 2]
    };
    (0..=n)
        .map(|k| match k {
            0 => ends[0],
            k if k == n => ends[1],
            k => between(pair(k - 1), pair(k)),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_a_parabola_is_exact_and_a_period_has_no_ends() {
        let times = vec![0.0, 0.1, 0.3, 0.4];
        let course = |values: Vec<f64>| Samples { name: String::new(), times: times.clone(), values };
        let found = rates(&course(times.iter().map(|t| t * t).collect()));
        assert!((found[1] - 0.2).abs() < 1e-12 && (found[2] - 0.6).abs() < 1e-12, "{found:?}");
        let found = rates(&course(vec![1.0, 2.0, 0.0, 1.0]));
        assert!((found[0] - 10.0).abs() < 1e-12 && (found[3] - 10.0).abs() < 1e-12, "{found:?}");
    }
}
