//! What crosses between the tick thread and the others: bounded, single-producer, never waited for.

use std::sync::Arc;
use std::thread::Thread;

use rtrb::{Consumer, PopError, Producer, RingBuffer};

use super::film::FilmStart;
use super::live::Live;
use super::timed::StartOff;
use crate::belief::Fall;
use crate::belief::LaneEvidence;
use crate::drive::Lane;
use crate::engine::{Engine, Unplanned};
use crate::plan::{Course, Planner, Request as PlanRequest, Scene};
use crate::state::{Cause, Event, Machine, Next, Refusal, State, Transition};
use crate::time::{MonoTime, Rate, ShowTime};
use crate::timeline::Timeline;
use crate::wire::FrameNo;

/// Seconds of ticks that the mailboxes to the ack thread hold.
const HELD_S: f64 = 2.0;
/// Places in the mailboxes to and from the planner.
const PLANS: usize = 8;
/// Commands that wait at the most: a person gives no more, and of a flood the rest is refused where it is given.
const COMMANDS: usize = 64;
/// News that waits at the most.
const NEWS: usize = 256;

/// What the tick thread says about one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sent {
    /// It is about to be sent.
    Posted {
        /// The controller.
        lane: u16,
        /// Its number.
        frame: FrameNo,
        /// Whether it asks for a reply.
        asked: bool,
        /// The instant before it is sent.
        at: MonoTime,
        /// It switches outputs on.
        lights: bool,
        /// The greatest amplitude of vibration that it asks for, strokes.
        shakes: f64,
    },
    /// The next frame of a lane has another number than the one after its last: none has those between.
    Skipped {
        /// The controller.
        lane: u16,
        /// The number of the next.
        next: FrameNo,
    },
    /// The kernel did not take it.
    Failed {
        /// The controller.
        lane: u16,
        /// Its number.
        frame: FrameNo,
    },
    /// A lane that was away is where the others are again.
    Joined {
        /// The controller.
        lane: u16,
    },
    /// Nothing goes to a lane any more, as it is not known where its seat is; it is to be looked at.
    FellOut {
        /// The controller.
        lane: u16,
        /// Why.
        why: Fall,
        /// The amplitude with which the seat may vibrate on, strokes.
        shakes: f64,
    },
    /// A seat was found, but not all of its axes tell where they are: it has to be homed.
    Unread {
        /// The controller.
        lane: u16,
    },
}

/// What the tick thread says about one tick that sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TickReport {
    /// The instant before its first send, minus its deadline, nanoseconds.
    pub late_ns: u64,
    /// Ticks slept through before it.
    pub(crate) missed: u64,
}

/// The planner's answer.
#[derive(Debug)]
pub enum Answer {
    /// The course that was asked for, and the scene that came with the request.
    Course(Box<Course>, Box<Scene>),
    /// There is none for the request of that serial.
    Refused(u32, Box<Scene>),
}

/// What a person asks for, once; what lasts stands on the [`super::Desk`].
#[derive(Debug)]
pub enum Command {
    /// Anything but to seek.
    Request(Transition),
    /// Go on at that time of the film.
    Seek(ShowTime),
    /// Something that the control plane has found out: the hall is ready, the seats are home.
    Event(Event),
    /// What is loaded starts by itself, with the film at its beginning at that instant, where the hall is armed until then. The news is
    /// either [`News::Started`] or [`News::CalledOff`], once. One that is held is replaced.
    StartAt(MonoTime),
    /// It does not.
    CallOff,
    /// The show that is next. Not taken while the seats move.
    Load(Box<Loaded>),
    /// One slow frame that leads a seat of which nobody has told where it is to park, from wherever it may be. Taken only before the
    /// hall knows of any seat, and only where it is slow enough from everywhere.
    ParkSlowly {
        /// The controller.
        lane: u16,
        /// How long the frame takes.
        time_ms: u32,
    },
}

/// A show that is ready to be let go.
#[derive(Debug)]
pub struct Loaded {
    /// What the lanes do; it waits.
    pub engine: Engine,
    /// How they are sent to, in the order of the controllers.
    pub(crate) lanes: Vec<Lane>,
    /// What the planner plans with from then on; none once it has it.
    pub(crate) planning: Option<Box<Planning>>,
    /// How it follows the film of the hall, if it does.
    pub(crate) film: Option<FilmStart>,
}

/// What the planner plans with.
#[derive(Debug)]
pub struct Planning {
    /// Who plans.
    pub planner: Planner,
    /// The cue that is planned for.
    pub timeline: Arc<Timeline>,
}

/// What the planner is told.
#[derive(Debug)]
pub enum Task {
    /// Plan that.
    Plan(PlanRequest),
    /// Plan with this from now on.
    Load(Box<Planning>),
    /// Free a show that is over, or was not taken.
    Free(Box<Loaded>),
    /// Free a course that is no longer followed.
    Retire(Box<Course>),
}

