//! Prediction of unseen data by fitted frictions.
//!
//!     cargo xtask study prediction
//!
//! fits frictions to parts of two real recordings, has each predict the rest, and writes `docs/studies/prediction.json`,
//! `prediction.md` and the figures of the guide.

mod study;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use stickslip::figure::{Axis, Figure, Role, Series};
use stickslip::fit::{Choice, Profile, choose};
use stickslip::identify::cross_validation::{Fit, Friction, NAMES, would_tell};
use stickslip::identify::servo::{self, Fitted, Kind};
use stickslip::{Error, Summary, Watch, output};
use study::{EMPS_BLOCKS, Emps, XL330_GROUPS, Xl330};

/// Parameters of the richest friction whose covariance alone is not reliable, with their units, the range of their
/// profile and its number of steps.
const DOUBTFUL: [(usize, &str, f64, usize); 4] =
    [(1, "N", 10.0, 10), (9, "s", 10.0, 10), (10, "N/m", 100.0, 12), (11, "N s/m", 30.0, 10)];

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().unwrap_or_else(|| "docs/studies".into()));
    let figures = folder.join("../src/figures/prediction");
    output::create_folder(&figures)?;
    let mut summary = Summary::new("cargo xtask study prediction");
    let mut text = String::from(HEAD);
    emps(&mut summary, &mut text, &figures)?;
    xl330(&mut summary, &mut text, &figures)?;
    output::write(&folder.join("prediction.json"), summary.to_json())?;
    output::write(&folder.join("prediction.md"), text)
}

const HEAD: &str = "\
# Prediction of unseen data by fitted frictions

Each friction is fitted to a part of a recording and simulates the rest, which the fit did not use: the closed loop with \
its controller, from the measured state at the start. Then the next part is left out. A friction is called better than a \
simpler one only if its error on the parts is smaller by more than the standard error of the difference; parts of one \
recording are alike, so that this is a minimum requirement. Made by `cargo xtask study prediction`; the numbers \
are in `prediction.json`.
";

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Mean square errors, one row for each model: the recommended model, as lines of a table and a sentence.
struct Verdict {
    choice: Choice,
    /// rms over all folds.
    rms: Vec<f64>,
}

impl Verdict {
    fn of(errors: &[Vec<f64>]) -> Self {
        let squares: Vec<Vec<f64>> = errors.iter().map(|row| row.iter().map(|error| error * error).collect()).collect();
        let rms = squares.iter().map(|row| (row.iter().sum::<f64>() / row.len() as f64).sqrt()).collect();
        Verdict { choice: choose(&squares).expect("several folds"), rms }
    }

    /// Difference of a model's mean square from that of the best, in standard errors.
    fn behind(&self, model: usize) -> String {
        match self.choice.behind[model] {
            _ if model == self.choice.best => "best".into(),
            [middle, error] => format!("{:.1} standard errors", middle / error),
        }
    }

    fn sentence(&self, titles: &[&str]) -> String {
        let Choice { best, chosen, .. } = self.choice;
        if best == chosen {
            format!("\n**{}** predicts best, and no simpler friction is within its standard error.\n", titles[best])
        } else {
            format!(
                "\n{} predicts best, but **{}** is simpler and not worse by more than the standard error of the \
                 difference: it is recommended.\n",
                titles[best], titles[chosen]
            )
        }
    }
}

/// Errors on the parts, one line for each model.
fn figure(title: &str, x: &str, y: Axis, models: &[(&str, Vec<f64>)]) -> Figure {
    let roles = [Role::Reference, Role::Measured, Role::Fitted, Role::Desired];
    models.iter().enumerate().fold(Figure::new(title).x(Axis::new(x, "1")).y(y), |figure, (k, (name, errors))| {
        let points = errors.iter().enumerate().map(|(part, error)| ((part + 1) as f64, *error));
        let line = Series::line(roles[k % roles.len()], *name, points);
        figure.series(if k >= roles.len() { line.dashed() } else { line })
    })
}

