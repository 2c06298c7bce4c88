mod back;
mod chance;
mod latched;
mod mbox;

use super::*;
use crate::observe::What;
use crate::state::{Event, Latch, Trouble};
use crate::wire::DPFE;

const TICK: Duration = Duration::from_millis(10);
const IDENTITY: Identity = Identity { version: 3, minor_version: 1, work_mode: 2, axes: 3 };

/// Controllers that can be taken off the network, at 100 Hz, and what the health of their groups told.
struct Hall {
    health: HealthTable,
    now: MonoTime,
    frame: u32,
    /// How many datagrams each controller has received.
    packets: Vec<u16>,
    /// How late acks come; `None` if they do not.
    ack_after: Vec<Option<Duration>>,
    ack_every: u32,
    notices: Vec<(MonoTime, Notice)>,
    answers_reads: bool,
    homed: bool,
    /// True if they tell how many datagrams they received, as MBOX controllers do not.
    counts: bool,
    alarm: u16,
}

impl Hall {
    /// Three groups: two controllers under one seat, and two seats of one controller each.
    fn new(policy: LossPolicy) -> Self {
        Self::asking(policy, 1, TICK)
    }

    fn asking(policy: LossPolicy, ack_every: u32, period: Duration) -> Self {
        let groups = Groups::named(["A1", "A1", "A2", "A3"]);
        let now = MonoTime::default() + Duration::from_secs(100);
        let packets = vec![65_500, 9, 300, 7];
        let mut hall = Self {
            health: HealthTable::new(groups, policy, ack_every, period),
            now,
            frame: 0,
            packets,
            ack_after: vec![Some(Duration::from_millis(1)); 4],
            ack_every,
            notices: Vec::new(),
            answers_reads: true,
            homed: true,
            counts: true,
            alarm: 0,
        };
        if ack_every > 0 {
            hall.look();
            assert_eq!(hall.reads(), [0, 1, 2, 3], "the counters are read once");
            hall.notices.clear();
        }
        hall
    }

    fn look(&mut self) {
        let now = self.now;
        let mut new = Vec::new();
        self.health.tick(now, &mut |notice| new.push(notice));
        for notice in &new {
            match *notice {
                Notice::Read(controller) if self.answers_reads => self.read(controller),
                Notice::Count(controller) => self.count(controller),
                _ => {}
            }
        }
        new.retain(|notice| !matches!(notice, Notice::Count(_)));
        self.notices.extend(new.into_iter().map(|notice| (now, notice)));
    }

    /// Sends the read, which comes through and is answered where acks do and are.
    fn read(&mut self, controller: usize) {
        self.health.on_read_sent(controller, 1);
        if self.ack_after[controller].is_some() {
            self.packets[controller] = self.packets[controller].wrapping_add(1);
            let sighting = self.sighting(controller);
            self.health.on_counted(controller);
            self.health.on_sighting(controller, &sighting, self.now);
        }
    }

    /// Reads the packet counter alone.
    fn count(&mut self, controller: usize) {
        if self.ack_after[controller].is_some() {
            self.packets[controller] = self.packets[controller].wrapping_add(1);
            self.health.on_count(controller, self.packets[controller]);
        }
    }

    fn sighting(&self, controller: usize) -> Sighting {
        Sighting {
            identity: IDENTITY,
            error: 0,
            alarm: self.alarm,
            continuity: if self.counts {
                Continuity::Packets(self.packets[controller])
            } else {
                Continuity::Answers
            },
            homed: self.homed,
        }
    }

    fn tick(&mut self) {
        self.tick_after(TICK);
    }

    fn tick_after(&mut self, period: Duration) {
        self.now = self.now + period;
        self.frame += 1;
        let frame = FrameNo(self.frame);
        for controller in 0..4 {
            if !self.health.standing(self.health.groups().group_of(controller)).may_move() {
                continue;
            }
            let asks = frame.asks(self.ack_every);
            self.health.on_sent(controller, frame, asks, self.now);
            let Some(after) = self.ack_after[controller] else { continue };
            self.packets[controller] = self.packets[controller].wrapping_add(1);
            if asks {
                self.health.on_ack(controller, frame, self.now + after);
            }
        }
        self.look();
    }

    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    fn silence(&mut self, controllers: &[usize]) {
        controllers.iter().for_each(|&controller| self.ack_after[controller] = None);
    }

