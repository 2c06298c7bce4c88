//! The ack thread: drains replies by a timer, never woken by one, and keeps the books of every frame.

use std::sync::Arc;
use std::time::Duration;

use hdrhistogram::Histogram;
use rtrb::Consumer;

use super::withdrawn::Withdrawn;
use super::{LinkNews, Live, Sent, TickReport, Watch};
use crate::drive::Incoming;
use crate::drive::link::StreamEvent;
use crate::health::Change;
use crate::net::{DrainGrid, Origin, Receiver};
use crate::observe::{FirstAnswer, Observer, Watched};
use crate::record::{AckRecord, AckStanding, AckTap, latency_ns};
use crate::time::{Clock, MonoTime};
use crate::tracker::{ACK_TIMEOUT, Books, Fate, Ledger, Reply, Tracker, histogram};
use crate::wire::{FrameNo, FromController, MotionReply, ReplyCode};

/// How often replies are looked for while no frames are sent.
const IDLE: Duration = Duration::from_millis(5);
/// A drain that is so much overdue says that this thread hangs: nobody hears of an emergency stop then.
const HANGS_AFTER: Duration = Duration::from_millis(100);
/// The same where every other program of the machine may hold it up.
const SHARED_HANGS_AFTER: Duration = Duration::from_millis(500);
/// How often the times so far are told to whoever looks.
const TELL: Duration = Duration::from_millis(100);

/// Everything that was counted.
#[derive(Debug)]
pub struct Accounts {
    /// The fate of every frame.
    pub books: Books,
    /// Lateness of every tick that sent, nanoseconds.
    pub lateness: Histogram<u64>,
    /// What the controllers said of themselves.
    pub observer: Observer,
    /// Datagrams from nobody we sent to.
    pub strangers: u64,
    /// How the groups stood otherwise than before; the first 1,000 times.
    pub(crate) changes: Vec<Change>,
    /// Controllers that were given up in the end.
    pub(crate) gone: Vec<usize>,
}

impl Accounts {
    /// Empty accounts of these controllers, of which a reply is asked for in each of `ack_every` frames.
    #[must_use]
    pub(crate) fn new(watched: Vec<Watched>, ack_every: u32) -> Self {
        Self {
            books: Books::new(Tracker::new(watched.len(), ack_every)),
            lateness: histogram(),
            observer: Observer::new(watched),
            strangers: 0,
            changes: Vec::new(),
            gone: Vec::new(),
        }
    }

    /// Closes the accounts at `at`: every frame meets its fate. `last` are the controllers' last frames, whose records
    /// may have found no room.
    pub fn close(&mut self, last: impl Iterator<Item = FrameNo>, at: MonoTime) {
        for (controller, frame) in last.enumerate() {
            self.books.tracker_mut().on_last(controller, frame, at);
        }
        self.books.finish(&mut |_: &mut Tracker| {});
    }
}

/// The receiving side of a play.
#[derive(Debug)]
pub struct AckLoop {
    receiver: Receiver,
    accounts: Accounts,
    sent: Consumer<Sent>,
    ticks: Consumer<TickReport>,
    /// The newest instant at which a frame was sent.
    last_sent: MonoTime,
    /// What links tell, and how many frames ask for a reply.
    links: Vec<LinkNews>,
    ack_every: u32,
    withdrawn: Withdrawn,
    /// Who judges how the controllers stand.
    watch: Option<Watch>,
    /// Whom to tell which frames were acked, and the times so far.
    live: Option<Arc<Live>>,
    /// Whom to give a copy of all that is taken.
    tap: Option<AckTap>,
    hangs_after: Duration,
}

impl AckLoop {
    /// A loop over the replies to what `sent` tells of; each of `ack_every` frames asks for one.
    #[must_use]
    pub fn new(
        receiver: Receiver,
        watched: Vec<Watched>,
        ack_every: u32,
        sent: Consumer<Sent>,
        ticks: Consumer<TickReport>,
    ) -> Self {
        Self {
            receiver,
            accounts: Accounts::new(watched, ack_every),
            sent,
            ticks,
            links: Vec::new(),
            ack_every,
            withdrawn: Withdrawn::default(),
            watch: None,
            last_sent: MonoTime::default(),
            live: None,
            tap: None,
            hangs_after: HANGS_AFTER,
        }
    }

    /// The same where frames were sent before: `firsts` are the numbers of the next.
    #[must_use]
    pub(crate) fn going_on(mut self, firsts: &[FrameNo], ack_every: u32) -> Self {
        self.accounts.books = Books::new(Tracker::starting_at(firsts, ack_every));
        self
    }

