//! Is this machine real-time? Facts about it in, one line for each of them out: what was found, whether that will do, and
//! exactly what to change. Control thread only.
//!
//! One file for each family of facts holds the facts and their judgement, which is pure. [`facts()`] reads them from this
//! machine with the help of [`text`]; [`measure`] runs the bare tick loop; [`chart`] draws what came of it. What could not
//! be seen is said so, never guessed.

pub(crate) mod chart;
pub(crate) mod clocks;
pub(crate) mod facts;
pub(crate) mod kernel;
pub(crate) mod lateness;
pub(crate) mod measure;
pub(crate) mod memory;
pub(crate) mod network;
pub(crate) mod ports;
pub(crate) mod processor;
pub(crate) mod scheduling;
pub(crate) mod text;

use serde::Serialize;

use crate::time::Rate;

pub(crate) use facts::facts;

/// A fact, or why it could not be seen, in words.
pub(crate) type Seen<T> = Result<T, String>;

/// What a finding means for a show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Verdict {
    /// As it should be.
    Ok,
    /// A show will run; something makes it less sure than it could be.
    Warn,
    /// Ticks or frames will be lost; the machine is not ready.
    Bad,
    /// It could not be seen.
    Unknown,
}

impl Verdict {
    /// As it is written in reports.
    #[must_use]
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Warn => "warn",
            Self::Bad => "bad",
            Self::Unknown => "unknown",
        }
    }
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(crate) struct FindingLine {
    /// Its name, the same in every version.
    pub(crate) id: &'static str,
    /// What was found.
    pub(crate) found: String,
    /// What that means.
    pub(crate) verdict: Verdict,
    /// What to change, as a command or as a line of a file; `None` where there is nothing to change.
    pub(crate) fix: Option<String>,
}

impl FindingLine {
    /// All is well.
    fn ok(id: &'static str, found: impl Into<String>) -> Self {
        Self { id, found: found.into(), verdict: Verdict::Ok, fix: None }
    }

    /// It could be better, in this way.
    fn warn(id: &'static str, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { id, found: found.into(), verdict: Verdict::Warn, fix: Some(fix.into()) }
    }

    /// It has to change, in this way.
    fn bad(id: &'static str, found: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { id, found: found.into(), verdict: Verdict::Bad, fix: Some(fix.into()) }
    }

    /// It could not be seen, for this reason; `look` is how a person finds out.
    fn unknown(id: &'static str, why: impl Into<String>, look: impl Into<String>) -> Self {
        Self { id, found: why.into(), verdict: Verdict::Unknown, fix: Some(look.into()) }
    }
}

/// What the machine is to play to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Hall {
    /// Controllers; each takes a socket.
    pub(crate) controllers: u32,
    /// Addresses among them that are not this machine's own; each takes an entry of the neighbour table, unless it lies
    /// behind a router.
    pub(crate) neighbours: u32,
    /// How often frames go to each.
    pub(crate) rate: Rate,
}

/// All that is known of the machine.
#[derive(Debug)]
pub(crate) struct Facts {
    /// Real-time scheduling and what may stand in its way.
    pub(crate) scheduling: scheduling::Scheduling,
    /// The kernel, and the other real-time programs that it runs.
    pub(crate) kernel: kernel::Kernel,
    /// Locked memory and swap.
    pub(crate) memory: memory::MemoryFacts,
    /// The processors and how they save power.
    pub(crate) processor: processor::Processor,
    /// Its clocks.
    pub(crate) clocks: clocks::Clocks,
    /// Its tables and buffers.
    pub(crate) network: network::NetworkFacts,
}

/// Judges every fact for a hall, in the order in which a person would mend things.
#[must_use]
pub(crate) fn judge(facts: &Facts, hall: Hall) -> Vec<FindingLine> {
    let granted = facts.scheduling.granted();
    let mut lines = facts.scheduling.judge();
    lines.extend(facts.memory.judge());
    lines.extend(facts.kernel.judge(granted));
    lines.extend(facts.processor.judge(granted));
    lines.extend(facts.clocks.judge());
    lines.extend(facts.network.judge(hall));
    lines
}

/// True if a machine with these findings is ready: nothing is bad. What could not be seen does not count against it.
#[must_use]
pub(crate) fn ready(lines: &[FindingLine]) -> bool {
    lines.iter().all(|line| line.verdict != Verdict::Bad)
}

/// A noun with its number.
fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Several names as a person reads them: the first few, and how many more.
fn some_of<T: AsRef<str>>(names: &[T], shown: usize) -> String {
    let mut text = names.iter().take(shown).map(AsRef::as_ref).collect::<Vec<_>>().join(", ");
    if names.len() > shown {
        text += &format!(" and {} more", names.len() - shown);
    }
    text
}

#[cfg(test)]
mod tests;
