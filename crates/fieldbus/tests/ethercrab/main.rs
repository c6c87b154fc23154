//! The main device `ethercrab` on an emulated segment, over a pair of virtual interfaces in a namespace of the test.
//!
//! A test starts this program again in a new network namespace, which ends with it: no name can collide and nothing is
//! left behind. Where that is not permitted the test reports it.
#![cfg(target_os = "linux")]
#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;
mod executor;
mod namespace;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use ethercrab::std::{ethercat_now, tx_rx_task};
use ethercrab::subdevice_group::{DcConfiguration, HasDc, Op, SubDeviceGroup};
use ethercrab::{
    DcSync, DefaultLock, MainDevice, MainDeviceConfig, ObjectDescriptionListQuery, PduStorage, RetryBehaviour, Timeouts,
};
use stickslip_fieldbus::{DriveSheet, Rotors, Segment, Server, VENDOR};

use executor::block_on;
use namespace::{End, is_inside, pair_of_interfaces};

/// Period of the set-points: long, so that a loaded computer keeps it.
const CYCLE: Duration = Duration::from_millis(4);

type Group = SubDeviceGroup<4, 128, DefaultLock, Op, HasDc>;

/// Runs a main device on one end of a pair of interfaces, with two drives and an analogue input on the other.
fn with_segment(run: impl FnOnce(&MainDevice<'static>) + Send) {
    static STORAGE: PduStorage<16, { PduStorage::element_size(1100) }> = PduStorage::new();
    pair_of_interfaces();
    let sheets = [DriveSheet::default(), DriveSheet { name: "second drive".into(), ..DriveSheet::default() }];
    let (ended, is_bound) = (AtomicBool::new(false), AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let segment = Segment::new(&sheets, 1, Box::new(Rotors { inertia: 1e-3, friction: 1e-3 }));
            let mut server = Server::bind("sub", segment, Duration::ZERO).unwrap();
            is_bound.store(true, Ordering::Release);
            server.serve(|_| !ended.load(Ordering::Acquire)).unwrap();
        });
        while !is_bound.load(Ordering::Acquire) {
            std::thread::yield_now();
        }
        let (tx, rx, pdu_loop) = STORAGE.try_split().unwrap();
        let task = tx_rx_task("main", tx, rx).unwrap();
        std::thread::spawn(move || block_on(task));
        let timeouts = Timeouts {
            pdu: Duration::from_millis(500),
            eeprom: Duration::from_secs(1),
            mailbox_response: Duration::from_secs(2),
            ..Timeouts::default()
        };
        let config = MainDeviceConfig { dc_static_sync_iterations: 200, retry_behaviour: RetryBehaviour::Count(5) };
        let end = End(&ended);
        // The list of objects has room for all indices, on the stack.
        let main_device = std::thread::Builder::new().stack_size(64 << 20);
        let run = move || run(&MainDevice::new(pdu_loop, timeouts, config));
        let result = main_device.spawn_scoped(scope, run).unwrap().join();
        drop(end);
        result.unwrap();
    });
}

/// From the scan to OP with SYNC0.
async fn operational(main: &MainDevice<'static>) -> Group {
    let mut group = main.init_single_group::<4, 128>(ethercat_now).await.unwrap();
    let names: Vec<String> = group.iter(main).map(|device| device.name().to_string()).collect();
    assert_eq!(names, ["stickslip emulated drive", "second drive", "stickslip emulated input"]);
    for mut device in group.iter_mut(main) {
        assert_eq!(device.identity().vendor_id, VENDOR);
        if device.name() != "stickslip emulated input" {
            objects(&device).await;
            // A loaded computer may be late: 1 s of watchdog, and missed set-points are not supervised.
            device.register_write(0x0420_u16, 10_000_u16).await.unwrap();
            device.sdo_write(0x10F1, 2, u16::MAX).await.unwrap();
            device.set_dc_sync(DcSync::Sync0);
        }
    }
    let group = group.into_pre_op_pdi(main).await.unwrap();
    let start_delay = Duration::from_millis(200);
    let dc = DcConfiguration { start_delay, sync0_period: CYCLE, sync0_shift: CYCLE / 2 };
    let group = group.configure_dc_sync(main, dc).await.unwrap();
    let group = group.into_safe_op(main).await.unwrap();
    let group = group.request_into_op(main).await.unwrap();
    let start = Instant::now();
    while !group.tx_rx_dc(main).await.unwrap().all_op() {
        assert!(start.elapsed() < Duration::from_secs(10), "OP is not reached");
        std::thread::sleep(CYCLE);
    }
    group
}

