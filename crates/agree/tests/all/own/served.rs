//! A served bench with a library in the loop.

use std::path::{Path, PathBuf};

use stickslip::bench::ThreadSettings;
use stickslip::external::{ExternalFile, Role};
use stickslip::live::protocol::{Answer, Call, Item};
use stickslip::live::{Live, Start};
use stickslip::xcp::Layout;
use stickslip::xcp::a2l::{Doors, describe};
use stickslip::{Preset, parameters};

pub(crate) struct Served {
    live: Live,
    pub(crate) library: PathBuf,
}

impl Served {
    /// Starts a bench in a folder, with a library in this role.
    pub(crate) fn with(library: Vec<u8>, role: Role, project: &Path) -> Self {
        let path = project.join("own.so");
        std::fs::write(&path, library).expect("a writable folder");
        let mut source = parameters::presets::find("clm-bench").expect("it is built in");
        let rate = [("bench.tick_rate", "1000")];
        source.text = parameters::set_all::<Preset<f64>>(&source.text, "here", &rate).expect("a rate");
        let loaded = Some(ExternalFile { path: path.clone(), role, trust: true, ..ExternalFile::default() });
        let start = Start { thread_settings: ThreadSettings::PLAIN, loaded, ..Start::new(source, project) };
        Served { live: Live::start(start).expect("it starts"), library: path }
    }

    fn call(&self, call: Call) -> Answer {
        self.live.call("ann", call).expect("an answer")
    }

    /// The item of this path.
    pub(crate) fn item(&self, path: &str) -> Item {
        let Answer::Items { items } = self.call(Call::Items { values: Default::default() }) else { panic!("no items") };
        items.into_iter().find(|item| item.path == path).expect("it is listed")
    }

    pub(crate) fn signals(&self) -> Vec<String> {
        let Answer::Signals { signals, .. } = self.call(Call::Signals {}) else { panic!("no signals") };
        signals.into_iter().map(|signal| signal.name).collect()
    }

    /// Its numbers are in the description for calibration tools, which an independent reader accepts.
    pub(crate) fn describes(&self, numbers: &[&str]) {
        let described = describe(&Layout::with(1000.0, &self.live.entries()), Doors::default());
        let (_, messages) =
            a2lfile::load_from_string(&described, None, true).expect("an independent reader accepts it");
        assert!(messages.is_empty(), "{messages:?}");
        for name in numbers {
            assert!(described.contains(&format!("CHARACTERISTIC loaded.{name} ")), "{name}");
        }
    }

    /// Sets a number; returns the number of changed entries.
    pub(crate) fn set(&self, path: &str, value: &str) -> usize {
        let values = [(path.to_owned(), value.to_owned())].into();
        let Answer::Entered { differences, .. } = self.call(Call::Set { values }) else { panic!("not entered") };
        differences.len()
    }

    pub(crate) fn stop(self) {
        self.live.stop();
    }
}