/// What the ack thread sees of the controllers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Alarm {
    /// Something that concerns the hall.
    Event(Event),
    /// A controller is lost: its lane comes to rest, and after its hold frames nothing goes to it.
    Leave(u16),
    /// Nothing goes to that lane from now on.
    Cut(u16),
    /// A controller takes part again: where its seat was read at rest stands in [`crate::belief::LaneEvidence`].
    Found(u16),
}

/// What the tick thread makes known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum News {
    /// The hall is in another state, or in the same for another cause or with another next action.
    Entered {
        /// Which.
        state: State,
        /// Why.
        cause: Cause,
        /// What a person does next, in words.
        next: Next,
        /// Since when.
        at: MonoTime,
    },
    /// A command was taken. Every command is followed by this or by a refusal, in the order of the commands.
    Taken,
    /// A command was not taken.
    Refused(Refusal),
    /// A show was not loaded, because the seats move.
    NotLoaded(State),
    /// No move was found for something that the show goes on without.
    Unplanned(Unplanned),
    /// What was to start at its instant has.
    Started,
    /// It has not, and will not.
    CalledOff(StartOff),
}

/// The number of a command, from 0 in the order in which they are given. It needs no place beside the command: the mailbox keeps
/// the order.
pub(crate) type Ticket = u32;

/// Whom the tick thread tells: news, and the ticket of the command that it answers, where it does.
pub(crate) type NewsOut = Producer<(Option<Ticket>, News)>;

/// Where the tick thread's news comes out.
#[derive(Debug)]
pub struct NewsIn(Consumer<(Option<Ticket>, News)>);

impl NewsIn {
    /// The next, for whoever does not care which command it answers.
    ///
    /// # Errors
    /// Where there is none.
    pub fn pop(&mut self) -> Result<News, PopError> {
        self.0.pop().map(|(_, news)| news)
    }

    /// The next, with the ticket of the command that it answers.
    pub(crate) fn take(&mut self) -> Option<(Option<Ticket>, News)> {
        self.0.pop().ok()
    }
}

/// The mailbox for so much news.
#[must_use]
pub(crate) fn news(places: usize) -> (NewsOut, NewsIn) {
    let (news, news_end) = RingBuffer::new(places);
    (news, NewsIn(news_end))
}

/// The tick thread's ends.
#[derive(Debug)]
pub struct Mail {
    sent: Producer<Sent>,
    ticks: Producer<TickReport>,
    tasks: Producer<Task>,
    answers: Consumer<Answer>,
    commands: Consumer<Command>,
    /// Commands taken so far.
    taken: Ticket,
    alarms: Consumer<Alarm>,
    news: NewsOut,
    planner: Option<Thread>,
    leader: Option<Thread>,
    live: Arc<Live>,
    unposted: u64,
}

/// The other threads' ends.
#[derive(Debug)]
pub struct MailEnds {
    /// To the ack thread: frames.
    pub sent: Consumer<Sent>,
    /// To the ack thread: ticks.
    pub ticks: Consumer<TickReport>,
    /// To the planner: what to plan, and what to free.
    pub tasks: Consumer<Task>,
    /// From the planner: answers.
    pub answers: Producer<Answer>,
    /// From whoever leads the show: commands.
    pub commands: Producer<Command>,
    /// From the ack thread: what it sees of the controllers.
    pub alarms: Producer<Alarm>,
    /// To whoever leads the show: what the hall does.
    pub news: NewsIn,
}

/// Mailboxes for a play of that many lanes.
#[must_use]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 2,000 ticks")]
pub fn mailboxes(lanes: usize, rate: Rate, live: Arc<Live>) -> (Mail, MailEnds) {
    let held = (HELD_S * rate.hz()).ceil() as usize;
    // Each frame may be followed by word of its failure. One whose number is not the next has word of that instead, once.
    let (sent, sent_end) = RingBuffer::new((2 * lanes * held).max(1024));
    let (reports, reports_end) = RingBuffer::new(held.max(64));
    let (tasks, tasks_end) = RingBuffer::new(2 * PLANS);
    let (answers_end, answers) = RingBuffer::new(PLANS);
    let (commands_end, commands) = RingBuffer::new(COMMANDS);
    // Some for each lane at once, and some more.
    let (alarms_end, alarms) = RingBuffer::new(4 * lanes + COMMANDS);
    let (news, news_end) = news(NEWS);
    let mail = Mail {
        sent,
        ticks: reports,
        tasks,
        answers,
        commands,
        taken: 0,
        alarms,
        news,
        planner: None,
        leader: None,
        live,
        unposted: 0,
    };
    let ends = MailEnds {
        sent: sent_end,
        ticks: reports_end,
        tasks: tasks_end,
        answers: answers_end,
        commands: commands_end,
        alarms: alarms_end,
        news: news_end,
    };
    (mail, ends)
}

impl Mail {
    /// Names the planner's thread, which is woken when there is something for it.
    pub fn wakes(&mut self, planner: Thread) {
        self.planner = Some(planner);
    }

