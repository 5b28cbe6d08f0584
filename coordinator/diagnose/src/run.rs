//! A whole diagnosis on a page: the model without a fault, the alarm, the library, the verdict.
//!
//! Next file to read: [`super::hypothesis`].

use starlings_estimators::scenarios::probabilities;
use starlings_fleet::Fleet;
use starlings_study::Stage;
use starlings_study::diagnosis::Diagnosis;

use crate::alarm::{Series, alarm};
use crate::error::DiagnoseError;
use crate::foreseen::Foreseen;
use crate::hypothesis::{Hypothesis, drive};
use crate::result::{
    AlarmFound, CourseFound, Diagnosed, HealthyFound, LISTED, NAMED, ScenarioFound, Verdict,
};
use crate::runs::{Runnable, Runs, rows};
use crate::search::starts;
use crate::words;

/// Courses that are kept for the page.
const COURSES: usize = 6;
/// Values of a course that are kept at most.
const KEPT: usize = 1000;

/// Diagnoses a study that was read for it. `watch` hears of every part as it begins, and before and after every batch of runs.
///
/// # Errors
/// When the fleet fails, or the model without a fault or every scenario cannot be run.
pub fn diagnose(
    of: &Diagnosis,
    fleet: &mut dyn Fleet,
    watch: &mut dyn FnMut(&Stage),
) -> Result<Diagnosed, DiagnoseError> {
    let mut runs = Runs::new(fleet, rows(&of.healthy), Foreseen::new(of), watch);
    if runs.rows.is_empty() {
        return Err(DiagnoseError::NoValues);
    }
    let healthy_model = Runnable::new(&of.healthy);
    runs.begin(0, "fit", "the model without a fault".to_owned());
    let mut healthy = [Hypothesis::at_prior(&healthy_model)];
    drive(&mut runs, &mut healthy)?;
    let [healthy] = healthy;
    if let Some(reason) = &healthy.failure {
        return Err(DiagnoseError::Healthy(reason.clone()));
    }
    let models: Vec<Runnable> = of.scenarios.iter().map(|s| Runnable::new(&s.study)).collect();
    let fits = library(of, &mut runs, &healthy, &models)?;
    judged(of, &runs, &healthy, &fits)
}

/// The best fit of every scenario, in their order.
fn library<'m>(
    of: &Diagnosis,
    runs: &mut Runs<'_>,
    healthy: &Hypothesis<'_>,
    models: &'m [Runnable],
) -> Result<Vec<Hypothesis<'m>>, DiagnoseError> {
    let mut fits = Vec::new();
    let mut of_scenario = Vec::new();
    for (k, (scenario, model)) in of.scenarios.iter().zip(models).enumerate() {
        runs.begin(1 + k, "search", format!("scenario `{}`", scenario.name));
        for start in starts(runs, healthy, (scenario, model), of.severity())? {
            fits.push(Hypothesis::new(model, start));
            of_scenario.push(k);
        }
    }
    runs.begin(1 + models.len(), "fits", "all scenarios".to_owned());
    drive(runs, &mut fits)?;
    let mut best: Vec<Option<Hypothesis<'m>>> = vec![None; models.len()];
    for (k, fit) in of_scenario.into_iter().zip(fits) {
        if best[k].as_ref().is_none_or(|known| fit.cost() < known.cost()) {
            best[k] = Some(fit);
        }
    }
    Ok(best.into_iter().flatten().collect())
}

