//! What tests and benches use of each room: the rooms themselves are walled.

pub mod api {
    pub use crate::api::{Running, Setup, StopSocket, start, stop_socket};
}
pub mod app {
    pub use crate::app::{Control, Play, PlayHandle, Played, StagedShow};
    pub mod runtime {
        pub use crate::app::runtime::{Loops, Numbers, Purpose, Runtime, RuntimeHandle};
    }
    pub mod staged {
        pub use crate::app::staged::{chasing, headroom};
    }
}
pub mod belief {
    pub use crate::belief::{EvidenceTable, LaneEvidence, Reading, Taken};
}
pub mod channel {
    pub use crate::channel::Sample;
}
pub mod config {
    pub use crate::config::{
        Api, ApiToken, BroadcastNetwork, Config, Controller, LossPolicy, Station, from_to_args, load,
    };
}
pub mod control {
    pub use crate::control::{
        Code, Command, ControllerStatus, Desired, Handle, Health, Inbox, JournalLine, LevelsChange, Problem,
        Role, StartOrder, Status, StatusSource, Surface, Who, handle,
    };
    pub mod model {
        pub use crate::control::model::{Ending, FrameCounts, Percentiles};
    }
}
pub mod device {
    pub use crate::device::{Address, Patience, Talk, reads, settings, table};
}
pub mod drive {
    pub use crate::drive::{Lane, Manner};
}
pub mod engine {
    pub use crate::engine::{Ending, Headroom, Mix, Show, Step, Unplanned};
}
pub mod film {
    pub mod chase {
        pub use crate::film::chase::{Chase, ChaseInput, ChaseRules, ChaseVerdict, FilmLeave};
    }
    pub mod point {
        pub use crate::film::point::{ChasedFilm, FilmPoint, FilmState, PublishedPoint};
    }
}
pub mod health {
    pub use crate::health::{Groups, HealthTable, Notice};
}
pub mod journal {
    pub use crate::journal::{Action, FilmProof, Journal, Limits, Outcome, SeatOut, ShowRecord};
}
pub mod latency {
    pub use crate::latency::{Percentiles, read};
}
pub mod library {
    pub use crate::library::{Awaited, Bounds, CueInfo, Hall, Library, Proved};
}
pub mod limiter {
    pub use crate::limiter::{Admitted, Limit, Limiter, Provenance};
}
pub mod log {
    pub use crate::log::Log;
}
pub mod motion {
    pub use crate::motion::{
        AxisGeometry, Limits, MAX_AXES, Measure, Pose, Pulses, SeatAxis, SeatType, Slot, Spacing, Window,
    };
}
pub mod net {
    pub use crate::net::{Delivery, DrainGrid, Lead, Network, Origin, Ports, SendFault, Sender, over};
}
pub mod observe {
    pub use crate::observe::Watched;
}
pub mod plan {
    pub use crate::plan::{Curve, From, LaneScene, Place, Request, Scene, To};
}
pub mod playlist {
    pub use crate::playlist::{Playlist, Shelf};
}
pub mod preflight {
    pub use crate::preflight::Check;
}
pub mod proof {
    pub use crate::proof::{Digest, DriveTerms, Proof, Terms, figures, prove, prove_driven};
}
pub mod record {
    pub use crate::record::{AckTap, Asked, FrameKind, RecordedSeat, Tap, TickHead, ack_tap, tap};
}
pub mod rt {
    pub use crate::rt::{
        Accounts, AckLoop, Alarm, Answer, Broadcast, Command, Conductor, Desk, Ended, FilmLead, FrameSink,
        Line, Live, Loaded, MailEnds, News, NewsIn, Order, Outlets, Places, PlanLoop, Planning, Sent,
        Spinning, Task, TickLoop, TickReport, Ticked, mailboxes,
    };
}
pub mod sim {
    pub use crate::sim::{
        Action, Command, CommandError, Controller, Farm, FarmError, LinkFaults, Options, Setup, pa,
    };
}
pub mod state {
    pub use crate::state::{
        Cause, Event, Finding, Latch, LedBefore, Machine, PlayMode, Readiness, Refusal, State, Transition,
        Trouble, Why,
    };
}
pub mod sys {
    pub mod batch {
        pub use crate::sys::batch::{Batch, SLOTS, stamp_arrivals};
    }
    pub mod clock {
        pub use crate::sys::clock::{Monotonic, thread_cpu_time, wall_now_ns};
    }
    pub mod realtime {
        pub use crate::sys::realtime::{RealTime, normal_priority, request};
    }
}
pub mod time {
    pub use crate::time::{Clock, MonoTime, Rate, ShowTime, Tick, TickGrid, nanos};
}
pub mod timeline {
    pub use crate::timeline::{EffectSet, Hint, Timeline};
}
pub mod tracker {
    pub use crate::tracker::{ACK_TIMEOUT, Books, Counts, Histogram, KEPT, Reply, Tracker, histogram};
}
