//! Judging fits: what chance alone would give, which gates a refitted variant passes, and the verdict on all of them.
//!
//! Files, each of which sees only those before it: [`effective_noise`], [`null_distribution`] (what a search finds by chance),
//! [`misfit`], [`adequacy`] (residuals against the stated noise), [`uncertainty`] (what the uncertainty of an estimate explains),
//! [`held_out`], [`form`] (whether an effect has the right form), [`gates`], [`search_result`] (all that was judged),
//! [`noise_model`] (whether the noise is correlated), [`contribution`] (whether every effect takes away its share), [`larger_noise`]
//! (whether a noise that was found is larger), [`objections`] (what speaks against a name), [`rivals`] (what comes as close),
//! [`twins`] (what has the same influence), [`verdict`], [`probability`] (how probable each answer is).

pub(crate) mod adequacy;
pub(crate) mod contribution;
pub(crate) mod effective_noise;
pub(crate) mod form;
pub(crate) mod gates;
pub(crate) mod held_out;
pub(crate) mod larger_noise;
pub(crate) mod misfit;
pub(crate) mod noise_model;
pub(crate) mod null_distribution;
pub(crate) mod objections;
pub(crate) mod probability;
mod range;
mod rivals;
pub(crate) mod search_result;
pub(crate) mod twins;
mod uncertainty;
pub(crate) mod verdict;

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    /// `NAME | file | value` of every number that stands at the head of a file, or of the files of a folder.
    fn numbers(path: &Path, name: &str, found: &mut BTreeSet<String>) {
        if path.is_dir() {
            for entry in std::fs::read_dir(path).unwrap().flatten() {
                let below = format!("{name}/{}", entry.file_name().to_string_lossy());
                if entry.path().is_file() {
                    numbers(&entry.path(), &below, found);
                }
            }
            return;
        }
        let text = std::fs::read_to_string(path).unwrap();
        let constants =
            text.lines().filter(|line| !line.starts_with(' ')).filter_map(|line| line.split_once("const "));
        for (name_and_type, value) in constants.filter_map(|(_, rest)| rest.split_once(" = ")) {
            let (constant, kind) = name_and_type.split_once(": ").unwrap();
            if kind.contains("f64") || kind == "usize" {
                found.insert(format!("`{constant}` | `{name}` | {}", value.trim_end_matches(';')));
            }
        }
    }

    #[test]
    fn the_page_lists_every_number_of_the_decision_and_of_the_race_with_its_value() {
        let of = Path::new(env!("CARGO_MANIFEST_DIR"));
        let places = [
            "judge",
            "refit/near_priors.rs",
            "refit/race.rs",
            "refit/instants.rs",
            "refit/other_forms.rs",
            "refit/replacements.rs",
            "screen/proposals.rs",
            "screen/proposals",
        ];
        let mut code = BTreeSet::new();
        for place in places {
            numbers(&of.join("src").join(place), &format!("coordinator/explain/src/{place}"), &mut code);
        }
        let page = std::fs::read_to_string(of.join("../../docs/explain.md")).unwrap();
        let is_row = |line: &&str| line.starts_with("| `") && line.contains("` | `coordinator/explain/src/");
        let listed: BTreeSet<String> = page
            .lines()
            .filter(is_row)
            .map(|row| row.trim_start_matches("| ").split(" | ").take(3).collect::<Vec<_>>().join(" | "))
            .collect();
        assert_eq!(listed, code);
    }
}
