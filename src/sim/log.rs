//! The logs of virtual controllers, in CSV: a row for each motion frame, with where the motors were when it came, and a
//! row for each move that the motors ran.

use std::fmt::Write as _;
use std::fs::File;
use std::io;
use std::net::SocketAddrV4;

use super::MotionSeen;
use super::outcome::Outcome;
use super::player::Executed;
use super::sheet::Sheet;
use crate::motion::Pulses;
use crate::time::MonoTime;

/// The logs that somebody wants.
#[derive(Debug)]
pub(super) struct Logs {
    /// What their times are counted from.
    start: MonoTime,
    frames: Option<Sheet>,
    moves: Option<Sheet>,
}

impl Logs {
    /// Logs that begin with their header rows; what was in the files is gone.
    pub(super) fn new(start: MonoTime, frames: Option<File>, moves: Option<File>) -> Self {
        let frame_columns = "time_s,controller,frame,function,time_ms,reply,outputs,extend";
        let move_columns = "time_s,controller,duration_ms";
        Self {
            start,
            frames: frames.map(|file| Sheet::new(file, frame_columns, ["commanded", "executed"])),
            moves: moves.map(|file| Sheet::new(file, move_columns, ["from", "to"])),
        }
    }

    /// True if frames are logged.
    pub(super) const fn want_frames(&self) -> bool {
        self.frames.is_some()
    }

    /// A motion frame, `answered` with its x or not, and where the motors were.
    pub(super) fn frame(
        &mut self,
        at: MonoTime,
        controller: SocketAddrV4,
        seen: &MotionSeen,
        answered: bool,
        executed: &[Pulses],
    ) {
        let Some(sheet) = &mut self.frames else { return };
        sheet.start_row(at.since(self.start), controller);
        let request = &seen.request;
        let (frame, function, time_ms) = (request.frame, request.function(), request.time_ms);
        let _ = write!(sheet.row, ",{frame},0x{function:04x},{time_ms},"); // writing to a String cannot fail
        if answered {
            let _ = write!(sheet.row, "{}", seen.code as u8);
        }
        let _ = write!(sheet.row, ",0x{:04x},0x{:08x}", request.outputs, request.extend);
        sheet.positions(&request.positions);
        sheet.positions(executed);
        sheet.end_row();
    }

    /// A move of the axes that work, which is over.
    pub(super) fn executed(&mut self, controller: SocketAddrV4, axes: usize, executed: &Executed) {
        let Some(sheet) = &mut self.moves else { return };
        let Executed { start, duration, from, to } = executed;
        sheet.start_row(start.since(self.start), controller);
        let _ = write!(sheet.row, ",{}.{:03}", duration.as_millis(), duration.subsec_micros() % 1_000);
        sheet.positions(&from[..axes]);
        sheet.positions(&to[..axes]);
        sheet.end_row();
    }

    /// Where the motors of a controller are at the end, and its outputs of both kinds.
    pub(super) fn rest(&mut self, at: MonoTime, end: &Outcome) {
        let Some(sheet) = &mut self.frames else { return };
        let Outcome { address, positions, outputs, extend, .. } = end;
        sheet.start_row(at.since(self.start), *address);
        let _ = write!(sheet.row, ",,,,,0x{outputs:04x},0x{extend:08x}");
        sheet.positions(&[]);
        let executed: Vec<Pulses> = positions.iter().copied().map(Pulses).collect();
        sheet.positions(&executed);
        sheet.end_row();
    }

    /// Writes what is still held back.
    ///
    /// # Errors
    /// The first failure there was in either.
    pub(super) fn close(self) -> io::Result<()> {
        let [frames, moves] = [self.frames, self.moves].map(|sheet| sheet.map_or(Ok(()), Sheet::close));
        frames.and(moves)
    }
}
