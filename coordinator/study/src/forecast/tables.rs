//! The tables of a forecast, with every digit.

use starlings_estimators::forecast::Fan;

use super::Forecast;

impl Forecast {
    /// One row per output, kind (`quantity`, or `measured`: with the errors of what would be measured) and time, one column per quantile.
    pub fn fan_table(&self) -> Vec<Vec<String>> {
        let probabilities = self.outputs.first().map_or(&[][..], |output| &output.fan.probabilities);
        let fixed = ["output", "kind", "time"].map(str::to_owned);
        let mut rows = vec![fixed.into_iter().chain(probabilities.iter().map(|p| format!("q{p}"))).collect()];
        for output in &self.outputs {
            rows.extend(of_fan(&output.output, "quantity", &output.fan));
            rows.extend(output.measured.iter().flat_map(|fan| of_fan(&output.output, "measured", fan)));
        }
        rows
    }

    /// One row per level and member that crosses it, sorted by time.
    pub fn crossing_table(&self) -> Vec<Vec<String>> {
        let mut rows = vec![["level", "time"].map(str::to_owned).to_vec()];
        for level in &self.levels {
            let name = level.says.split(':').next().unwrap_or_default();
            rows.extend(level.times.iter().map(|time| vec![name.to_owned(), format!("{time:?}")]));
        }
        rows
    }
}

fn of_fan(output: &str, kind: &str, fan: &Fan) -> Vec<Vec<String>> {
    let row = |(k, time): (usize, &f64)| {
        let fixed = [output.to_owned(), kind.to_owned(), format!("{time:?}")];
        let values = fan.quantiles.iter().map(|values| format!("{:?}", values[k]));
        fixed.into_iter().chain(values).collect()
    };
    fan.times.iter().enumerate().map(row).collect()
}