    /// The same that hears links as well, whose seats come behind those on the network.
    #[must_use]
    pub(crate) fn hearing(mut self, links: Vec<LinkNews>) -> Self {
        let on_links = links.iter().map(|link| link.controllers.len()).sum();
        self.accounts.observer.add(on_links);
        self.accounts.books.tracker_mut().set_on_links(on_links);
        Self { links, withdrawn: Withdrawn::of(on_links), ..self }
    }

    /// Tells `live` which frames were acked, and the times so far, again and again while it runs.
    pub fn tell(&mut self, live: Arc<Live>) {
        self.live = Some(live);
    }

    /// Has whatever is taken copied to `tap`.
    pub fn record(&mut self, tap: AckTap) {
        self.tap = Some(tap);
        if let Some(watch) = &mut self.watch {
            watch.keep_records();
        }
    }

    /// Its thread has no real-time service: a busy machine holds it up, as it does the tick thread.
    pub(crate) fn shares_the_machine(&mut self) {
        self.hangs_after = SHARED_HANGS_AFTER;
    }

    /// Has `watch` judge how the controllers stand.
    pub(crate) fn watched_by(&mut self, mut watch: Watch) {
        if self.tap.is_some() {
            watch.keep_records();
        }
        self.watch = Some(watch);
    }

    /// Drains until `done` says that no more frames come and the last of them has had its second; the accounts are still
    /// open then.
    pub fn run(mut self, clock: &impl Clock, drains: DrainGrid, done: impl Fn() -> bool) -> Accounts {
        let mut tell_at = clock.now() + TELL;
        loop {
            let over = done();
            let next = self.step(clock, drains, &mut tell_at);
            if over && clock.now().since(self.last_sent) > ACK_TIMEOUT {
                break;
            }
            clock.sleep_until(next);
        }
        self.tell_times();
        self.into_accounts()
    }

    /// Drains once, and tells what is new, or all where it is time to; gives when to drain next.
    pub fn step(&mut self, clock: &impl Clock, drains: DrainGrid, tell_at: &mut MonoTime) -> MonoTime {
        self.drain(&mut |_, _| false);
        if clock.now() >= *tell_at {
            self.tell_times();
            *tell_at = clock.now() + TELL;
        } else if self.watch.as_ref().is_some_and(Watch::is_untold) {
            self.tell_table();
        }
        let now = clock.now();
        let next = if self.is_idle() { now + IDLE } else { drains.next_after(now) };
        // Without a watch nobody would hear of an emergency stop anyway.
        if let (Some(live), true) = (&self.live, self.watch.is_some()) {
            live.expect_by(next + self.hangs_after);
        }
        next
    }

    /// Whether no frame is on its way: then there is no hurry, and what a slow grid has of drains is too few.
    fn is_idle(&self) -> bool {
        self.watch.as_ref().is_some_and(Watch::is_idle)
    }

    fn tell_times(&mut self) {
        if let Some(live) = &self.live {
            let Accounts { books, lateness, .. } = &self.accounts;
            live.on_times(lateness, books.tracker().latencies());
        }
        self.tell_table();
    }

    fn tell_table(&mut self) {
        if let (Some(watch), true) = (&mut self.watch, self.live.is_some()) {
            watch.tell_table(self.accounts.books.tracker(), &self.accounts.observer);
        }
    }

