//! The sentence of a tie: a choice among names, or one effect whose exact form is open.
//!
//! Next file to read: [`super::words`].

use crate::fit::kind::Kind;
use crate::judge::verdict::{another_form, parameter_at_limit};

/// What explains the gap about equally well. That its exact form is open, or a parameter inside it, is another thing than a choice among
/// names.
pub(super) fn tied(name: &str, subject: &str, tied: &[Vec<String>]) -> String {
    let open = another_form(name);
    let (mut form_is_open, mut undetermined, mut named) = (false, Vec::new(), Vec::new());
    for set in tied {
        match set.as_slice() {
            [form] if *form == open => form_is_open = true,
            [form] if parameter_at_limit(form).is_some() => undetermined.extend(parameter_at_limit(form)),
            names => named.push(names.join(" + ")),
        }
    }
    let undetermined = undetermined.join(" and ");
    if named.is_empty() {
        let form =
            " These data show that it is there and not its exact form: others like it would fit as well.";
        let limit = format!(
            " These data hardly determine its {undetermined}: far smaller or larger values would fit about as well."
        );
        let open = [(form_is_open, form), (!undetermined.is_empty(), &limit)];
        return open
            .into_iter()
            .filter(|(is_open, _)| *is_open)
            .fold(subject.to_owned(), |said, (_, more)| said + more);
    }
    let beside = match (form_is_open, undetermined.is_empty()) {
        (false, true) => String::new(),
        (true, true) => ", nor the exact form of the first".to_owned(),
        (false, false) => format!(", nor determine {undetermined} of the first"),
        (true, false) => format!(", nor the exact form and {undetermined} of the first"),
    };
    format!("{name} or {}: the data cannot tell them apart{beside}.", named.join(" or "))
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
    use crate::judge::verdict::at_a_limit;

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
    fn a_parameter_that_the_data_do_not_determine_is_no_other_name() {
        let limit = vec![at_a_limit("saturation", "half_saturation")];
        let alone = tied("saturation", "Missing: saturation.", std::slice::from_ref(&limit));
        assert!(
            alone.starts_with("Missing: saturation. These data hardly determine its half_saturation"),
            "{alone}"
        );
        assert!(!alone.contains(" or saturation"), "{alone}");
        let both = tied("saturation", "", &[limit, vec!["loss".to_owned()]]);
        assert_eq!(
            both,
            "saturation or loss: the data cannot tell them apart, nor determine half_saturation of the first."
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
