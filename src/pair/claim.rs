//! The claim of one machine to the lead.

use serde::{Deserialize, Serialize};

use super::{ALONE, AWAY, FRESH, KEPT, LEAST_REVISION, PROMISED, RENEW, UNCHANGED};
use crate::time::MonoTime;

/// Heartbeats whose instants are kept; one that was sent longer ago promises nothing any more.
const BEATS: usize = 64;

/// What a machine is in its pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// The other one may lead; this one sends nothing.
    Follows,
    /// It asks the engine for the lead with that ticket, which left then. It gives its word to nobody.
    Claims { ticket: u64, left: MonoTime },
    /// It leads until then, unless it is promised more.
    Leads { until: MonoTime },
    /// Its promises have run out. It never leads again: the program has to start anew.
    Lost,
}

/// What one machine tells the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Beat {
    /// Whose it is: a number by chance, another one at each start.
    pub(crate) from: u64,
    /// Whom it is for, by the same; 0 before anything was heard of it.
    pub(crate) to: u64,
    /// Its number, from 1.
    pub(crate) number: u64,
    /// The newest beat of whom it is for that came: it is from after that one was sent. 0 for none.
    pub(crate) echo: u64,
    /// True if it leads.
    pub(crate) leads: bool,
    /// True if it wants to lead and asks for the other's word.
    pub(crate) wants: bool,
    /// The word not to lead, in answer to the beat of that number; 0 for none.
    pub(crate) word: u64,
    /// What tells its configuration from another one.
    pub(crate) print: u64,
}

/// Who wrote the key, and the how-manieth time: no two writes are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Holder {
    /// The session of the machine.
    pub(crate) session: u64,
    /// Its count of what it asked.
    pub(crate) count: u64,
    /// What tells its configuration from another one; 0 where it does not say.
    #[serde(default)]
    pub(crate) print: u64,
}

/// Why a machine does not begin to lead by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PairMisfit {
    /// The other machine, which is heard, has another configuration.
    Other,
    /// Whoever led last had another one.
    Leader,
}

/// What is asked of the engine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Want {
    /// What the key is.
    Read,
    /// To write the key where its revision is still that one; 0 where there is none.
    Swap { revision: u64, holder: Holder },
}

/// One request to the engine: to the link, a line of JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Ask {
    /// Its number; an answer to another one is none.
    pub(crate) ticket: u64,
    /// What.
    pub(crate) want: Want,
}

/// What the engine answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Answer {
    /// The key, as it is.
    Key { holder: Holder, revision: u64 },
    /// There is no key.
    NoKey,
    /// It is written, and has that revision.
    Granted { revision: u64 },
    /// Its revision is another one.
    Refused,
}

/// What came of a request: of the link, a line of JSON.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Answered {
    /// That of the request.
    pub(crate) ticket: u64,
    /// `None` where the engine said nothing.
    pub(crate) answer: Option<Answer>,
}

/// The other machine, as far as it was heard.
#[derive(Debug, Clone, Copy, Default)]
struct Partner {
    session: u64,
    /// The newest beat of it that counted.
    number: u64,
    /// A beat of it that is not answered yet.
    unanswered: u64,
    leads: bool,
    wants: bool,
    print: u64,
    heard: Option<MonoTime>,
}

/// Whom beats are for, and the newest of its beats, which they echo. It may be nobody: an old beat, sent again, is from somebody as well.
#[derive(Debug, Clone, Copy, Default)]
struct Addressee {
    session: u64,
    number: u64,
}

/// The key, and since when it was seen so.
#[derive(Debug, Clone, Copy)]
struct SeenKey {
    holder: Holder,
    revision: u64,
    since: MonoTime,
    /// When the newest request left that found it so.
    asked: MonoTime,
}

/// What is known of the lease.
#[derive(Debug, Clone, Copy)]
enum Lease {
    Unknown,
    Missing,
    Seen(SeenKey),
    /// Written by us.
    Ours {
        revision: u64,
    },
}

/// The claim of one machine.
#[derive(Debug, Clone)]
pub(crate) struct Claim {
    session: u64,
    /// What tells its configuration from another one.
    print: u64,
    /// Of two that start together this one leads.
    is_first: bool,
    role: Role,
    /// It has promised not to lead before that.
    bound_until: MonoTime,
    partner: Partner,
    addressee: Addressee,
    number: u64,
    sent: [MonoTime; BEATS],
    lease: Lease,
    ticket: u64,
    asked: MonoTime,
    open: bool,
    /// When the newest request left that was granted.
    granted: Option<MonoTime>,
    /// Until then it takes the lead also where nothing says that it may: a person has said that the other machine is off.
    is_told_until: MonoTime,
}

