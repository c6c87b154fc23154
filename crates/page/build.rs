//! Builds `web/` with npm and lists the files; without Node there is no page, and the reason is embedded instead.

use std::fmt::Write as _;
use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sources of the page, below `web/`.
const SOURCES: [&str; 11] = [
    "src",
    "public",
    "index.html",
    "package.json",
    "package-lock.json",
    "vite.config.ts",
    "guide.ts",
    // The help window shows the guide.
    "../docs",
    "svelte.config.js",
    "tsconfig.json",
    "compress.mjs",
];
/// The oldest suitable version of Node.
const NODE: u32 = 20;

fn main() {
    let web = Path::new(&env("CARGO_MANIFEST_DIR")).join("../../web");
    let out = PathBuf::from(env("OUT_DIR"));
    println!("cargo:rerun-if-env-changed=STICKSLIP_PAGE");
    for source in SOURCES {
        println!("cargo:rerun-if-changed={}", web.join(source).display());
    }
    let list = match build(&web, &out.join("page")) {
        Ok(built) => table(&built),
        Err(Missing(why)) => {
            if std::env::var("STICKSLIP_PAGE").is_err() {
                println!("cargo:warning=the program is built without its page: {why}");
            }
            format!("pub(super) const FILES: &[File] = &[];\npub(super) const MISSING: Option<&str> = Some({why:?});\n")
        }
    };
    fs::write(out.join("files.rs"), list).expect("Cargo's own folder can be written");
}

/// Why there is no page, with a remedy.
struct Missing(String);

fn build(web: &Path, built: &Path) -> Result<PathBuf, Missing> {
    let missing = |why: String| Missing(why);
    if std::env::var("STICKSLIP_PAGE").is_ok_and(|value| value == "none") {
        return Err(missing("it was built with STICKSLIP_PAGE=none; unset STICKSLIP_PAGE and build again".into()));
    }
    let node = format!("install Node {NODE} or later (https://nodejs.org) and build again");
    let version = output("node", web, &["--version"])
        .map_err(|error| missing(format!("Node was not found during the build ({error}): {node}")))?;
    let major = version.trim().trim_start_matches('v').split('.').next().and_then(|number| number.parse::<u32>().ok());
    if major.is_none_or(|major| major < NODE) {
        return Err(missing(format!("Node {} is too old: {node}", version.trim())));
    }
    if !web.join("package-lock.json").exists() {
        return Err(missing("the folder web/ is missing next to crates/".into()));
    }
    // Simultaneous builds, by cargo and by an editor, run one after the other.
    let _lock = lock(web).map_err(|error| missing(format!("the build cannot be locked ({error})")))?;
    install(web).map_err(|error| missing(format!("its libraries could not be downloaded: {error}")))?;
    let _ = fs::remove_dir_all(built);
    // An error in the page itself is an error of the build.
    let output = npm().args(["run", "build"]).current_dir(web).env("STICKSLIP_PAGE_OUT", built).output();
    match output {
        Ok(output) if output.status.success() => Ok(built.to_owned()),
        Ok(output) => {
            let output = [output.stdout, output.stderr].concat();
            panic!("`npm run build` failed in {}:\n{}", web.display(), String::from_utf8_lossy(&output))
        }
        Err(error) => Err(missing(format!("npm does not start ({error}): {node}"))),
    }
}

/// Locks a folder for one build at a time. The lock is elsewhere, so that no file remains next to the sources.
fn lock(web: &Path) -> io::Result<File> {
    let mut hasher = DefaultHasher::new();
    web.canonicalize()?.hash(&mut hasher);
    let file = File::create(std::env::temp_dir().join(format!("stickslip-page-{:016x}.lock", hasher.finish())))?;
    file.lock()?;
    Ok(file)
}

/// Downloads the libraries, unless those of this lock file are installed.
fn install(web: &Path) -> Result<(), String> {
    let lock = fs::read(web.join("package-lock.json")).map_err(|error| error.to_string())?;
    let stamp = web.join("node_modules/.of-lock");
    if fs::read(&stamp).is_ok_and(|installed| installed == lock) {
        return Ok(());
    }
    let mut command = npm();
    command.args(["ci", "--no-audit", "--no-fund"]).current_dir(web);
    let output = command.output().map_err(|error| format!("npm does not start ({error})"))?;
    if !output.status.success() {
        return Err(format!("`npm ci` failed: {}", String::from_utf8_lossy(&output.stderr).trim()));
    }
    fs::write(stamp, lock).map_err(|error| error.to_string())
}

fn npm() -> Command {
    Command::new(if cfg!(windows) { "npm.cmd" } else { "npm" })
}

fn output(program: &str, folder: &Path, arguments: &[&str]) -> io::Result<String> {
    let output = Command::new(program).args(arguments).current_dir(folder).output()?;
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The files as a table in Rust.
fn table(built: &Path) -> String {
    let mut names = Vec::new();
    collect(built, built, &mut names).expect("the built files can be listed");
    names.sort();
    let mut text = String::from("pub(super) const FILES: &[File] = &[\n");
    for name in names.iter().filter(|name| !name.ends_with(".gz")) {
        let packed = format!("{}.gz", built.join(name).display());
        writeln!(text, "    File {{ path: {name:?}, gzip: include_bytes!({packed:?}) }},").expect("a string takes all");
    }
    text + "];\npub(super) const MISSING: Option<&str> = None;\n"
}

fn collect(root: &Path, folder: &Path, names: &mut Vec<String>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(root, &path, names)?;
        } else if let Ok(name) = path.strip_prefix(root) {
            names.push(name.to_string_lossy().replace('\\', "/"));
        }
    }
    Ok(())
}

fn env(name: &str) -> String {
    std::env::var(name).expect("Cargo sets it")
}