fn judged(
    of: &Diagnosis,
    runs: &Runs<'_>,
    healthy: &Hypothesis<'_>,
    fits: &[Hypothesis<'_>],
) -> Result<Diagnosed, DiagnoseError> {
    if let (Some(scenario), true) = (of.scenarios.first(), fits.iter().all(|fit| fit.failure.is_some())) {
        let reason = fits.first().and_then(|fit| fit.failure.clone()).unwrap_or_default();
        return Err(DiagnoseError::NoScenario { name: scenario.name.clone(), reason });
    }
    let series = Series::new(&of.healthy, &runs.rows);
    let named: Vec<(&str, usize, &Hypothesis<'_>)> =
        of.scenarios.iter().zip(fits).map(|(s, fit)| (s.name.as_str(), s.n_start(), fit)).collect();
    let alarm = alarm(&series, healthy, &named, of.false_alarm);
    let scenarios = scenarios(of, runs, healthy, fits, &series);
    let (verdict, left) = verdict(&alarm, &scenarios);
    let likeliest = likeliest(&scenarios).map(|k| &fits[k]);
    Ok(Diagnosed {
        study: of.healthy.name.clone(),
        model: of.healthy.setup.model.kind.clone(),
        time_unit: of.healthy.time_unit.clone(),
        verdict,
        says: words::says(verdict, &alarm, &left, &of.healthy.time_unit),
        named: left.iter().map(|scenario| scenario.name.clone()).collect(),
        healthy: HealthyFound { misfit: healthy.misfit(), parameters: healthy.parameters(None) },
        courses: courses(of, runs, healthy, likeliest, &series),
        n_value: runs.rows.len(),
        runs: runs.n_run,
        conditional_on: words::conditional_on(),
        warnings: warnings(of, healthy, fits),
        alarm,
        scenarios,
    })
}

fn scenarios(
    of: &Diagnosis,
    runs: &Runs<'_>,
    healthy: &Hypothesis<'_>,
    fits: &[Hypothesis<'_>],
    series: &Series<'_>,
) -> Vec<ScenarioFound> {
    let evidence: Vec<f64> = fits.iter().map(|fit| fit.log_evidence(&runs.rows)).collect();
    let beforehand: Vec<f64> = of.scenarios.iter().map(|scenario| scenario.weight).collect();
    let none = healthy.log_evidence(&runs.rows);
    let found = of.scenarios.iter().zip(fits).zip(evidence.iter().zip(probabilities(&evidence, &beforehand)));
    found
        .map(|((scenario, fit), (evidence, probability))| {
            let ran = fit.failure.is_none();
            ScenarioFound {
                name: scenario.name.clone(),
                says: scenario.says.clone(),
                probability,
                log_bayes_factor: (evidence.is_finite() && none.is_finite()).then_some(evidence - none),
                misfit: ran.then(|| fit.misfit()),
                explains: ran && series.first(&fit.innovations(), of.false_alarm).is_none(),
                parameters: if ran { fit.parameters(Some(of.severity())) } else { Vec::new() },
                failure: fit.failure.clone(),
            }
        })
        .collect()
}

/// Index of the likeliest scenario.
fn likeliest(scenarios: &[ScenarioFound]) -> Option<usize> {
    let run = (0..scenarios.len()).filter(|k| scenarios[*k].failure.is_none());
    run.max_by(|a, b| scenarios[*a].probability.total_cmp(&scenarios[*b].probability).then(b.cmp(a)))
}

/// The verdict, and the scenarios that are left, the likeliest first.
fn verdict<'s>(alarm: &AlarmFound, scenarios: &'s [ScenarioFound]) -> (Verdict, Vec<&'s ScenarioFound>) {
    let Some(best) = likeliest(scenarios).map(|k| &scenarios[k]).filter(|_| alarm.is_raised()) else {
        return (Verdict::NoFault, Vec::new());
    };
    if !best.explains {
        return (Verdict::Unexplained, vec![best]);
    }
    if best.probability >= NAMED {
        return (Verdict::Named, vec![best]);
    }
    let mut left: Vec<&ScenarioFound> = scenarios.iter().filter(|s| s.probability >= LISTED).collect();
    left.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    (Verdict::Undecided, left)
}

/// What was measured and what the models say of it: the series whose two courses differ most, in units of the noise.
fn courses(
    of: &Diagnosis,
    runs: &Runs<'_>,
    healthy: &Hypothesis<'_>,
    likeliest: Option<&Hypothesis<'_>>,
    series: &Series<'_>,
) -> Vec<CourseFound> {
    let Some(likeliest) = likeliest else { return Vec::new() };
    let apart = |of: &Vec<usize>| {
        let off = |i: &usize| (healthy.predicted[*i] - likeliest.predicted[*i]) / runs.rows[*i].noise;
        of.iter().map(|i| off(i).powi(2)).sum::<f64>()
    };
    let mut order: Vec<(f64, &Vec<usize>)> = series.iter().map(|of| (apart(of), of)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0));
    let course = |rows: &Vec<usize>| {
        let first = runs.rows[rows[0]];
        let kept: Vec<usize> = rows.iter().copied().step_by(rows.len().div_ceil(KEPT)).collect();
        let of_kept = |values: &[f64]| kept.iter().map(|i| values[*i]).collect();
        let output = of.healthy.setup.outputs[first.output].clone();
        let quantity = starlings_study::field::quantity_of(&of.healthy.spec.outputs, &output);
        CourseFound {
            record: of.healthy.records[first.record].name.clone(),
            unit: quantity.map_or_else(String::new, |quantity| quantity.unit.clone()),
            output,
            times: kept.iter().map(|i| runs.rows[*i].time).collect(),
            observed: kept.iter().map(|i| runs.rows[*i].observed).collect(),
            noise: first.noise,
            healthy: of_kept(&healthy.predicted),
            likeliest: of_kept(&likeliest.predicted),
        }
    };
    order.into_iter().take(COURSES).map(|(_, rows)| course(rows)).collect()
}

fn warnings(of: &Diagnosis, healthy: &Hypothesis<'_>, fits: &[Hypothesis<'_>]) -> Vec<String> {
    let mut warnings = of.healthy.warnings.clone();
    if !healthy.has_converged() {
        warnings.push(
            "the fit of the model without a fault has not converged: what departs from it may be its fit"
                .to_owned(),
        );
    }
    for (scenario, fit) in of.scenarios.iter().zip(fits) {
        let name = &scenario.name;
        warnings
            .extend(scenario.study.warnings.iter().map(|warning| format!("scenario `{name}`: {warning}")));
        if let Some(reason) = &fit.failure {
            warnings.push(format!(
                "scenario `{name}` cannot be run and has no part in the probabilities: {reason}"
            ));
        } else if !fit.has_converged() {
            warnings.push(format!("the fit of scenario `{name}` has not converged: its probability is too small rather than too large"));
        }
    }
    warnings
}