    /// Reads all that came: replies to frames go to the books, reports to the observer, `other` may take what else a
    /// controller sent, and what it does not take is stray.
    pub fn drain(&mut self, other: &mut dyn FnMut(usize, Incoming<'_>) -> bool) {
        let Self { receiver, accounts, sent, ticks, last_sent, watch, live, links, tap, withdrawn, .. } =
            self;
        let Accounts { books, lateness, observer, strangers, .. } = accounts;
        let began = receiver.drain(|origin, octets, at| {
            let controller = match origin {
                Origin::Controller(controller) => controller,
                Origin::Stranger(from) => {
                    copy(tap, &AckRecord::Heard(origin, at, octets));
                    watch.iter().for_each(|watch| watch.hear_stranger(from, octets));
                    *strangers += u64::from(!observer.hear_elsewhere(from, octets, at));
                    return;
                }
            };
            if let Some(live) = live {
                live.on_heard(controller);
            }
            let message = observer.read(controller, octets);
            if let FromController::Reply(reply) = message {
                observer.on_reply(controller, &reply, at);
                let MotionReply { frame, code, error, inputs, .. } = reply;
                let reply = Reply { controller, frame, code, error, inputs, at: at.whole_micros() };
                copy(tap, &AckRecord::Reply(reply));
                return books.on_reply(reply, &mut Records { sent, last_sent, watch, observer, live, tap });
            }
            // A count of datagrams is held against what was sent and acked until then: that must be in the books.
            if matches!(message, FromController::Registers(_)) {
                books.catch_up(&mut Records { sent, last_sent, watch, observer, live, tap });
            }
            copy(tap, &AckRecord::Heard(origin, at, octets));
            let is_report = observer.hear(controller, &message, at);
            let is_known = is_report
                || watch.as_mut().is_some_and(|watch| watch.hear_look(controller, &message))
                || watch.as_mut().is_some_and(|watch| {
                    // Another thread has a conversation of its own: it is handed what nobody here takes for a report.
                    let others_ask = watch.pass_on(controller, octets, at);
                    watch.hear(observer, controller, Incoming { message, at, others_ask })
                })
                || other(controller, Incoming { message, at, others_ask: false });
            copy_judged(tap, watch);
            if !is_known {
                books.tracker_mut().on_stray(controller);
            }
        });
        let mut records = Records { sent, last_sent, watch, observer, live, tap };
        links.iter_mut().for_each(|link| records.hear_link(books, link, withdrawn, self.ack_every, began));
        books.settle(began, &mut records);
        records.withdraw(books, withdrawn);
        if let Some(live) = live {
            live.on_told(began);
        }
        note_closed(receiver, books.tracker_mut(), watch.as_ref());
        while let Ok(report) = ticks.pop() {
            lateness.saturating_record(report.late_ns);
        }
        if let Some(watch) = watch {
            watch.look(observer, began);
        }
        copy_judged(tap, watch);
        if let Some(tap) = tap {
            tell_standings(tap, receiver, accounts, watch.as_ref());
            tap.drained(began);
        }
    }

    /// The accounts, still open, once nothing more is to be drained.
    #[must_use]
    pub fn into_accounts(self) -> Accounts {
        let (changes, gone) = self.watch.map(Watch::into_outcome).unwrap_or_default();
        Accounts { changes, gone, ..self.accounts }
    }
}

/// Copies to `tap` what has changed of how controllers stand.
fn tell_standings(tap: &mut AckTap, receiver: &Receiver, accounts: &Accounts, watch: Option<&Watch>) {
    let Accounts { books, observer, .. } = accounts;
    for (controller, state) in observer.states().iter().enumerate() {
        let is_station = controller < receiver.lanes();
        let standing = AckStanding {
            lost: books.tracker().counts(controller).lost,
            closed: if is_station { receiver.port_closed(controller) } else { 0 },
            measured: state.measured.map(|heard| (heard.at, heard.value)),
            standing: watch.map(|watch| watch.stands(controller)),
        };
        tap.stands(controller, standing);
    }
}

/// Notes how often ports were found closed so far.
fn note_closed(receiver: &Receiver, tracker: &mut Tracker, watch: Option<&Watch>) {
    for controller in 0..receiver.lanes() {
        let closed = receiver.port_closed(controller);
        tracker.on_port_closed(controller, closed);
        if let Some(watch) = watch {
            watch.on_closed(controller, closed);
        }
    }
}

/// What the tick thread told of its frames, and who wants to know what became of them.
struct Records<'a> {
    sent: &'a mut Consumer<Sent>,
    last_sent: &'a mut MonoTime,
    watch: &'a mut Option<Watch>,
    live: &'a Option<Arc<Live>>,
    observer: &'a mut Observer,
    tap: &'a mut Option<AckTap>,
}

impl Records<'_> {
    fn note_posted(&mut self, posted: &mut Option<(u32, usize, FrameNo)>) {
        if let Some((frames, lane, last)) = posted.take() {
            copy(self.tap, &AckRecord::Posted(frames, lane, last));
        }
    }

    /// Hears what a link tells of its controllers: the frames that it confirms count as acked by now.
    fn hear_link(
        &mut self,
        books: &mut Books,
        link: &mut LinkNews,
        withdrawn: &mut Withdrawn,
        ack_every: u32,
        now: MonoTime,
    ) {
        for (controller, event) in link.take() {
            // That a unit does not answer, its thread says.
            if let Some(live) = self.live.as_ref().filter(|_| !matches!(event, StreamEvent::Lost { .. })) {
                live.on_heard(controller);
            }
            match event {
                StreamEvent::Confirmed { first, last, .. } => {
                    copy(self.tap, &AckRecord::Confirmed(controller, first, last));
                    let next = |frame: &FrameNo| (frame.since(last) < 0).then(|| frame.next());
                    let asked = |frame: &FrameNo| frame.asks(ack_every);
                    for frame in std::iter::successors(Some(first), next).filter(asked) {
                        let code = ReplyCode::Running;
                        books.on_reply(Reply { controller, frame, code, error: 0, inputs: 0, at: now }, self);
                    }
                }
                StreamEvent::Withdrawn { first, last, .. } => withdrawn.take(controller, first, last),
                _ => {
                    if let Some(watch) = self.watch {
                        watch.hear_link(self.observer, controller, &event, now);
                    }
                }
            }
            copy_judged(self.tap, self.watch);
        }
    }

    /// What was withdrawn, once the books have the records of that.
    fn withdraw(&mut self, books: &mut Books, withdrawn: &mut Withdrawn) {
        for (controller, first, last) in withdrawn.drain() {
            copy(self.tap, &AckRecord::Withdrawn(controller, first, last));
            books.tracker_mut().withdraw(controller, first, last);
        }
    }
}

