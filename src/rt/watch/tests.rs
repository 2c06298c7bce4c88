use std::path::Path;

use rtrb::RingBuffer;

use super::*;
use crate::config::{LossPolicy, from_to_args};
use crate::cue::{Source, read};
use crate::drive::{Manner, lanes};
use crate::health::Groups;
use crate::net::Ports;
use crate::timeline::Timeline;

#[test]
fn no_alarm_is_dropped_where_the_tick_thread_has_no_room_and_all_come_in_their_order() {
    let cue = read(Path::new("a.csv"), &b"time_ms,a1\n0,0\n1000,0.1\n"[..], &Source::Native).unwrap();
    let config = from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
    let lanes = lanes(&config, &Timeline::new(cue), Manner { level: 1.0, silent: false });
    let (sender, _) =
        Ports::open("127.0.0.1:0".parse().unwrap(), &[config.controllers[0].address]).unwrap().split();
    let (producer, mut alarms) = RingBuffer::new(2);
    let health =
        HealthTable::new(Groups::of(&config.controllers), LossPolicy::Continue, 1, Duration::from_millis(10));
    let mut watch = Watch::new(health, &config.controllers, &lanes, sender, producer, Arc::default());
    let all: Vec<Alarm> = (0..7).map(Alarm::Leave).collect();
    all.iter().for_each(|alarm| watch.alarm(*alarm));
    let mut heard = Vec::new();
    while heard.len() < all.len() {
        watch.send_alarms();
        assert!(!alarms.is_empty(), "{heard:?}");
        heard.extend(std::iter::from_fn(|| alarms.pop().ok()));
    }
    assert_eq!(heard, all);
}
