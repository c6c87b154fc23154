//! A frequency response, as `response.csv`.

use super::{Outcome, Plan};
use crate::{Answer, COHERENT, Line, Response, ResponsePlan, measure_response};
use stickslip_base::figure::{Axis, Figure, Role, Series};
use stickslip_base::quantity::Estimate;
use stickslip_base::report::{Cell, Table};
use stickslip_base::table::Column;
use stickslip_base::{Error, Preset, Summary, Watch};
use stickslip_bench::Bench;
use stickslip_design::linear::{Operating, decibels, size, unwrapped};

/// A sensor: its name, what it measures, the unit of its gain and its answers.
struct Sensor {
    name: &'static str,
    quantity: &'static str,
    unit: &'static str,
    answer: fn(&Line) -> Answer,
}

const SENSORS: [Sensor; 2] = [
    Sensor { name: "tacho", quantity: "motor velocity", unit: "rad/(N m s)", answer: |line| line.velocity },
    Sensor { name: "encoder", quantity: "angle", unit: "rad/(N m)", answer: |line| line.angle },
];

impl Plan for ResponsePlan<f64> {
    const KIND: &'static str = "response";
    type Outcome = Response;

    /// Four times the periods.
    fn thorough() -> Self {
        let quick = ResponsePlan::default();
        ResponsePlan { periods: 4.0 * quick.periods, ..quick }
    }

    fn duration(&self, preset: &Preset<f64>) -> f64 {
        let limits = preset.bench.safety;
        self.duration([limits.lower_end, limits.upper_end])
    }

    fn about(&self) -> String {
        let Self { lowest_frequency, highest_frequency, periods, .. } = *self;
        let signal = if self.chirp > 0.5 { "a chirp" } else { "a multisine" };
        let load = match self.operating() {
            Operating::Sliding(velocity) => format!("sliding at {velocity} rad/s"),
            Operating::Stuck => "at rest".into(),
        };
        format!(
            "Frequency response from {lowest_frequency} to {highest_frequency} Hz by {periods} periods of {signal}, the \
             load {load}"
        )
    }

    fn run(&self, bench: &mut dyn Bench, watch: &Watch) -> Result<Response, Error> {
        measure_response(self, bench, watch)
    }
}

impl Response {
    fn coherent(&self, sensor: &Sensor) -> impl Iterator<Item = (f64, Answer)> {
        let answers = self.lines.iter().map(|line| (line.frequency, (sensor.answer)(line)));
        answers.filter(|(_, answer)| answer.coherence > COHERENT)
    }

    fn magnitude(&self, sensor: &Sensor) -> (Figure, String) {
        let expected = self.lines.iter().map(|line| (line.frequency, decibels((sensor.answer)(line).expected)));
        let points = self.coherent(sensor);
        let points = points.map(|(frequency, answer)| (frequency, decibels(answer.gain), answer.interval()[0]));
        let figure = Figure::new(format!("Commanded torque to {}, magnitude", sensor.quantity))
            .x(Axis::new("frequency", "Hz").stretched())
            .y(Axis::new(format!("magnitude over 1 {}", stickslip_base::quantity::unit(sensor.unit)), "dB"))
            .series(Series::bars(Role::Measured, "measured", points))
            .series(Series::line(Role::Fitted, "modelled", expected));
        let ([by, _], count) = self.deviation(sensor.answer);
        let caption = format!(
            "Measured by the {} where its coherence is above {COHERENT}, at {count} of {} frequencies, with 95\u{a0}% \
             intervals; the modelled axis deviates by at most {}.",
            sensor.name,
            self.lines.len(),
            Estimate::new(by, "dB")
        );
        (figure, caption)
    }

    fn phase(&self, sensor: &Sensor) -> (Figure, String) {
        let all = unwrapped(self.lines.iter().map(|line| (sensor.answer)(line).expected), -90.0);
        let expected: Vec<(f64, f64)> = self.lines.iter().map(|line| line.frequency).zip(all).collect();
        let model_phase =
            |at: f64| expected.iter().find(|(frequency, _)| *frequency == at).map_or(f64::NAN, |(_, p)| *p);
        // On the same turn as the modelled phase, so that a gap does not hide a turn.
        let points: Vec<(f64, f64, f64)> = self
            .coherent(sensor)
            .map(|(frequency, answer)| {
                (frequency, model_phase(frequency) + answer.deviation()[1], answer.interval()[1])
            })
            .collect();
        let figure = Figure::new(format!("Commanded torque to {}, phase", sensor.quantity))
            .x(Axis::new("frequency", "Hz").stretched())
            .y(Axis::new("phase", "°"))
            .series(Series::bars(Role::Measured, "measured", points))
            .series(Series::line(Role::Fitted, "modelled", expected));
        let ([_, by], _) = self.deviation(sensor.answer);
        (
            figure,
            format!(
                "Both include the delay of the tick; the modelled axis deviates by at most {}.",
                Estimate::new(by, "°")
            ),
        )
    }

