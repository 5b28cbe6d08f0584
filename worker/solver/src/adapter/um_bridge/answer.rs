//! What a UM-Bridge server answers, as rows of outputs.
//!
//! One vector holds all outputs of the first time, then of the second; several hold one output each. One vector per time is
//! refused: where there are as many times as outputs nobody could tell it from one per output. Next file to read: [`super`].

use serde_json::Value;
use starlings_models::Spec;

/// The values of all outputs, one time after the other.
///
/// # Errors
/// What is wrong with the answer, as the end of a sentence about the server.
pub(crate) fn rows(answer: &Value, spec: &Spec, n_times: usize) -> Result<Vec<f64>, String> {
    let vector = |value: &Value| -> Option<Vec<f64>> {
        let number = |v: &Value| if v.is_null() { Some(f64::NAN) } else { v.as_f64() };
        value.as_array()?.iter().map(number).collect()
    };
    let vectors =
        answer["output"].as_array().and_then(|list| list.iter().map(vector).collect::<Option<Vec<_>>>());
    let vectors = vectors.ok_or_else(|| {
        let text: String = answer.to_string().chars().take(200).collect();
        format!("answered without a list of vectors of numbers in `output`: {text}")
    })?;
    let (n, got) = (spec.n_output(), vectors.iter().map(Vec::len).sum::<usize>());
    if got != n * n_times {
        let names: Vec<&str> = spec.outputs.iter().map(|q| q.name.as_str()).collect();
        return Err(format!(
            "answered {got} values where {} belong: {n} ({}) for each of {n_times} times; it must look at `times` in the \
             configuration, or the study at fewer times",
            n * n_times,
            names.join(", ")
        ));
    }
    if let [all] = vectors.as_slice() {
        return Ok(all.clone());
    }
    let lengths = spec.outputs.iter().map(|q| q.size * n_times);
    if !lengths.eq(vectors.iter().map(Vec::len)) {
        return Err(format!(
            "answered {} vectors where one belongs that holds all outputs of the first time, then of the next, or one for each \
             of the {} outputs with its values at all {n_times} times",
            vectors.len(),
            spec.outputs.len()
        ));
    }
    let at = |j: usize| {
        let parts = vectors.iter().zip(&spec.outputs);
        parts.flat_map(move |(vector, q)| &vector[j * q.size..(j + 1) * q.size])
    };
    Ok((0..n_times).flat_map(at).copied().collect())
}

/// The rows of the outputs that were asked for.
pub(super) fn asked(rows: &[f64], spec: &Spec, names: &[String]) -> Vec<f64> {
    let ranges: Vec<_> = names.iter().filter_map(|name| Spec::range_of(&spec.outputs, name)).collect();
    let columns = rows.chunks_exact(spec.n_output().max(1));
    columns.flat_map(|column| ranges.iter().flat_map(|range| &column[range.clone()])).copied().collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use starlings_models::Quantity;

    use super::*;

    fn spec() -> Spec {
        let outputs = vec![Quantity::new("tip", "m"), Quantity::new("wall", "m").size(2)];
        Spec { outputs, ..Spec::default() }
    }

    #[test]
    fn one_vector_holds_a_row_per_time_and_several_one_output_each() {
        let row_per_time = json!({ "output": [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]] });
        let one_each = json!({ "output": [[1.0, 4.0], [2.0, 3.0, 5.0, 6.0]] });
        for answer in [row_per_time, one_each] {
            assert_eq!(rows(&answer, &spec(), 2).unwrap(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        }
        let all = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(asked(&all, &spec(), &["wall".to_owned()]), [2.0, 3.0, 5.0, 6.0]);
    }

    #[test]
    fn vectors_that_are_not_one_per_output_are_refused_instead_of_strung_together() {
        let per_time = json!({ "output": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]] });
        let says = rows(&per_time, &spec(), 2).unwrap_err();
        assert!(says.starts_with("answered 2 vectors where one belongs that holds all outputs"), "{says}");
        let pieces = json!({ "output": [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]] });
        assert!(rows(&pieces, &spec(), 2).unwrap_err().starts_with("answered 3 vectors"));
        let lone = Spec { outputs: vec![Quantity::new("tip", "m")], ..Spec::default() };
        assert!(rows(&json!({ "output": [[1.0], [2.0]] }), &lone, 2).is_err());
        assert_eq!(rows(&json!({ "output": [[1.0, 2.0]] }), &lone, 2).unwrap(), [1.0, 2.0]);
    }

    #[test]
    fn a_wrong_number_of_values_is_said_with_what_belongs() {
        let says = rows(&json!({ "output": [[1.0, 2.0]] }), &spec(), 2).unwrap_err();
        assert!(says.contains("2 values where 6 belong: 3 (tip, wall) for each of 2 times"), "{says}");
        assert!(rows(&json!({ "output": [1.0] }), &spec(), 1).unwrap_err().contains("list of vectors"));
    }
}
