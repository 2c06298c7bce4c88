use super::*;
use crate::wire::{RegisterReport, Status};

/// The next report, if one is due.
fn report(bench: &mut Bench) -> Option<(String, Vec<u8>)> {
    let mut buf = [0xa5; MAX_LEN];
    let (to, bytes) = bench.controller.report(at(bench.at_ms), &mut buf)?;
    Some((to.to_string(), bytes.to_vec()))
}

fn status(bench: &mut Bench) -> Option<Status> {
    report(bench).map(|(_, bytes)| Status::parse(&bytes).unwrap())
}

#[test]
fn reports_come_every_pa1e_to_the_host_that_pa1f_names() {
    for (reports, host) in [(1, "192.168.15.101:8410"), (2, "10.0.0.2:8500")] {
        let second = [(0x25, 10), (0x28, 2), (0x29, 8_500)];
        let parameters = [&[(pa::REPORTS, reports), (pa::REPORT_INTERVAL, 100)], &second[..]].concat();
        let mut bench = Bench::with(&parameters);
        assert_eq!((report(&mut bench), bench.controller.report_due()), (None, Some(at(100))));
        bench.play(&Motion { outputs: 5, ..FRAME });
        bench.controller.set_switches(2, at(50));
        assert_eq!(report(bench.wait(99)), None);
        let (to, bytes) = report(bench.wait(1)).unwrap();
        let status = Status::parse(&bytes).unwrap();
        assert_eq!((to.as_str(), bytes.len(), status.station), (host, 40, Code(0x0fc9)));
        assert_eq!((&status.positions[..], status.outputs, status.inputs), (FRAME.positions, 5, 2));
        assert_eq!((status.error, bench.controller.report_due()), (0, Some(at(200))));
        assert_eq!(bench.controller.counts().reported, 1);
    }
}

#[test]
fn a_report_that_comes_late_is_not_made_up_for() {
    let mut bench = Bench::with(&[(pa::REPORTS, 1), (pa::REPORT_INTERVAL, 10)]);
    assert!(report(bench.wait(1_003)).is_some());
    assert_eq!((report(&mut bench), bench.controller.report_due()), (None, Some(at(1_013))));
}

#[test]
fn with_pa1e_0_a_report_comes_once_for_each_error() {
    let mut bench = Bench::with(&[(pa::REPORTS, 1)]);
    assert_eq!(bench.controller.report_due(), None);
    bench.controller.act(&Action::Error(12), at(70));
    bench.controller.act(&Action::Error(12), at(80));
    let status = status(bench.wait(70)).unwrap();
    assert_eq!((status.error, &status.servo_errors[..], status.forces[2]), (12, &[0, 0, 1][..], 0));
    assert_eq!((report(&mut bench), bench.controller.report_due()), (None, None));
    bench.controller.act(&Action::Error(1), at(90));
    assert!(report(bench.wait(20)).is_some());
}

#[test]
fn without_pa1f_nothing_is_reported_and_pa15_does_not_matter() {
    let mut off = Bench::with(&[(pa::REPORT_INTERVAL, 10)]);
    off.controller.act(&Action::Error(12), at(0));
    assert_eq!(report(off.wait(100)), None);
    let mut default = Bench::with(&[]);
    default.controller.act(&Action::Error(12), at(0));
    assert_eq!(report(&mut default), None);
    let mut on = Bench::with(&[(pa::REPORT_INTERVAL, 10), (pa::ANSWERS, 0)]);
    on.controller.act(&Action::Parameter(pa::REPORTS, 1), at(0));
    assert!(report(on.wait(10)).is_some());
    on.controller.act(&Action::Parameter(pa::REPORTS, 0), at(10));
    assert_eq!(on.controller.report_due(), None);
}

#[test]
fn a_controller_that_starts_again_or_is_mute_reports_nothing() {
    let mut bench = Bench::with(&[(pa::REPORTS, 1), (pa::REPORT_INTERVAL, 100)]);
    bench.controller.act(&Action::Reboot, at(0));
    assert_eq!(bench.controller.report_due(), Some(at(1_600)));
    bench.controller.act(&Action::Mute(true), at(0));
    assert_eq!((report(bench.wait(1_600)), bench.controller.report_due()), (None, Some(at(1_700))));
}

#[test]
fn an_mbox_reports_its_alarm_register_once() {
    let mut bench = Bench::new(&Setup { dialect: Dialect::Mbox, ..Setup::default() });
    bench.controller.act(&Action::Error(11), at(0));
    let (to, bytes) = report(&mut bench).unwrap();
    let told = RegisterReport::parse(&bytes).unwrap();
    assert_eq!((to.as_str(), told.start, told.data), ("192.168.15.101:8410", 0xfe, Words::from(&[11][..])));
    assert_eq!((bench.word(0, 0xfe), report(&mut bench)), (11, None));
}
