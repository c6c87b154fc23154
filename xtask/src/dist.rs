//! `cargo xtask dist`: one archive that runs on a bare machine.
//!
//! `target/dist/stickslip-VERSION-TARGET.tar.gz` holds the program, licences, README, presets and completions. The
//! program is linked statically: with musl where its target can be had, else with the C library of this machine.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::test::{cargo, run};
use crate::{tools, tree};

const MUSL: &str = "x86_64-unknown-linux-musl";
const GLIBC: &str = "x86_64-unknown-linux-gnu";

/// The shells that get completions, and where each keeps them.
const SHELLS: [(&str, &str); 4] =
    [("bash", "stickslip.bash"), ("zsh", "_stickslip"), ("fish", "stickslip.fish"), ("powershell", "_stickslip.ps1")];

/// Builds, packs, and starts what was packed in an empty folder that is its whole world.
pub(crate) fn dist() -> Result<(), String> {
    let root = tree::root()?;
    let target = if tools::target(MUSL) && tools::musl_compiler() {
        MUSL
    } else {
        let remedy = format!("`rustup target add {MUSL}`, and musl-gcc, on Debian of musl-tools");
        println!("skipped: {MUSL} cannot be had ({remedy}); {GLIBC} is linked statically instead");
        GLIBC
    };
    let build = ["build", "--profile", "shipped", "--locked", "--package", "stickslip-cli", "--target", target];
    run(cargo(&root, build).env("RUSTFLAGS", "-C target-feature=+crt-static -C strip=symbols"))?;
    let built = root.join("target").join(target).join("shipped/stickslip");

    let name = format!("stickslip-{}-{target}", env!("CARGO_PKG_VERSION"));
    let dist = root.join("target/dist");
    let folder = dist.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("cannot empty {}: {error}", folder.display()))?;
    }
    fill(&root, &built, &folder)?;
    let archive = dist.join(format!("{name}.tar.gz"));
    // The same files give the same bytes: no owner, no time, names in order.
    let tar = ["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mtime=@0", "-czf"];
    run(Command::new("tar").current_dir(&dist).args(tar).arg(&archive).arg(&name))?;
    let bytes = fs::metadata(&archive).map_err(|error| format!("cannot read {}: {error}", archive.display()))?.len();
    println!("{}: {:.1} MB", archive.display(), bytes as f64 / 1e6);
    try_alone(&dist, &archive, &name)
}

/// What the archive holds.
fn fill(root: &Path, built: &Path, folder: &Path) -> Result<(), String> {
    let copy = |from: PathBuf, to: PathBuf| {
        let into = to.parent().expect("a file of the archive lies in the archive");
        fs::create_dir_all(into).map_err(|error| format!("cannot create {}: {error}", into.display()))?;
        fs::copy(&from, &to).map_err(|error| format!("cannot copy {}: {error}", from.display())).map(drop)
    };
    copy(built.into(), folder.join("stickslip"))?;
    for name in ["README.md", "LICENSE-MIT", "LICENSE-APACHE", "CHANGELOG.md"] {
        copy(root.join(name), folder.join(name))?;
    }
    for preset in tree::files(root)?.iter().filter(|file| file.starts_with("presets")) {
        copy(root.join(preset), folder.join(preset))?;
    }
    let completions = folder.join("completions");
    fs::create_dir_all(&completions).map_err(|error| format!("cannot create {}: {error}", completions.display()))?;
    for (shell, file) in SHELLS {
        let output = Command::new(built).args(["completions", shell]).output();
        let output = output.map_err(|error| format!("cannot start {}: {error}", built.display()))?;
        let file = completions.join(file);
        fs::write(&file, output.stdout).map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    }
    Ok(())
}

/// Unpacks the archive into an empty folder and runs the demonstration there, with that folder as the root of the file
/// system: no libraries, no Rust, no /proc. Said and skipped where this machine does not allow it.
fn try_alone(dist: &Path, archive: &Path, name: &str) -> Result<(), String> {
    let world = dist.join("alone");
    if world.exists() {
        fs::remove_dir_all(&world).map_err(|error| format!("cannot empty {}: {error}", world.display()))?;
    }
    fs::create_dir_all(&world).map_err(|error| format!("cannot create {}: {error}", world.display()))?;
    run(Command::new("tar").arg("-xzf").arg(archive).arg("-C").arg(&world))?;
    let program = format!("/{name}/stickslip");
    let alone = |arguments: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--root"]).arg(&world).arg(&program).args(arguments);
        command
    };
    // Whether namespaces are allowed is the machine's business; whether the program starts in one is ours.
    let allowed = Command::new("unshare").args(["--map-root-user", "true"]).status();
    if !allowed.is_ok_and(|status| status.success()) {
        println!("skipped: this machine allows no user namespace, so the archive was not tried alone");
        return Ok(());
    }
    run(&mut alone(&["demo", "--out", "/results"]))?;
    match fs::read_to_string(world.join("results/summary.json")) {
        Ok(summary) if summary.contains("render.rms_error") => {
            println!("its demo runs in an empty folder");
            Ok(())
        }
        _ => Err("the demo in an empty folder left no summary".into()),
    }
}
