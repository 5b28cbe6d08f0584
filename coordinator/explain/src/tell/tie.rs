//! The sentence of a tie: a choice among names, or one effect whose exact form is open.
//!
//! Next file to read: [`super::words`].

use crate::fit::kind::Kind;
use crate::judge::verdict::another_form;

/// What explains the gap about equally well. That its exact form is open is another thing than a choice among names.
pub(super) fn tied(name: &str, subject: &str, tied: &[Vec<String>]) -> String {
    let open = another_form(name);
    let (forms, named): (Vec<String>, Vec<String>) =
        tied.iter().map(|set| set.join(" + ")).partition(|set| *set == open);
    match (forms.is_empty(), named.is_empty()) {
        (_, true) => format!(
            "{subject} These data show that it is there and not its exact form: others like it would fit as well."
        ),
        (false, false) => format!(
            "{name} or {}: the data cannot tell them apart, nor the exact form of the first.",
            named.join(" or ")
        ),
        (true, false) => format!("{name} or {}: the data cannot tell them apart.", named.join(" or ")),
    }
}

/// Why this one of a kind is told first: `better` is what the data support more of its own kind, `last` the least likely kind that is tied.
pub(super) fn first(name: &str, kind: Kind, better: Option<&str>, last: Option<Kind>) -> String {
    match (better, last.filter(|last| *last > kind)) {
        (Some(better), _) => {
            format!(" `{name}` is told first as the simpler form; the data support `{better}` more.")
        }
        (None, Some(last)) => {
            format!(
                " `{name}` is told first, since {} are held likelier than {}.",
                kind.plural(),
                last.plural()
            )
        }
        (None, None) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_form_is_another_thing_than_a_choice_among_names() {
        let set = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
        let open = vec![another_form("drag")];
        let alone = tied("drag", "Missing: drag. It brakes.", std::slice::from_ref(&open));
        assert!(alone.starts_with("Missing: drag. It brakes. These data show that it is there"), "{alone}");
        assert!(!alone.contains("apart"), "{alone}");
        let pair = set(&["lag", "gain"]);
        let names = tied("drag", "", std::slice::from_ref(&pair));
        assert_eq!(names, "drag or lag + gain: the data cannot tell them apart.");
        let both = tied("drag", "", &[open, pair]);
        assert_eq!(
            both,
            "drag or lag + gain: the data cannot tell them apart, nor the exact form of the first."
        );
    }

    #[test]
    fn what_is_told_first_is_so_for_its_simplicity_or_for_its_kind() {
        let said = |better, last| first("source", Kind::Generic, better, last);
        let simpler = " `source` is told first as the simpler form; the data support `threshold` more.";
        assert_eq!(
            said(Some("threshold"), Some(Kind::Instrument)),
            simpler,
            "what the data say comes before the prior"
        );
        assert!(said(None, Some(Kind::Instrument)).contains("are held likelier than"));
        assert_eq!(said(None, Some(Kind::Generic)), "");
        assert_eq!(said(None, None), "");
    }
}
