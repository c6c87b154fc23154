//! Files of other programs.

use super::super::block::Blocks;
use super::super::read;
use super::*;
use crate::Recording;

/// A file of another program: one group of records of `length` bytes, its channels and its data.
pub(super) fn other_file(
    length: u32,
    rows: u64,
    channels: impl Fn(&mut Blocks) -> u64,
    data: impl Fn(&mut Blocks) -> u64,
) -> Vec<u8> {
    let mut blocks = Blocks::at(0);
    blocks.bytes.extend([&b"MDF     4.10    another "[..], &[0; 4], &410u16.to_le_bytes(), &[0; 34]].concat());
    let hd = blocks.push(b"HD", &[0; 6], &[&[0; 32]]);
    let first = channels(&mut blocks);
    let data = data(&mut blocks);
    let sizes = [length.to_le_bytes(), [0; 4]].concat();
    let cg = blocks.push(b"CG", &[0, first, 0, 0, 0, 0], &[&[0; 8], &rows.to_le_bytes(), &[0; 8], &sizes]);
    let dg = blocks.push(b"DG", &[0, cg, data, 0], &[&[0; 8]]);
    blocks.set_link(hd, 0, dg);
    blocks.bytes
}

/// A channel: kind, kind of number, first bit, first byte, bits, conversion.
pub(super) fn cn(
    blocks: &mut Blocks,
    next: u64,
    name: &str,
    kind: [u8; 3],
    start: u32,
    bits: u32,
    conversion: u64,
) -> u64 {
    let name = blocks.text(b"TX", name);
    let data = [[kind[0], 0, kind[1], kind[2]], start.to_le_bytes(), bits.to_le_bytes()].concat();
    blocks.push(b"CN", &[next, 0, name, 0, conversion, 0, 0, 0], &[&data, &[0; 60]])
}

fn cc(blocks: &mut Blocks, kind: u8, parameters: &[f64]) -> u64 {
    let parameters: Vec<u8> = parameters.iter().flat_map(|p| p.to_le_bytes()).collect();
    let unit = blocks.text(b"MD", "<CCunit><TX>mm</TX></CCunit>");
    blocks.push(b"CC", &[0, unit, 0, 0], &[&[kind], &[0; 23], &parameters])
}

#[test]
fn numbers_of_any_width_order_and_conversion_are_read() {
    let channels = |blocks: &mut Blocks| {
        let linear = cc(blocks, 1, &[0.5, 2.0]);
        let rational = cc(blocks, 2, &[0.0, 1.0, 0.0, 0.0, 0.0, 4.0]);
        let formula = cc(blocks, 3, &[]);
        let texts = cc(blocks, 7, &[]);
        let mut next = 0;
        for (name, kind, start, bits, conversion) in [
            ("words", [0, 0, 0], 0, 16, texts),
            ("formula", [0, 0, 0], 0, 16, formula),
            ("text", [0, 6, 0], 0, 16, 0),
            ("row", [3, 0, 0], 0, 0, linear),
            ("float", [0, 5, 0], 4, 32, 0),
            ("quotient", [0, 3, 0], 2, 16, rational),
            ("bits", [0, 2, 3], 0, 10, 0),
            ("word", [2, 0, 0], 0, 16, linear),
        ] {
            next = cn(blocks, next, name, kind, start, bits, conversion);
        }
        next
    };
    let record =
        |word: u16, big: i16, float: f32| [&word.to_le_bytes()[..], &big.to_be_bytes(), &float.to_be_bytes()].concat();
    // Bits 3 to 12 of the second word are 1022, signed -2.
    let records = [record(100, -2, 1.5), record(1022 << 3 | 0b101, 6, -0.25)].concat();
    let plain = |blocks: &mut Blocks| blocks.push(b"DT", &[], &[&records]);
    let listed = |blocks: &mut Blocks| {
        // A record may be split over two blocks.
        let parts = [&records[..5], &records[5..]].map(|part| blocks.push(b"DT", &[], &[part]));
        let second = blocks.push(b"DL", &[0, parts[1]], &[&[0; 24]]);
        blocks.push(b"DL", &[second, parts[0]], &[&[0; 24]])
    };
    for file in [other_file(8, 2, channels, plain), other_file(8, 2, channels, listed)] {
        let read = contents(&file).unwrap();
        let signals = &read.groups[0].signals;
        let of = |name: &str| signals.iter().find(|s| s.channel.name == name).map(|s| &s.values[..]);
        assert_eq!(of("word"), Some(&[200.5, 2.0 * 8181.0 + 0.5][..]));
        assert_eq!(of("bits"), Some(&[12.0, -2.0][..]));
        assert_eq!(of("quotient"), Some(&[-0.5, 1.5][..]));
        assert_eq!(of("float"), Some(&[1.5, -0.25][..]));
        assert_eq!(of("row"), Some(&[0.5, 2.5][..]));
        assert_eq!((of("text"), of("words")), (None, None));
        assert_eq!(signals[0].channel.unit, "mm");
        let recording = Recording::parse(Path::new("axis.mf4"), &file).unwrap();
        assert!(recording.columns().iter().any(|c| c.name == "formula" && c.values[0].is_nan()));
    }
}

#[test]
fn lists_of_asammdf_compressed_or_not_are_read() {
    for name in ["plain.mf4", "zipped.mf4", "transposed.mf4"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/reference/recording");
        let read = read(&folder.join(name)).unwrap();
        assert_eq!(read.header.start, UNIX_EPOCH + Duration::from_secs(1_772_353_800));
        assert!(read.header.program == "asammdf" && read.finished);
        assert_eq!(read.groups.iter().map(|group| group.signals.len()).collect::<Vec<_>>(), [4, 2]);
        // The flag is a text; the slow signal has another group and covers fewer rows.
        let recording = Recording::read(&folder.join(name)).unwrap();
        let columns: Vec<_> = recording.columns().iter().map(|c| (&*c.name, c.unit.as_deref())).collect();
        let expected =
            ["time", "x", "x32", "lost", "slow"].map(|name| (name, Some(if name == "time" { "s" } else { "m" })));
        assert_eq!(columns, expected);
        for i in 0..50 {
            let position = 0.1 * libm::sin(40.0 * (i as f64 * 1e-3));
            let [time, x, x32, lost] = [0, 1, 2, 3].map(|column| recording.columns()[column].values[i]);
            assert_eq!((time, x32), (i as f64 * 1e-3, f64::from(position as f32)), "{name} {i}");
            // A count is a tenth of a millimetre; NumPy's sine differs in the last bits.
            assert!((x - position).abs() < 0.51e-4, "{name} {i}: {x}");
            assert!(if i == 30 { lost.is_nan() } else { (lost - position).abs() < 1e-15 }, "{name} {i}: {lost}");
        }
        assert!(recording.column("lost").unwrap_err().to_string().contains(":31: column `lost`"));
    }
}
