//! Who takes a broadcast: asked by one, a read that all controllers of a network answer and nobody else. What is broadcast as motion
//! reaches everybody that takes the code, so that without such a look, and once anybody else has answered anything that was sent so,
//! each controller gets its own frames. All are asked again once they are on the cue, and from time to time, in a show and at rest: a
//! permit is as old as its question.

use std::net::SocketAddrV4;
use std::sync::Arc;
use std::time::Duration;

use super::Watch;
use crate::health::{HealthInput, HealthState};
use crate::net::Delivery;
use crate::rt::broadcast::{Broadcast, Permit};
use crate::state::{PlayMode, State};
use crate::time::MonoTime;
use crate::tracker::Fate;
use crate::wire::{Access, FromController, MAX_LEN, ReadRequest, VibrationPort};

/// PA12 and PA13, by which a controller knows whether a code means it (SMC manual 2.2.1). Nobody here asks for these two alone otherwise.
const PARAMETERS: u16 = 1;
const COLUMN_AND_ROW: u16 = 0x12;
const BOTH: u16 = 2;
/// One look asks so often, so far apart: of somebody else each question or answer may be lost.
const QUESTIONS: u32 = 3;
const APART: Duration = Duration::from_millis(50);
/// How long answers are listened for from the first on: whoever is slow is to be heard as well.
const LISTEN: Duration = Duration::from_millis(300);
/// From one look to the next: of a network that waits for a permit, on the cue, and at rest.
const AGAIN: Duration = Duration::from_secs(1);
const ON_CUE: Duration = Duration::from_secs(4);
const AT_REST: Duration = Duration::from_secs(30);

/// How far the look at the network is.
#[derive(Debug)]
pub(super) struct BroadcastLook {
    /// When the last one ended, or was broken off.
    ended: Option<MonoTime>,
    /// The one that is under way: when it began, and how many questions were due, and have left.
    under_way: Option<(MonoTime, u32, u32)>,
    /// How often each of its lanes has answered, in their order there.
    answers: Vec<u32>,
}

impl BroadcastLook {
    /// One at that network, if there is one.
    pub(super) fn of(broadcast: Option<&Arc<Broadcast>>) -> Self {
        Self { ended: None, under_way: None, answers: vec![0; broadcast.map_or(0, |one| one.lanes.len())] }
    }

    /// Ends what is under way. What is still answered then is over before the next one.
    const fn end(&mut self, now: MonoTime) {
        self.under_way = None;
        self.ended = Some(now);
    }
}

/// Whether that is an answer to such a read.
fn is_answer(message: &FromController<'_>) -> bool {
    matches!(message, FromController::Registers(reply)
        if reply.access == Access::Read && reply.start == COLUMN_AND_ROW && reply.num == BOTH)
}

impl Watch {
    /// Looks who takes broadcasts, and takes the permit back where a controller does not take part.
    pub(super) fn mind_broadcast(&mut self, now: MonoTime) {
        let Some(one) = self.live.broadcast().cloned().filter(|one| !one.permit().is_final()) else { return };
        // Preflight counts every datagram, and takes answers for its own.
        let others_ask = self.is_hushed() || self.is_asked_otherwise();
        let is_out = |lane: &&usize| {
            let standing = self.stands(**lane);
            !matches!(standing, HealthState::Ok | HealthState::Degraded) || !self.takes_part(**lane)
        };
        let out = one.lanes.iter().find(is_out).copied();
        if let Some(lane) = out {
            one.set(Permit::Out(lane));
        }
        if out.is_some() || others_ask {
            self.broadcast_look.end(now);
        } else {
            self.look_at(&one, now);
        }
    }

    fn look_at(&mut self, one: &Broadcast, now: MonoTime) {
        let every = match (self.live.state(), one.permit()) {
            (State::Playing(PlayMode::Following), Permit::Given) if !one.is_stale() => ON_CUE,
            (State::Playing(PlayMode::Following), _) | (_, Permit::Unasked | Permit::Out(_)) => AGAIN,
            _ => AT_REST,
        };
        let look = &mut self.broadcast_look;
        match look.under_way {
            None if look.ended.is_none_or(|ended| now.since(ended) >= every) => {
                look.answers.fill(0);
                look.under_way = Some((now, 0, 0));
            }
            None => return,
            Some((began, _, asked)) if now.since(began) >= LISTEN => {
                look.end(now);
                let silent = one.lanes.iter().zip(&look.answers).find(|(_, answers)| **answers == 0);
                match silent {
                    // Too few for anybody else to be heard.
                    _ if asked < QUESTIONS => {}
                    Some((lane, _)) => one.set(Permit::Silent(*lane)),
                    None => one.give(began),
                }
                return;
            }
            Some(_) => {}
        }
        self.ask_all(one, now);
    }

