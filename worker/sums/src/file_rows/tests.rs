//! Rows of texts and of files, plain and not.

use super::*;

fn def(n_cell: usize, cells: &[usize]) -> SumsFile {
    SumsFile { n_cell, cells: cells.to_vec(), ..SumsFile::default() }
}

fn parse(text: &[u8], def: &SumsFile, n_row: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let mut rows = Rows::new(def, text.len() as u64)?;
    rows.take_all(text)?;
    (rows.times.len() == n_row).then_some((rows.times, rows.values))
}

#[test]
fn plain_rows_are_read_in_the_order_of_the_columns() {
    let expected = Some((vec![0.5, 0.75], vec![3.0, -1e-3, 4.0, 2.0]));
    for text in ["a,-1e-3,0.5,3\nb,2,.75,+4.\n", " , -1e-3 ,\t0.5,3\r\n,2,0.75,4"] {
        assert_eq!(parse(text.as_bytes(), &def(4, &[2, 3, 1]), 2), expected, "{text:?}");
    }
}

#[test]
fn what_is_not_plain_is_left_to_others() {
    let wrong = [
        "0,1\n1,2\n2,3\n", // more rows
        "0,1\n",           // fewer
        "0,1\n\n1,2\n",    // an empty line
        "0,1\n1\n",
        "0,1\n1,2,3\n",
        "0,1\n1,\n",
        "0,1\n1,x\n",
        "0,1\n1,inf\n",
        "0,1\n1,NaN\n",
        "0,1\n1,\"2\"\n",
        "0,1\r1,2\n2,3", // a line that ends otherwise
        "0,1\n1,\u{e4}2\n",
        "0,1\n1,2e\n",
        "0,1\n1,1_0\n",
        "0,1\n1,0x1\n",
        "0,1\n1,1e999\n",
        "0,1\n\r\n",
    ];
    for text in wrong {
        assert_eq!(parse(text.as_bytes(), &def(2, &[0, 1]), 2), None, "{text:?}");
    }
    assert!(parse(b"0,1\n1,2\n", &def(2, &[0, 1]), 2).is_some());
    assert_eq!(parse(b"0,1\n1,2\n", &def(2, &[0, 2]), 2), None, "a position that no row has");
    assert_eq!(parse(b"\n\n", &def(1, &[]), 2), None, "no time");
    assert_eq!(parse(b"1\n\n", &def(1, &[0]), 2), None);
}

#[test]
fn numbers_have_the_bits_of_the_standard_library() {
    let mut state = 1_u64;
    for k in 0..20_000 {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let bits = f64::from_bits(state);
        let value = if k % 2 == 0 { (state >> 11) as f64 * 1e-12 - 4.0 } else { bits };
        if value.is_finite() {
            for text in [format!("{value:?},{value}"), format!("{value:e},{value:.3e}")] {
                let expected: Vec<f64> = text.split(',').filter_map(|cell| cell.parse().ok()).collect();
                let found = parse(text.as_bytes(), &def(2, &[0, 1]), 1);
                let found = found.map(|(times, rows)| [times, rows].concat()).unwrap_or_default();
                let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&found), bits(&expected), "{text}");
            }
        }
    }
}

/// The description of a file of this text.
fn described(dir: &std::path::Path, text: &str, n_cell: usize, cells: &[usize]) -> SumsFile {
    let path = dir.join("rows.csv");
    std::fs::write(&path, text).unwrap_or_else(|error| panic!("{error}"));
    let file = File::open(&path).unwrap_or_else(|error| panic!("{error}"));
    let (length, modified) = stamp(&file).unwrap_or_default();
    SumsFile { path: path.display().to_string(), length, modified, ..def(n_cell, cells) }
}

#[test]
fn parts_hold_every_row_once_wherever_the_pieces_in_which_they_are_read_end() {
    let dir = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let n_row = 12_000;
    let row = |k: usize| format!("{k},{}", (k as f64 * 0.37).sin() * [1e-3, 1.0, 1e5][k % 3]);
    for (line_end, last) in [("\n", "\n"), ("\n", ""), ("\r\n", "\r\n"), ("\r\n", "")] {
        let lines: Vec<String> = (0..n_row).map(row).collect();
        let text = format!("t,x{line_end}{}{last}", lines.join(line_end));
        let file = described(dir.path(), &text, 2, &[0, 1]);
        let expected: Vec<f64> = lines.iter().filter_map(|l| l.split(',').nth(1)?.parse().ok()).collect();
        // As the reader of CSV counts, a row begins behind the first byte of the line end before it.
        for size in [997, 60_000, 65_536, 200_000] {
            let (mut from, mut steps, mut ahead) = (4, 0, Vec::new());
            while from < file.length {
                let to = (from + size).min(file.length);
                // No step starts in a part that is shorter than a row.
                if let Some((n_step, times, values)) = read_part(&file, Part { from, to, ahead: 2 }) {
                    assert!(
                        (times[0] - steps as f64).abs() < 0.5,
                        "{line_end:?}, parts of {size} from {from}"
                    );
                    assert!(times.len() <= n_step + 3);
                    assert_eq!(values, expected[steps..steps + values.len()]);
                    steps += n_step;
                    ahead.push(times.len() - n_step);
                }
                from = to;
            }
            assert_eq!(steps, n_row - 1, "{line_end:?}, parts of {size}");
            assert_eq!(ahead[0], 3);
        }
    }
}

#[test]
fn a_file_that_was_changed_is_not_read() {
    let dir = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let path = dir.path().join("rows.csv");
    std::fs::write(&path, "t,x\n0,1\n1,2\n").unwrap_or_else(|error| panic!("{error}"));
    let open = || File::open(&path).unwrap_or_else(|error| panic!("{error}"));
    let (length, modified) = stamp(&open()).unwrap_or_default();
    let path = path.display().to_string();
    let file = SumsFile { path, length, modified, ..def(2, &[0, 1]) };
    let all = Bytes { start: 4, length: 8, n_row: 2 };
    assert_eq!(read(&file, all), Some((vec![0.0, 1.0], vec![1.0, 2.0])));
    assert_eq!(read(&file, Bytes { length: 9, ..all }), None, "beyond its end");
    assert_eq!(read(&file, Bytes { start: u64::MAX, ..all }), None);
    assert_eq!(read(&SumsFile { length: length - 1, ..file.clone() }, all), None);
    assert_eq!(read(&SumsFile { modified: modified + 1, ..file }, all), None);
}