    fn standings(&self) -> [HealthState; 3] {
        [0, 1, 2].map(|group| self.health.standing(group))
    }

    fn reads(&self) -> Vec<usize> {
        let read = |(_, notice): &(MonoTime, Notice)| match notice {
            Notice::Read(controller) => Some(*controller),
            _ => None,
        };
        self.notices.iter().filter_map(read).collect()
    }

    fn changes(&self) -> Vec<(HealthState, Why)> {
        let change = |(_, notice): &(MonoTime, Notice)| match notice {
            Notice::Group(change) => Some((change.to, change.why)),
            _ => None,
        };
        self.notices.iter().filter_map(change).collect()
    }

    fn told_hall(&self) -> Vec<Event> {
        let event = |(_, notice): &(MonoTime, Notice)| match notice {
            Notice::Hall(event) => Some(*event),
            _ => None,
        };
        self.notices.iter().filter_map(event).collect()
    }

    fn observed(&mut self, controller: usize, what: What) {
        self.health.on_event(&observe::Event { controller, at: self.now, what });
    }

    /// Takes controller 2 off the network until its group is lost.
    fn with_lost() -> Self {
        let mut hall = Self::new(LossPolicy::Continue);
        hall.run(100);
        hall.silence(&[2]);
        hall.run(30);
        assert_eq!(hall.standings(), [HealthState::Ok, HealthState::Lost, HealthState::Ok]);
        hall.notices.clear();
        hall
    }

    /// Puts it back.
    fn back(&mut self) {
        self.ack_after[2] = Some(Duration::from_millis(1));
    }
}

#[test]
fn a_count_is_held_against_what_was_acked_when_it_came_however_late_the_rest_of_its_look() {
    for frames in [60, 200, 1_000] {
        let mut hall = Hall::asking(LossPolicy::Continue, 1, Duration::from_millis(1));
        (0..500).for_each(|_| hall.tick_after(Duration::from_millis(1)));
        hall.health.on_read_sent(2, 1);
        hall.packets[2] += 1;
        let sighting = hall.sighting(2);
        hall.health.on_counted(2);
        // A busy machine brings the rest so much later, and frames are acked meanwhile.
        for _ in 0..frames {
            hall.now = hall.now + Duration::from_millis(1);
            hall.frame += 1;
            hall.health.on_sent(2, FrameNo(hall.frame), true, hall.now);
            hall.packets[2] = hall.packets[2].wrapping_add(1);
            hall.health.on_ack(2, FrameNo(hall.frame), hall.now);
        }
        hall.health.on_sighting(2, &sighting, hall.now);
        hall.look();
        let group = hall.health.groups().group_of(2);
        assert!(hall.health.standing(group).may_move(), "{frames}: {:?}", hall.health.why(group));
        // Who has counted less than it acked has restarted all the same.
        hall.read(2);
        hall.packets[2] = 3;
        hall.read(2);
        hall.look();
        assert!(!hall.health.standing(group).may_move(), "{frames}");
    }
}

#[test]
fn another_master_in_mid_show_is_told_within_two_seconds() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(300);
    for _ in 0..200 {
        hall.packets[3] += 1; // somebody else's frame, at the same rate
        hall.tick();
    }
    assert_eq!(hall.told_hall()[0], Event::Trouble(Trouble::OtherMaster(3)));
    assert_eq!((hall.health.standing(2), hall.health.why(2)), (HealthState::Excluded, Why::OtherMaster(3)));
    assert_eq!(hall.standings()[..2], [HealthState::Ok; 2]);
}

const ESTOP: What = What::EmergencyStop { cause: observe::Cause::Reply };

#[test]
fn a_hall_that_acks_stands_well_and_says_nothing() {
    let mut hall = Hall::new(LossPolicy::Park);
    hall.run(1_000);
    assert_eq!(hall.standings(), [HealthState::Ok; 3]);
    assert_eq!(hall.notices, []);
}