impl Claim {
    /// Of a program that has just started, in a session that no other has. What it may have promised before it ended, it keeps.
    pub(crate) fn new(session: u64, is_first: bool, now: MonoTime) -> Self {
        Self {
            session,
            print: 0,
            is_first,
            role: Role::Follows,
            bound_until: now + KEPT,
            partner: Partner::default(),
            addressee: Addressee::default(),
            number: 0,
            sent: [MonoTime::default(); BEATS],
            lease: Lease::Unknown,
            ticket: 0,
            asked: MonoTime::default(),
            open: false,
            granted: None,
            is_told_until: MonoTime::default(),
        }
    }

    /// A person says that the other machine is off, and that this one is to lead: for a while it may make the key where the engine has
    /// none, and take that of a machine with another configuration.
    pub(crate) fn is_alone(&mut self, now: MonoTime) {
        self.is_told_until = now + ALONE;
    }

    /// It has that configuration from now on.
    pub(crate) fn set_print(&mut self, print: u64) {
        self.print = print;
    }

    /// Why it does not begin to lead, or the other one does not, if their configurations are no longer the same.
    pub(crate) fn misfit(&self, now: MonoTime) -> Option<PairMisfit> {
        if self.hears(now) {
            return (self.partner.print != self.print).then_some(PairMisfit::Other);
        }
        match self.lease {
            Lease::Seen(key) if !self.fits(&key) => Some(PairMisfit::Leader),
            _ => None,
        }
    }

    /// True if whoever wrote a key had the same configuration, or did not say.
    fn fits(&self, key: &SeenKey) -> bool {
        key.holder.print == 0 || key.holder.print == self.print
    }

    /// What it is.
    pub(crate) fn role(&mut self, now: MonoTime) -> Role {
        self.age(now);
        self.role
    }

    /// True if the other machine was heard of late.
    pub(crate) fn hears(&self, now: MonoTime) -> bool {
        self.partner.heard.is_some_and(|heard| now.since(heard) < AWAY)
    }

    /// True if the newest word of the other machine is that it leads.
    pub(crate) fn hears_leader(&self, now: MonoTime) -> bool {
        self.hears(now) && self.partner.leads
    }

    /// Ends what has lasted its time; before anything else is done at `now`.
    fn age(&mut self, now: MonoTime) {
        match self.role {
            Role::Leads { until } if now >= until => self.role = Role::Lost,
            Role::Claims { left, .. } if now >= left + PROMISED => {
                (self.role, self.lease) = (Role::Follows, Lease::Unknown);
            }
            _ => {}
        }
    }

    /// The next heartbeat, which leaves at `now` or later. It is the word not to lead where that was asked for and may be given.
    pub(crate) fn beat(&mut self, now: MonoTime) -> Beat {
        self.age(now);
        self.number += 1;
        self.sent[slot(self.number)] = now;
        let asked = self.partner.leads || self.partner.wants;
        let unanswered = std::mem::take(&mut self.partner.unanswered);
        let word = if asked && self.role == Role::Follows { unanswered } else { 0 };
        if word > 0 {
            self.bound_until = self.bound_until.max(now + KEPT);
        }
        Beat {
            from: self.session,
            to: self.addressee.session,
            number: self.number,
            echo: self.addressee.number,
            leads: matches!(self.role, Role::Leads { .. }),
            wants: self.wants(now),
            word,
            print: self.print,
        }
    }

    /// True if it asks for the other's word so as to begin to lead.
    fn wants(&self, now: MonoTime) -> bool {
        let may_begin = self.is_first && self.role == Role::Follows && now >= self.bound_until;
        may_begin && !self.partner.leads && self.misfit(now).is_none()
    }

    /// Takes a heartbeat that is authentic; true if it counts. None does that is for somebody else, that came before, or that does not
    /// echo a beat of ours of just now: whatever was recorded is older.
    pub(crate) fn hear(&mut self, beat: &Beat, now: MonoTime) -> bool {
        self.age(now);
        if beat.from == self.session || ![0, self.session].contains(&beat.to) {
            return false;
        }
        let is_partner = beat.from == self.partner.session;
        // Whoever was heard a moment ago is not given up for another one.
        if !is_partner && self.hears(now) {
            return false;
        }
        self.answer_to(beat);
        if beat.to == 0 || !self.is_fresh(beat.echo, now) || is_partner && beat.number <= self.partner.number
        {
            return false;
        }
        let Beat { number, leads, wants, word, print, .. } = *beat;
        let (session, unanswered, heard) = (beat.from, number, Some(now));
        self.partner = Partner { session, number, unanswered, leads, wants, print, heard };
        // Our clock stood still while the other one took over: this is a virtual machine that was paused. The other one leads by now.
        if leads && matches!(self.role, Role::Leads { .. }) {
            self.role = Role::Lost;
        }
        self.take_word(word, now);
        true
    }

    /// Has the next beats be for whoever sent that one.
    fn answer_to(&mut self, beat: &Beat) {
        if self.addressee.session != beat.from {
            self.addressee = Addressee { session: beat.from, number: 0 };
        }
        self.addressee.number = self.addressee.number.max(beat.number);
    }

