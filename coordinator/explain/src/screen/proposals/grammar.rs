//! The grammar of terms that an equation may lack: powers, inverses, products, quotients, directions, limits and trends of the states and
//! inputs, and what the model's own rates become where they enter another equation or change with a quantity ([`own_rates`]).
//!
//! Dimensions are carried by the coefficient, so that a term is possible wherever nothing but numbers enters a function; what needs a
//! scale takes it from the course of its quantity. A factor of constant sign has no direction and no size of its own. Next file to
//! read: [`own_rates`].

mod own_rates;

use starlings_models::effect::library::{MOST_SIGN_WIDTH, SIGN_WIDTH};
use starlings_models::effect::{Addition, EffectParameter};
use starlings_models::units;
use starlings_models::{EffectDef, Quantity, Role};
use starlings_study::Study;

use crate::locate::Track;

/// Quantities that enter at most, those of the study's order: the number of terms grows with its square.
const MOST: usize = 6;
/// Part of a quantity's swing below which its root goes straight to zero and its inverse stays finite.
const WIDTH: f64 = 0.02;

/// A state or input with the ends of its course.
#[derive(Clone, Copy)]
struct Signal<'a> {
    of: &'a Quantity,
    ends: [f64; 2],
}

impl Signal<'_> {
    fn name(&self) -> &str {
        &self.of.name
    }

    fn swing(&self) -> f64 {
        0.5 * (self.ends[1] - self.ends[0])
    }

    fn changes_sign(&self) -> bool {
        self.ends[0] < 0.0 && self.ends[1] > 0.0
    }

    /// Whether zero lies outside of its course, farther than a root is rounded.
    fn keeps_from_zero(&self) -> bool {
        self.ends[0] > WIDTH * self.swing() || self.ends[1] < -WIDTH * self.swing()
    }
}

/// An equation whose terms are made.
struct Equation<'a> {
    state: &'a Quantity,
    time: &'a str,
    made: Vec<EffectDef>,
}

/// Every term that the equation of a state may lack; none of a displacement, whose rate is a velocity by definition.
pub(super) fn grammar(study: &Study, state: &str, tracks: &[Track]) -> Vec<EffectDef> {
    let spec = &study.spec;
    let scalar = |q: &&Quantity| q.size == 1;
    let Some(state) =
        spec.states.iter().filter(scalar).find(|q| q.name == state && q.role != Role::Displacement)
    else {
        return Vec::new();
    };
    let signal = |of| -> Option<Signal<'_>> {
        let of: &Quantity = of;
        let ends = tracks.iter().find(|t| t.name == of.name)?.ends();
        (ends[1] - ends[0] > 1e-9 * ends[0].abs().max(ends[1].abs()) && ends.iter().all(|e| e.is_finite()))
            .then_some(Signal { of, ends })
    };
    let signals: Vec<Signal<'_>> =
        spec.states.iter().chain(&spec.inputs).filter(scalar).filter_map(signal).take(MOST).collect();
    let mut equation = Equation { state, time: &study.time_unit, made: Vec::new() };
    equation.add("trend", &[], 1.0, "grows with time", |k| format!("{k}*t"));
    for (i, q) in signals.iter().enumerate() {
        equation.of_one(q);
        for p in &signals[i + 1..] {
            equation.of_two(q, p);
        }
    }
    if let Some(equations) = &study.setup.model.equations {
        equation.of_rates(&own_rates::own_rates(equations, &signals), &signals);
    }
    equation.made
}

/// A parameter inside a term: where it may lie, where it is tried, and whether it rounds a corner.
struct Inner {
    range: [f64; 2],
    grid: Vec<f64>,
    is_rounding: bool,
}

impl Inner {
    fn new(range: [f64; 2], grid: &[f64]) -> Self {
        Self { range, grid: grid.to_vec(), is_rounding: false }
    }
}

