//! A recording without what its hall, its cue and its day are known by: names, addresses, digests, times of the wall clock, the stations
//! by which frames and answers name controllers, and all in datagrams that nobody judges.

use std::net::{Ipv4Addr, SocketAddrV4};

use super::chunk::{ChunkWriter, SentFrame, longest_frame};

use super::{AckChunk, AckRecord, Chunk, Contents, FrameKind, JudgedController, Judging, RecordedSeat};
use crate::motion::MAX_AXES;
use crate::net::Origin;
use crate::wire::{
    Access, Code, DP_INPUTS, FromController, MAX_LEN, MotionRequest, RegisterReport, Status, VibrationPort,
    Words,
};

/// Where strangers are said to be: an address for documentation (RFC 5737).
const STRANGER: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(192, 0, 2, 1), 9);

/// What stands for what the hall is known by.
#[derive(Debug)]
pub(super) struct Anonymous {
    seats: Vec<RecordedSeat>,
    judging: Option<Judging>,
    /// The stations that controllers were; none where the file does not say.
    stations: Vec<Code>,
    addresses: Vec<Option<Ipv4Addr>>,
}

impl Anonymous {
    pub(super) fn of(contents: &Contents) -> Self {
        let mut judging = contents.judging();
        let controllers = || judging.iter().flat_map(|judging| &judging.controllers);
        let stations = controllers().map(|one| Code(u16::from_be_bytes(one.station))).collect();
        for (index, one) in judging.iter_mut().flat_map(|judging| &mut judging.controllers).enumerate() {
            one.station = made_up(index);
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
        let Some(FrameKind::Datagram(port)) = self.seats.get(frame.lane).map(|seat| seat.frames) else {
            return frame.datagram.to_vec();
        };
        // What is no frame of motion says nothing that anybody needs.
        let Ok(request) = MotionRequest::parse_as(port, frame.datagram) else { return Vec::new() };
        let accept = station(frame.lane);
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

    /// What the observer takes of a datagram: reports, and what a register tells of the inputs. All else may hold anything, such as
    /// addresses in registers, and is left empty.
    fn heard(&self, origin: Origin, heard: &[u8]) -> (Origin, Vec<u8>) {
        let port = match origin {
            Origin::Controller(index) => self.seats.get(index).map(|seat| seat.frames),
            Origin::Stranger(_) => None,
        };
        let port = if let Some(FrameKind::Datagram(port)) = port { port } else { VibrationPort::Two };
        let message = FromController::parse(port, heard);
        let told = if let FromController::Status(status) = message { Some(status.station) } else { None };
        let (index, origin) = match origin {
            Origin::Controller(index) => (index, origin),
            Origin::Stranger(from) => match self.reporter(*from.ip(), told) {
                Some((index, address)) => (index, Origin::Stranger(address)),
                None => return (Origin::Stranger(STRANGER), Vec::new()),
            },
        };
        let mut buf = [0; MAX_LEN];
        let octets: &[u8] = match message {
            FromController::Status(status) => {
                let is_own = self.stations.get(index) == Some(&status.station);
                let station = if is_own { station(index) } else { Code::NONE };
                Status { station, ..status }.emit(&mut buf)
            }
            FromController::Report(report) => {
                let (accept, reply) = (Code::NONE, Code::NONE);
                // Channel 0 is what the controller sees; its parameters have addresses in them.
                let data = if report.channel == 0 { report.data } else { Words::EMPTY };
                RegisterReport { accept, reply, data, ..report }.emit(&mut buf)
            }
            FromController::Registers(reply)
                if (reply.access, reply.channel, reply.start) == (Access::Read, 0, DP_INPUTS) =>
            {
                reply.emit(&mut buf)
            }
            _ => &[],
        };
        (origin, octets.to_vec())
    }

    /// Which controller sent a report from another port, and where it is said to be, by the rule of the observer.
    fn reporter(&self, from: Ipv4Addr, told: Option<Code>) -> Option<(usize, SocketAddrV4)> {
        let may_be = |index: &usize| {
            self.addresses[*index] == Some(from)
                && told.is_none_or(|told| self.stations.get(*index) == Some(&told))
        };
        let mut found = (0..self.addresses.len()).filter(may_be);
        let index = found.next().filter(|_| found.next().is_none())?;
        let address = self.judging()?.controllers.get(index).map(JudgedController::address)?;
        Some((index, address))
    }
}

/// The last two octets of the address that a controller is said to have.
fn made_up(index: usize) -> [u8; 2] {
    let octet = |number: usize| u8::try_from(number).unwrap_or(u8::MAX);
    [octet(64 + index / 250), octet(1 + index % 250)]
}

fn station(index: usize) -> Code {
    Code(u16::from_be_bytes(made_up(index)))
}

#[cfg(test)]
mod tests;