    /// True if that is a beat of ours that left just now.
    fn is_fresh(&self, number: u64, now: MonoTime) -> bool {
        self.sent_at(number).is_some_and(|sent| now.since(sent) < AWAY)
    }

    /// When the beat of that number left; `None` of one that did not, or long ago.
    fn sent_at(&self, number: u64) -> Option<MonoTime> {
        let is_known = number > 0 && number <= self.number && self.number - number < BEATS as u64;
        is_known.then(|| self.sent[slot(number)])
    }

    fn take_word(&mut self, word: u64, now: MonoTime) {
        let Some(sent) = self.sent_at(word) else { return };
        let until = sent + PROMISED;
        match self.role {
            Role::Leads { until: before } => self.role = Role::Leads { until: before.max(until) },
            Role::Follows if self.wants(now) && now < until => self.role = Role::Leads { until },
            _ => {}
        }
    }

    /// What is to be asked of the engine next, leaving at `now` or later.
    pub(crate) fn ask(&mut self, now: MonoTime) -> Ask {
        self.age(now);
        self.ticket += 1;
        (self.asked, self.open) = (now, true);
        let revision = match self.role {
            Role::Leads { .. } => self.to_renew(now),
            Role::Follows => self.to_claim(now),
            Role::Claims { .. } | Role::Lost => None,
        };
        if revision.is_some() && self.role == Role::Follows {
            self.role = Role::Claims { ticket: self.ticket, left: now };
        }
        let holder = Holder { session: self.session, count: self.ticket, print: self.print };
        let want = revision.map_or(Want::Read, |revision| Want::Swap { revision, holder });
        Ask { ticket: self.ticket, want }
    }

    /// The revision that whoever leads replaces: its own, none where the engine has lost it, or one that nobody renews.
    fn to_renew(&self, now: MonoTime) -> Option<u64> {
        match self.lease {
            Lease::Ours { revision } => Some(revision),
            Lease::Missing => Some(0),
            Lease::Seen(key) if key.holder.session == self.session => Some(key.revision),
            Lease::Seen(key) if now.since(key.since) >= UNCHANGED => Some(key.revision),
            Lease::Seen(_) | Lease::Unknown => None,
        }
    }

    /// The revision that a machine replaces to lead from now on: one that nobody has renewed for long enough.
    fn to_claim(&self, now: MonoTime) -> Option<u64> {
        let is_told = now < self.is_told_until;
        if now < self.bound_until || self.hears_leader(now) || !is_told && self.misfit(now).is_some() {
            return None;
        }
        match self.lease {
            Lease::Seen(key)
                if now.since(key.since) >= UNCHANGED
                    && now.since(key.asked) <= FRESH
                    && key.revision >= LEAST_REVISION =>
            {
                Some(key.revision)
            }
            Lease::Missing if is_told => Some(0),
            _ => None,
        }
    }

    /// When the next request is due.
    pub(crate) fn ask_at(&self) -> MonoTime {
        self.asked + RENEW
    }

    /// Takes what the engine answered; what answers an older request says nothing.
    pub(crate) fn answer(&mut self, ticket: u64, answer: Answer, now: MonoTime) {
        self.age(now);
        if ticket != self.ticket || !std::mem::take(&mut self.open) {
            return;
        }
        self.lease = match answer {
            Answer::NoKey => Lease::Missing,
            Answer::Key { holder, revision } => Lease::Seen(self.seen(holder, revision, now)),
            Answer::Granted { revision } => {
                self.granted(ticket);
                Lease::Ours { revision }
            }
            Answer::Refused => Lease::Unknown,
        };
        if matches!(self.role, Role::Claims { ticket: claimed, .. } if claimed == ticket) {
            (self.role, self.lease) = (Role::Follows, Lease::Unknown);
        }
        self.age(now);
    }

    /// What it asked for is granted: it leads, from when it asked on.
    fn granted(&mut self, ticket: u64) {
        let until = self.asked + PROMISED;
        self.granted = Some(self.asked);
        match self.role {
            Role::Leads { until: before } => self.role = Role::Leads { until: before.max(until) },
            Role::Claims { ticket: claimed, .. } if claimed == ticket => self.role = Role::Leads { until },
            _ => {}
        }
    }

    fn seen(&self, holder: Holder, revision: u64, now: MonoTime) -> SeenKey {
        let asked = self.asked;
        match self.lease {
            Lease::Seen(before) if before.holder == holder && before.revision == revision => {
                SeenKey { asked, ..before }
            }
            _ => SeenKey { holder, revision, since: now, asked },
        }
    }

    /// True if the engine has granted the lease of late.
    pub(crate) fn has_lease(&self, now: MonoTime) -> bool {
        self.granted.is_some_and(|granted| now.since(granted) < AWAY)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "less than the number of slots")]
const fn slot(number: u64) -> usize {
    (number % BEATS as u64) as usize
}
