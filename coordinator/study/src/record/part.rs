//! What a written channel stands for: one output, or every component of a field that the file has a column for.
//!
//! The columns of a field `wall` are `<column>[0]`, `<column>[1]`, …; those that the file lacks are not observed. Next file
//! to read: [`super::channel`].

use starlings_models::{Quantity, Spec, quoted_list};

use super::reader::ChannelReader;
use crate::field::{component_of, quantity_of};
use crate::file::ChannelSection;
use crate::problem::Source;

/// A scalar output and its column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    pub(super) output: String,
    pub(super) column: String,
}

impl ChannelReader<'_> {
    /// The quantity that a channel measures; `None` when a problem was reported.
    pub(super) fn quantity(&self, section: &ChannelSection) -> Option<&Quantity> {
        quantity(self.source, section, self.spec)
    }

    /// The scalar channels behind a written one; `None` when a problem was reported.
    pub(super) fn parts(&self, section: &ChannelSection, quantity: &Quantity) -> Option<Vec<Part>> {
        let (output, column) = (section.output.get_ref(), section.column.get_ref());
        let n = Spec::range_of(&self.spec.outputs, output).map_or(1, |range| range.len());
        if n == 1 {
            return Some(vec![Part { output: output.clone(), column: column.clone() }]);
        }
        let headers = &self.table.csv.headers;
        let beyond = headers
            .iter()
            .find(|header| component_of(header).is_some_and(|(field, index)| field == column && index >= n));
        if let Some(beyond) = beyond {
            let file = self.table.csv.path.display();
            self.source.report_with(
                section.column.span(),
                format!("`{file}` has a column `{beyond}`, but output `{output}` has {n} components"),
                "give the model as many components as were measured, or rename the columns by the components that they measure",
            );
            return None;
        }
        if let Some(header) = headers.iter().find(|header| is_misspelt(header, column)) {
            let file = self.table.csv.path.display();
            self.source.report_with(
                section.column.span(),
                format!("`{file}` has a column `{header}`, which is no component of output `{output}`"),
                format!("components are counted from 0: `{column}[0]` to `{column}[{}]`", n - 1),
            );
            return None;
        }
        let part = |i: usize| Part { output: format!("{output}[{i}]"), column: format!("{column}[{i}]") };
        let parts: Vec<Part> = (0..n).map(part).filter(|part| headers.contains(&part.column)).collect();
        if parts.is_empty() {
            self.no_component(section, quantity);
            return None;
        }
        Some(parts)
    }

    /// Reports that the file has no column for any component of a channel.
    fn no_component(&self, section: &ChannelSection, quantity: &Quantity) {
        let (column, name, last) = (section.column.get_ref(), &quantity.name, quantity.size - 1);
        let message = format!(
            "`{}` has none of the columns `{column}[0]` to `{column}[{last}]` of the {} components of output `{name}`",
            self.table.csv.path.display(),
            quantity.size
        );
        let help = if self.table.csv.headers.contains(column) {
            format!("column `{column}` can measure one component: say which, as output = \"{name}[0]\"")
        } else {
            format!("its columns are {}", quoted_list(&self.table.csv.headers))
        };
        self.source.report_with(section.column.span(), message, help);
    }
}

/// The quantity that a channel measures; `None` when a problem was reported.
pub(super) fn quantity<'a>(
    source: &Source,
    section: &ChannelSection,
    spec: &'a Spec,
) -> Option<&'a Quantity> {
    let output = section.output.get_ref();
    let found = quantity_of(&spec.outputs, output);
    if found.is_none() {
        let (message, valid) = unknown(spec, output);
        source.report_unknown(section.output.span(), message, &valid);
    }
    found
}

fn unknown(spec: &Spec, output: &str) -> (String, Vec<String>) {
    let valid: Vec<String> = spec.outputs.iter().map(|q| q.name.clone()).collect();
    let kind = &spec.kind;
    let field = component_of(output)
        .and_then(|(field, _)| spec.outputs.iter().find(|q| q.name == field))
        .filter(|q| q.size > 1);
    let message = match field {
        Some(q) => format!(
            "model `{kind}` has no output `{output}`: `{0}` has the components `{0}[0]` to `{0}[{1}]`",
            q.name,
            q.size - 1
        ),
        None => format!("model `{kind}` has no output `{output}`"),
    };
    (message, valid)
}

/// Whether a header is meant as a component of a column's field and is none: its index is no plain number.
fn is_misspelt(header: &str, column: &str) -> bool {
    let Some(index) = header.strip_prefix(column).and_then(|rest| rest.strip_prefix('[')) else {
        return false;
    };
    let index = index.strip_suffix(']').unwrap_or("");
    index.parse::<usize>().map_or(true, |i| i.to_string() != index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_is_misspelt_when_its_index_is_no_plain_number() {
        let misspelt = ["w[x]", "w[01]", "w[+1]", "w[]", "w[1"].map(|header| is_misspelt(header, "w"));
        assert_eq!(misspelt, [true; 5]);
        let others = ["w[0]", "w[12]", "w", "wall[x]", "v[x]"].map(|header| is_misspelt(header, "w"));
        assert_eq!(others, [false; 5]);
    }
}
