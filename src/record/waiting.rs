//! Messages on their way into a file, put into the order of their log times: a sample is told once its window is over, and what happened
//! meanwhile at once. Readers that go through a file as it is written then meet what was first, first.

use super::Entry;

/// What has to wait at the most, ns: more is written before its turn.
const LONGEST_NS: u64 = 1_000_000_000;

/// Messages that are not written yet. Their memory is used again.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    octets: Vec<u8>,
    messages: Vec<WaitingMessage>,
    /// Where the least and the greatest log time of these are, ns.
    span: Option<(u64, u64)>,
}

#[derive(Debug, Clone, Copy)]
struct WaitingMessage {
    log_time: u64,
    channel: u16,
    /// Where its octets are.
    from: usize,
    until: usize,
    /// It was held back before.
    is_held: bool,
}

impl Waiting {
    /// Takes the next.
    pub(super) fn put(&mut self, Entry { channel, log_time, data }: &Entry) {
        let from = self.octets.len();
        self.octets.extend_from_slice(data);
        self.add(WaitingMessage {
            log_time: *log_time,
            channel: *channel,
            from,
            until: self.octets.len(),
            is_held: false,
        });
    }

    fn add(&mut self, message: WaitingMessage) {
        let (least, most) = self.span.unwrap_or((message.log_time, message.log_time));
        self.span = Some((least.min(message.log_time), most.max(message.log_time)));
        self.messages.push(message);
    }

    /// True where they are of more than a second.
    pub(super) fn is_long(&self) -> bool {
        self.span.is_some_and(|(least, most)| most - least > LONGEST_NS)
    }

    /// Hands over those up to a log time in their order, each as channel, log time and octets; of one time those that came first. What
    /// is newer is held back, once.
    ///
    /// # Errors
    /// The first of `write`; what is left is lost then.
    pub(super) fn hand_over<E>(
        &mut self,
        until: u64,
        mut write: impl FnMut(u16, u64, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let (octets, mut messages) = (std::mem::take(&mut self.octets), std::mem::take(&mut self.messages));
        self.span = None;
        messages.sort_by_key(|message| message.log_time);
        let is_due = |message: &WaitingMessage| message.is_held || message.log_time <= until;
        for WaitingMessage { channel, log_time, from, until, .. } in messages.iter().filter(|one| is_due(one))
        {
            write(*channel, *log_time, &octets[*from..*until])?;
        }
        let (mut octets, mut kept) = (octets, Vec::new());
        for message in messages.iter().filter(|one| !is_due(one)) {
            let from = kept.len();
            kept.extend_from_slice(&octets[message.from..message.until]);
            self.add(WaitingMessage { from, until: kept.len(), is_held: true, ..*message });
        }
        octets.clear();
        octets.extend_from_slice(&kept);
        self.octets = octets;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(waiting: &mut Waiting, log_time: u64, data: &[u8]) {
        waiting.put(&Entry { channel: 1, log_time, data: data.to_vec() });
    }

    fn handed(waiting: &mut Waiting, until: u64) -> Vec<(u64, Vec<u8>)> {
        let mut all = Vec::new();
        let mut write = |_, log_time, data: &[u8]| {
            all.push((log_time, data.to_vec()));
            Ok::<(), ()>(())
        };
        waiting.hand_over(until, &mut write).unwrap();
        all
    }

    #[test]
    fn what_is_newer_waits_once_for_what_was_before_it() {
        let mut waiting = Waiting::default();
        for (log_time, data) in [(70, &b"note"[..]), (30, b"b"), (20, b"a"), (30, b"c")] {
            put(&mut waiting, log_time, data);
        }
        let first: Vec<(u64, Vec<u8>)> =
            [(20, "a"), (30, "b"), (30, "c")].map(|(at, one)| (at, one.into())).into();
        assert_eq!(handed(&mut waiting, 50), first);
        put(&mut waiting, 60, b"d");
        put(&mut waiting, 90, b"late");
        assert_eq!(
            handed(&mut waiting, 65),
            [(60, b"d".to_vec()), (70, b"note".to_vec())],
            "not longer than that"
        );
        assert_eq!(handed(&mut waiting, 65), [(90, b"late".to_vec())]);
        assert_eq!(handed(&mut waiting, u64::MAX), []);
    }

    #[test]
    fn more_than_a_second_is_long() {
        let mut waiting = Waiting::default();
        [5, LONGEST_NS + 5].iter().for_each(|at| put(&mut waiting, *at, b""));
        assert!(!waiting.is_long());
        put(&mut waiting, LONGEST_NS + 6, b"");
        assert!(waiting.is_long());
        handed(&mut waiting, u64::MAX);
        assert!(!waiting.is_long());
    }
}
