//! Anything.

use proptest::prelude::*;

use super::*;

fn any_command() -> impl Strategy<Value = [u8; 8]> {
    let codes = prop::sample::select(vec![
        0x11_u8, 0x12, 0x13, 0x14, 0x15, 0x16, 0x18, 0x19, 0x20, 0x21, 0x22, 0x24, 0x25, 0x26, 0x27, 0x28,
        0x2a, 0x2b, 0x30, 0x40, 0x41, 0x43, 0x50, 0xcc,
    ]);
    (codes, 0_u8..7, any::<[u8; 6]>())
        .prop_map(|(code, motor, [a, b, c, d, e, f])| [code, motor, a, b, c, d, e, f])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_it_is_told_nothing_breaks_and_no_axis_leaves_its_travel(
        commands in prop::collection::vec((any_command(), 0_u64..200), 1..60),
        noise in prop::collection::vec(any::<u8>(), 0..40),
    ) {
        let mut host = Host::with(ShaftSetup::default());
        for (command, ms) in commands {
            host.octets(&[&[UNIT], command.as_slice()].concat());
            host.hear(MS(ms / 10));
            host.wait(MS(ms));
        }
        host.octets(&noise);
        host.bus.on_break(host.now);
        host.wait(MS(50));
        for motor in &host.unit().motors {
            let executed = motor.shaft.executed();
            prop_assert!(executed.lowest >= -10.0 * MM && executed.highest <= 155.0 * MM, "{:?}", executed);
            prop_assert!(executed.lost.is_finite() && executed.jerk.is_finite(), "{:?}", executed);
        }
    }
}