#[test]
fn five_missing_acks_in_a_row_degrade_and_a_good_second_makes_well() {
    let mut hall = Hall::new(LossPolicy::Park);
    hall.run(100);
    hall.silence(&[2]);
    hall.run(4);
    hall.back();
    hall.run(20);
    assert_eq!(hall.standings(), [HealthState::Ok; 3], "four in a row, and four in a hundred");
    hall.silence(&[2]);
    hall.run(5);
    hall.back();
    hall.run(11);
    assert_eq!(hall.changes(), [(HealthState::Degraded, Why::AcksMissing(2))]);
    hall.run(98);
    assert_eq!(hall.health.standing(1), HealthState::Degraded);
    hall.run(10);
    assert_eq!(hall.changes()[1..], [(HealthState::Ok, Why::Acked)]);
    assert_eq!(hall.told_hall(), []);
}

#[test]
fn more_than_one_ack_in_ten_missing_in_a_second_degrades() {
    let standing = |one_in: u32| {
        let mut hall = Hall::new(LossPolicy::Continue);
        for tick in 0..300 {
            hall.ack_after[3] = (tick % one_in != 0).then_some(Duration::from_millis(1));
            hall.tick();
        }
        hall.health.standing(2)
    };
    assert_eq!((standing(11), standing(9)), (HealthState::Ok, HealthState::Degraded));
}

#[test]
fn acks_that_come_after_more_than_100_ms_are_missing_and_still_a_sign_of_life() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.ack_after[3] = Some(Duration::from_millis(99));
    hall.run(300);
    assert_eq!(hall.health.standing(2), HealthState::Ok);
    hall.ack_after[3] = Some(Duration::from_millis(600));
    hall.run(300);
    assert_eq!(hall.health.standing(2), HealthState::Degraded);
}

#[test]
fn a_controller_is_lost_after_250_ms_of_silence_give_or_take_a_period() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    let last_ack = hall.now + Duration::from_millis(1);
    hall.silence(&[3]);
    hall.run(40);
    let lost = hall.notices.iter().find_map(|(at, notice)| match notice {
        Notice::Group(Change { to: HealthState::Lost, why: Why::Silent(3), .. }) => Some(at.since(last_ack)),
        _ => None,
    });
    let lost = lost.unwrap();
    assert!(lost.abs_diff(Duration::from_millis(250)) <= TICK, "{lost:?}");
}

#[test]
fn at_a_low_rate_a_controller_is_lost_after_ten_frames_that_asked() {
    for (ack_every, period_ms, lost_after_ms) in [(1, 50, 500), (10, 10, 1_000), (4, 1, 250), (1, 1, 250)] {
        let period = Duration::from_millis(period_ms);
        let mut hall = Hall::asking(LossPolicy::Continue, ack_every, period);
        let every = u64::from(ack_every);
        (0..100 * every).for_each(|_| hall.tick_after(period));
        hall.silence(&[2]);
        let began = hall.now;
        while hall.health.standing(1) != HealthState::Lost {
            hall.tick_after(period);
            assert!(hall.now.since(began) < Duration::from_secs(5));
        }
        let (lost, slack) = (hall.now.since(began), u32::try_from(every).unwrap() * period + TICK);
        let expected = Duration::from_millis(lost_after_ms);
        assert!(lost.abs_diff(expected) <= slack, "{lost:?}, not {expected:?}");
    }
}

#[test]
fn hold_frames_at_ten_a_second_lose_nobody_by_their_slowness() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    (0..100).for_each(|_| hall.tick_after(Duration::from_millis(100)));
    assert_eq!(hall.changes(), []);
    hall.silence(&[2]);
    (0..12).for_each(|_| hall.tick_after(Duration::from_millis(100)));
    assert_eq!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn nine_hold_frames_without_an_ack_lose_nobody() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.silence(&[2]);
    (0..9).for_each(|_| hall.tick_after(Duration::from_millis(100)));
    assert_ne!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn what_was_unanswered_of_the_last_show_does_not_count_in_the_next() {
    let mut hall = Hall::asking(LossPolicy::Continue, 1, Duration::from_millis(1));
    hall.silence(&[2]);
    (0..9).for_each(|_| hall.tick_after(Duration::from_millis(1)));
    hall.tick_after(Duration::from_mins(1));
    (0..200).for_each(|_| hall.tick_after(Duration::from_millis(1)));
    assert_ne!(hall.health.standing(1), HealthState::Lost);
    (0..100).for_each(|_| hall.tick_after(Duration::from_millis(1)));
    assert_eq!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn a_process_that_slept_loses_nobody_who_answers_when_it_wakes() {
    let mut hall = Hall::new(LossPolicy::Park);
    for gap_ms in [300, 1_500, 60_000] {
        hall.run(100);
        hall.tick_after(Duration::from_millis(gap_ms));
    }
    hall.run(100);
    assert_eq!(hall.changes(), []);
}

#[test]
fn a_status_report_is_a_sign_of_life() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.silence(&[3]);
    for _ in 0..100 {
        hall.tick();
        hall.health.on_status(3, hall.now);
    }
    assert_eq!(hall.health.standing(2), HealthState::Degraded);
}