    /// Names the thread of whoever leads the hall, which is woken when there is news.
    pub(crate) fn wakes_leader(&mut self, leader: Option<Thread>) {
        self.leader = leader;
    }

    /// Records that found no room so far.
    #[must_use]
    pub(crate) const fn unposted(&self) -> u64 {
        self.unposted
    }

    pub(super) fn post(&mut self, sent: Sent) {
        self.unposted += u64::from(self.sent.push(sent).is_err());
    }

    pub(super) fn report(&mut self, report: TickReport) {
        self.live.on_tick(&report);
        self.unposted += u64::from(self.ticks.push(report).is_err());
    }

    pub(super) fn answer(&mut self) -> Option<Answer> {
        self.answers.pop().ok()
    }

    /// What the ack thread has seen of a lane; none where nobody tells.
    pub(super) fn evidence(&self, lane: usize) -> Option<LaneEvidence<'_>> {
        self.live.evidence(lane)
    }

    /// What the ack thread sees, and is asked.
    pub(super) fn live(&self) -> &Live {
        &self.live
    }

    /// The instant up to which the ack thread has told all that arrived.
    pub(super) fn told(&self) -> MonoTime {
        self.live.told()
    }

    /// Notes how often the limiter held a lane back.
    pub(super) fn clamps(&self, lane: usize, clamps: u64) {
        self.live.on_clamps(lane, clamps);
    }

    /// Notes a tick.
    pub(super) fn beat(&self) {
        self.live.beat();
    }

    /// By when the ack thread is to have told more; none before it runs.
    pub(super) fn told_by(&self) -> Option<MonoTime> {
        self.live.told_by()
    }

    /// Shows how far the play is.
    pub(super) fn look(&self, machine: &Machine, engine: &Engine) {
        self.live.on_hall(machine, engine);
    }

    /// The next command, with its ticket.
    pub(super) fn command(&mut self) -> Option<(Ticket, Command)> {
        let command = self.commands.pop().ok()?;
        let ticket = self.taken;
        self.taken = ticket.wrapping_add(1);
        Some((ticket, command))
    }

    pub(super) fn alarm(&mut self) -> Option<Alarm> {
        self.alarms.pop().ok()
    }

    /// Whether whoever leads the hall would hear something new.
    pub(super) fn has_room_for_news(&self) -> bool {
        !self.news.is_full()
    }

    /// Where nobody reads it, news is lost; where the hall stands is in [`Live`] as well.
    pub(super) fn tell(&mut self, news: News) {
        self.put((None, news));
    }

    /// Answers a command.
    pub(super) fn reply(&mut self, ticket: Ticket, news: News) {
        self.put((Some(ticket), news));
    }

    fn put(&mut self, news: (Option<Ticket>, News)) {
        let _ = self.news.push(news);
        self.wake_leader();
    }

    /// Has whoever leads the hall look at what there is, be it no news.
    pub(super) fn wake_leader(&self) {
        wake(self.leader.as_ref());
    }

    /// Has the planner do it. It has as many places as courses that can be under way, so there is room.
    pub(super) fn task(&mut self, task: Task) {
        self.unposted += u64::from(self.tasks.push(task).is_err());
        wake(self.planner.as_ref());
    }

    /// Whether the planner can be given a whole show: to load one, and to free the one before.
    pub(super) fn has_room_for_a_show(&self) -> bool {
        self.tasks.slots() >= 2
    }
}

/// One system call where the thread sleeps, none where it works; it never waits.
fn wake(thread: Option<&Thread>) {
    if let Some(thread) = thread {
        thread.unpark();
    }
}

#[cfg(test)]
mod tests {
    use std::thread;
    use std::time::Duration;

    use super::*;

    #[test]
    fn whoever_leads_the_hall_can_sleep_until_there_is_news_and_an_answer_names_its_command() {
        let (mut mail, ends) = mailboxes(1, Rate::from_hz(100.0), Arc::default());
        let MailEnds { mut commands, mut news, .. } = ends;
        let (tell, told) = std::sync::mpsc::channel();
        let leader = thread::spawn(move || {
            let take = || {
                news.take().or_else(|| {
                    thread::park();
                    None
                })
            };
            tell.send(std::iter::repeat_with(take).flatten().take(3).collect::<Vec<_>>()).unwrap();
        });
        mail.wakes_leader(Some(leader.thread().clone()));
        for _ in 0..2 {
            commands.push(Command::Request(Transition::Arm)).unwrap();
        }
        mail.tell(News::NotLoaded(State::Boot));
        while let Some((ticket, _)) = mail.command() {
            mail.reply(ticket, News::Taken);
        }
        let told = told.recv_timeout(Duration::from_secs(20)).expect("it is woken");
        assert_eq!(told.iter().map(|(ticket, _)| *ticket).collect::<Vec<_>>(), [None, Some(0), Some(1)]);
        leader.join().unwrap();
    }
}
