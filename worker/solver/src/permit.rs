//! Which programs a setup may have started here.
//!
//! A setup comes from a coordinator, and a program that it names would run as this user. So a worker runs what its own command
//! line names. Of a setup's table of the solver it then uses the numbers that bound a run, and compares the rest with its own:
//! what decides the result must be the same, and what only says where files lie is not looked at. Next file to read: [`crate::site`].

use std::collections::BTreeMap;
use std::fmt::Write;

use starlings_models::{FilesDef, SolverDef};

/// Which programs a setup may have started.
#[derive(Clone, Debug)]
pub enum Permit {
    /// None: built-in models and equations only.
    Nothing,
    /// This one.
    Pinned(Box<SolverDef>),
    /// Whichever it names.
    Study,
}

impl Permit {
    /// The program that is started for what a setup asks for.
    ///
    /// # Errors
    /// When that is not permitted: a sentence with the flag that would.
    pub(crate) fn of(&self, asked: &SolverDef) -> Result<SolverDef, String> {
        match self {
            Self::Study => Ok(asked.clone()),
            Self::Nothing => Err(format!(
                "this worker runs built-in models and equations only, and the study asks it to {}: start the worker with --solver \
                 CMD or --solver-from STUDY, which name the program that it may run, or with --allow-commands-from-study, by \
                 which a coordinator can run any command as the worker's user",
                wish(asked)
            )),
            Self::Pinned(own) => pinned(own, asked),
        }
    }
}

/// What a setup wants, in words of limited length.
fn wish(asked: &SolverDef) -> String {
    let (what, name) = match (asked.command.first(), &asked.address) {
        (Some(_), _) => ("run the program", asked.command.join(" ")),
        (None, Some(address)) => ("connect to", address.clone()),
        (None, None) => ("use the adapter", asked.adapter.clone()),
    };
    format!("{what} `{}`", short(&name))
}

fn short(text: &str) -> String {
    let shown: String = text.chars().take(80).collect();
    if shown.len() < text.len() { shown + " …" } else { shown }
}

/// This worker's own program with the limits of the setup.
fn pinned(own: &SolverDef, asked: &SolverDef) -> Result<SolverDef, String> {
    let differs = differences(own, asked);
    if !differs.is_empty() {
        return Err(format!(
            "the study asks for another solver than this worker was started with: {}; start the worker with --solver-from STUDY and \
             a study file of this machine that says the same",
            differs.join("; ")
        ));
    }
    let SolverDef { timeout, start_timeout, threads, pin, memory, .. } = *asked;
    let described = own.described.clone().or_else(|| asked.described.clone());
    Ok(SolverDef { timeout, start_timeout, threads, pin, memory, described, ..own.clone() })
}

/// What decides a result and is not the same, a phrase each.
fn differences(own: &SolverDef, asked: &SolverDef) -> Vec<String> {
    let mut found = Vec::new();
    let mut note = |what: &str, own: &str, asked: &str| {
        if own != asked {
            found.push(format!("{what} `{}` and not `{}`", short(asked), short(own)));
        }
    };
    note("the adapter", &own.adapter, &asked.adapter);
    let model = |def: &SolverDef| def.model.clone().unwrap_or_default();
    note("the model", &model(own), &model(asked));
    if own.adapter == asked.adapter {
        note("ranks", &own.ranks.to_string(), &asked.ranks.to_string());
    }
    found.extend(map_difference("the variable", &own.environment, &asked.environment));
    let none = FilesDef::default();
    let (ours, theirs) = (own.files.as_ref().unwrap_or(&none), asked.files.as_ref().unwrap_or(&none));
    found.extend(map_difference("the template of", &ours.templates, &theirs.templates));
    found.extend(map_difference("the rule of the output", &ours.reads, &theirs.reads));
    // Where a copied file lies is this machine's business; that it is there is the study's.
    let names = |files: &FilesDef| {
        files.copies.keys().map(|name| (name.clone(), String::new())).collect::<BTreeMap<_, _>>()
    };
    found.extend(map_difference("the copied file", &names(ours), &names(theirs)));
    // What a program says of itself is compared once it has said it.
    if own.described.is_some() && asked.described.is_some() && own.described != asked.described {
        found.push("another description".to_owned());
    }
    found
}

