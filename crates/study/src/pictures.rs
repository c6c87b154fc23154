//! Pictures of a study: curves and maps of grids, clouds of samples, bars of sensitivities.

use super::sensitivity::{Effects, Indices, elementary_effects, sobol_indices};
use super::{Axis, Design, Outcome, Spread, design};
use crate::benchmark::Measure;
use stickslip_base::figure::{Axis as FigureAxis, Figure, Map, Role, Series};
use stickslip_base::parameters::number;
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::{Error, Summary};

/// Largest number of cases in a cloud; of more cases, a regular selection is drawn.
const CLOUD: u64 = 2000;
/// Ratio of an axis' largest to smallest value above which it is drawn logarithmically.
const DECADES: f64 = 50.0;

/// A picture with its caption.
#[derive(Clone, Debug)]
pub(super) enum Picture {
    Figure(Figure, String),
    Map(Map, String),
}

/// Whether an axis is drawn logarithmically: where its values are even in the logarithm, or cover decades.
fn is_logarithmic(axis: &Axis) -> bool {
    let ends = axis.spread.extremes();
    let (low, high) =
        ends.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &value| (low.min(value), high.max(value)));
    let is_even = matches!(axis.spread, Spread::Range { logarithmic: true, .. } | Spread::LogNormal { .. });
    low > 0.0 && (is_even || high / low >= DECADES)
}

/// An axis of a study as an axis of a figure.
fn drawn(axis: &Axis) -> FigureAxis {
    let drawn = FigureAxis::new(axis.name.clone(), axis.unit.clone());
    if is_logarithmic(axis) { drawn.logarithmic() } else { drawn }
}

impl Outcome {
    /// A map for each measure of a grid of two axes, otherwise each measure over each axis.
    pub(super) fn pictures(&self) -> Result<Vec<Picture>, Error> {
        let measures: Vec<&Measure> = self.plan.measures().collect();
        if let (Design::Grid, [rows, columns]) = (&self.plan.design, &self.plan.axes[..])
            && let (Spread::Values(of_rows), Spread::Values(of_columns)) = (&rows.spread, &columns.spread)
            && of_rows.len() > 1
            && of_columns.len() > 1
        {
            let mut values: Vec<Vec<Option<f64>>> = vec![Vec::new(); measures.len()];
            self.each(|row| values.iter_mut().zip(&row.measures).for_each(|(all, value)| all.push(*value)))?;
            let axis = |axis: &Axis| FigureAxis::new(axis.name.clone(), axis.unit.clone());
            let map = |(measure, values): (&&Measure, Vec<Option<f64>>)| {
                let title = format!("{} over {} and {}", measure.title, columns.name, rows.name);
                let value = FigureAxis::new(measure.title, measure.unit);
                let axes = [axis(columns), axis(rows), value];
                let unit = stickslip_base::quantity::unit(measure.unit);
                let unit = if unit.is_empty() { String::new() } else { format!(", in {unit}") };
                let failed = if values.contains(&None) { " Empty cells: failed cases." } else { "" };
                let caption = format!("{}{unit}; a stronger colour is a larger value.{failed}", measure.title);
                Picture::Map(Map::new(title, axes, [of_columns.clone(), of_rows.clone()], values), caption)
            };
            return Ok(measures.iter().zip(values).map(map).collect());
        }
        let mut figures = Vec::new();
        let every = self.cases.div_ceil(CLOUD);
        let mut rows = Vec::new();
        self.each(|row| rows.extend((row.case - 1).is_multiple_of(every).then(|| row.clone())))?;
        let alone = self.plan.axes.len() == 1;
        for (index, measure) in measures.iter().enumerate() {
            for (k, axis) in self.plan.axes.iter().enumerate() {
                let mut points: Vec<(f64, f64)> =
                    rows.iter().map(|row| (row.values[k], row.measures[index].unwrap_or(f64::NAN))).collect();
                points.sort_by(|one, other| one.0.total_cmp(&other.0));
                let mut figure = Figure::new(format!("{} over {}", measure.title, axis.name))
                    .x(drawn(axis))
                    .y(FigureAxis::new(measure.title, measure.unit));
                if alone && self.plan.design == Design::Grid {
                    figure = figure.series(Series::line(Role::Fitted, "between them", points.iter().copied()));
                }
                let count = points.iter().filter(|point| point.1.is_finite()).count();
                figure = figure.series(Series::points(Role::Reference, "cases", points).large());
                let part = if every > 1 { format!(" One of {every} cases is drawn.") } else { String::new() };
                let caption = format!("{}: {count} cases with a number.{part}", measure.title);
                figures.push(Picture::Figure(figure, caption));
            }
        }
        Ok(figures)
    }

