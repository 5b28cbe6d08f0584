//! Where an output is found in what a program wrote.
//!
//! A rule is one line of the study, such as `csv:result.csv:tip`; without one an output is a key of the JSON object on standard
//! output. Nothing is read here. Next file to read: [`super::results`], which follows the rules.

use std::path::{Component, Path};

use regex::{Regex, RegexBuilder};

/// The name by which a rule means the standard output instead of a file.
pub(super) const STANDARD_OUTPUT: &str = "-";

/// The forms of a rule, for messages.
const FORMS: &str = "`json`, `json:FILE`, `json:FILE:KEY.KEY`, `csv:FILE:COLUMN`, `csv:FILE:COLUMN:TIMECOLUMN`, \
                     `regex:FILE:PATTERN` and `column:FILE:NUMBER`";

/// Why a rule is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum RuleError {
    #[error("there is no rule `{0}`; rules are {FORMS}, where FILE is `-` for the standard output")]
    Form(String),
    #[error("`{0}` names no column by its number: the first column is 1")]
    Number(String),
    #[error("the pattern of `{rule}` is no regular expression: {reason}")]
    Pattern { rule: String, reason: String },
    #[error("the pattern of `{0}` has no group: put the part that is the number in parentheses")]
    Group(String),
    #[error("the file `{0}` lies outside the run's folder; give its name relative to that folder")]
    Outside(String),
}

/// Where an output is found.
#[derive(Clone, Debug)]
pub(super) enum Rule {
    /// A value in a JSON document, by the keys that lead to it.
    Json { file: String, keys: Vec<String> },
    /// A column of a table with a heading, by time where the table has times.
    Csv { file: String, column: String, time: Option<String> },
    /// The first group of every match.
    Regex { file: String, pattern: Regex },
    /// A column of the rows that hold nothing but numbers, counted from one.
    Column { file: String, number: usize },
}

impl Rule {
    /// Reads the rule of an output.
    ///
    /// # Errors
    /// When it is none, or its file lies outside the run's folder.
    pub(super) fn parse(text: &str, output: &str) -> Result<Self, RuleError> {
        let form = || RuleError::Form(text.to_owned());
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        let parts: Vec<&str> = if rest.is_empty() { Vec::new() } else { rest.split(':').collect() };
        let rule = match (kind.trim(), parts.as_slice()) {
            ("json", []) => Self::whole(output),
            ("json", [file]) => Self::Json { file: (*file).to_owned(), keys: vec![output.to_owned()] },
            ("json", [file, keys]) => {
                Self::Json { file: (*file).to_owned(), keys: keys.split('.').map(str::to_owned).collect() }
            }
            ("csv", [file, column]) => {
                Self::Csv { file: (*file).to_owned(), column: (*column).to_owned(), time: None }
            }
            ("csv", [file, column, time]) => Self::Csv {
                file: (*file).to_owned(),
                column: (*column).to_owned(),
                time: Some((*time).to_owned()),
            },
            ("column", [file, number]) => {
                let number = number.trim().parse().ok().filter(|n| *n > 0);
                let number = number.ok_or_else(|| RuleError::Number(text.to_owned()))?;
                Self::Column { file: (*file).to_owned(), number }
            }
            ("regex", [_, _, ..]) => {
                let (file, pattern) = rest.split_once(':').ok_or_else(form)?;
                Self::Regex { file: file.to_owned(), pattern: pattern_of(pattern, text)? }
            }
            _ => return Err(form()),
        };
        match rule.file() {
            "" => Err(form()),
            file if file != STANDARD_OUTPUT && !lies_inside(file) => Err(RuleError::Outside(file.to_owned())),
            _ => Ok(rule),
        }
    }

    /// The rule of an output that has none: its own key on standard output.
    pub(super) fn whole(output: &str) -> Self {
        Self::Json { file: STANDARD_OUTPUT.to_owned(), keys: vec![output.to_owned()] }
    }

    /// The file that is read.
    pub(super) fn file(&self) -> &str {
        match self {
            Self::Json { file, .. }
            | Self::Csv { file, .. }
            | Self::Regex { file, .. }
            | Self::Column { file, .. } => file,
        }
    }
}

/// A pattern in which `^` and `$` stand for the ends of a line, since it is meant for files of many lines.
fn pattern_of(pattern: &str, rule: &str) -> Result<Regex, RuleError> {
    let made = RegexBuilder::new(pattern).multi_line(true).build();
    let made = made.map_err(|error| {
        // The last line of the crate's message says what is wrong; those before it draw the place.
        let reason = error.to_string().lines().last().unwrap_or_default().trim().to_owned();
        RuleError::Pattern { rule: rule.to_owned(), reason }
    })?;
    if made.captures_len() < 2 { Err(RuleError::Group(rule.to_owned())) } else { Ok(made) }
}

/// Whether a relative name stays in the folder that it starts from.
pub(super) fn lies_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    !name.is_empty() && parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_a_rule_is_read() {
        let read = |text: &str| format!("{:?}", Rule::parse(text, "tip").unwrap());
        assert_eq!(read("json"), r#"Json { file: "-", keys: ["tip"] }"#);
        assert_eq!(read("json:out.json"), r#"Json { file: "out.json", keys: ["tip"] }"#);
        assert_eq!(read("json:out.json:a.b"), r#"Json { file: "out.json", keys: ["a", "b"] }"#);
        assert_eq!(read("csv:-:tip"), r#"Csv { file: "-", column: "tip", time: None }"#);
        assert_eq!(read("csv:r.csv:tip:t"), r#"Csv { file: "r.csv", column: "tip", time: Some("t") }"#);
        assert_eq!(read("column:beam.dat:3"), r#"Column { file: "beam.dat", number: 3 }"#);
        assert_eq!(
            read("regex:log:a:(.*)"),
            r#"Regex { file: "log", pattern: Regex("a:(.*)") }"#,
            "a colon belongs to the pattern"
        );
    }

    #[test]
    fn what_is_no_rule_is_said() {
        let says = |text: &str| Rule::parse(text, "tip").unwrap_err().to_string();
        assert!(says("cvs:r.csv:tip").contains("there is no rule `cvs:r.csv:tip`"));
        assert!(says("csv:r.csv").contains("`csv:FILE:COLUMN`"));
        assert!(says("column:r.dat:0").contains("the first column is 1"));
        assert!(says("regex:r.dat:tip .*").contains("parentheses"));
        assert!(says("regex:r.dat:(tip").contains("unclosed group"));
        assert!(says("csv:../r.csv:tip").contains("outside the run's folder"));
        assert!(says("csv:/tmp/r.csv:tip").contains("outside the run's folder"));
    }
}
