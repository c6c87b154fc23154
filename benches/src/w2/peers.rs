//! The peers: C by gcc, numba, JAX and SciPy by Python.

use std::error::Error;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::drive::Bristles;

/// A variant for a peer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Case {
    pub(super) breakaway: f64,
    pub(super) stribeck: f64,
    pub(super) gain: f64,
    pub(super) substeps: usize,
}

fn write(cases: &[Case], file: &Path) -> std::io::Result<()> {
    let numbers = cases.iter().flat_map(|case| [case.breakaway, case.stribeck, case.gain, case.substeps as f64]);
    std::fs::write(file, numbers.flat_map(f64::to_ne_bytes).collect::<Vec<u8>>())
}

/// Vectors of this many numbers: what of them is fastest, counts.
const WIDTHS: [usize; 3] = [8, 16, 32];

/// The classical Runge-Kutta method in C.
pub(super) struct Rk4 {
    folder: PathBuf,
    name: &'static str,
    /// The fastest width.
    widest: usize,
}

impl Rk4 {
    /// # Errors
    /// Without gcc.
    pub(super) fn compile(folder: &Path, kind: Bristles) -> Result<Self, Box<dyn Error>> {
        let name = if kind == Bristles::Constant { "constant" } else { "elasto" };
        std::fs::write(folder.join("rk4.c"), include_str!("rk4.c"))?;
        for width in [1].into_iter().chain(WIDTHS) {
            let mut gcc = Command::new("gcc");
            gcc.args(["-std=c11", "-O3", "-march=native", "-w", "-o"]).arg(format!("{name}{width}"));
            gcc.args((width > 1).then(|| format!("-DWIDTH={width}")));
            gcc.args((kind == Bristles::ElastoPlastic).then_some("-DELASTO_PLASTIC"));
            let out = gcc
                .args(["rk4.c", "-lm"])
                .current_dir(folder)
                .output()
                .map_err(|error| format!("cannot start gcc ({error}): apt-get install gcc libc6-dev"))?;
            if !out.status.success() {
                return Err(String::from_utf8_lossy(&out.stderr).into());
            }
        }
        let mut rk4 = Rk4 { folder: folder.into(), name, widest: WIDTHS[0] };
        let cases = vec![Case { breakaway: 0.3, stribeck: 1.5, gain: 20.0, substeps: 25 }; 64];
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            for width in WIDTHS {
                let time = rk4.start(width, &cases, 1001, false)?.0;
                if time < best {
                    (best, rk4.widest) = (time, width);
                }
            }
        }
        Ok(rk4)
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    pub(super) fn widest(&self) -> usize {
        self.widest
    }

    /// Seconds one after the other.
    pub(super) fn one_by_one(&self, cases: &[Case], samples: usize) -> Result<f64, Box<dyn Error>> {
        Ok(self.start(1, cases, samples, false)?.0)
    }

    /// Seconds side by side.
    pub(super) fn time_vectors(&self, cases: &[Case], samples: usize) -> Result<f64, Box<dyn Error>> {
        Ok(self.start(self.widest, cases, samples, false)?.0)
    }

    /// Seconds side by side, angle and deflection of each.
    pub(super) fn vectors(&self, cases: &[Case], samples: usize) -> Result<Found, Box<dyn Error>> {
        self.start(if cases.len() == 1 { WIDTHS[0] } else { self.widest }, cases, samples, true)
    }

    fn start(&self, width: usize, cases: &[Case], samples: usize, record: bool) -> Result<Found, Box<dyn Error>> {
        write(cases, &self.folder.join("cases"))?;
        let mut peer = Command::new(self.folder.join(format!("{}{width}", self.name)));
        peer.args(["cases", &samples.to_string()]).args(record.then_some("courses")).current_dir(&self.folder);
        let out = peer.output()?;
        if !out.status.success() {
            return Err(format!("the C peer failed: {:?}", out.status).into());
        }
        let time = String::from_utf8(out.stdout)?.trim().parse()?;
        if !record {
            return Ok((time, Vec::new()));
        }
        let bytes = std::fs::read(self.folder.join("courses"))?;
        let numbers = |bytes: &[u8]| -> Vec<f64> {
            bytes.chunks_exact(8).map(|eight| f64::from_ne_bytes(eight.try_into().expect("eight bytes"))).collect()
        };
        let course = |bytes: &[u8]| [numbers(&bytes[..8 * samples]), numbers(&bytes[8 * samples..])];
        Ok((time, bytes.chunks_exact(16 * samples).map(course).collect()))
    }
}

/// Seconds, and where it was recorded angle and deflection of each case.
type Found = (f64, Vec<[Vec<f64>; 2]>);

/// A peer in Python, which compiles once and then runs when it is asked to.
pub(super) struct Server {
    pub(super) kind: String,
    /// Best time, scaled to all cases [s].
    pub(super) best: f64,
    /// What it did.
    pub(super) says: String,
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    /// Substeps in a run: all samples and cases.
    work: f64,
}

/// Samples that a peer in Python runs in a round: its time a substep does not depend on more.
const SHORT: usize = 1001;

impl Server {
    /// # Errors
    /// The reason why it cannot take part: no Python (`$PYTHON`, else `python3`), or the package is not installed.
    pub(super) fn start(folder: &Path, kind: &str, cases: &[Case]) -> Result<Self, Box<dyn Error>> {
        std::fs::write(folder.join("peers.py"), include_str!("peers.py"))?;
        let file = format!("{kind}-cases");
        write(cases, &folder.join(&file))?;
        let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
        let mut child = Command::new(python)
            .args(["peers.py", kind, &file, &SHORT.to_string()])
            .current_dir(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let (to, from) = child.stdin.take().zip(child.stdout.take()).ok_or("no pipes")?;
        let mut from = BufReader::new(from);
        let mut line = String::new();
        from.read_line(&mut line)?;
        if line.trim() != "ready" {
            return Err(format!("{kind} is not installed: pip install numba jax scipy, and PYTHON=…").into());
        }
        let work = (cases.iter().map(|case| case.substeps).sum::<usize>() * SHORT) as f64;
        let says = match kind {
            "scipy" => "LSODA, from sample to sample, relative tolerance 1e-5".into(),
            _ => format!("Runge-Kutta, its first second of {} variants scaled", cases.len()),
        };
        Ok(Server { kind: kind.into(), best: f64::INFINITY, says, child, to, from, work })
    }

    /// One more round; `total` substeps a sample are asked for.
    pub(super) fn round(&mut self, cases: &[Case], total: usize) -> Result<(), Box<dyn Error>> {
        writeln!(self.to, "1e-5")?;
        self.to.flush()?;
        let mut line = String::new();
        self.from.read_line(&mut line)?;
        let time: f64 = line.split_whitespace().next().ok_or("no answer")?.parse()?;
        let all = (total * super::SAMPLES) as f64;
        let scale =
            if self.kind == "scipy" { (cases.len() * super::SAMPLES) as f64 / SHORT as f64 } else { all / self.work };
        self.best = self.best.min(time * scale);
        Ok(())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It waits for its next line: nothing is lost.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