    fn coherence(&self) -> (Figure, String) {
        let axes = Figure::new("Coherence")
            .x(Axis::new("frequency", "Hz").stretched())
            .y(Axis::new("coherence", "1").range(0.0, 1.0));
        let figure = SENSORS.iter().enumerate().fold(axes, |figure, (index, sensor)| {
            let points = self.lines.iter().map(|line| (line.frequency, (sensor.answer)(line).coherence));
            figure.series(Series::line(Role::Trace(index), sensor.name, points))
        });
        let caption = format!(
            "Share of the power that follows the excitation, of the sensor's or of the torque's, the smaller of both; \
             noise alone has {1} over {0} periods.",
            self.periods,
            Estimate::new(1.0 / self.periods as f64, "1")
        );
        (figure, caption)
    }
}

impl Outcome for Response {
    const DATA: &'static str = "response";

    fn complete(&self) -> bool {
        self.complete
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings()
    }

    fn table(&self) -> Table {
        let table = Table::new(["", "coherent frequencies", "magnitude deviation", "phase deviation"])
            .caption(format!("Largest deviation from the modelled axis where the coherence is above {COHERENT}."));
        SENSORS.iter().fold(table, |table, sensor| {
            let ([magnitude, phase], count) = self.deviation(sensor.answer);
            table.row([
                sensor.name.into(),
                Cell::Text(format!("{count} of {}", self.lines.len())),
                Cell::Estimate(Estimate::new(magnitude, "dB")),
                Cell::Estimate(Estimate::new(phase, "°")),
            ])
        })
    }

    fn figure(&self) -> (Figure, String) {
        self.magnitude(&SENSORS[0])
    }

    fn further(&self) -> Vec<(Figure, String)> {
        let [tacho, encoder] = &SENSORS;
        vec![self.phase(tacho), self.magnitude(encoder), self.phase(encoder), self.coherence()]
    }

    fn add_to(&self, summary: &mut Summary) {
        let velocity = if let Operating::Sliding(velocity) = self.operating { velocity } else { 0.0 };
        summary
            .result("measure.velocity", velocity, "rad/s")
            .result("measure.periods", self.periods as f64, "1")
            .result("measure.lines", self.lines.len() as f64, "1");
        for sensor in &SENSORS {
            let ([magnitude, phase], count) = self.deviation(sensor.answer);
            let mut add = |quantity: &str, value: f64, unit: &str| {
                summary.result(&format!("measure.{}.{quantity}", sensor.name), value, unit);
            };
            add("coherent_lines", count as f64, "1");
            add("magnitude_deviation", magnitude, "dB");
            add("phase_deviation", phase, "°");
        }
    }

    fn columns(&self) -> Vec<Column> {
        let column = |name: String, unit: &str, values: Vec<f64>| Column { name, unit: unit.into(), values };
        let frequency = self.lines.iter().map(|line| line.frequency).collect();
        let mut columns = vec![column("frequency".into(), "Hz", frequency)];
        for Sensor { name, unit, answer, .. } in &SENSORS {
            let answers = || self.lines.iter().map(answer);
            let expected = unwrapped(answers().map(|answer| answer.expected), -90.0);
            let phase = expected.iter().zip(answers()).map(|(phase, answer)| phase + answer.deviation()[1]).collect();
            let named = |quantity: &str| format!("{name}_{quantity}");
            columns.extend([
                column(named("gain"), unit, answers().map(|answer| size(answer.gain)).collect()),
                column(named("phase"), "°", phase),
                column(named("half_width"), "1", answers().map(|answer| answer.half_width).collect()),
                column(named("coherence"), "1", answers().map(|answer| answer.coherence).collect()),
                column(named("believed_gain"), unit, answers().map(|answer| size(answer.expected)).collect()),
                column(named("believed_phase"), "°", expected),
            ]);
        }
        columns
    }
}