/// Expedited and normal uploads, a download, the list of objects, assignment of process data.
async fn objects<S: std::ops::DerefMut<Target = ethercrab::SubDevice>>(device: &ethercrab::SubDeviceRef<'_, S>) {
    assert_eq!(device.sdo_read::<u32>(0x6076, 0).await.unwrap(), 500);
    // In one message; segments are left to the tests in Python, since version 0.7.1 refuses the specifier 0 of a segment.
    assert_eq!(&device.sdo_read::<[u8; 8]>(0x1009, 0).await.unwrap(), b"emulated");
    device.sdo_write(0x6072, 0, 1000_u16).await.unwrap();
    assert_eq!(device.sdo_read::<u16>(0x6072, 0).await.unwrap(), 1000);
    assert!(device.sdo_write(0x6076, 0, 1_u32).await.is_err(), "a constant was written");
    let list = device.sdo_info_object_description_list(ObjectDescriptionListQuery::All).await.unwrap().unwrap();
    assert!(list.contains(&0x6040) && list.len() > 40);
    device.sdo_write_array(0x1C12, [0x1600_u16, 0x1602]).await.unwrap();
    device.sdo_write_array(0x1C13, [0x1A00_u16, 0x1A01]).await.unwrap();
}

/// Statusword, position, velocity, torque and error code of a drive.
#[derive(Debug)]
struct Inputs(u16, i32, i32, i16, u16);

/// Cycles with a controlword and a torque for both drives; the inputs of the first.
async fn cycles(group: &Group, main: &MainDevice<'static>, count: usize, control: u16, torque: i16) -> Inputs {
    for _ in 0..count {
        for at in 0..2 {
            let device = group.subdevice(main, at).unwrap();
            let mut outputs = device.outputs_raw_mut();
            outputs[0..2].copy_from_slice(&control.to_le_bytes());
            outputs[2..4].copy_from_slice(&torque.to_le_bytes());
            outputs[4] = 10;
        }
        let response = group.tx_rx_dc(main).await.unwrap();
        assert_eq!(response.working_counter, 7, "two drives with outputs and inputs, one input");
        std::thread::sleep(CYCLE);
    }
    let device = group.subdevice(main, 0).unwrap();
    let inputs = device.inputs_raw();
    let word = |at: usize| u16::from_le_bytes([inputs[at], inputs[at + 1]]);
    let long = |at: usize| (u32::from(word(at)) | u32::from(word(at + 2)) << 16) as i32;
    Inputs(word(0), long(2), long(6), word(10) as i16, word(12))
}

#[test]
fn ethercrab_brings_two_drives_to_operation_and_turns_them() {
    if !is_inside("ethercrab_brings_two_drives_to_operation_and_turns_them") {
        return;
    }
    with_segment(|main| {
        block_on(async {
            let group = operational(main).await;
            for (control, state) in [(0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)] {
                let inputs = cycles(&group, main, 10, control, 0).await;
                assert_eq!(inputs.0 & 0x6F, state, "{inputs:?}");
            }
            let Inputs(_, before, ..) = cycles(&group, main, 2, 0x0F, 0).await;
            let Inputs(status, position, velocity, torque, _) = cycles(&group, main, 50, 0x0F, 150).await;
            assert!(status & 0x1000 != 0 && torque == 150 && velocity > 50_000 && position > before + 3_000);

            // A fault on purpose, and its reset by the rising edge.
            group.subdevice(main, 0).unwrap().sdo_write(0x2020, 1, 0x4210_u16).await.unwrap();
            let Inputs(status, _, _, torque, error) = cycles(&group, main, 10, 0x0F, 150).await;
            assert_eq!((status & 0x6F, torque, error), (0x08, 0, 0x4210));
            assert_eq!(cycles(&group, main, 10, 0x80, 0).await.0 & 0x6F, 0x40);

            // Without set-points.
            std::thread::sleep(Duration::from_millis(1300));
            let device = group.subdevice(main, 0).unwrap();
            assert_eq!(device.register_read::<u16>(0x0130_u16).await.unwrap(), 0x14);
            assert_eq!(device.register_read::<u16>(0x0134_u16).await.unwrap(), 0x1B);
        });
    });
}
