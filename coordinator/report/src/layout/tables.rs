//! Names every cell of a table by the head of its column, so that on a narrow screen a row can stand as a block.
//!
//! Works on the finished page, whose tables all have the same form; no text of a study can open or end a cell, because it is
//! escaped. Tables that are a matrix of their own (`correlation`) stay as they are.

/// The page with `data-label` in the cells of its tables and the class that makes blocks of their rows.
pub(super) fn labelled(page: &str) -> String {
    let mut parts = page.split("<table");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (table, rest) = part.split_once("</table>").unwrap_or((part, ""));
        let is_matrix = table.split('>').next().is_some_and(|head| head.contains("correlation"));
        if is_matrix {
            text.extend(["<table", table, "</table>", rest]);
        } else {
            text.extend(["<table", &rows(table), "</table>", rest]);
        }
    }
    text
}

/// A table from behind its name to its end.
fn rows(table: &str) -> String {
    let (attributes, content) = table.split_once('>').unwrap_or(("", table));
    let head = content.split("</thead>").next().unwrap_or_default();
    let names: Vec<String> = head
        .split("<th")
        .skip(2)
        .filter_map(|cell| Some(text_of(cell.split_once('>')?.1.split("</th>").next().unwrap_or_default())))
        .collect();
    let class = match attributes.trim() {
        "" => " class=\"cards\"".to_owned(),
        own if own.contains("cards") => format!(" {own}"),
        own => format!(" {}", own.replacen("class=\"", "class=\"cards ", 1)),
    };
    let Some((before, body)) = content.split_once("<tbody>") else { return format!("{class}>{content}") };
    let mut lines = body.split("<tr>");
    let mut text = format!("{class}>{before}<tbody>{}", lines.next().unwrap_or_default());
    for line in lines {
        let mut cells = line.split("<td");
        text.extend(["<tr>", cells.next().unwrap_or_default()]);
        // A row whose first cell is no heading begins with the first column.
        let offset = usize::from(!line.trim_start().starts_with("<td"));
        for (k, cell) in cells.enumerate() {
            let name = names.get(k + offset).filter(|name| !name.is_empty());
            let label = name.map_or(String::new(), |name| format!(" data-label=\"{name}\""));
            text.extend(["<td", &label, cell]);
        }
    }
    text
}

/// What of a heading can stand in an attribute: its text without its elements.
fn text_of(heading: &str) -> String {
    let mut parts = heading.split('<');
    let mut text = parts.next().unwrap_or_default().to_owned();
    parts.for_each(|part| text += part.split_once('>').map_or("", |(_, rest)| rest));
    text.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_carry_the_head_of_their_column() {
        let page = "<table>\n<thead><tr><th scope=\"col\">name</th><th scope=\"col\">value</th></tr></thead>\n<tbody>\n\
                    <tr><th scope=\"row\">R</th><td class=\"number\">1</td></tr></tbody></table>.";
        let labelled = labelled(page);
        assert!(labelled.starts_with("<table class=\"cards\">"), "{labelled}");
        assert!(
            labelled.contains("<th scope=\"row\">R</th><td data-label=\"value\" class=\"number\">1</td>"),
            "{labelled}"
        );
        assert!(labelled.ends_with("</tbody></table>."), "{labelled}");
    }

    #[test]
    fn an_element_in_a_heading_does_not_end_the_attribute() {
        let page = "<table><thead><tr><th>a</th><th scope=\"col\"><i class=\"key\"></i>one &quot;</th></tr></thead><tbody><tr><th>b</th><td>1</td></tr></tbody></table>";
        assert!(labelled(page).contains("<td data-label=\"one &quot;\">1</td>"), "{}", labelled(page));
    }

    #[test]
    fn a_matrix_stays_as_it_is() {
        let page = "<table class=\"correlation\"><tbody><tr><td>1</td></tr></tbody></table>";
        assert_eq!(labelled(page), page);
    }
}