impl Equation<'_> {
    /// The terms of one quantity.
    fn of_one(&mut self, q: &Signal<'_>) {
        let (x, own) = (q.name().to_owned(), q.name() == self.state.name);
        let width = WIDTH * q.swing();
        self.add("even-square", &[(q, 2.0)], 0.0, &format!("goes with the square of {x}"), |k| {
            format!("{k}*{x}^2")
        });
        self.add("cube", &[(q, 3.0)], 0.0, &format!("goes with the cube of {x}"), |k| format!("{k}*{x}^3"));
        self.add("drift", &[(q, 1.0)], 1.0, &format!("goes with {x} and grows with time"), |k| {
            format!("{k}*{x}*t")
        });
        let root = format!("goes with the square root of the size of {x}");
        self.add("root", &[(q, 0.5)], 0.0, &root, |k| format!("{k}*{x}/sqrt(abs({x}) + {width:?})"));
        if q.keeps_from_zero() {
            let inverse = format!("goes with one over {x}");
            self.add("inverse", &[(q, -1.0)], 0.0, &inverse, |k| {
                format!("{k}*{x}/({x}^2 + {:?})", width * width)
            });
            let square = format!("goes with one over the square of {x}");
            self.add("inverse-square", &[(q, -2.0)], 0.0, &square, |k| {
                format!("{k}/({x}^2 + {:?})", width * width)
            });
        }
        if q.changes_sign() {
            let square = format!("goes with the square of {x} and has its sign");
            self.add("odd-square", &[(q, 2.0)], 0.0, &square, |k| format!("{k}*{x}*abs({x})"));
            // As a dry friction of the library, so that the two are known as one effect.
            let width = Inner {
                is_rounding: true,
                ..Inner::new([0.0, MOST_SIGN_WIDTH * q.swing()], &[SIGN_WIDTH * q.swing()])
            };
            self.with_inner((q, 0.0), "direction", width, |k, h| {
                (format!("{k}*tanh({x}/{h})"), format!("has one size and the sign of {x}"))
            });
            let size = format!("goes with the size of {x}, whatever its sign");
            self.add("size", &[(q, 1.0)], 0.0, &size, |k| format!("{k}*abs({x})"));
            let clamped = |k: &str, h: &str| {
                (format!("{k}*max(min({x}, {h}), -{h})"), format!("goes with {x} and stays at a limit"))
            };
            let limit = Inner::new([0.02 * q.swing(), q.swing()], &[0.2, 0.5].map(|s| s * q.swing()));
            self.with_inner((q, 1.0), "clamped", limit, clamped);
        }
        if !own {
            let half = Inner::new([0.02 * q.swing(), 5.0 * q.swing()], &[0.2, 0.8].map(|s| s * q.swing()));
            self.with_inner((q, 0.0), "limited", half, |k, h| {
                (format!("{k}*{x}/({h} + abs({x}))"), format!("goes with {x} up to a limit"))
            });
            let at = |share: f64| q.ends[0] + 2.0 * share * q.swing();
            let threshold = Inner::new(q.ends, &[0.25, 0.5, 0.75].map(at));
            self.with_inner((q, 1.0), "beyond", threshold, |k, h| {
                (format!("{k}*max({x} - {h}, 0)"), format!("goes with what {x} exceeds a threshold by"))
            });
        }
    }

    /// The terms of two different quantities.
    fn of_two(&mut self, a: &Signal<'_>, b: &Signal<'_>) {
        let (x, y) = (a.name(), b.name());
        self.add("product", &[(a, 1.0), (b, 1.0)], 0.0, &format!("goes with {x} times {y}"), |k| {
            format!("{k}*{x}*{y}")
        });
        for (q, p) in [(a, b), (b, a)] {
            let (x, y) = (q.name(), p.name());
            let says = format!("goes with the square of {x} times {y}");
            self.add("square-times", &[(q, 2.0), (p, 1.0)], 0.0, &says, |k| format!("{k}*{x}^2*{y}"));
            if q.changes_sign() {
                let says = format!("goes with the size of {x} times {y}");
                self.add("size-times", &[(q, 1.0), (p, 1.0)], 0.0, &says, |k| format!("{k}*abs({x})*{y}"));
            }
            if p.keeps_from_zero() {
                let zero = format!("{:?}", (WIDTH * p.swing()).powi(2));
                let says = format!("goes with {x} over {y}");
                self.add("over", &[(q, 1.0), (p, -1.0)], 0.0, &says, |k| {
                    format!("{k}*{x}*{y}/({y}^2 + {zero})")
                });
                let says = format!("goes with {x} over the square of {y}");
                self.add("over-square", &[(q, 1.0), (p, -2.0)], 0.0, &says, |k| {
                    format!("{k}*{x}/({y}^2 + {zero})")
                });
            }
        }
    }

    /// A term with one coefficient, of these quantities with their powers; `t` is the power of the time.
    fn add(
        &mut self,
        stem: &str,
        of: &[(&Signal<'_>, f64)],
        t: f64,
        says: &str,
        term: impl Fn(&str) -> String,
    ) {
        let told: Vec<&str> =
            std::iter::once(self.state.name.as_str()).chain(of.iter().map(|(q, _)| q.name())).collect();
        let name = format!("{stem}:{}", told.join(":"));
        let amplitude = coefficient("k", stem, &told);
        let factors = of.iter().map(|(q, power)| (q.of.unit.as_str(), *power));
        let factors: Vec<(&str, f64)> = factors.chain([(self.time, t)]).collect();
        let unit = self.unit(&factors);
        self.push(name, says, term(&amplitude), vec![parameter(&amplitude, unit)]);
    }

    /// A term with a parameter inside, in the unit of its quantity; the amplitude's unit is that of the rate over so many powers of it.
    fn with_inner(
        &mut self,
        (q, power): (&Signal<'_>, f64),
        stem: &str,
        Inner { range, grid, is_rounding }: Inner,
        term: impl Fn(&str, &str) -> (String, String),
    ) {
        let told = [self.state.name.as_str(), q.name()];
        let (amplitude, inner) = (coefficient("k", stem, &told), coefficient("at", stem, &told));
        let (text, says) = term(&amplitude, &inner);
        let unit = self.unit(&[(q.of.unit.as_str(), power)]);
        let inside = EffectParameter { range, grid, is_rounding, ..parameter(&inner, q.of.unit.clone()) };
        self.push(
            format!("{stem}:{}", told.join(":")),
            &says,
            text,
            vec![parameter(&amplitude, unit), inside],
        );
    }

    fn push(&mut self, name: String, says: &str, term: String, parameters: Vec<EffectParameter>) {
        let def = self.def(name, says, term, parameters);
        self.made.push(def);
    }

    fn def(&self, name: String, says: &str, term: String, parameters: Vec<EffectParameter>) -> EffectDef {
        let says = format!("The rate of {} lacks a term that {says}.", self.state.name);
        let adds = vec![Addition { to: self.state.name.clone(), term }];
        EffectDef { name, says, adds, parameters, ..EffectDef::default() }
    }

    /// The label of the rate's unit over that of a term's factors, in their symbols; empty where one of them has none that can be read.
    fn unit(&self, factors: &[(&str, f64)]) -> String {
        let mut all = vec![(self.state.unit.as_str(), 1.0), (self.time, -1.0)];
        all.extend(
            factors.iter().filter(|(_, power)| power.abs() > 0.0).map(|(label, power)| (*label, -power)),
        );
        units::product(&all)
    }
}

/// The name of a parameter of a term.
fn coefficient(what: &str, stem: &str, told: &[&str]) -> String {
    format!("{what}_{stem}_{}", told.join("_")).replace('-', "_")
}

fn parameter(name: &str, unit: String) -> EffectParameter {
    EffectParameter { name: name.to_owned(), unit, ..EffectParameter::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_need_a_divisor_that_keeps_from_zero_and_carry_their_unit() {
        let of = [Quantity::new("u", "m/s^2"), Quantity::new("h", "m")];
        let [u, h] = [Signal { of: &of[0], ends: [-1.0, 1.0] }, Signal { of: &of[1], ends: [0.5, 2.5] }];
        let state = Quantity::new("v", "m/s");
        let mut equation = Equation { state: &state, time: "s", made: Vec::new() };
        equation.of_one(&h);
        equation.of_two(&u, &h);
        let unit = |name: &str| {
            let def = equation.made.iter().find(|def| def.name == name)?;
            Some(def.parameters[0].unit.clone())
        };
        assert_eq!(unit("over:v:u:h").as_deref(), Some("m"));
        assert_eq!(unit("over-square:v:u:h").as_deref(), Some("m^2"));
        assert_eq!(unit("inverse-square:v:h").as_deref(), Some("m^3/s^2"));
        assert!(unit("over:v:h:u").is_none() && unit("over-square:v:h:u").is_none());
    }
}