fn emps(summary: &mut Summary, text: &mut String, figures: &Path) -> Result<(), Error> {
    let emps = Emps::read()?;
    let blocks = emps.blocks();
    let watch = Watch::silent();
    let folds = blocks.cross_validate(&Friction::ALL, threads(), &watch)?;
    let errors: Vec<Vec<f64>> = folds.iter().map(|row| row.iter().map(|fold| fold.error).collect()).collect();
    let verdict = Verdict::of(&errors);
    let _ = writeln!(
        text,
        "\n## A positioning axis: EMPS\n\n24.8 s at 1 kHz, both directions, up to 125 mm/s, in {EMPS_BLOCKS} contiguous \
         blocks of half a lap. Compared is the command of the controller.\n\n\
         | friction | parameters | error on unseen blocks, rms | behind |\n|-|-|-|-|"
    );
    for (k, friction) in Friction::ALL.into_iter().enumerate() {
        let parameters = (0..NAMES.len()).filter(|i| friction.has(*i)).count();
        let _ = writeln!(
            text,
            "| {} | {parameters} | {:.1} mV | {} |",
            friction.title(),
            1e3 * verdict.rms[k],
            verdict.behind(k)
        );
        let [middle, error] = verdict.choice.behind[k];
        summary.result(&format!("emps.{}.error", friction.name()), verdict.rms[k], "V");
        summary.result(&format!("emps.{}.behind", friction.name()), middle, "V^2");
        summary.result(&format!("emps.{}.behind_standard_error", friction.name()), error, "V^2");
        for (block, fold) in folds[k].iter().enumerate() {
            let cells = (0..NAMES.len()).map(|i| (NAMES[i], fold.fit.parameters[i].into()));
            let head = [("data", "emps".into()), ("model", friction.name().into()), ("part", (block + 1).into())];
            summary.row(head.into_iter().chain([("error", fold.error.into())]).chain(cells));
        }
    }
    text.push_str(&verdict.sentence(&Friction::ALL.map(Friction::title)));
    text.push_str(
        "\nThe parameters that the authors of the record published, fitted to all of it by the balance of forces:",
    );
    for friction in Friction::ALL {
        let Some(theirs) = emps.published(friction) else { continue };
        let squares = (0..EMPS_BLOCKS).map(|block| Ok(blocks.error(&theirs, block, &watch)?.powi(2)));
        let rms = (squares.sum::<Result<f64, Error>>()? / EMPS_BLOCKS as f64).sqrt();
        let _ = write!(text, " {} {:.1} mV.", friction.title(), 1e3 * rms);
        summary.result(&format!("emps.{}.published_error", friction.name()), rms, "V");
    }
    text.push_str(" Their fit used the predicted data.\n");
    let models: Vec<(&str, Vec<f64>)> =
        Friction::ALL.into_iter().zip(&errors).map(|(friction, row)| (friction.title(), row.clone())).collect();
    let errors_figure = figure("EMPS: error on the left-out block", "block", Axis::new("rms u − û", "V"), &models);
    output::write(&figures.join("emps.svg"), errors_figure.svg())?;
    profiles(&emps, summary, text, figures)
}

fn profiles(emps: &Emps, summary: &mut Summary, text: &mut String, figures: &Path) -> Result<(), Error> {
    let blocks = emps.blocks();
    let watch = Watch::silent();
    let fit: Fit = blocks.fit(Friction::LugreEachWay, &blocks.whole(), &watch)?;
    let profiles: Vec<(usize, Profile)> = std::thread::scope(|scope| {
        let jobs: Vec<_> = DOUBTFUL
            .into_iter()
            .map(|(parameter, unit, reach, steps)| {
                let (blocks, watch, fit) = (&blocks, &watch, &fit);
                scope.spawn(move || Ok((parameter, blocks.profile(fit, parameter, unit, (reach, steps), watch)?)))
            })
            .collect();
        jobs.into_iter().map(|job| job.join().expect("a profile does not panic")).collect::<Result<_, Error>>()
    })?;
    text.push_str(
        "\n### Parameters that the recording does not determine\n\nProfile likelihood: each parameter of the LuGre model is \
         held at one value after the other, and all others are fitted again. If the sum of squares does not rise above \
         the 95 % limit, the recording does not determine the parameter; the correlation of residuals is included.\n\n",
    );
    let mut profiles_figure = Figure::new("EMPS: profiles of doubtful parameters")
        .x(Axis::new("log10 of the value over that of the fit", "1"))
        .y(Axis::new("rise of the log-likelihood, twice", "1").range(0.0, 5.0 * Profile::LIMIT));
    let roles = [Role::Measured, Role::Fitted, Role::Desired, Role::Reference];
    for (k, (parameter, profile)) in profiles.iter().enumerate() {
        let advice = if profile.is_identifiable() { String::new() } else { format!(" {}", would_tell(*parameter)) };
        let _ = writeln!(text, "- {profile}.{advice}");
        let place = |(value, rise): (f64, f64)| (value - profile.best.log10(), rise);
        profiles_figure = profiles_figure.series(Series::line(
            roles[k % roles.len()],
            profile.name.clone(),
            profile.rises().map(place),
        ));
        for (end, limit) in ["low", "high"].into_iter().zip(profile.interval()) {
            let name = format!("emps.profile.{}.{end}", profile.name);
            summary.result(&name, limit.unwrap_or(f64::NAN), &profile.unit);
        }
    }
    let limit = [(-2.0, Profile::LIMIT), (2.0, Profile::LIMIT)];
    profiles_figure = profiles_figure.series(Series::line(Role::Reference, "95 %", limit).dashed());
    output::write(&figures.join("profiles.svg"), profiles_figure.svg())
}