    /// Asks the next question of the look that is under way, if it is due.
    fn ask_all(&mut self, one: &Broadcast, now: MonoTime) {
        let Some((began, due, asked)) = &mut self.broadcast_look.under_way else { return };
        if *due >= QUESTIONS || now.since(*began) < *due * APART {
            return;
        }
        *due += 1;
        let (accept, reply) = (one.code, one.code);
        let read = ReadRequest { channel: PARAMETERS, accept, reply, start: COLUMN_AND_ROW, num: BOTH };
        if let Delivery::Failed(_) = self.sender.send_to_all(read.emit(&mut [0; MAX_LEN])) {
            return;
        }
        *asked += 1;
        one.lanes.iter().for_each(|lane| self.judge(HealthInput::OtherSent(*lane, 1)));
    }

    /// Hears a message of a controller that is no reply to a frame; says whether it answers a look.
    pub(in super::super) fn hear_look(&mut self, controller: usize, message: &FromController<'_>) -> bool {
        let Some(one) = self.live.broadcast() else { return false };
        if !is_answer(message) || self.is_asked_otherwise() {
            return false;
        }
        let Some(place) = one.lanes.iter().position(|lane| *lane == controller) else {
            one.set(Permit::Foreign(controller));
            return true;
        };
        let BroadcastLook { under_way, answers, .. } = &mut self.broadcast_look;
        if let Some((_, _, asked)) = *under_way {
            answers[place] += 1;
            if answers[place] > asked {
                one.set(Permit::Twice(controller));
            }
        }
        true
    }

    /// Hears what somebody sent who is no controller of the hall: whoever answers frames, or a look, takes what is broadcast.
    pub(in super::super) fn hear_stranger(&self, from: SocketAddrV4, octets: &[u8]) {
        let Some(one) = self.live.broadcast() else { return };
        let message = FromController::parse(VibrationPort::Two, octets);
        // What the IMAX manual prints is sent by nobody whom this hall plays.
        if matches!(message, FromController::Reply(_) | FromController::PrintedImax) || is_answer(&message) {
            one.set(Permit::Stranger(from));
        }
    }

