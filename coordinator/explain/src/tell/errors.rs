//! How the error changes with what was found, in words.
//!
//! Next file to read: [`super::words`].

use crate::judge::gates::JudgedFit;
use crate::judge::search_result::SearchResult;
use crate::number::factor;
use crate::rows::Usage;
use crate::run_cache::RunCache;

/// How the error changes, for each use of the data.
pub(super) fn shrinking(cache: &RunCache<'_>, found: &SearchResult<'_>, judged: &JudgedFit<'_>) -> String {
    let noise = |y: &[f64], usage| {
        let scaled = cache.rows.scaled(y);
        let of = cache.rows.rows.iter().zip(&scaled).filter(|(row, _)| row.usage == usage);
        let (n, sum) = of.fold((0.0, 0.0), |(n, sum), (_, e)| (n + 1.0, sum + e * e));
        (n > 0.0).then(|| f64::sqrt(sum / n))
    };
    let spans = [
        (Usage::Train, "the training data"),
        (Usage::HeldOut, "the held-out span"),
        (Usage::HeldOutChannel, "the held-out channels"),
    ];
    let part = |(usage, what)| {
        let before = noise(&found.base.predicted, usage)?;
        Some((before, noise(&judged.fit.predicted, usage)?, what))
    };
    moves(&spans.into_iter().filter_map(part).collect::<Vec<(f64, f64, &str)>>())
}

/// How errors in noise sd change, in words: (before, after, of what). Neighbours that change alike share one verb.
fn moves(parts: &[(f64, f64, &str)]) -> String {
    let mut last = "";
    let mut words = Vec::new();
    for (before, after, what) in parts {
        let (from, to) = (factor(*before), factor(*after));
        let verb = if from == to {
            "stays"
        } else if after < before {
            "falls"
        } else {
            "rises"
        };
        let said = if verb == last { String::new() } else { format!("{verb} ") };
        last = verb;
        words.push(match verb {
            "stays" => format!("{said}at {to} noise sd on {what}"),
            _ => format!("{said}from {from} to {to} noise sd on {what}"),
        });
    }
    format!("the error {}.", words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_falls_rises_or_stays_as_its_figures_do() {
        let all = [(2.16, 0.8, "the training data"), (2.54, 1.7, "the held-out span")];
        assert_eq!(
            moves(&all),
            "the error falls from 2.16 to 0.80 noise sd on the training data, from 2.54 to 1.70 noise sd on the held-out span."
        );
        let mixed = [(2.0, 1.0, "a"), (1.0, 1.3, "b"), (1.001, 1.002, "c")];
        assert_eq!(
            moves(&mixed),
            "the error falls from 2.00 to 1.00 noise sd on a, rises from 1.00 to 1.30 noise sd on b, stays at 1.00 noise sd on c."
        );
    }

    #[test]
    fn the_verb_is_that_of_the_figures_whatever_they_are() {
        for before in [0.0, 1e-9, 0.5, 1.0, 3.0, 1e9] {
            for after in [0.0, 1e-9, 0.5, 1.0, 3.0, 1e9] {
                let text = moves(&[(before, after, "x")]);
                assert_eq!(text.contains("falls"), after < before, "{text}");
                assert_eq!(text.contains("rises"), after > before, "{text}");
            }
        }
    }
}
