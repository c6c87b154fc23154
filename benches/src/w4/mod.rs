//! W4: the Stribeck curve through five thousand noisy points, by this program, by C and by SciPy.
//!
//! All get the same columns of speed and torque. Ours searches everywhere and gives the covariance; the peers get a start
//! that is near, and SciPy gives the covariance too.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use stickslip::fit::stribeck_optimum;
use stickslip::noise::Normals;

pub(crate) const NAMES: [&str; 2] = ["w4/c_lm", "w4/scipy"];

const POINTS: usize = 5000;
/// M_S, M_K, Ω_Strib, b.
const TRUTH: [f64; 4] = [0.3, 0.18, 3.0, 2e-3];
/// Standard deviation of a torque [N m].
const NOISE: f64 = 0.01;
/// Where the peers begin.
const START: [&str; 4] = ["0.35", "0.15", "2", "0.001"];
/// Fits of a contestant in a round.
const FITS: usize = 50;
/// What the peer is compiled with: as fast as this machine goes.
const FLAGS: [&str; 4] = ["-std=c99", "-O3", "-march=native", "-Wall"];
/// Largest difference of a parameter, as a share of it: the peers stop at shares of 1e-8 of the sum of squares.
const ALIKE: f64 = 1e-6;

/// What came of a contestant: microseconds of its fastest fit, parameters, root mean square of what is left [N m].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fitted {
    pub(crate) time: f64,
    pub(crate) parameters: [f64; 4],
    pub(crate) rms: f64,
}

impl Fitted {
    /// The faster of two runs.
    fn or(self, other: Option<Self>) -> Self {
        other.filter(|other| other.time < self.time).unwrap_or(self)
    }

    /// Largest difference of a parameter, as a share of it.
    pub(crate) fn apart(&self, other: &Self) -> f64 {
        let share = |(a, b): (&f64, &f64)| (a / b - 1.0).abs();
        self.parameters.iter().zip(&other.parameters).map(share).fold(0.0, f64::max)
    }
}

/// Ours, and each peer in the order of [`NAMES`] or why it did not run.
pub(crate) struct Outcome {
    pub(crate) ours: Fitted,
    pub(crate) peers: [Result<Fitted, String>; 2],
}

/// Runs all in turn, `rounds` times.
///
/// # Errors
/// If the system refuses files; if the contestants do not find the same curve.
pub(crate) fn run(rounds: usize) -> Result<Outcome, Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("stickslip-w4-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let outcome = contest(&folder, rounds);
    std::fs::remove_dir_all(&folder)?;
    outcome
}

fn contest(folder: &Path, rounds: usize) -> Result<Outcome, Box<dyn Error>> {
    let [speeds, torques] = points();
    let numbers = [POINTS as f64].into_iter().chain(speeds.iter().copied()).chain(torques.iter().copied());
    std::fs::write(folder.join("points"), numbers.flat_map(f64::to_ne_bytes).collect::<Vec<u8>>())?;
    std::fs::write(folder.join("lm.c"), include_str!("lm.c"))?;
    std::fs::write(folder.join("curve_fit.py"), include_str!("curve_fit.py"))?;
    let python = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
    let mut ready = [
        told(Command::new("gcc").args(FLAGS).args(["-o", "lm", "lm.c", "-lm"]), folder).map(drop),
        told(Command::new(&python).args(["-c", "import numpy, scipy.optimize"]), folder).map(drop),
    ];
    let (mut lm, mut scipy) = (Command::new(folder.join("lm")), Command::new(python));
    lm.arg("points").args(START);
    scipy.args(["curve_fit.py", "points"]).args(START);
    let mut ours = None;
    let mut peers: [Option<Fitted>; 2] = [None, None];
    for _ in 0..rounds {
        ours = Some(here(&speeds, &torques)?.or(ours));
        for ((peer, ready), command) in peers.iter_mut().zip(&mut ready).zip([&mut lm, &mut scipy]) {
            if ready.is_err() {
                continue;
            }
            match there(command, folder) {
                Ok(fitted) => *peer = Some(fitted.or(*peer)),
                Err(reason) => *ready = Err(reason),
            }
        }
    }
    let ours = ours.ok_or("no round")?;
    if let Some(other) = peers.iter().flatten().find(|peer| peer.apart(&ours) > ALIKE) {
        return Err(format!("the curves differ: {ours:?} here, {other:?} there").into());
    }
    let [c, python] = peers;
    let [why_no_c, why_no_python] = ready.map(|it| it.err().unwrap_or_default());
    Ok(Outcome { ours, peers: [c.ok_or(why_no_c), python.ok_or(why_no_python)] })
}

/// Speeds from 0.1 to 50 rad/s, evenly in their logarithm, in an order in which neighbours are far apart.
fn points() -> [Vec<f64>; 2] {
    let speeds: Vec<f64> =
        (0..POINTS).map(|k| 0.1 * 500_f64.powf((k * 1237 % POINTS) as f64 / (POINTS - 1) as f64)).collect();
    let [breakaway, kinetic, velocity, viscous] = TRUTH;
    let noise = Normals::new(1);
    let torque = |(k, v): (usize, &f64)| {
        kinetic + (breakaway - kinetic) * (-v / velocity).exp() + viscous * v + NOISE * noise.pair(0, k as u64)[0]
    };
    let torques = speeds.iter().enumerate().map(torque).collect();
    [speeds, torques]
}

fn here(speeds: &[f64], torques: &[f64]) -> Result<Fitted, Box<dyn Error>> {
    let mut fastest = f64::INFINITY;
    let mut found = stribeck_optimum(speeds, torques, None)?;
    for _ in 0..FITS {
        let begin = Instant::now();
        found = black_box(stribeck_optimum(black_box(speeds), black_box(torques), None)?);
        fastest = fastest.min(begin.elapsed().as_secs_f64());
    }
    Ok(Fitted { time: 1e6 * fastest, parameters: found.parameters, rms: found.rms })
}

/// The same by a peer.
fn there(command: &mut Command, folder: &Path) -> Result<Fitted, String> {
    let text = told(command, folder)?;
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let Ok([time, a, b, c, d, rms]) = numbers.as_deref() else { return Err(format!("it printed {text}")) };
    Ok(Fitted { time: 1e-3 * time, parameters: [*a, *b, *c, *d], rms: *rms })
}

/// What a program prints, or why it does not.
fn told(command: &mut Command, folder: &Path) -> Result<String, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let out = command.current_dir(folder).output().map_err(|error| format!("cannot start {name} ({error})"))?;
    if out.status.success() {
        return Ok(String::from_utf8_lossy(&out.stdout).into_owned());
    }
    let errors = String::from_utf8_lossy(&out.stderr).into_owned();
    Err(format!("{name}: {}", errors.lines().last().unwrap_or("it failed")))
}
