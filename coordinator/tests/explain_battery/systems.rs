//! The systems of the battery: a model as a study states it, how it is excited and seen, and what may be missing from it.
//!
//! Next file to read: [`crate::world`], which simulates them.

mod building;
mod motor;
mod oscillator;
mod pendulum;
mod reactor;
mod tanks;
mod tube;
mod windkessel;

/// Name of an input, and its value at a time.
pub type Input = (&'static str, fn(f64) -> f64);

/// A model, its experiment, and the effects that can be missing from it.
pub struct System {
    pub name: &'static str,
    /// `[model]`, `[[parameters]]` and, where it has candidates of its own, `[[effects]]`.
    pub text: &'static str,
    /// `[[effects]]` that no search knows.
    pub aliens: &'static str,
    /// `[[effects]]` of a form that only a proposal has, by whose name they go.
    pub unlisted: &'static str,
    /// Length of the recording.
    pub span: f64,
    /// Inputs and their courses.
    pub inputs: &'static [Input],
    /// Observed outputs.
    pub channels: &'static [&'static str],
    /// How the truth is simulated more finely than the model.
    pub finer: Finer,
    /// Effects that leave a gap when they are missing.
    pub truths: &'static [Truth],
    /// Effects that the parameters of the model imitate: nothing can be missed.
    pub absorbed: &'static [Truth],
    /// Whether it is also recorded with four times as many samples.
    pub long: bool,
}

/// The integrator of the truth.
pub enum Finer {
    /// The same equations with a relative tolerance of 1e-11.
    Tolerance,
    /// These equations, with that tolerance, for a built-in model that brings its own step.
    Twin(&'static str),
    /// The same layout with this step.
    LayoutStep(f64),
}

/// An effect that is really there.
pub struct Truth {
    /// Its name in the library or among the study's own effects.
    pub name: &'static str,
    /// Effects that give the same data in this system, whatever their coefficients, and why.
    pub equals: &'static [(&'static str, &'static str)],
    /// Effects of which it is a special case: they hold it with more parameters. Naming one is no success, but where the truth
    /// is left out they are left out as well.
    pub within: &'static [&'static str],
}

impl System {
    /// Names of the effects that no search knows.
    pub fn alien_names(&self) -> Vec<String> {
        names(self.aliens)
    }

    /// Names of the effects of a form that only a proposal has.
    pub fn unlisted_names(&self) -> Vec<String> {
        names(self.unlisted)
    }
}

/// The names of these effects.
fn names(effects: &str) -> Vec<String> {
    let effects = effects.split("[[effects]]").skip(1);
    effects.filter_map(|text| text.split('"').nth(1)).map(str::to_owned).collect()
}

/// A truth without equals.
const fn truth(name: &'static str) -> Truth {
    Truth { name, equals: &[], within: &[] }
}

impl Truth {
    /// The same truth with effects that cannot be told from it.
    const fn same(mut self, equals: &'static [(&'static str, &'static str)]) -> Self {
        self.equals = equals;
        self
    }

    /// The same truth with effects that hold it as a special case.
    const fn inside(mut self, within: &'static [&'static str]) -> Self {
        self.within = within;
        self
    }

    /// The names that a search without this effect may not try.
    pub fn relatives(&self) -> Vec<String> {
        self.accepted().into_iter().chain(self.within.iter().map(|name| (*name).to_owned())).collect()
    }

    /// The names that count as right.
    pub fn accepted(&self) -> Vec<String> {
        std::iter::once(self.name)
            .chain(self.equals.iter().map(|(name, _)| *name))
            .map(str::to_owned)
            .collect()
    }
}

/// All systems.
pub fn all() -> Vec<System> {
    vec![
        oscillator::system(),
        pendulum::system(),
        tanks::system(),
        motor::system(),
        windkessel::system(),
        building::system(),
        tube::system(),
        reactor::system(),
    ]
}