#[test]
fn a_report_of_long_ago_told_again_at_every_look_is_none() {
    let mut hall = Hall::new(LossPolicy::Continue);
    let reported_at = hall.now;
    hall.run(100);
    hall.silence(&[2]);
    for _ in 0..30 {
        hall.health.on_status(2, reported_at);
        hall.tick();
    }
    assert_eq!(hall.health.standing(1), HealthState::Lost);
}

#[test]
fn with_no_frames_on_their_way_a_controller_is_lost_that_answers_no_beat() {
    let mut hall = Hall::new(LossPolicy::Continue);
    let beats = |hall: &mut Hall, answered: bool| {
        for _ in 0..4 {
            for controller in 0..4 {
                hall.health.on_beat_sent(controller, hall.now);
                if answered || controller != 2 {
                    hall.health.on_status(controller, hall.now + Duration::from_millis(1));
                }
            }
            hall.now = hall.now + Duration::from_millis(250);
            hall.look();
        }
    };
    beats(&mut hall, true);
    assert_eq!(hall.standings(), [HealthState::Ok; 3]);
    hall.silence(&[2]);
    beats(&mut hall, false);
    assert_eq!(hall.standings(), [HealthState::Ok, HealthState::Lost, HealthState::Ok]);
}

#[test]
fn with_no_frames_on_their_way_a_controller_is_lost_to_which_no_beat_goes_out() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.silence(&[2]);
    for _ in 0..4 {
        for controller in 0..4 {
            if controller == 2 {
                hall.health.on_beat_kept(controller, hall.now);
            } else {
                hall.health.on_beat_sent(controller, hall.now);
                hall.health.on_status(controller, hall.now + Duration::from_millis(1));
            }
        }
        hall.now = hall.now + Duration::from_millis(250);
        hall.look();
    }
    assert_eq!(hall.standings(), [HealthState::Ok, HealthState::Lost, HealthState::Ok]);
}

#[test]
fn one_controller_lost_is_its_whole_seat_lost_and_nobody_elses() {
    let mut hall = Hall::new(LossPolicy::Continue);
    hall.run(100);
    hall.silence(&[1]);
    hall.run(40);
    assert_eq!(hall.standings(), [HealthState::Lost, HealthState::Ok, HealthState::Ok]);
    assert_eq!(hall.health.why(0), Why::Silent(1));
    let reads = hall.reads();
    assert!(reads.contains(&0) && reads.contains(&1) && !reads.contains(&2), "{reads:?}");
    hall.run(500);
    assert_eq!(
        hall.health.standing(0),
        HealthState::Lost,
        "the other controller of the seat is seen all the while"
    );
}

#[test]
fn the_hall_does_what_its_configuration_says() {
    for (policy, expected) in [
        (LossPolicy::Continue, vec![]),
        (LossPolicy::Pause, vec![Event::Policy(Demand::Pause, 1)]),
        (LossPolicy::Park, vec![Event::Policy(Demand::Park, 1)]),
    ] {
        let mut hall = Hall::new(policy);
        hall.run(100);
        hall.silence(&[2]);
        hall.run(200);
        assert_eq!(hall.told_hall(), expected, "once");
    }
}

#[test]
fn with_acks_off_nobody_is_watched_but_emergency_stops_still_stop() {
    let mut hall = Hall::asking(LossPolicy::Park, 0, TICK);
    hall.silence(&[0, 1, 2, 3]);
    hall.run(1_000);
    assert_eq!((hall.standings(), hall.notices.len()), ([HealthState::Unwatched; 3], 0));
    hall.observed(3, ESTOP);
    hall.look();
    assert_eq!(hall.health.standing(2), HealthState::Stopped);
    assert!(ACKS_OFF.starts_with("acks are off"));
}
