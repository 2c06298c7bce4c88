//! The line, the delay of answers, resets, and what it tells of itself.

use super::*;

#[test]
fn a_unit_wakes_at_19231_is_switched_and_falls_back_with_all_it_knew_on_a_reset() {
    let mut host = Host::with(ShaftSetup::default());
    assert_eq!(host.bus.baud(), 19_231);
    assert_eq!(host.identity().map(|told| (told.reset, told.celsius, told.serial)), Some((1, 30, 4_660)));
    assert_eq!(host.identity().map(|told| told.reset), Some(0));
    host.settle(0);
    host.order(SixpackOrder::Preset(PositionPreset { motor: 0, position: 1_000_000 }));
    host.order(SixpackOrder::Baud(BaudSwitch { divisor: 22, delay: 1 }));
    assert_eq!((host.bus.baud(), host.position(0).position), (56_818, 1_000_000));
    host.suffer(SixpackFault::Reset);
    assert_eq!((host.bus.baud(), host.position(0).position), (19_231, 0));
    assert_eq!(host.motor(0).written, MotorWritten::waking(0));
    assert_eq!(host.identity().map(|told| told.reset), Some(1));
    assert_eq!(host.motor(0).shaft.place(), ShaftSetup::default().start);
}

#[test]
fn an_answer_waits_for_the_delay_and_what_comes_while_it_holds_two_wires_is_lost() {
    let mut host = Host::of(SixpackSetup { is_two_wires: true, ..setup() });
    let ask = SixpackOrder::AskUnit(UnitQuery { response: ANSWER });
    host.order(ask);
    assert_eq!(host.hear(Duration::from_micros(5_900)).len(), 0);
    assert_eq!(host.hear(Duration::from_micros(200)).len(), 9);
    // Nine octets of 520 us, and 6 ms behind them.
    host.wait(MS(9));
    host.octets(&[1]);
    assert_eq!(host.unit().books.collisions, 1);
    host.wait(MS(3));
    assert!(host.identity().is_some());
    host.order(SixpackOrder::Baud(BaudSwitch { divisor: 11, delay: 0 }));
    host.order(ask);
    assert_eq!(host.bus.take_octet(host.now), Some(ANSWER));
}

#[test]
fn on_wires_of_its_own_for_each_way_it_hears_while_it_speaks() {
    let mut host = Host::with(ShaftSetup::default());
    let ask = SixpackOrder::AskUnit(UnitQuery { response: ANSWER });
    host.order(ask);
    assert_eq!(host.hear(MS(7)).len(), 9);
    assert!(host.identity().is_some());
    assert_eq!(host.unit().books.collisions, 0);
}

#[test]
fn a_lost_octet_costs_the_next_frames_until_a_break_or_the_packet_timeout() {
    let mut host = Host::with(ShaftSetup::default());
    let short = |host: &mut Host| host.octets(&target(0, 5).frame(UNIT).octets()[1..]);
    short(&mut host);
    host.wait(MS(500));
    assert!(host.identity().is_none());
    host.bus.on_break(host.now);
    assert!(host.identity().is_some());
    host.order(SixpackOrder::Timeout(PacketTimeout { timeout: 10 }));
    short(&mut host);
    assert!(host.identity().is_none());
    short(&mut host);
    host.wait(MS(40));
    assert!(host.identity().is_some());
}

#[test]
fn a_dead_unit_stands_and_says_nothing_and_wakes_as_after_a_reset() {
    let mut host = Host::with(ShaftSetup { start: 0.0, ..ShaftSetup::default() });
    host.settle(0);
    host.order(target(0, 64_000));
    host.wait(MS(100));
    host.suffer(SixpackFault::Dead(true));
    let place = host.motor(0).shaft.place();
    host.wait(Duration::from_secs(1));
    assert!(host.identity().is_none() && place > 0.0 && host.motor(0).shaft.place() == place);
    host.suffer(SixpackFault::Dead(false));
    assert_eq!(host.identity().map(|told| told.reset), Some(1));
}

#[test]
fn settings_of_a_motor_that_moves_and_what_is_never_sent_stand_in_the_books() {
    let mut host = Host::with(ShaftSetup::default());
    host.settle(0);
    host.order(target(0, 64_000));
    host.wait(MS(50));
    host.settle(1);
    assert_eq!(host.unit().books.settings_in_motion, 1);
    host.settle(0);
    assert_eq!(host.unit().books.settings_in_motion, 7);
    host.tell(SixpackCommand::Other { command: 0xcc, parameters: [0; 7] });
    host.order(target(6, 0));
    let UnitBooks { unknown, no_motor, frames, .. } = host.unit().books;
    assert_eq!((unknown, no_motor, frames), (1, 1, 21));
}

#[test]
fn supply_and_temperature_are_told_as_they_are() {
    let mut host = Host::with(ShaftSetup::default());
    host.suffer(SixpackFault::Celsius(-5));
    host.suffer(SixpackFault::Volts(51));
    let supply = host.ask(SixpackOrder::AskInput(InputQuery { channel: 7, response: ANSWER }));
    let Some(SixpackReply::InputTold(told)) = supply else { panic!("{supply:?}") };
    assert_eq!((told.value, host.identity().map(|told| told.celsius)), (51 * 22, Some(-5)));
    let actions = host.ask(SixpackOrder::AskActions { response: ANSWER });
    assert_eq!(actions, Some(ActionsTold { actions: [0; 6] }.into()));
    let asked = host.ask(SixpackOrder::AskVelocity(VelocityQuery { motor: 6, response: ANSWER }));
    assert_eq!(asked, None);
}

#[test]
fn a_bus_at_rest_wants_nothing_and_one_that_moves_the_next_loop() {
    let mut host = Host::with(ShaftSetup::default());
    host.settle(0);
    assert_eq!(host.bus.next(), None);
    host.order(target(0, 64_000));
    let next = host.bus.next().unwrap();
    assert!(next > host.now && next.since(host.now) <= LOOP);
}

#[test]
fn of_two_units_only_the_one_that_is_addressed_obeys_and_answers() {
    let now = MonoTime::from_nanos(0);
    let bus = SixpackBus::waking([setup(), SixpackSetup { unit: 2, serial: 7, ..setup() }], now);
    let mut host = Host { bus, now };
    let ask = SixpackOrder::AskUnit(UnitQuery { response: 9 });
    host.octets(&ask.frame(2).octets());
    let heard: [u8; FRAME_LEN] = host.hear(MS(20)).try_into().unwrap();
    let told = ask.answered_by(SixpackFrame::from_octets(heard));
    assert!(matches!(told, Some(SixpackReply::UnitTold(UnitTold { serial: 7, .. }))), "{told:?}");
    assert_eq!(host.bus.units().iter().map(|unit| unit.books.frames).collect::<Vec<_>>(), [0, 1]);
    host.order(SixpackOrder::Baud(BaudSwitch { divisor: 22, delay: 1 }));
    assert_eq!(host.bus.baud(), 19_231);
    host.octets(&SixpackOrder::Baud(BaudSwitch { divisor: 22, delay: 1 }).frame(2).octets());
    assert_eq!(host.bus.baud(), 56_818);
}
