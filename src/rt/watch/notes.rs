//! What the watch makes of all that it hears, kept until it is copied to whoever records. Room for it is made at the start.

use crate::health::HealthInput;
use crate::observe::Look;
use crate::record::AckRecord;
use crate::time::MonoTime;
use crate::wire::ReplyCode;

/// Notes of one controller between two copies, at the most.
const OF_EACH: usize = 24;

/// Notes, oldest first.
#[derive(Debug)]
pub(super) struct Notes {
    all: Vec<AckRecord<'static>>,
    /// What has to stand before the next note.
    mark: Option<AckRecord<'static>>,
    /// Notes that found no room.
    lost: u32,
}

impl Notes {
    pub(super) fn of(controllers: usize) -> Self {
        let mut all = Vec::with_capacity(OF_EACH * controllers + OF_EACH);
        all.push(AckRecord::Watched);
        Self { all, mark: None, lost: 0 }
    }

    /// The observer's events were passed on.
    pub(super) const fn on_events(&mut self) {
        self.mark = Some(AckRecord::Events);
    }

    /// All groups were judged.
    pub(super) const fn on_judged(&mut self) {
        self.mark = Some(AckRecord::Judged);
    }

    /// The look is over.
    pub(super) const fn end_look(&mut self) {
        self.mark = None;
    }

    pub(super) fn health(&mut self, input: HealthInput) {
        self.put(AckRecord::Health(input));
    }

    pub(super) fn code(&mut self, controller: usize, code: ReplyCode, at: MonoTime) {
        self.put(AckRecord::Code(controller, code, at));
    }

    pub(super) fn look(&mut self, controller: usize, look: Look, at: MonoTime) {
        self.put(AckRecord::Look(controller, look, at));
    }

    fn put(&mut self, note: AckRecord<'static>) {
        for note in self.mark.take().into_iter().chain([note]) {
            if self.all.len() < self.all.capacity() {
                self.all.push(note);
            } else {
                self.lost += 1;
            }
        }
    }

    /// Gives what there is, and how much was lost.
    pub(super) fn take(&mut self, give: &mut dyn FnMut(&AckRecord<'static>)) -> u32 {
        self.all.drain(..).for_each(|note| give(&note));
        std::mem::take(&mut self.lost)
    }
}