    /// A controller answered a frame that it was not sent, or one frame twice: one that is not in the network may have taken its frames, and
    /// where one of it answers twice there may be two.
    pub(in super::super) fn mind_foreign(&self, controller: usize, fate: Fate) {
        let Some(one) = self.live.broadcast().filter(|one| one.permit() == Permit::Given) else { return };
        let found = match fate {
            // What drives confirm came by their link, and nothing broadcast does.
            _ if self.wants(controller).is_some() => return,
            _ if !one.has(controller) => Permit::Foreign(controller),
            Fate::Duplicate => Permit::Twice(controller),
            _ => return,
        };
        one.set(found);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use rtrb::RingBuffer;

    use super::*;
    use crate::config::{LossPolicy, load};
    use crate::cue::{Source, read};
    use crate::drive::{Manner, lanes};
    use crate::health::{Groups, HealthTable};
    use crate::net::Ports;
    use crate::rt::Live;
    use crate::timeline::Timeline;
    use crate::wire::{RegisterReply, ReplyCode, Words};

    /// A1 and A2 get one datagram together, B1 is in another network, and D1 on a link.
    const HALL: &str = "[link.stalls]\nport = \"/dev/ttyUSB0\"\n[broadcast.row_a]\nalone = true\nnetwork = \"127.0.0.0/24\"\n\
        [seat.s]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 10000\n\
        max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n\
        [seat.d]\naxes = 3\nstroke_mm = 150\nlead_mm = 5\npulses_per_rev = 4000\n\
        max_velocity_mm_s = 240\nmax_acceleration_mm_s2 = 3000\nmax_jerk_mm_s3 = 60000\n[seat.d.drive]\n\
        home = { way = \"switch\", input = 1, toward = \"down\", travel_mm = 165, zero_mm = -2, speed_mm_s = 50 }\n\
        torque = { hold = \"60%\", move = 1.0, full = 20000 }\n\
        [[controller]]\nname = \"A1\"\nseat = \"s\"\naddress = \"127.0.0.1:9\"\n\
        [[controller]]\nname = \"A2\"\nseat = \"s\"\naddress = \"127.0.0.2:9\"\n\
        [[controller]]\nname = \"B1\"\nseat = \"s\"\naddress = \"127.0.1.1:9\"\n\
        [[controller]]\nname = \"D1\"\nseat = \"d\"\naddress = \"link:stalls\"\ndialect = \"silvermax\"\nunits = [16, 17, 18]\n";

    /// The watch over that hall, which permits one datagram, and its network.
    fn watch() -> (Watch, Arc<Broadcast>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hall.toml");
        std::fs::write(&path, HALL).unwrap();
        let config = load(&path).unwrap();
        let cue = read(Path::new("a.csv"), &b"time_ms,a1\n0,0\n1000,0.1\n"[..], &Source::Native).unwrap();
        let lanes = lanes(&config, &Timeline::new(cue), Manner { level: 1.0, silent: false });
        let peers: Vec<_> = config.stations().iter().map(|one| one.connection.address).collect();
        let (sender, _) = Ports::open("127.0.0.1:0".parse().unwrap(), &peers).unwrap().split();
        let (alarms, _) = RingBuffer::new(2);
        let groups = Groups::of(&config.controllers);
        let health = HealthTable::new(groups, LossPolicy::Continue, 1, Duration::from_millis(10));
        let live = Arc::new(Live::new(lanes.len()).with_broadcast(Broadcast::of(&config, false)));
        let one = Arc::clone(live.broadcast().unwrap());
        one.give(MonoTime::from_nanos(1));
        (Watch::new(health, &config.controllers, &lanes, sender, alarms, live), one)
    }

    fn answer(num: u16) -> FromController<'static> {
        let (access, code, channel, error) = (Access::Read, ReplyCode::Running, PARAMETERS, 0);
        let data = Words::from(&[0, 1][..]);
        FromController::Registers(RegisterReply {
            access,
            code,
            channel,
            error,
            start: COLUMN_AND_ROW,
            num,
            data,
        })
    }

    #[test]
    fn a_controller_of_the_hall_that_is_not_in_the_network_and_answers_ends_it_and_is_named() {
        const B1: usize = 2;
        for how in 0..4 {
            let (mut watch, one) = watch();
            match how {
                0 => assert!(watch.hear_look(B1, &answer(BOTH))),
                1 => watch.mind_foreign(B1, Fate::Duplicate),
                2 => watch.mind_foreign(B1, Fate::Stray),
                // Something else that it was asked, and what its own frame may come to.
                _ => {
                    assert!(!watch.hear_look(B1, &answer(1)));
                    watch.mind_foreign(0, Fate::Stray);
                    assert_eq!(one.permit(), Permit::Given);
                    continue;
                }
            }
            assert_eq!(one.permit(), Permit::Foreign(B1), "{how}");
            one.give(MonoTime::from_nanos(2));
            let words = one.permit().words(|lane| format!("lane {lane}")).unwrap();
            assert_eq!(words, "lane 2 is not of this network, and answers its broadcasts");
            assert!(one.permit().remedy().is_some_and(|remedy| remedy.contains("PA12, PA13")));
        }
    }

    #[test]
    fn a_seat_on_a_link_is_reached_by_no_broadcast_whatever_it_confirms() {
        let (watch, one) = watch();
        for fate in [Fate::Stray, Fate::Duplicate] {
            watch.mind_foreign(3, fate);
            assert_eq!(one.permit(), Permit::Given, "{fate:?}");
        }
    }

    #[test]
    fn somebody_who_answers_a_question_with_registers_of_32_bits_is_a_stranger_as_well() {
        let from = "127.0.0.9:9".parse().unwrap();
        let words: [&[u16]; 3] = [&[0, 9], &[0, 0, 0, 9], &[9]];
        for (words, is_answer) in words.into_iter().zip([true, true, false]) {
            let (watch, one) = watch();
            let num = if is_answer { 2 } else { 1 };
            let mut octets = vec![0x55, 0xaa, 0, 0, 0x11, 2, 0, 1, 0, 0, 0, 0, 0, 0x12, 0, num];
            octets.extend(words.iter().flat_map(|word| word.to_be_bytes()));
            watch.hear_stranger(from, &octets);
            let found = if is_answer { Permit::Stranger(from) } else { Permit::Given };
            assert_eq!(one.permit(), found, "{words:?}");
        }
    }
}
