//! What the ack thread took in half a second, as columns. Replies and their fates, which are nearly all of it, are a column for each number
//! of each controller; in which order they came is told in runs over controllers that follow one another. All else stands octet by octet.

use prost::Message as _;

use super::columns::{Column, ColumnReaders, ColumnSet};
use super::{AckChunk, AckRecord};
use crate::time::MonoTime;
use crate::tracker::{Fate, Reply};
use crate::wire::{FrameNo, ReplyCode};

/// Records of a message at the most: five seconds of the largest hall. More are damage.
const MOST: usize = 1_000_000;
/// Controllers at the most.
const CONTROLLERS: usize = 4_096;
const NS: u64 = 1_000;

/// What the ack thread took in half a second: `kinocue.Acks`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Acks {
    /// What comes one after the other: what it is (0 replies, 1 fates, 2 another record, 3 the end of a chunk), of which controller
    /// the first is, how many there are, each of the next controller.
    #[prost(message, repeated, tag = "1")]
    runs: Vec<Column>,
    /// How many runs.
    #[prost(uint32, tag = "2")]
    count: u32,
    /// Of each chunk: records dropped before it, 1 where a drain is over with it, and when that began, ns.
    #[prost(message, repeated, tag = "3")]
    chunks: Vec<Column>,
    /// Controllers that replied.
    #[prost(message, repeated, tag = "4")]
    controllers: Vec<ReplyColumns>,
    /// Other records, one behind the other.
    #[prost(bytes = "vec", tag = "5")]
    others: Vec<u8>,
}

/// The replies of a controller: `kinocue.Replies`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct ReplyColumns {
    /// Its place among the seats of the metadata.
    #[prost(uint32, tag = "1")]
    controller: u32,
    /// Of each reply: frame, code, error, inputs, and when it was received, µs.
    #[prost(message, repeated, tag = "2")]
    replies: Vec<Column>,
    /// Of each fate: frame; the code of an answer, else 16 for a duplicate, 17 for a stale and 18 for a stray reply; and when its frame left, µs: when the last
    /// reply was received, less the latency.
    #[prost(message, repeated, tag = "3")]
    fates: Vec<Column>,
}

/// Kinds of runs.
const REPLY: i64 = 0;
const FATE: i64 = 1;
const OTHER: i64 = 2;
const END: i64 = 3;

const FATES: [Fate; 3] = [Fate::Duplicate, Fate::Stale, Fate::Stray];

/// What a controller replied, on its way.
#[derive(Debug, Default)]
struct ReplyWriter {
    replies: ColumnSet,
    fates: ColumnSet,
    /// How many there are of each.
    counts: [usize; 2],
    /// When the last reply was received, µs.
    at_us: i64,
}

impl ReplyWriter {
    /// What it came to, where it came to anything. The next begins anew, in the same memory.
    fn take(&mut self, controller: usize) -> Option<ReplyColumns> {
        self.at_us = 0;
        (std::mem::take(&mut self.counts) != [0; 2]).then(|| ReplyColumns {
            controller: u32::try_from(controller).unwrap_or(u32::MAX),
            replies: self.replies.take(),
            fates: self.fates.take(),
        })
    }
}

/// Packs drains. Its memory is used again for the next.
#[derive(Debug, Default)]
pub(super) struct AckPacker(Vec<ReplyWriter>);

impl AckPacker {
    /// Drains, as they crossed, as a message.
    pub(super) fn pack(&mut self, drains: &[u8]) -> Vec<u8> {
        let mut runs = Vec::<[i64; 3]>::new();
        let (mut chunks, mut ends) = (ColumnSet::default(), 0);
        let (mut others, mut rest) = (Vec::new(), drains);
        while let Some((chunk, behind)) = AckChunk::parse(rest) {
            rest = behind;
            for record in chunk.records() {
                let (kind, controller) = take(&record, &mut self.0, &mut others);
                match runs.last_mut() {
                    // Others are of no controller.
                    Some([last, first, count])
                        if *last == kind && (kind == OTHER || *first + *count == controller) =>
                    {
                        *count += 1;
                    }
                    _ => runs.push([kind, controller, 1]),
                }
            }
            let began = chunk.drained.unwrap_or_default().as_nanos().cast_signed();
            chunks.push(ends, &[chunk.dropped.into(), chunk.drained.is_some().into(), began]);
            ends += 1;
            runs.push([END, 0, 1]);
        }
        let controllers = self.0.iter_mut().enumerate().filter_map(|(place, writer)| writer.take(place));
        let controllers = controllers.collect();
        let count = u32::try_from(runs.len()).unwrap_or(u32::MAX);
        let mut columns = ColumnSet::default();
        runs.into_iter().enumerate().for_each(|(row, run)| columns.push(row, &run));
        Acks { runs: columns.take(), count, chunks: chunks.take(), controllers, others }.encode_to_vec()
    }
}

