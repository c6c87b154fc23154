//! The page of a running bench: the files built from `web/`, embedded in compressed form.
//!
//! `build.rs` calls npm. Without Node 20, or with `STICKSLIP_PAGE=none`, the program has no page and shows the reason at
//! its address. The source is TypeScript and Svelte. Its rules:
//!
//! - It contains no equation and no number format of a result: curves, fits, ranges, units and help texts come from
//!   the calls of `stickslip_live::protocol`. `web/src/protocol.ts` is generated from that schema.
//! - Commands and their keys are in one table (`web/src/commands.ts`), colours in one file (`web/src/tokens.css`). A plot
//!   (`web/src/plot/Plot.svelte`) is given roles, not colours.
//! - One folder per window. The state of the bench is in `web/src/bench.svelte.ts`; *Stop* has its own connection
//!   (`web/src/stop.svelte.ts`).
//! - The scope takes every cycle of all signals and bypasses the framework: `web/src/scope/frames.ts` reads the binary
//!   messages in place, `web/src/scope/ring.ts` keeps the newest cycles with the extremes of blocks, and
//!   `web/src/scope/raster.ts` draws dense traces as pixels.
//! - `web/guide.ts` generates the help window from `docs/src`.
//! - The tests in `web/tests` use the real program and a real browser (`web/tests/harness.mjs`).
//!
//! ```
//! match stickslip_page::file("/") {
//!     Some(page) => assert_eq!(page.content_type(), "text/html; charset=utf-8"),
//!     // Built without Node.
//!     None => assert!(stickslip_page::missing().is_some()),
//! }
//! ```
#![forbid(unsafe_code)]

use std::io::Read as _;

use flate2::read::GzDecoder;

mod files {
    use super::File;
    include!(concat!(env!("OUT_DIR"), "/files.rs"));
}

/// A file of the page.
#[derive(Clone, Copy, Debug)]
pub struct File {
    /// Its path below the page's address.
    pub path: &'static str,
    /// Compressed by gzip.
    pub gzip: &'static [u8],
}

impl File {
    /// Decompressed, for clients that do not accept gzip.
    pub fn plain(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        GzDecoder::new(self.gzip).read_to_end(&mut bytes).expect("the build has compressed it");
        bytes
    }

    /// Its MIME type.
    pub fn content_type(&self) -> &'static str {
        match self.path.rsplit_once('.').map(|(_, ending)| ending) {
            Some("html") => "text/html; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("svg") => "image/svg+xml",
            Some("woff2") => "font/woff2",
            Some("json") => "application/json",
            _ => "application/octet-stream",
        }
    }

    /// Whether its name contains a hash of its content, so that it never changes under that name.
    pub fn is_immutable(&self) -> bool {
        self.path.starts_with("assets/")
    }
}

/// The file of a path; the page itself for every window's address.
pub fn file(path: &str) -> Option<&'static File> {
    let path = path.trim_start_matches('/');
    let find = |path: &str| files::FILES.iter().find(|file| file.path == path);
    if path.rsplit('/').next().is_some_and(|name| name.contains('.')) { find(path) } else { find("index.html") }
}

/// Why there is no page, with a remedy; `None` if there is one.
pub fn missing() -> Option<&'static str> {
    files::MISSING
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_an_index_for_each_window_and_stays_small() {
        if missing().is_some() {
            assert!(file("/").is_none());
            return;
        }
        assert_eq!(file("/").map(|file| file.path), file("/friction").map(|file| file.path));
        assert!(file("/").is_some_and(|file| file.plain().starts_with(b"<!")), "the index decompresses to a page");
        assert!(file("/assets/none.js").is_none());
        // Transfer to a phone on a workshop's network in one or two seconds: all windows, and the guide, which is loaded
        // when it is opened. The pictures of the guide are loaded one by one.
        let sent =
            |counts: fn(&str) -> bool| files::FILES.iter().filter(|it| counts(it.path)).map(|it| it.gzip.len()).sum();
        let guide: usize = sent(|path| path.starts_with("assets/Help-"));
        let windows: usize = sent(|path| !path.starts_with("assets/Help-") && !path.ends_with(".svg"));
        assert!(windows > 0 && guide > 0);
        assert!(windows + guide <= 450_000, "{windows} bytes of windows, {guide} bytes of guide");
    }
}