    /// Sensitivities to the axes for each measure, if the design yields them.
    pub(super) fn sensitivities(&self) -> Result<Vec<Sensitivity>, Error> {
        if !matches!(self.plan.design, Design::Morris { .. } | Design::Saltelli { .. }) {
            return Ok(Vec::new());
        }
        let (axes, design) = (&self.plan.axes, &self.plan.design);
        let mut sensitivities = Vec::new();
        for (index, measure) in self.plan.measures().enumerate() {
            // One measure after the other: one column fits in memory where the table does not.
            let mut values = Vec::new();
            self.each(|row| values.push(row.measures[index].unwrap_or(f64::NAN)))?;
            let places = |case| match design.place(case, axes) {
                design::Place::Within(places) | design::Place::Normal(places) => places,
            };
            let kind = if let Design::Morris { .. } = design {
                Some(SensitivityKind::Effects(elementary_effects(axes.len(), &values, places)))
            } else {
                sobol_indices(axes.len(), &values).map(SensitivityKind::Indices)
            };
            let names: Vec<String> = axes.iter().map(|axis| axis.name.clone()).collect();
            sensitivities.extend(kind.map(|kind| Sensitivity { measure, names, kind }));
        }
        Ok(sensitivities)
    }
}

/// Sensitivity of a measure to each axis.
#[derive(Clone, Debug)]
pub(super) struct Sensitivity {
    measure: &'static Measure,
    names: Vec<String>,
    kind: SensitivityKind,
}

#[derive(Clone, Debug)]
enum SensitivityKind {
    Effects(Vec<Effects>),
    Indices(Vec<Indices>),
}

/// Horizontal offset of the second number of an axis from the first.
const BESIDE: f64 = 0.08;

/// Numbers over 1, 2, … with their intervals, which need not be symmetric.
fn with_intervals(
    figure: Figure,
    role: Role,
    name: &str,
    offset: f64,
    numbers: impl Iterator<Item = (f64, [f64; 2])>,
) -> Figure {
    let numbers: Vec<(f64, f64, [f64; 2])> =
        numbers.enumerate().map(|(k, (value, ends))| ((k + 1) as f64 + offset, value, ends)).collect();
    let ends = numbers.iter().flat_map(|&(x, _, [low, high])| [(x, low), (x, high), (x, f64::NAN)]);
    figure
        .series(Series::line(role, format!("{name}, 95 %"), ends))
        .series(Series::points(role, name, numbers.iter().map(|&(x, value, _)| (x, value))).large())
}

impl Sensitivity {
    fn title(&self) -> String {
        match self.kind {
            SensitivityKind::Effects(_) => format!("{}: elementary effects", self.measure.title),
            SensitivityKind::Indices(_) => format!("{}: Sobol's indices", self.measure.title),
        }
    }

