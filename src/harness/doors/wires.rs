//! What controllers and drives send.

use std::time::Duration;

use super::seen;
use crate::wire::silvermax::{AnyRequest, Collected, LineCollector, MAX_LINE, Reply};
use crate::wire::sixpack2::{CanFrame, FrameCollector, SixpackCommand, SixpackFrame};
use crate::wire::{FromController, ImaxMotion, ImaxRegisters, MAX_LEN, Message, MotionReply, VibrationPort};
use crate::wire::{RegisterReply, RegisterReport, Status, is_printed_imax};

/// What a controller may send is told apart at once as each reader of one message alone would tell.
pub(super) fn controller(octets: &[u8]) {
    seen(FromController::parse(VibrationPort::Four, octets));
    let told = FromController::parse(VibrationPort::Two, octets);
    let is_alone = match &told {
        FromController::Reply(reply) => MotionReply::parse(octets).as_ref() == Ok(reply),
        FromController::Registers(reply) => RegisterReply::parse(octets).as_ref() == Ok(reply),
        FromController::Status(status) => Status::parse(octets).as_ref() == Ok(status),
        FromController::Report(report) => RegisterReport::parse(octets).as_ref() == Ok(report),
        FromController::PrintedImax => is_printed_imax(octets),
        FromController::Other => {
            let all = [
                MotionReply::parse(octets).is_ok(),
                RegisterReply::parse(octets).is_ok(),
                Status::parse(octets).is_ok(),
                RegisterReport::parse(octets).is_ok(),
            ];
            all == [false; 4]
        }
    };
    assert!(is_alone, "{told:?}");
    if let Ok(reply) = ImaxRegisters::parse(octets) {
        seen(reply.values().count());
    }
    seen(ImaxMotion::parse(octets));
}

/// What is read is read again as it was from what is written of it.
pub(super) fn message(octets: &[u8]) {
    seen(Message::parse_as(VibrationPort::Four, octets));
    let Ok(message) = Message::parse(octets) else { return };
    let mut buf = [0xa5; MAX_LEN];
    assert_eq!(Message::parse(message.emit(&mut buf)), Ok(message));
}

pub(super) fn silvermax(octets: &[u8]) {
    let mut collector = LineCollector::of_both();
    for octet in octets {
        let Some(Collected::Line(line)) = collector.push(*octet) else { continue };
        seen(AnyRequest::parse(line));
        let Ok(reply) = Reply::parse(line) else { continue };
        let mut buf = [0xa5; MAX_LINE];
        let written = reply.emit(&mut buf);
        assert_eq!(Reply::parse(written.trim_ascii_end()), Ok(reply));
    }
}

/// The first octet of each ten is the silence before the others, ms.
pub(super) fn sixpack2(octets: &[u8]) {
    let mut collector = FrameCollector::new(Some(Duration::from_millis(100)));
    for piece in octets.chunks(10) {
        let Some((silence, frame)) = piece.split_first() else { return };
        let mut silence = Duration::from_millis((*silence).into());
        for octet in frame {
            if let Some(frame) = collector.push(*octet, std::mem::take(&mut silence)) {
                frame_stands(frame);
            }
        }
        assert!(collector.begun().len() < frame_len(), "no frame is longer");
    }
}

const fn frame_len() -> usize {
    crate::wire::sixpack2::FRAME_LEN
}

fn frame_stands(frame: SixpackFrame) {
    assert_eq!(SixpackFrame::from_octets(frame.octets()), frame);
    let by_can = SixpackFrame::try_from(CanFrame::from(frame));
    assert!(by_can == Ok(frame) || frame.address == 0, "{by_can:?}");
    let command = SixpackCommand::of(frame);
    assert_eq!(SixpackCommand::of(command.frame(frame.address)), command);
    command.tell(|name, value| seen((name, value)));
    seen(command.answered_by(frame));
}
