use super::*;

fn readings() -> Measurement<f64> {
    let mut next = 0.0;
    from_numbers((0..6).map(|_| {
        next += 0.1;
        next
    }))
    .unwrap()
}

fn all() -> Vec<Message> {
    let preload = Preload { preload: 0.3 };
    vec![
        Message::Begin(Begin { tick_time: 250e-6 }),
        Message::Begun(Begun { preload: 1.0, measurement: readings() }),
        Message::Voltages(Voltages { servo_voltage: 0.1 + 0.2, amplifier_voltage: -0.0 }),
        Message::Readings(readings()),
        Message::Preload(preload),
        Message::Pressed(preload),
        Reason::TickTime.message(1.0, 2.0),
        Message::End,
        Message::BeginRealTime(Begin { tick_time: 1e-3 }),
    ]
}

#[test]
fn every_message_is_read_back_bit_by_bit() {
    for (k, message) in all().into_iter().enumerate() {
        let datagram = message.datagram(u64::MAX - k as u64);
        let (sequence, back) = Message::read(&datagram).unwrap();
        assert_eq!((sequence, back.kind(), back), (u64::MAX - k as u64, k as u8 + 1, message));
        assert_eq!(back.datagram(sequence), datagram);
        let once = matches!(message, Message::Begun(_));
        assert!(datagram.len() <= if once { LONGEST } else { 64 }, "{message:?}");
        assert_eq!(Message::length(message.kind()), Some(datagram.len()));
    }
}

#[test]
fn every_flipped_bit_and_every_wrong_length_is_detected() {
    for message in all() {
        let datagram = message.datagram(7);
        for bit in 0..8 * datagram.len() {
            let mut flipped = datagram;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(Message::read(&flipped).is_err(), "{message:?}: bit {bit}");
        }
        for length in 0..datagram.len() {
            assert!(Message::read(&datagram[..length]).is_err(), "{message:?}: {length} bytes");
        }
    }
}

/// A frame with a correct checksum and wrong content.
fn sealed(change: impl FnOnce(&mut Vec<u8>)) -> Result<(u64, Message), FrameError> {
    let mut bytes = Message::Voltages(Voltages::default()).datagram(1).to_vec();
    bytes.truncate(bytes.len() - TAIL);
    change(&mut bytes);
    let sum = checksum(&bytes);
    bytes.extend(sum.to_le_bytes());
    Message::read(&bytes)
}

#[test]
fn a_wrong_frame_with_a_correct_checksum_is_refused() {
    assert!(sealed(|_| ()).is_ok());
    assert_eq!(sealed(|bytes| bytes[0] = b'X'), Err(FrameError::Mark));
    assert_eq!(sealed(|bytes| bytes[2] = 1), Err(FrameError::Version(1)));
    assert_eq!(sealed(|bytes| bytes[3] = 99), Err(FrameError::Kind(99)));
    assert_eq!(sealed(|bytes| bytes.extend([0; 8])), Err(FrameError::Length(40)));
    assert_eq!(sealed(|bytes| bytes.extend([0; 3])), Err(FrameError::Length(35)));
    assert_eq!(sealed(|bytes| bytes.truncate(HEAD)), Err(FrameError::Length(16)));
}

#[test]
fn the_guide_has_the_layout() {
    let page = include_str!("../../../../../docs/src/frame.md");
    let names = |shape: stickslip_core::fields::Shape| match shape {
        stickslip_core::fields::Shape::Group(fields) => fields.iter().map(|field| field.name).collect::<Vec<_>>(),
        _ => Vec::new(),
    };
    let rows = |kind: u8, names: Vec<&str>| {
        for (k, name) in names.into_iter().enumerate() {
            let row = format!("| {kind} | {} | f64 | `{name}` |", HEAD + 8 * k);
            assert!(page.contains(&row), "docs/src/frame.md lacks {row}");
        }
    };
    rows(1, names(<Begin<f64> as Numbers<f64>>::SHAPE));
    let measurement = || names(<Measurement<f64> as Numbers<f64>>::SHAPE);
    rows(2, ["preload"].into_iter().chain(measurement()).collect());
    rows(3, names(<Voltages<f64> as Numbers<f64>>::SHAPE));
    rows(4, measurement());
    rows(5, names(<Preload<f64> as Numbers<f64>>::SHAPE));
    rows(9, names(<Begin<f64> as Numbers<f64>>::SHAPE));
    rows(7, names(<Refusal<f64> as Numbers<f64>>::SHAPE));
    for message in all() {
        let length = message.datagram(0).len();
        let row = format!("| {} | {length} |", message.kind());
        assert!(page.contains(&row), "docs/src/frame.md lacks {row}");
    }
}
