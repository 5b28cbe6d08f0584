//! How many rounds more an iteration takes until its steps are as short as they should be, from the lengths of those so far.
//!
//! Steps of Gauss and Newton get shorter by a factor that falls itself, the better the nearer the model is to linear about the estimate: from
//! round to round it is raised to a power, the order of convergence, which is two where the residuals are small and one where they are not
//! (Nocedal & Wright 2006, section 10.3). Next file to read: [`super::plan`].

/// A step longer than this share of the one before says nothing of how many follow.
const SLOWEST: f64 = 0.75;
/// Rounds that are foreseen at most.
const MOST: usize = 50;

/// What is expected after a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum More {
    /// As many as there usually are.
    #[default]
    Usual,
    /// So many.
    Expected(usize),
    /// Nobody knows how many.
    Unknown,
}

impl More {
    /// The same a round later.
    #[must_use]
    pub(crate) fn later(self) -> Self {
        match self {
            Self::Expected(more) => Self::Expected(more.saturating_sub(1)),
            more => more,
        }
    }
}

/// The lengths of the last three steps, the last one first.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Settling {
    lengths: [Option<f64>; 3],
}

impl Settling {
    /// A step of this length was made.
    pub(crate) fn step(&mut self, length: f64) {
        let [last, before, _] = self.lengths;
        self.lengths = [Some(length), last, before];
    }

    /// Rounds that follow until a step is shorter than `goal`.
    pub(crate) fn more(&self, goal: f64) -> More {
        let [Some(last), before, first] = self.lengths else { return More::Usual };
        if last < goal {
            return More::Expected(0);
        }
        let Some(before) = before else { return More::Usual };
        let mut factor = last / before;
        // Infinite lengths of what could not be run too.
        if factor.is_nan() || factor > SLOWEST || last.is_infinite() {
            return More::Unknown;
        }
        let order = first
            .map(|first| before / first)
            .filter(|factor| *factor > 0.0 && *factor < 1.0)
            .map_or(2.0, |before| (factor.ln() / before.ln()).clamp(1.0, 2.0));
        let mut length = last;
        let rounds = (1..=MOST).find(|_| {
            factor = factor.powf(order);
            length *= factor;
            length < goal
        });
        rounds.map_or(More::Unknown, More::Expected)
    }
}

#[cfg(test)]
mod tests {
    use super::{More, Settling};

    /// What is told after every one of these lengths.
    fn told(lengths: &[f64], goal: f64) -> Vec<More> {
        let mut settling = Settling::default();
        let tell = |length: &f64| {
            settling.step(*length);
            settling.more(goal)
        };
        lengths.iter().map(tell).collect()
    }

    #[test]
    fn steps_that_get_shorter_by_the_same_factor_end_when_it_is_told() {
        let lengths: Vec<f64> = (0..7).map(|k| 5.0 * 0.4_f64.powi(k)).collect();
        let end = lengths.iter().position(|length| *length < 0.1).expect("one is short enough");
        let told = told(&lengths, 0.1);
        for (k, more) in told.iter().enumerate().take(end + 1).skip(2) {
            assert_eq!(*more, More::Expected(end - k), "after {k}");
        }
    }

    #[test]
    fn steps_whose_factor_is_squared_end_when_it_is_told() {
        let lengths = [20.0, 20.0 * 0.2, 20.0 * 0.2 * 0.04, 20.0 * 0.2 * 0.04 * 0.0016];
        let [usual, told @ ..] = &told(&lengths, 0.01)[..] else { unreachable!("four are told") };
        assert_eq!((*usual, told), (More::Usual, &[2, 1, 0].map(More::Expected)[..]));
    }

    #[test]
    fn nothing_is_told_of_steps_that_get_no_shorter() {
        assert_eq!(Settling::default().more(0.1), More::Usual);
        assert_eq!(told(&[3.0, 3.0], 0.1)[1], More::Unknown);
        assert_eq!(told(&[3.0, f64::INFINITY], 0.1)[1], More::Unknown);
        assert_eq!(
            told(&[f64::INFINITY, 3.0, 0.3], 0.1),
            [More::Usual, More::Expected(1), More::Expected(1)]
        );
    }
}
