//! The courses as a table, with every digit.

use super::PredictedCourse;

/// One row per record, output and time, with the median and the ends of the 95 % band.
///
/// # Errors
/// Never in practice: the text is written to memory.
pub fn to_csv(courses: &[PredictedCourse]) -> Result<String, csv::Error> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(["record", "output", "unit", "time", "median", "lo95", "hi95"])?;
    for course in courses {
        for (k, time) in course.time.iter().enumerate() {
            let names = [&course.record, &course.output, &course.unit].map(String::clone);
            let numbers = [*time, course.median[k], course.lo[k], course.hi[k]].map(|v| format!("{v:?}"));
            csv.write_record(names.into_iter().chain(numbers))?;
        }
    }
    let bytes = csv.into_inner().map_err(csv::IntoInnerError::into_error)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
