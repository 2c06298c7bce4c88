//! A recording without what its hall is known by: names of seats, addresses, and the stations by which frames and answers name controllers.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::chunk::{ChunkWriter, SentFrame, longest_frame};

use super::{AckChunk, AckRecord, Chunk, Contents, FrameKind, Judging, RecordedSeat};
use crate::motion::MAX_AXES;
use crate::net::Origin;
use crate::wire::{Code, FromController, MAX_LEN, MotionRequest, VibrationPort};

/// Where strangers are said to be: an address for documentation (RFC 5737).
const STRANGER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 9);

/// What stands for what the hall is known by.
#[derive(Debug)]
pub(super) struct Anonymous {
    seats: Vec<RecordedSeat>,
    judging: Option<Judging>,
    /// The stations that controllers were, and that they are said to be.
    stations: Vec<(Code, Code)>,
    addresses: Vec<Option<Ipv4Addr>>,
}

impl Anonymous {
    pub(super) fn of(contents: &Contents) -> Self {
        let mut judging = contents.judging();
        let made_up = |index: usize| [0, 0, octet(64 + index / 250), octet(1 + index % 250)];
        let old =
            |judging: &Judging, index: usize| Code(u16::from_be_bytes(judging.controllers[index].station));
        let all = 0..contents.seats.len();
        let stations = judging.iter().flat_map(|judging| {
            all.clone().map(move |index| (old(judging, index), Code::station(made_up(index))))
        });
        let stations = stations.collect();
        for (index, one) in judging.iter_mut().flat_map(|judging| &mut judging.controllers).enumerate() {
            let [_, _, column, row] = made_up(index);
            one.station = [column, row];
        }
        let address = |seat: &RecordedSeat| {
            let address: SocketAddrV4 = seat.address.as_deref()?.parse().ok()?;
            Some(*address.ip())
        };
        let addresses = contents.seats.iter().map(address).collect();
        let nameless = |(index, seat): (usize, &RecordedSeat)| seat.without_names(index);
        let seats = contents.seats.iter().enumerate().map(nameless).collect();
        Self { seats, judging, stations, addresses }
    }

    pub(super) fn seats(&self) -> &[RecordedSeat] {
        &self.seats
    }

    pub(super) const fn judging(&self) -> Option<&Judging> {
        self.judging.as_ref()
    }

    /// A tick with frames to nobody in particular; `None` where that is none.
    pub(super) fn tick(&self, chunk: &Chunk<'_>) -> Option<Vec<u8>> {
        let frames: Vec<(SentFrame<'_>, Vec<u8>)> =
            chunk.frames().map(|frame| (frame, self.frame(&frame))).collect();
        let room = frames.iter().map(|(_, datagram)| longest_frame(MAX_AXES, datagram.len())).sum();
        let mut writer = ChunkWriter::with_room(room);
        frames.iter().for_each(|(frame, datagram)| writer.frame(&SentFrame { datagram, ..*frame }));
        writer.close(&chunk.head, chunk.dropped).map(<[u8]>::to_vec)
    }

    fn frame(&self, frame: &SentFrame<'_>) -> Vec<u8> {
        let station = self.stations.get(frame.lane).map(|(_, made_up)| *made_up);
        let Some(FrameKind::Datagram(port)) = self.seats.get(frame.lane).map(|seat| seat.frames) else {
            return frame.datagram.to_vec();
        };
        // What is no frame of motion says nothing that anybody needs.
        let Ok(request) = MotionRequest::parse_as(port, frame.datagram) else { return Vec::new() };
        let accept = station.unwrap_or(Code::ALL);
        let reply = if request.reply == Code::NONE { Code::NONE } else { accept };
        MotionRequest { accept, reply, ..request }.emit_as(port, &mut [0; MAX_LEN]).to_vec()
    }

    /// A drain in which nobody is named.
    pub(super) fn drain(&self, chunk: &AckChunk<'_>) -> Vec<u8> {
        let mut octets = Vec::new();
        chunk.rewritten(&mut octets, |record, out| match *record {
            AckRecord::Heard(origin, at, heard) => {
                let (origin, heard) = self.heard(origin, heard);
                AckRecord::Heard(origin, at, &heard).write(out);
            }
            ref other => other.write(out),
        });
        octets
    }

    fn heard(&self, origin: Origin, heard: &[u8]) -> (Origin, Vec<u8>) {
        let (controller, origin) = match origin {
            Origin::Controller(controller) => (Some(controller), origin),
            Origin::Stranger(from) => {
                let known = self.addresses.iter().position(|address| *address == Some(*from.ip()));
                let address = |index: usize| Some(self.judging.as_ref()?.controllers.get(index)?.address());
                (known, Origin::Stranger(known.and_then(address).unwrap_or(STRANGER)))
            }
        };
        let mut octets = heard.to_vec();
        // A status report names its station in another place.
        let is_status = matches!(FromController::parse(VibrationPort::Two, heard), FromController::Status(_));
        let places: &[usize] = if is_status { &[6] } else { &[8, 10] };
        let stations = controller.and_then(|controller| self.stations.get(controller));
        for (old, made_up) in stations.map_or(self.stations.as_slice(), std::slice::from_ref) {
            for place in places {
                if let Some(code) =
                    octets.get_mut(*place..place + 2).filter(|code| **code == old.0.to_be_bytes())
                {
                    code.copy_from_slice(&made_up.0.to_be_bytes());
                }
            }
        }
        (origin, octets)
    }
}

fn octet(number: usize) -> u8 {
    u8::try_from(number).unwrap_or(u8::MAX)
}
