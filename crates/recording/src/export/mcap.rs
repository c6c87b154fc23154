//! MCAP, for robotics tools (Foxglove, PlotJuggler): a JSON message per row, with a schema of its fields.

use std::collections::BTreeMap;
use std::io;
use std::time::UNIX_EPOCH;

use ::mcap::records::MessageHeader;
use ::mcap::write::NoSeek;
use ::mcap::{WriteOptions, Writer};
use serde_json::{Map, Value, json};

use super::{Out, Sink};
use crate::mdf::{Channel, Header};

/// A topic with a message for each row.
pub(super) struct Mcap<'a> {
    writer: Writer<NoSeek<Out<'a>>>,
    channel: u16,
    names: Vec<String>,
    /// Start of the run [ns since 1970].
    start: u64,
    row: u32,
    message: Vec<u8>,
}

impl<'a> Mcap<'a> {
    pub(super) fn new(out: Out<'a>, columns: &[&Channel], header: &Header) -> io::Result<Self> {
        let options = WriteOptions::new()
            .compression(None)
            .disable_seeking(true)
            .library(concat!("stickslip ", env!("CARGO_PKG_VERSION")));
        let mut writer = Writer::with_options(NoSeek::new(out), options).map_err(io::Error::other)?;
        let field = |channel: &&Channel| {
            let text = [&channel.comment, " [", &channel.unit, "]"].concat();
            (channel.name.clone(), json!({ "type": ["number", "null"], "description": text }))
        };
        let fields: Map<String, Value> = columns.iter().map(field).collect();
        let schema = json!({ "type": "object", "title": "stickslip.cycle", "properties": fields }).to_string();
        let schema = writer.add_schema("stickslip.cycle", "jsonschema", schema.as_bytes()).map_err(io::Error::other)?;
        let units = columns.iter().map(|channel| (format!("unit.{}", channel.name), channel.unit.clone()));
        let units: BTreeMap<_, _> = units.collect();
        let channel = writer.add_channel(schema, "/bench", "json", &units).map_err(io::Error::other)?;
        let start = header.start.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64);
        let names = columns.iter().map(|channel| channel.name.clone()).collect();
        Ok(Mcap { writer, channel, names, start, row: 0, message: Vec::new() })
    }
}

impl Sink for Mcap<'_> {
    fn row(&mut self, row: &[f64]) -> io::Result<()> {
        // Non-finite numbers are null.
        let message: Map<String, Value> =
            self.names.iter().cloned().zip(row.iter().map(|value| json!(value))).collect();
        self.message.clear();
        serde_json::to_writer(&mut self.message, &message)?;
        let time = self.start + (row[0].max(0.0) * 1e9).round() as u64;
        let header = MessageHeader { channel_id: self.channel, sequence: self.row, log_time: time, publish_time: time };
        self.row = self.row.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &self.message).map_err(io::Error::other)
    }

    fn finish(mut self: Box<Self>) -> io::Result<()> {
        self.writer.finish().map(drop).map_err(io::Error::other)
    }
}