/// Puts a record where it belongs; gives its kind and its controller.
fn take(record: &AckRecord<'_>, writers: &mut Vec<ReplyWriter>, others: &mut Vec<u8>) -> (i64, i64) {
    let controller = match record {
        AckRecord::Reply(reply) if reply.at == reply.at.whole_micros() => Some(reply.controller),
        AckRecord::Fate(controller, _, _, latency) if u64::from(*latency).is_multiple_of(NS) => {
            Some(*controller)
        }
        _ => None,
    };
    let Some(controller) = controller.filter(|controller| *controller < CONTROLLERS) else {
        record.write(others);
        return (OTHER, 0);
    };
    if writers.len() <= controller {
        writers.resize_with(controller + 1, ReplyWriter::default);
    }
    let ReplyWriter { replies, fates, counts: [replied, fated], at_us } = &mut writers[controller];
    let kind = match *record {
        AckRecord::Reply(Reply { frame, code, error, inputs, at, .. }) => {
            *at_us = (at.as_nanos() / NS).cast_signed();
            replies.push(*replied, &[frame.0.into(), code as i64, error.into(), inputs.into(), *at_us]);
            *replied += 1;
            REPLY
        }
        AckRecord::Fate(_, frame, fate, latency) => {
            let left_us = at_us.wrapping_sub(i64::from(latency) / NS.cast_signed());
            fates.push(*fated, &[frame.0.into(), number(fate), left_us]);
            *fated += 1;
            FATE
        }
        _ => OTHER,
    };
    (kind, i64::try_from(controller).unwrap_or_default())
}

fn number(fate: Fate) -> i64 {
    match fate {
        Fate::Answered(code) => code as i64,
        Fate::Duplicate => 16,
        Fate::Stale => 17,
        Fate::Stray => 18,
    }
}

/// The replies of a controller as they are read.
struct ReplyReader<'a> {
    controller: i64,
    replies: ColumnReaders<'a>,
    fates: ColumnReaders<'a>,
    /// When the last reply was received, µs.
    at_us: i64,
}

/// The drains of a message, as they crossed; `None` where it is none.
pub(super) fn unpacked(message: &[u8]) -> Option<Vec<u8>> {
    let acks = Acks::decode(message).ok()?;
    let (mut runs, mut chunks) = (ColumnReaders::new(&acks.runs), ColumnReaders::new(&acks.chunks));
    let mut controllers: Vec<ReplyReader<'_>> = acks.controllers.iter().map(ReplyReader::new).collect();
    controllers.sort_by_key(|one| one.controller);
    let (mut others, mut left) = (acks.others.as_slice(), MOST);
    let (mut drains, mut records) = (Vec::new(), Vec::new());
    for _ in 0..acks.count {
        let [kind, first, count] = runs.next();
        let count = usize::try_from(count).ok().filter(|count| *count <= left)?;
        left = left.checked_sub(count.max(1))?;
        if kind == END {
            let [dropped, is_over, began] = chunks.next();
            let began = MonoTime::from_nanos(began.cast_unsigned());
            AckChunk::write(
                &mut drains,
                u32::try_from(dropped).ok()?,
                (is_over != 0).then_some(began),
                &records,
            );
            records.clear();
            continue;
        }
        for step in 0..count {
            let controller = first.checked_add(i64::try_from(step).ok()?)?;
            records.push(match kind {
                OTHER => AckRecord::first_of(&mut others)?,
                REPLY | FATE => {
                    let place = controllers.binary_search_by_key(&controller, |one| one.controller).ok()?;
                    controllers[place].next(kind)?
                }
                _ => return None,
            });
        }
    }
    Some(drains)
}

impl<'a> ReplyReader<'a> {
    fn new(columns: &'a ReplyColumns) -> Self {
        let [replies, fates] = [&columns.replies, &columns.fates].map(|one| ColumnReaders::new(one));
        Self { controller: columns.controller.into(), replies, fates, at_us: 0 }
    }

    fn next(&mut self, kind: i64) -> Option<AckRecord<'static>> {
        let controller = usize::try_from(self.controller).ok()?;
        if kind == FATE {
            let [frame, fate, left_us] = self.fates.next();
            let fate = match u8::try_from(fate).ok()? {
                other @ 16.. => *FATES.get(usize::from(other - 16))?,
                code => Fate::Answered(ReplyCode::from_byte(code)?),
            };
            let latency = u32::try_from(self.at_us.wrapping_sub(left_us)).ok()?;
            let latency = latency.checked_mul(u32::try_from(NS).ok()?)?;
            return Some(AckRecord::Fate(controller, FrameNo(u32::try_from(frame).ok()?), fate, latency));
        }
        let [frame, code, error, inputs, at_us] = self.replies.next();
        self.at_us = at_us;
        Some(AckRecord::Reply(Reply {
            controller,
            frame: FrameNo(u32::try_from(frame).ok()?),
            code: ReplyCode::from_byte(u8::try_from(code).ok()?)?,
            error: u16::try_from(error).ok()?,
            inputs: u16::try_from(inputs).ok()?,
            at: MonoTime::from_nanos(u64::try_from(at_us).ok()?.checked_mul(NS)?),
        }))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::health::HealthState;
    use crate::net::Origin;
    use crate::record::ack_tap;
    use crate::time::Rate;

