//! Figures of a benchmark on a bench: the deviations of the controllers over each other, and their differences.

use super::report::{DRAWN, Panels};
use super::{BENCH, Outcome, rank};
use crate::trials::over_time;
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_simulate::manoeuvre::{Course, Manoeuvre};

impl Outcome {
    /// For each manoeuvre the name of its file, the deviations of the first entrant and of the best others in their
    /// first repetition, and those less that of the first.
    pub(super) fn figures_of_bench(&self) -> Vec<(String, Panels)> {
        let first = &self.plan.entrants[0].name;
        let ranks = rank(self, BENCH);
        let best = ranks.iter().map(|it| &it.entrant).filter(|name| *name != first).take(DRAWN);
        let names: Vec<&String> = best.collect();
        let of = |manoeuvre: &Manoeuvre| {
            let course = |name: &String| {
                let found = self.courses.iter().find(|(other, of, _)| other == name && of == manoeuvre);
                found.map(|(_, _, course)| course)
            };
            let reference = course(first)?;
            let others = names.iter().filter_map(|name| Some((name.as_str(), course(name)?)));
            Some((
                format!("{}.svg", manoeuvre.name()),
                compared(manoeuvre.title(), (first, reference), others.collect()),
            ))
        };
        self.plan.manoeuvres.iter().filter_map(of).collect()
    }
}

/// The deviations, and below them the differences of courses of the same duration and rate.
fn compared(title: &str, (name, first): (&str, &Course), others: Vec<(&str, &Course)>) -> Panels {
    let figure =
        |title: String, quantity: &str| Figure::new(title).x(Axis::new("time", "s")).y(Axis::new(quantity, "mrad"));
    let line = |role: Role, name: &str, course: &Course, minus: Option<&Course>| {
        let values = course.deviation.iter().enumerate();
        let values = values.map(|(k, value)| 1e3 * (value - minus.map_or(0.0, |minus| minus.deviation[k])));
        Series::line(role, name, over_time(course.period, values))
    };
    let traces = || others.iter().enumerate().map(|(index, (name, course))| (Role::Trace(index), *name, *course));
    let deviations = traces()
        .map(|(role, name, course)| line(role, name, course, None))
        .fold(figure(title.into(), "deviation").series(line(Role::Reference, name, first, None)), Figure::series);
    let fits = |course: &Course| course.period == first.period && course.deviation.len() == first.deviation.len();
    let differences: Vec<Series> = traces()
        .filter(|(_, _, course)| fits(course))
        .map(|(role, other, course)| line(role, &format!("{other} − {name}"), course, Some(first)))
        .collect();
    let caption = format!("{title}: set-point minus measured angle, the first repetition of each controller.");
    let mut figures = vec![(deviations, caption)];
    if !differences.is_empty() {
        let figure = differences.into_iter().fold(figure("Difference".into(), "difference"), Figure::series);
        figures.push((figure, format!("{title}: deviations less the deviation of {name}.")));
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;
    use stickslip_base::figure::panels;

    fn course(period: f64, deviation: Vec<f64>) -> Course {
        let zeros = vec![0.0; deviation.len()];
        Course { period, deviation, velocity: zeros.clone(), torque: zeros }
    }

    #[test]
    fn controllers_are_over_each_other_with_the_differences_below() {
        let (slow, fast) = (course(1e-3, vec![4e-3; 500]), course(1e-3, vec![1e-3; 500]));
        let other_rate = course(2e-3, vec![2e-3; 250]);
        let figures = compared("Sine", ("active", &slow), vec![("pid", &fast), ("lqr", &other_rate)]);
        assert_eq!(figures.len(), 2);
        let drawn: Vec<Figure> = figures.into_iter().map(|(figure, _)| figure).collect();
        let text = panels("Sine", &drawn);
        assert!(
            text.contains(
                "active (line): 500 values from 4.00 to 4.00 mrad. pid (line): 500 values from 1.00 to 1.00 mrad."
            ),
            "{text}"
        );
        assert!(
            text.contains("pid − active (line): 500 values from −3.00 to −3.00 mrad.</desc>"),
            "another rate: no difference"
        );
        assert!(text.contains("lqr (line): 250 values from 2.00 to 2.00 mrad."));
        assert_eq!(compared("Sine", ("active", &slow), vec![("lqr", &other_rate)]).len(), 1);
    }
}
