//! What was played, on its way into a file: from the tick thread's taps to what viewers open.
//!
//! The tick thread copies what it asked for and what left, octet by octet, into a ring, one chunk a tick, all of it or nothing
//! ([`Tap`]). A thread behind the ring takes chunks apart ([`Chunk`]), folds them into samples ([`Sampled`]) and writes these as MCAP
//! ([`Recording`], `mcap.dev/spec`), where it is asked for with every tick as it was (`full`). It is told no time but that of the
//! ticks. [`read()`] reads such files back.

mod ack_columns;
mod ack_inputs;
mod ack_record;
mod ack_words;
mod acks;
mod anonymous;
mod block;
mod budget;
mod chunk;
mod columns;
mod compare;
mod cursor;
mod cut;
mod descriptors;
mod falls;
mod flight;
mod full;
mod incidents;
mod intake;
mod judging;
mod margins;
mod notes;
mod read;
mod reading;
#[cfg(test)]
mod reading_tests;
mod recorder;
mod recording;
mod recover;
#[cfg(test)]
mod recover_tests;
mod report;
mod sample_text;
mod sampled;
mod scene;
mod schemas;
mod seat;
mod summary;
mod tap;
#[cfg(test)]
mod tests;
mod waiting;

pub(crate) use ack_record::{AckRecord, latency_ns, standing_of};
pub(crate) use acks::{AckChunk, AckStanding};
pub use acks::{AckTap, ack_tap};
pub(crate) use budget::{AskBudget, TooOften};
pub(crate) use chunk::Chunk;
pub use chunk::{Asked, TickHead};
#[cfg(feature = "harness")]
pub(crate) use chunk::{Handed, SentFrame};
pub(crate) use compare::{Comparison, FilmTracks, Places, compare, tracks};
pub(crate) use cut::{CutError, CutManner, Piece, Stretch, cut, each_tick};
pub(crate) use falls::{Falls, FilmInstant, SeatFall};
pub(crate) use flight::{Entry, Flight, read as read_flight};
pub(crate) use incidents::{IncidentCause, IncidentStep, Incidents, Watchman};
pub(crate) use intake::{Counts, Intake, Taps};
pub(crate) use judging::{JudgedController, Judging};
pub(crate) use margins::{Margin, Margins, Quantity};
pub(crate) use notes::{
    ActionNote, EventNote, HallNote, LogNote, MarkNote, Note, TimecodeNote, note_in_words,
};
pub(crate) use read::{Contents, ReadError, Told, Wanted, WantedFull, WantedSamples, beginning};
pub(crate) use reading::{read, read_ahead};
pub(crate) use recorder::Recorder;
pub(crate) use recording::{ACKS, About, EntryMaker, Mode, Opening, Recording, SAMPLE_HZ};
pub(crate) use recover::{RecoverError, Recovered, recover};
pub(crate) use report::{Closing, closing_of};
pub(crate) use sampled::{Message, Sampled, SeatSample, TickSample};
pub(crate) use schemas::state_number;
pub(crate) use seat::RecordedAxis;
pub use seat::{FrameKind, RecordedSeat};
pub(crate) use summary::{FilmPass, SeatTotals, Summary, each_chunk, state_word, summarize};
pub use tap::{Tap, tap};
pub(crate) use tap::{file_octets_a_second, octets_a_second};
#[cfg(test)]
pub(crate) use tests::{recorded_as, recorded_falling, recorded_filmed, recorded_measured, recorded_of};