    fn record() -> impl Strategy<Value = AckRecord<'static>> {
        let code = prop_oneof![Just(ReplyCode::Running), Just(ReplyCode::EmergencyStop)];
        let at = any::<u64>().prop_map(|ns| MonoTime::from_nanos(ns >> 1));
        let whole = at.clone().prop_map(MonoTime::whole_micros);
        let fate = prop_oneof![code.clone().prop_map(Fate::Answered), Just(Fate::Stale), Just(Fate::Stray)];
        prop_oneof![
            (0..6_usize, any::<u32>(), code, any::<u16>(), prop_oneof![9 => whole, 1 => at.clone()])
                .prop_map(|(controller, frame, code, error, at)| {
                    let frame = FrameNo(frame);
                    AckRecord::Reply(Reply { controller, frame, code, error, inputs: error / 2, at })
                }),
            (
                0..6_usize,
                any::<u32>(),
                fate,
                prop_oneof![(0..1_000_u32).prop_map(|us| us * 1_000), any::<u32>()]
            )
                .prop_map(|(controller, frame, fate, ns)| AckRecord::Fate(
                    controller,
                    FrameNo(frame),
                    fate,
                    ns
                )),
            (any::<u32>(), 0..6_usize).prop_map(|(count, lane)| AckRecord::Posted(
                count,
                lane,
                FrameNo(count)
            )),
            at.prop_map(|at| AckRecord::Heard(Origin::Controller(1), at, b"who is there")),
            Just(AckRecord::Standing(3, HealthState::Lost)),
        ]
    }

    fn crossed(drains: &[(u64, Vec<AckRecord<'_>>)]) -> Vec<u8> {
        let (mut tap, mut ring) = ack_tap(6, Rate::from_hz(1_000.0));
        for (began, records) in drains {
            records.iter().for_each(|record| tap.take(record));
            tap.drained(MonoTime::from_nanos(*began));
        }
        let mut held = vec![0; ring.slots()];
        ring.pop_entire_slice(&mut held).expect("it is all there");
        held
    }

    proptest! {
        #[test]
        fn drains_come_back_from_columns_octet_by_octet(
            drains in prop::collection::vec((any::<u64>(), prop::collection::vec(record(), 0..20)), 0..12),
        ) {
            let (crossed, mut packer) = (crossed(&drains), AckPacker::default());
            for _ in 0..2 {
                let back = unpacked(&packer.pack(&crossed));
                prop_assert_eq!(back.as_ref(), Some(&crossed), "the memory of the last says nothing");
            }
        }

        #[test]
        fn no_message_panics(mut message in prop::collection::vec(any::<u8>(), 0..200), at in 0..600_usize, flip: u8) {
            unpacked(&message);
            let record = AckRecord::Fate(1, FrameNo(7), Fate::Stale, 1_000);
            message = AckPacker::default().pack(&crossed(&[(1, vec![record; 9]), (9, vec![record; 9])]));
            if let Some(octet) = message.get_mut(at) {
                *octet ^= flip;
            }
            unpacked(&message);
        }
    }

    #[test]
    fn where_all_replies_come_in_order_each_takes_a_byte_for_when_it_came_and_one_for_how_long_it_took() {
        let jitter = |number: u64| number * 7_919 % 41;
        let drain = |tick: u64| {
            let at = |controller: usize| (tick * 1_000 + 180 + jitter(tick + controller as u64)) * 1_000;
            let frame = FrameNo(u32::try_from(tick).expect("few"));
            let reply = |controller| {
                let (code, at) = (ReplyCode::Running, MonoTime::from_nanos(at(controller)));
                AckRecord::Reply(Reply { controller, frame, code, error: 0, inputs: 0, at })
            };
            let latency =
                |controller: usize| u32::try_from(jitter(tick + controller as u64)).expect("few") * 1_000;
            let fate = |controller| {
                AckRecord::Fate(
                    controller,
                    frame,
                    Fate::Answered(ReplyCode::Running),
                    150_000 + latency(controller),
                )
            };
            ((tick + 1) * 1_000_000 + tick, (0..6).map(reply).chain((0..6).map(fate)).collect())
        };
        let drains: Vec<_> = (0..500).map(drain).collect();
        let octets = AckPacker::default().pack(&crossed(&drains)).len();
        assert!(octets < 500 * 6 * 5 / 2 + 500 * 14, "{octets} for {} replies", 500 * 6);
    }
}
