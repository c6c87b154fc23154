//! `cargo xtask dist`: the archive for a bare machine.
//!
//! `target/dist/stickslip-VERSION-TARGET.tar.gz` contains the program, licences, README, presets and completions. The
//! program is linked statically: with musl if its target is available, otherwise with the C library of this machine.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::command::{Cargo, run};
use crate::{tools, tree};

const MUSL: &str = "x86_64-unknown-linux-musl";
const GLIBC: &str = "x86_64-unknown-linux-gnu";

/// Shells with completions, and the file name of each.
const SHELLS: [(&str, &str); 4] =
    [("bash", "stickslip.bash"), ("zsh", "_stickslip"), ("fish", "stickslip.fish"), ("powershell", "_stickslip.ps1")];

/// Builds and packs the program, then runs it from the archive in an empty folder.
pub(crate) fn dist() -> Result<(), String> {
    let root = tree::root()?;
    let target = if tools::target(MUSL) && tools::musl_compiler() {
        MUSL
    } else {
        let remedy = format!("`rustup target add {MUSL}`, and musl-gcc, on Debian in musl-tools");
        println!("skipped: {MUSL} is not available ({remedy}); {GLIBC} is linked statically instead");
        GLIBC
    };
    let build = ["build", "--profile", "shipped", "--locked", "--package", "stickslip-cli", "--target", target];
    let cargo = Cargo::new(&root, &root);
    run(cargo.command(build).env("RUSTFLAGS", "-C target-feature=+crt-static -C strip=symbols"))?;
    let built = cargo.target.join(target).join("shipped/stickslip");

    let name = format!("stickslip-{}-{target}", env!("CARGO_PKG_VERSION"));
    let dist = root.join("target/dist");
    let folder = dist.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| format!("cannot empty {}: {error}", folder.display()))?;
    }
    fill(&root, &built, &folder)?;
    let archive = dist.join(format!("{name}.tar.gz"));
    // The same files give the same bytes: without owner and time, sorted by name.
    let tar = ["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mtime=@0", "-czf"];
    run(Command::new("tar").current_dir(&dist).args(tar).arg(&archive).arg(&name))?;
    let bytes = fs::metadata(&archive).map_err(|error| format!("cannot read {}: {error}", archive.display()))?.len();
    println!("{}: {:.1} MB", archive.display(), bytes as f64 / 1e6);
    test_archive(&dist, &archive, &name)
}

/// Fills the folder of the archive.
fn fill(root: &Path, built: &Path, folder: &Path) -> Result<(), String> {
    let copy = |from: PathBuf, to: PathBuf| {
        let into = to.parent().expect("a file has a folder");
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
/// system: no libraries, no Rust, no /proc. Skipped with a message if this machine does not allow it.
fn test_archive(dist: &Path, archive: &Path, name: &str) -> Result<(), String> {
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
    let allowed = Command::new("unshare").args(["--map-root-user", "true"]).status();
    if !allowed.is_ok_and(|status| status.success()) {
        println!("skipped: this machine allows no user namespace, so the archive was not run in an empty folder");
        return Ok(());
    }
    run(&mut alone(&["demo", "--out", "/results"]))?;
    match fs::read_to_string(world.join("results/summary.json")) {
        Ok(summary) if summary.contains("render.rms_error") => {
            println!("the demo runs in an empty folder");
            Ok(())
        }
        _ => Err("the demo in an empty folder wrote no summary".into()),
    }
}