    /// Numbers over the number of the axis.
    pub(super) fn figure(&self) -> Figure {
        let place = |k: usize| (k + 1) as f64;
        let count = self.names.len() as f64;
        let mut figure = Figure::new(self.title()).x(FigureAxis::new("axis", "1").range(0.5, count + 0.9));
        for (k, name) in self.names.iter().enumerate() {
            figure = figure.interval(place(k) - 0.03, place(k) + 0.03, name.clone());
        }
        match &self.kind {
            SensitivityKind::Effects(effects) => {
                let means = effects.iter().map(|it| (it.magnitude, it.ci95));
                let spreads = effects.iter().enumerate().map(|(k, it)| (place(k) + BESIDE, it.sd));
                with_intervals(figure.y(FigureAxis::new("effect", self.measure.unit)), Role::Fitted, "μ*", 0.0, means)
                    .series(Series::points(Role::Desired, "σ", spreads).large())
            }
            SensitivityKind::Indices(indices) => {
                let figure = figure.y(FigureAxis::new("share of the variance", "1"));
                let first = indices.iter().map(|it| (it.first.value, it.first.ci95));
                let total = indices.iter().map(|it| (it.total.value, it.total.ci95));
                let figure = with_intervals(figure, Role::Fitted, "alone", 0.0, first);
                with_intervals(figure, Role::Desired, "with all others", BESIDE, total)
            }
        }
    }

    pub(super) fn caption(&self) -> String {
        match self.kind {
            SensitivityKind::Effects(_) => format!(
                "μ* is the mean magnitude of the change of {} when an axis covers its whole range, σ how much that \
                 varies over the range: large where the axis has a nonlinear effect or interacts with others.",
                self.measure.title
            ),
            SensitivityKind::Indices(_) => format!(
                "Share of the variance of {} that an axis causes alone, and including its interactions; the difference \
                 is caused by interactions.",
                self.measure.title
            ),
        }
    }

    /// The numbers.
    pub(super) fn table(&self) -> Table {
        let unit = self.measure.unit;
        let cells = |value: f64, [low, high]: [f64; 2], unit: &str| {
            let ends = format!("{} … {}", number::rounded(low, 3), number::rounded(high, 3));
            [Cell::Estimate(Estimate::new(value, unit)), Cell::from(ends.as_str())]
        };
        match &self.kind {
            SensitivityKind::Effects(effects) => {
                let table = Table::new(["axis", "μ*", "95 %, in SI", "σ"]);
                self.names.iter().zip(effects).fold(table, |table, (name, it)| {
                    let [mean, ends] = cells(it.magnitude, it.ci95, unit);
                    table.row([Cell::from(name.as_str()), mean, ends, Cell::Estimate(Estimate::new(it.sd, unit))])
                })
            }
            SensitivityKind::Indices(indices) => {
                let table = Table::new(["axis", "alone", "95 %", "with all others", "95 %"]);
                self.names.iter().zip(indices).fold(table, |table, (name, it)| {
                    let [first, total] = [it.first, it.total].map(|share| cells(share.value, share.ci95, "1"));
                    table.row(std::iter::once(Cell::from(name.as_str())).chain(first).chain(total))
                })
            }
        }
        .caption(self.title())
    }

    /// A row of the summary for each axis.
    pub(super) fn rows(&self, summary: &mut Summary) {
        let measure = self.measure.name;
        for (k, name) in self.names.iter().enumerate() {
            match &self.kind {
                SensitivityKind::Effects(effects) => summary.row([
                    ("kind", "effects".into()),
                    ("measure", measure.into()),
                    ("axis", name.as_str().into()),
                    ("unit", self.measure.unit.into()),
                    ("magnitude", effects[k].magnitude.into()),
                    ("ci95", effects[k].ci95.to_vec().into()),
                    ("sd", effects[k].sd.into()),
                ]),
                SensitivityKind::Indices(indices) => summary.row([
                    ("kind", "indices".into()),
                    ("measure", measure.into()),
                    ("axis", name.as_str().into()),
                    ("first", indices[k].first.value.into()),
                    ("first_ci95", indices[k].first.ci95.to_vec().into()),
                    ("total", indices[k].total.value.into()),
                    ("total_ci95", indices[k].total.ci95.to_vec().into()),
                ]),
            };
        }
    }
}
