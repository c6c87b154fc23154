//! One whole experiment of the coverage study, and the sum of many.

use stickslip::bench::{Bench, VirtualBench};
use stickslip::experiment::{FrictionPlan, home, measure_friction};
use stickslip::fit::{CurvePoint, StribeckFit};
use stickslip::{Error, Preset, Watch, parameters, truth};

/// What the virtual machine has and what was measured of it.
pub struct Experiment {
    /// The parameters in truth.
    pub truth: [f64; 4],
    /// The points as measured.
    pub points: Vec<CurvePoint>,
    /// The fit.
    pub fit: StribeckFit,
}

/// Homes `clm-bench`, runs the quick plan at a preload of the friction wheel and fits.
pub fn experiment(preload: f64, seed: u64) -> Result<Experiment, Error> {
    let preset: Preset<f64> = parameters::presets::find("clm-bench")?.read()?;
    let plan = FrictionPlan::quick();
    let mut bench = VirtualBench::new(&preset, seed)?;
    home(&mut bench, &Watch::silent())?;
    bench.set_preload(preload)?;
    let curve = measure_friction(&plan, &mut bench, false, &Watch::silent())?;
    let truth = truth::own_curve(bench.truth(), &plan)?.parameters;
    Ok(Experiment { truth, points: curve.points(), fit: curve.fit()? })
}

/// Sums over experiments, for each parameter.
#[derive(Clone, Copy, Default)]
pub struct Tally {
    /// Experiments.
    pub count: usize,
    /// Intervals that contain the truth.
    pub hits: [usize; 4],
    errors: [f64; 4],
    squares: [f64; 4],
    stated: [f64; 4],
}

impl Tally {
    /// Counts an experiment.
    pub fn add(&mut self, truth: &[f64; 4], fit: &StribeckFit) {
        self.count += 1;
        for i in 0..4 {
            let error = fit.parameters[i] / truth[i] - 1.0;
            self.hits[i] += usize::from((fit.ci95[i][0]..=fit.ci95[i][1]).contains(&truth[i]));
            self.errors[i] += error;
            self.squares[i] += error * error;
            self.stated[i] += fit.standard_errors[i] / truth[i];
        }
    }

    /// Share of the intervals that contain the truth.
    pub fn coverage(&self, parameter: usize) -> f64 {
        self.hits[parameter] as f64 / self.count as f64
    }

    /// Mean error, its standard deviation and the mean standard error as stated, relative to the truth.
    pub fn errors(&self, parameter: usize) -> [f64; 3] {
        let n = self.count as f64;
        let mean = self.errors[parameter] / n;
        [mean, (self.squares[parameter] / n - mean * mean).sqrt(), self.stated[parameter] / n]
    }
}