impl Ledger for Records<'_> {
    fn bring_up_to_date(&mut self, tracker: &mut Tracker) {
        let mut posted: Option<(u32, usize, FrameNo)> = None;
        while let Ok(sent) = self.sent.pop() {
            record(sent, tracker, self.last_sent);
            if let Some(watch) = self.watch {
                watch.on_sent(sent);
            }
            match copy_of(sent) {
                AckRecord::Posted(one, lane, frame) => {
                    posted = Some((one + posted.map_or(0, |(before, ..)| before), lane, frame));
                }
                record => {
                    self.note_posted(&mut posted);
                    copy(self.tap, &record);
                }
            }
        }
        self.note_posted(&mut posted);
    }

    fn on_early(&mut self, reply: &Reply) {
        // Nobody waits for a record that hardly ever comes while whoever is not meant moves.
        self.watch.iter().for_each(|watch| watch.mind_foreign(reply.controller, Fate::Stray));
    }

    fn on_fate(&mut self, reply: &Reply, fate: Fate, sent_at: Option<MonoTime>) {
        copy(self.tap, &AckRecord::Fate(reply.controller, reply.frame, fate, latency_ns(sent_at, reply.at)));
        if let Fate::Answered(code) = fate {
            let Reply { controller, frame, error, inputs, at, .. } = *reply;
            self.observer.on_answer(controller, &FirstAnswer { frame, code, error, inputs }, at);
        }
        // One that was refused leads nowhere.
        if let (Some(live), Fate::Answered(ReplyCode::Running)) = (self.live, fate)
            && let Some(evidence) = live.evidence(reply.controller)
        {
            evidence.on_ack(reply.frame);
        }
        if let Some(watch) = self.watch {
            watch.on_fate(reply, fate);
        }
        copy_judged(self.tap, self.watch);
    }
}

fn copy(tap: &mut Option<AckTap>, record: &AckRecord<'_>) {
    if let Some(tap) = tap {
        tap.take(record);
    }
}

/// Copies to `tap` what `watch` made of what it heard since.
fn copy_judged(tap: &mut Option<AckTap>, watch: &mut Option<Watch>) {
    if let (Some(tap), Some(watch)) = (tap, watch) {
        let lost = watch.take_records(&mut |record| tap.take(record));
        tap.lose(lost);
    }
}

/// A record of a lane as it is copied.
fn copy_of(sent: Sent) -> AckRecord<'static> {
    match sent {
        Sent::Posted { lane, frame, .. } => AckRecord::Posted(1, usize::from(lane), frame),
        Sent::Skipped { lane, next } => AckRecord::Skipped(usize::from(lane), next),
        Sent::Failed { lane, frame } => AckRecord::Failed(usize::from(lane), frame),
        Sent::Joined { lane } => AckRecord::Joined(usize::from(lane)),
        Sent::FellOut { lane, why, shakes } => AckRecord::FellOut(usize::from(lane), why, shakes),
        Sent::Unread { lane } => AckRecord::Unread(usize::from(lane)),
    }
}

fn record(sent: Sent, tracker: &mut Tracker, last_sent: &mut MonoTime) {
    match sent {
        Sent::Posted { lane, frame, asked, at, .. } => {
            tracker.on_sent(usize::from(lane), frame, asked, at);
            *last_sent = at.max(*last_sent);
        }
        Sent::Skipped { lane, next } => tracker.on_skipped(usize::from(lane), next),
        Sent::Failed { lane, frame } => tracker.on_send_failed(usize::from(lane), frame),
        Sent::Joined { .. } | Sent::FellOut { .. } | Sent::Unread { .. } => {}
    }
}