/// Entries that are not the same on both sides, named but not shown: they may hold secrets.
fn map_difference(
    what: &str,
    own: &BTreeMap<String, String>,
    asked: &BTreeMap<String, String>,
) -> Option<String> {
    let names = own.keys().chain(asked.keys()).filter(|name| own.get(*name) != asked.get(*name));
    let names: std::collections::BTreeSet<&String> = names.collect();
    let first = names.first()?;
    let mut text = format!("{what} `{}`", short(first));
    let how = match (own.contains_key(*first), asked.contains_key(*first)) {
        (true, false) => " is set here only",
        (false, _) => " is set by the study only",
        (true, true) => " differs",
    };
    text.push_str(how);
    if names.len() > 1 {
        // Writing into a text does not fail.
        let _ = write!(text, " (and {} more)", names.len() - 1);
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(entries: &[(&str, &str)]) -> BTreeMap<String, String> {
        entries.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect()
    }

    fn words(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    fn own() -> SolverDef {
        SolverDef { command: words("python3 beam.py"), folder: "/here".to_owned(), ..SolverDef::default() }
    }

    fn of(asked: &SolverDef) -> Result<SolverDef, String> {
        Permit::Pinned(Box::new(own())).of(asked)
    }

    #[test]
    fn a_worker_that_permits_nothing_names_the_flags_and_what_was_asked() {
        let says = Permit::Nothing.of(&own()).unwrap_err();
        for word in ["--solver CMD", "--solver-from", "--allow-commands-from-study", "`python3 beam.py`"] {
            assert!(says.contains(word), "{says}");
        }
        let long = SolverDef { command: vec!["x".repeat(1_000_000)], ..own() };
        assert!(Permit::Nothing.of(&long).unwrap_err().len() < 1000);
        let dialled = SolverDef { command: vec![], address: Some("10.0.0.1:80".to_owned()), ..own() };
        assert!(Permit::Nothing.of(&dialled).unwrap_err().contains("connect to `10.0.0.1:80`"));
    }

    #[test]
    fn the_pinned_command_folder_and_address_are_used_whatever_a_setup_names() {
        let asked = SolverDef {
            command: words("sh -c evil"),
            folder: "/etc".to_owned(),
            address: Some("10.0.0.1:80".to_owned()),
            timeout: 7.0,
            threads: 3,
            ..SolverDef::default()
        };
        let used = of(&asked).unwrap();
        assert_eq!(used, SolverDef { timeout: 7.0, threads: 3, ..own() });
    }

    #[test]
    fn variables_files_rules_ranks_and_the_adapter_of_a_setup_are_refused_where_they_are_not_the_workers_own()
    {
        let files = |files: FilesDef| SolverDef { files: Some(files), ..own() };
        let says = |asked: SolverDef| {
            let says = of(&asked).unwrap_err();
            assert!(says.contains("--solver-from"), "{says}");
            says
        };
        let environment = map(&[("LD_PRELOAD", "/tmp/evil.so")]);
        assert!(says(SolverDef { environment, ..own() }).contains("`LD_PRELOAD` is set by the study only"));
        assert!(says(SolverDef { adapter: "command".to_owned(), ..own() }).contains("the adapter `command`"));
        assert!(says(SolverDef { ranks: 4096, ..own() }).contains("ranks `4096`"));
        assert!(says(SolverDef { model: Some("m".to_owned()), ..own() }).contains("the model `m`"));
        let copies = map(&[("shadow", "/etc/shadow")]);
        assert!(says(files(FilesDef { copies, ..FilesDef::default() })).contains("the copied file `shadow`"));
        let templates = map(&[("../x", "evil")]);
        assert!(
            says(files(FilesDef { templates, ..FilesDef::default() })).contains("the template of `../x`")
        );
        let reads = map(&[("tip", "column:/etc/shadow:1")]);
        assert!(
            says(files(FilesDef { reads, ..FilesDef::default() })).contains("the rule of the output `tip`")
        );
    }

    #[test]
    fn of_copied_files_the_workers_own_are_taken_and_secrets_of_its_environment_are_not_told() {
        let (here, there) = (map(&[("mesh", "/here/mesh")]), map(&[("mesh", "/etc/shadow")]));
        let with = |copies| SolverDef { files: Some(FilesDef { copies, ..FilesDef::default() }), ..own() };
        let permit = Permit::Pinned(Box::new(with(here.clone())));
        assert_eq!(permit.of(&with(there)).unwrap().files.unwrap().copies, here);
        let own = SolverDef { environment: map(&[("LICENCE", "secret")]), ..own() };
        let says = Permit::Pinned(Box::new(own)).of(&self::own()).unwrap_err();
        assert!(says.contains("`LICENCE` is set here only") && !says.contains("secret"), "{says}");
    }
}