/// Each kind fitted to all runs except those of a group, the simpler ones first.
fn fits(xl330: &Xl330, group: usize, watch: &Watch) -> Result<Vec<Fitted>, Error> {
    let [_, others] = xl330.parted(group);
    let mut fits: Vec<Fitted> = Vec::new();
    for kind in Kind::ALL {
        let simpler: Vec<&Fitted> = fits.iter().filter(|fitted| fitted.kind.is_within(kind)).collect();
        let fitted = servo::fit(kind, &others, &simpler, watch)?;
        eprintln!("xl330: {} without group {}", kind.name(), group + 1);
        fits.push(fitted);
    }
    Ok(fits)
}

fn xl330(summary: &mut Summary, text: &mut String, figures: &Path) -> Result<(), Error> {
    let servo = Xl330::read()?;
    let watch = Watch::silent();
    let groups = std::thread::scope(|scope| {
        let job = |group: usize| {
            let (servo, watch) = (&servo, &watch);
            move || fits(servo, group, watch)
        };
        let jobs: Vec<_> = (0..XL330_GROUPS).map(|group| scope.spawn(job(group))).collect();
        jobs.into_iter().map(|job| job.join().expect("a fit does not panic")).collect::<Result<Vec<_>, Error>>()
    })?;
    let (mut errors, mut published) = (Vec::new(), Vec::new());
    for (k, kind) in Kind::ALL.into_iter().enumerate() {
        let mut row = Vec::new();
        for (group, fits) in groups.iter().enumerate() {
            let error = servo.error(kind, &fits[k].servo, group)?;
            let fields = servo::fields().iter().zip(servo::values(&fits[k].servo));
            let cells = fields.map(|(field, value)| (field.name, value.into()));
            let head = [("data", "xl330".into()), ("model", kind.name().into()), ("part", (group + 1).into())];
            summary.row(head.into_iter().chain([("error", error.into())]).chain(cells));
            row.push(error);
        }
        errors.push(row);
        let theirs = servo::published(kind, &servo.machine).map(|theirs| {
            (0..XL330_GROUPS).map(|group| servo.error(kind, &theirs, group)).collect::<Result<Vec<f64>, Error>>()
        });
        published.push(theirs.transpose()?);
    }
    let verdict = Verdict::of(&errors);
    let _ = writeln!(
        text,
        "\n## A geared servo with a pendulum: XL330\n\nTwelve runs in {XL330_GROUPS} groups of three, in the order of \
         their recording. Compared is the angle of whole runs. Beside it the parameters that BAM publishes for the same \
         models and servo (Duclusaud et al. 2025), by the same equations on the same runs.\n\n\
         | friction | parameters | error on unseen runs, rms | behind | published parameters |\n|-|-|-|-|-|"
    );
    for (k, kind) in Kind::ALL.into_iter().enumerate() {
        let parameters = servo::fields().iter().filter(|field| kind.has(field.name)).count();
        let rms = |row: &[f64]| (row.iter().map(|error| error * error).sum::<f64>() / row.len() as f64).sqrt();
        let theirs = published[k].as_deref().map(rms);
        let published = theirs.map_or_else(String::new, |rms| format!("{:.0} mrad", 1e3 * rms));
        let _ = writeln!(
            text,
            "| {} | {parameters} | {:.0} mrad | {} | {published} |",
            kind.title(),
            1e3 * verdict.rms[k],
            verdict.behind(k)
        );
        summary.result(&format!("xl330.{}.error", kind.name()), verdict.rms[k], "rad");
        summary.result(&format!("xl330.{}.published_error", kind.name()), theirs.unwrap_or(f64::NAN), "rad");
    }
    text.push_str(&verdict.sentence(&Kind::ALL.map(Kind::title)));
    text.push_str(
        "\nBAM's authors fitted theirs to this type of servo by runs and a criterion of their own, ours are fitted to nine of \
         these twelve runs by the criterion of the table: the comparison shows the benefit of a fit to the machine at hand, \
         it does not compare the methods.",
    );
    if verdict.choice.best + 1 < Kind::ALL.len() {
        text.push_str(
            " Richer frictions than the best have larger errors: stick gives their fits many minima of nearly equal depth, and \
             parameters fitted to nine runs are not valid for the others.",
        );
    }
    text.push('\n');
    let models: Vec<(&str, Vec<f64>)> =
        Kind::ALL.into_iter().zip(&errors).map(|(kind, row)| (kind.title(), row.clone())).collect();
    let errors_figure =
        figure("XL330: error on the left-out runs", "group of runs", Axis::new("rms q − q̂", "rad"), &models);
    output::write(&figures.join("xl330.svg"), errors_figure.svg())
}
