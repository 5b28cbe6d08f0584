//! Options of the user for the program that submits: none that a deployment sets itself, and nothing that would be taken for a script.

use crate::error::DeployError;

/// An option that a deployment sets itself.
pub(crate) struct Own {
    /// Its long name; empty where it has none.
    pub(crate) long: &'static str,
    /// Its letter.
    pub(crate) letter: Option<char>,
    /// Who sets it, or what to use instead.
    pub(crate) reason: &'static str,
}

/// How a program takes its command line apart (getopt_long(3)).
pub(crate) struct Syntax {
    /// The program.
    pub(crate) program: &'static str,
    /// What a deployment sets itself.
    pub(crate) own: &'static [Own],
    /// Letters of options without a value in the next word; all others have one.
    pub(crate) flags: &'static str,
    /// Long names of such options; all others have a value, after a `=` or in the next word.
    pub(crate) long_flags: &'static [&'static str],
}

const SCRIPT: &str =
    "a word that is no option would be taken for the script, which is that of the deployment";
const NO_VALUE: &str = "it needs a value, and none follows";

impl Syntax {
    /// Refuses what a deployment sets itself, a word that is no option, and an option whose value is missing.
    pub(crate) fn check(&self, options: &[String]) -> Result<(), DeployError> {
        let mut words = options.iter();
        while let Some(word) = words.next() {
            let refused =
                |reason| Err(DeployError::Option { option: word.to_owned(), engine: self.program, reason });
            let takes_next = match word.strip_prefix("--") {
                Some("") => return refused(SCRIPT),
                Some(long) => {
                    if let Some(own) = self.own.iter().find(|own| is_long(own, long)) {
                        return refused(own.reason);
                    }
                    // A name may be shortened.
                    !long.contains('=') && !self.long_flags.iter().any(|flag| flag.starts_with(long))
                }
                None => match word.strip_prefix('-') {
                    None | Some("") => return refused(SCRIPT),
                    Some(letters) => match self.takes_next(letters) {
                        Ok(takes_next) => takes_next,
                        Err(reason) => return refused(reason),
                    },
                },
            };
            if takes_next && words.next().is_none() {
                return refused(NO_VALUE);
            }
        }
        Ok(())
    }

    /// Whether the value of the last of these letters is the next word; the reason where one of them is the deployment's own.
    fn takes_next(&self, letters: &str) -> Result<bool, &'static str> {
        let mut letters = letters.chars();
        while let Some(letter) = letters.next() {
            if let Some(own) = self.own.iter().find(|own| own.letter == Some(letter)) {
                return Err(own.reason);
            }
            if !self.flags.contains(letter) {
                return Ok(letters.as_str().is_empty());
            }
        }
        Ok(false)
    }
}

/// Whether a long option is this one, or a beginning of its name.
fn is_long(own: &Own, long: &str) -> bool {
    let name = long.split('=').next().unwrap_or(long);
    !own.long.is_empty() && own.long.starts_with(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SYNTAX: Syntax = Syntax {
        program: "submit",
        own: &[
            Own { long: "array", letter: Some('a'), reason: "ours" },
            Own { long: "wrap", letter: None, reason: "ours" },
        ],
        flags: "HQ",
        long_flags: &["hold", "exclusive"],
    };

    fn check(line: &str) -> Result<(), String> {
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        SYNTAX.check(&words).map_err(|error| error.to_string())
    }

    #[test]
    fn options_with_and_without_values_are_taken() {
        for line in [
            "",
            "-p short",
            "-pshort --time=1:00 --time 1:00",
            "-HQp short",
            "--hold --exc -c 4",
            "--exclusive=user -H",
        ] {
            assert_eq!(check(line), Ok(()), "{line}");
        }
    }

    #[test]
    fn a_word_that_is_no_option_and_what_a_deployment_sets_itself_are_refused() {
        for (line, option, words) in [
            ("script.sh", "script.sh", "for the script"),
            ("-p short more", "more", "for the script"),
            ("--hold short", "short", "for the script"),
            ("-H short", "short", "for the script"),
            ("-p short -- x", "--", "for the script"),
            ("-", "-", "for the script"),
            ("-p", "-p", "needs a value"),
            ("-c 4 --time", "--time", "needs a value"),
            ("-a 0-7", "-a", "ours"),
            ("-Ha0-7", "-Ha0-7", "ours"),
            ("--arr=0-7", "--arr=0-7", "ours"),
            ("--wrap ls", "--wrap", "ours"),
        ] {
            let said = check(line).unwrap_err();
            assert!(said.starts_with(&format!("{option} cannot be given to submit")), "{line}: {said}");
            assert!(said.contains(words), "{line}: {said}");
        }
    }
}
