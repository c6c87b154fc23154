//! The parts of Markdown that the guide uses: fenced blocks, headings, tables, links.

use std::path::{Path, PathBuf};

/// The book's sources.
pub(crate) fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src")
}

/// A page of the book.
pub(crate) struct Page {
    pub(crate) name: String,
    pub(crate) text: String,
}

/// A fenced block: the word after its fence, and its lines.
#[derive(Debug, PartialEq)]
pub(crate) struct Block {
    pub(crate) kind: String,
    /// Number of its first line in the page, from 0.
    pub(crate) first: usize,
    pub(crate) lines: Vec<String>,
}

/// A table below a heading, cells without their markup.
#[derive(Debug)]
pub(crate) struct Table {
    pub(crate) heading: String,
    pub(crate) head: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Page {
    pub(crate) fn read(name: &str) -> Self {
        let text = std::fs::read_to_string(source().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
        Page { name: name.into(), text }
    }

    /// All pages, sorted by name.
    pub(crate) fn all() -> Vec<Page> {
        let mut names: Vec<String> = std::fs::read_dir(source())
            .expect("the guide has a folder")
            .map(|entry| entry.expect("it can be listed").file_name().to_string_lossy().into_owned())
            .filter(|name| name.ends_with(".md"))
            .collect();
        names.sort();
        names.iter().map(|name| Page::read(name)).collect()
    }

    pub(crate) fn blocks(&self) -> Vec<Block> {
        let mut blocks = Vec::new();
        let mut open: Option<Block> = None;
        for (number, line) in self.text.lines().enumerate() {
            open = match (open, line.strip_prefix("```")) {
                (None, Some(kind)) => Some(Block { kind: kind.into(), first: number + 1, lines: Vec::new() }),
                (None, None) => None,
                (Some(block), Some("")) => {
                    blocks.push(block);
                    None
                }
                (Some(mut block), _) => {
                    block.lines.push(line.into());
                    Some(block)
                }
            };
        }
        assert!(open.is_none(), "{}: a fence is not closed", self.name);
        blocks
    }

    /// The lines outside fenced blocks.
    pub(crate) fn prose(&self) -> Vec<&str> {
        let mut fenced = false;
        let outside = |line: &&str| {
            let fence = line.starts_with("```");
            fenced ^= fence;
            !fence && !fenced
        };
        self.text.lines().filter(outside).collect()
    }

    pub(crate) fn tables(&self) -> Vec<Table> {
        let (mut tables, mut heading, mut within) = (Vec::<Table>::new(), String::new(), false);
        for line in self.prose() {
            if let Some(title) = line.strip_prefix('#') {
                heading = plain(title.trim_start_matches('#').trim());
            }
            let Some(row) = line.strip_prefix('|') else {
                within = false;
                continue;
            };
            let cells: Vec<String> = row.trim_end().trim_end_matches('|').split('|').map(|c| plain(c.trim())).collect();
            match tables.last_mut().filter(|_| within) {
                None => tables.push(Table { heading: heading.clone(), head: cells, rows: Vec::new() }),
                Some(_) if cells.iter().all(|cell| cell.chars().all(|c| "-: ".contains(c))) => {}
                Some(table) => table.rows.push(cells),
            }
            within = true;
        }
        tables
    }

    /// The targets of its links and pictures, without other sites.
    pub(crate) fn links(&self) -> Vec<String> {
        let mut found = Vec::new();
        for line in self.prose() {
            for part in line.split("](").skip(1) {
                let target = part.split(')').next().unwrap_or_default();
                if !target.contains("://") {
                    found.push(target.to_owned());
                }
            }
        }
        found
    }

    /// The anchors of its headings, as mdBook makes them.
    pub(crate) fn anchors(&self) -> Vec<String> {
        let headings = self.prose().into_iter().filter_map(|line| line.strip_prefix('#'));
        headings.map(|title| anchor(&plain(title.trim_start_matches('#').trim()))).collect()
    }
}

impl Table {
    /// The cells of a column; `None` if the table has no such column.
    pub(crate) fn column(&self, name: &str) -> Option<Vec<&str>> {
        let index = self.head.iter().position(|head| head == name)?;
        Some(self.rows.iter().map(|row| row.get(index).map_or("", String::as_str)).collect())
    }

    /// Rows reduced to these columns; `None` if one is missing.
    pub(crate) fn columns<const N: usize>(&self, names: [&str; N]) -> Option<Vec<[&str; N]>> {
        let columns: Vec<_> = names.iter().map(|name| self.column(name)).collect::<Option<_>>()?;
        Some((0..self.rows.len()).map(|row| std::array::from_fn(|k| columns[k][row])).collect())
    }
}

/// Text without markup: `J<sub>M</sub>` is J_M, a link its words.
fn plain(text: &str) -> String {
    let mut text = text.replace("<sub>", "_").replace("<sup>", "^").replace(['`', '*'], "");
    for tag in ["</sub>", "</sup>", "<i>", "</i>"] {
        text = text.replace(tag, "");
    }
    while let Some((before, rest)) = text.split_once('[')
        && let Some((words, rest)) = rest.split_once("](")
        && let Some((_, after)) = rest.split_once(')')
    {
        text = format!("{before}{words}{after}");
    }
    text
}

fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

#[test]
fn blocks_tables_links_and_anchors_are_found() {
    let text = "# A `title`, here\n[b](b.md#c) ![f](figures/f.svg) [w](https://w.org)\n\n| symbol | *unit* |\n|-|-|\n\
                | J<sub>M</sub> | N·m |\n| [x](y) | 1 |\n\n```sh\n# no heading [n](o)\n```\n";
    let page = Page { name: "a.md".into(), text: text.into() };
    let block = Block { kind: "sh".into(), first: 9, lines: vec!["# no heading [n](o)".into()] };
    assert_eq!(page.blocks(), [block]);
    assert_eq!(page.links(), ["b.md#c", "figures/f.svg", "y"]);
    assert_eq!(page.anchors(), ["a-title-here"]);
    let tables = page.tables();
    assert_eq!((tables.len(), tables[0].heading.as_str()), (1, "A title, here"));
    assert_eq!(tables[0].columns(["unit", "symbol"]), Some(vec![["N·m", "J_M"], ["1", "x"]]));
    assert_eq!(tables[0].column("parameter"), None);
}
