//! Cortex-M processors in QEMU, and their compiler.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use stickslip::generate::Generated;
use stickslip_codegen::c::CSource;
use stickslip_codegen::record::Program;
use stickslip_codegen::tree::Tree;
use tempfile::TempDir;

const GCC: &str = "arm-none-eabi-gcc";
const QEMU: &str = "qemu-system-arm";

/// A processor and its board in QEMU.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    pub name: &'static str,
    switches: [&'static str; 3],
    machine: &'static str,
}

/// Computes `float` in hardware, `double` in a library of the compiler.
pub const M4F: Target = Target {
    name: "Cortex-M4F",
    switches: ["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"],
    machine: "mps2-an386",
};

/// Computes both in hardware.
pub const M7: Target = Target {
    name: "Cortex-M7",
    switches: ["-mcpu=cortex-m7", "-mfpu=fpv5-d16", "-mfloat-abi=hard"],
    machine: "mps2-an500",
};

/// Whether compiler and emulator are available; otherwise a line reports the skipped checks.
pub fn available() -> bool {
    let starts = |name: &&str| Command::new(name).arg("--version").stdout(Stdio::null()).status().is_ok();
    let missing: Vec<_> = [GCC, QEMU].into_iter().filter(|name| !starts(name)).collect();
    if !missing.is_empty() {
        println!(
            "NOT RUN: {} missing: apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi {QEMU}",
            missing.join(", ")
        );
    }
    missing.is_empty()
}

/// First line of the version of the compiler.
pub fn compiler() -> String {
    let output = Command::new(GCC).arg("--version").output().expect("the compiler starts");
    String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().into()
}

fn firmware(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware").join(file)
}

/// Contents of a program besides the start-up.
pub enum Main<'a> {
    /// A block, called `block`, in `pil.c`; whether it counts instructions.
    Block { program: &'a Program, code: &'a CSource, single: bool, measure: bool },
    /// A generated project: its own example, which begins with the self-test.
    Project(&'a Generated),
    /// The text of a whole program.
    Text(&'a str),
}

/// A compiled program in a temporary folder.
pub struct Image {
    folder: TempDir,
    target: Target,
    measure: bool,
}

/// Result of a program.
pub struct Outcome {
    pub succeeded: bool,
    pub log: String,
    pub outputs: Vec<u8>,
}

impl Target {
    fn gcc(self, folder: &Path, arguments: &[String]) {
        let mut command = Command::new(GCC);
        command.args(["-std=c99", "-O2", "-mthumb"]).args(self.switches).args(arguments).current_dir(folder);
        let output = command.output().expect("the compiler starts");
        assert!(output.status.success(), "{}: {}", self.name, String::from_utf8_lossy(&output.stderr));
    }

    /// Compiles a program.
    pub fn compile(self, main: &Main<'_>) -> Image {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("a writable folder");
        let argument = |path: PathBuf| path.display().to_string();
        let mut arguments = vec!["--specs=rdimon.specs".into(), "-nostartfiles".into(), "-I.".into()];
        arguments.extend(["-T".into(), argument(firmware("link.ld")), argument(firmware("startup.c"))]);
        let mut measured = false;
        match main {
            Main::Block { program, code, single, measure } => {
                write("block.h", &code.header);
                write("block.c", &code.source);
                measured = *measure;
                let top = program.steps.last().expect("a program has at least the block itself");
                let lacks = |tree: &Tree, what: &str| (tree.numbers() == 0).then(|| format!("-DNO_{what}"));
                arguments.extend(lacks(&top.parameters, "PARAMETERS"));
                arguments.extend(lacks(&top.state, "STATE"));
                arguments.extend(lacks(&top.input, "INPUT"));
                arguments.extend(single.then(|| "-DREAL=float".into()));
                arguments.extend(measure.then(|| "-DMEASURE".into()));
                arguments.extend(["-DBLOCK=block".into(), argument(firmware("pil.c")), "block.c".into()]);
            }
            Main::Project(project) => {
                for (name, text) in project.files.iter().filter(|(name, _)| !name.contains('/')) {
                    write(name, text);
                    arguments.extend(name.ends_with(".c").then(|| name.clone()));
                }
            }
            Main::Text(text) => {
                write("main.c", text);
                arguments.push("main.c".into());
            }
        }
        arguments.extend(["-o", "image", "-lc", "-lrdimon"].map(String::from));
        self.gcc(folder.path(), &arguments);
        Image { folder, target: self, measure: measured }
    }
}

impl Image {
    /// Runs the program on these inputs; QEMU is ended if it takes longer than `limit`.
    pub fn run(&self, inputs: &[u8], limit: Duration) -> Outcome {
        let path = |name: &str| self.folder.path().join(name);
        std::fs::write(path("inputs"), inputs).expect("a writable folder");
        let log = std::fs::File::create(path("log")).expect("a writable folder");
        let mut command = Command::new(QEMU);
        command.args(["-M", self.target.machine, "-nographic", "-monitor", "none", "-serial", "none"]);
        command.args(["-semihosting-config", "enable=on,target=native", "-kernel", "image"]);
        if self.measure {
            // Time is instructions; see firmware/measure.h.
            command.args(["-icount", "shift=10"]);
        }
        command.current_dir(self.folder.path()).stdin(Stdio::null());
        command.stdout(log.try_clone().expect("a file can be shared")).stderr(log);
        let mut child = command.spawn().expect("QEMU starts");
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().expect("a child can be waited for") {
                break Some(status);
            }
            if start.elapsed() > limit {
                // It may have exited in between.
                let _ = child.kill();
                let _ = child.wait();
                break None;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let text = String::from_utf8_lossy(&std::fs::read(path("log")).unwrap_or_default()).into_owned();
        let late = if status.is_none() { format!("ended after {limit:?}: the program hangs") } else { String::new() };
        Outcome {
            succeeded: status.is_some_and(|status| status.success()),
            log: text + &late,
            outputs: std::fs::read(path("outputs")).unwrap_or_default(),
        }
    }

    /// Bytes of the step with all functions that it calls: its own, and those of the compiler's libraries.
    pub fn sizes(&self) -> [usize; 2] {
        let words = "-ffunction-sections -fdata-sections -nostartfiles -nodefaultlibs -Wl,--gc-sections -Wl,-e,block_step \
                     block.c -o step -lgcc -lc";
        self.target.gcc(self.folder.path(), &words.split_whitespace().map(String::from).collect::<Vec<_>>());
        let mut nm = Command::new("arm-none-eabi-nm");
        let output = nm.args(["--print-size", "step"]).current_dir(self.folder.path()).output().expect("nm starts");
        let (mut own, mut library) = (0, 0);
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            // Address, size, kind, name; a symbol without a size is a mark.
            let [_, size, kind, name] = line.split_whitespace().collect::<Vec<_>>()[..] else { continue };
            let size = usize::from_str_radix(size, 16).expect("sizes are hexadecimal");
            let ours = name.starts_with("block_") || name.starts_with("stickslip_");
            // Code and constants, strong or weak.
            if "tTrRW".contains(kind) {
                *(if ours { &mut own } else { &mut library }) += size;
            }
        }
        [own, library]
    }
}
