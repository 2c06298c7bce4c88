//! Every check of preflight: its name, how grave it is, and why it matters. One table; the judges, the configuration,
//! `--explain` and the reports all read it.

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};

/// How grave a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Severity {
    /// Worth knowing; nothing to be done.
    Info,
    /// Should be looked at; does not stop a show.
    Warn,
    /// Nobody should sit down before it is put right, or accepted by name.
    Fail,
}

impl Severity {
    /// The word for it.
    #[must_use]
    pub(crate) const fn word(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warn => "warn",
            Self::Fail => "fail",
        }
    }
}

/// What a check is about; a column of the table of controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Family {
    /// Whether it answers, and how fast.
    Answers,
    /// True if it is the controller it should be.
    Identity,
    /// The way to it and back.
    Network,
    /// How it takes frames.
    Motion,
    /// How fast it may move.
    Speed,
    /// Its emergency stop.
    EmergencyStop,
    /// What it says of itself, and how often.
    Status,
}

impl Family {
    /// All of them, in the order of the table.
    pub(crate) const ALL: [Self; 7] = [
        Self::Answers,
        Self::Identity,
        Self::Network,
        Self::Motion,
        Self::Speed,
        Self::EmergencyStop,
        Self::Status,
    ];

    /// What heads its column.
    #[must_use]
    pub(crate) const fn title(self) -> &'static str {
        match self {
            Self::Answers => "answers",
            Self::Identity => "identity",
            Self::Network => "network",
            Self::Motion => "motion",
            Self::Speed => "speed",
            Self::EmergencyStop => "e-stop",
            Self::Status => "status",
        }
    }
}

/// Makes the checks and the one table of them.
macro_rules! checks {
    ($($check:ident $id:literal $family:ident $severity:ident $why:literal;)+) => {
        /// One thing that preflight looks for.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Check {
            $(#[doc = $why] $check,)+
        }

        impl Check {
            /// All of them, by family.
            pub const ALL: &[Self] = &[$(Self::$check,)+];

            /// Its name, which never changes.
            #[must_use]
            pub const fn id(self) -> &'static str {
                match self { $(Self::$check => $id,)+ }
            }

            /// What it is about.
            #[must_use]
            pub(crate) const fn family(self) -> Family {
                match self { $(Self::$check => Family::$family,)+ }
            }

            /// How grave it is.
            #[must_use]
            pub(crate) const fn severity(self) -> Severity {
                match self { $(Self::$check => Severity::$severity,)+ }
            }

            /// Why it matters, in sentences.
            #[must_use]
            pub const fn why(self) -> &'static str {
                match self { $(Self::$check => $why,)+ }
            }
        }
    };
}

checks! {
    NoAnswer "no-answer" Answers Fail
        "A controller that does not answer cannot be checked, and a seat that nobody watches must not be played to. \
         PA15 = 0 silences a controller that is alive.";
    RegisterUnread "register-unread" Answers Fail
        "A setting that could not be read cannot be known to be safe.";
    RepliesDisabled "replies-disabled" Answers Fail
        "With PA15 other than 1 no frame is acknowledged, and the loss of a controller goes unnoticed.";
    RepliesLost "replies-lost" Answers Fail
        "More than 2 of 20 reads without an answer within 100 ms: so many lost frames make a show degrade.";
    RepliesMissed "replies-missed" Answers Warn
        "One or two of 20 reads without an answer within 100 ms: the network loses datagrams.";
    SlowReplies "slow-replies" Answers Warn
        "An answer that took over 20 ms: a show notices a silent controller after 250 ms, and late replies hide it. On a serial link: \
         answers so late that it cannot carry what it plays and be watched as well.";
    BrokenReplies "broken-replies" Answers Warn
        "Datagrams came from the controller's address that are no messages: a broken cable or switch, or another device.";
    DrivesUnasked "drives-unasked" Answers Fail
        "Drives on a CAN bus are not asked yet, and of a seat that nobody asked nothing is known.";

    Address "address" Identity Fail
        "The controller takes itself for another address or port than the one it was reached at (PA10 to PA14): its \
         station code and its reports are then another seat's.";
    DuplicateAddress "duplicate-address" Identity Fail
        "Two controllers of the configuration have one address, or one hardware address (PA16 to PA1b): what is meant \
         for one seat moves another.";
    DuplicateUnit "duplicate-unit" Identity Fail
        "Two drives on a link have one number: both obey what one is told, and their answers garble each other.";
    TwoAnswer "two-answer" Identity Warn
        "A request was answered more than once: two controllers may have one address, or the network repeats datagrams.";
    Contradiction "contradiction" Identity Fail
        "The same register read twice gave two values though nobody wrote it: two controllers answer for one, or \
         somebody else is changing its settings.";
    ForeignReplies "foreign-replies" Identity Warn
        "Answers came that nobody had asked for: another program speaks to this controller from this machine's \
         address, or two controllers have one address.";
    OtherMaster "other-master" Identity Fail
        "The controller counts more packets (DP34) than it was sent from here: another machine sends to it, and a \
         controller obeys everybody.";
    AxisCount "axis-count" Identity Fail
        "PA02 differs from the axes of the seat type: axes stand still, or motors that are not there raise errors.";
    AxisCountOpen "axis-count-open" Identity Info
        "Neither a configuration, nor axes= in --to, nor a cue says how many axes the seat has.";
    WorkMode "work-mode" Identity Fail
        "PA00 must be the work mode: 10, or 0 on RS-485 controllers of the IMAX manual. The others are for tests and \
         effects, and frames do not move the seat as meant.";
    WorkModeOpen "work-mode-open" Identity Warn
        "PA00 = 0 is the work mode of RS-485 units (SMC manual 5.2) and none of CAN units, whose work mode is 10; no \
         register tells which of them this is.";
    RotaryAxis "rotary-axis" Identity Fail
        "PA03 names the axis that takes for zero wherever it stands; the others search their zero at an end. Where that is not \
         the axis with unit = \"deg\" of the seat type, positions mean other places, or a turntable runs to search an end.";
    RotaryZero "rotary-zero" Identity Warn
        "A rotary axis has no search for its zero: wherever it stands when its controller starts or is homed becomes 0, and its range \
         lies about that. Homed a quarter turn off, it may be led a quarter turn past its end.";
    AxisOffset "axis-offset" Identity Fail
        "PA95 must be 0 where kinocue sends each controller its own axes (fan_out = slice), and axis_offset where each \
         takes its window of one frame (shared). Else the seat plays axes that are not its own.";
    Version "version" Identity Info
        "The version of the controller's software, DPFF and DPFE.";
    VersionDiffers "version-differs" Identity Warn
        "Controllers of one dialect with different software may behave differently, for instance in an emergency stop.";
    NotAsked "not-asked" Identity Info
        "MBOX controllers lack some registers; what these would tell is not known.";

    Route "route" Network Fail
        "The system has no way to the controller's address.";
    Mtu "mtu" Network Fail
        "The largest datagram does not fit through the interface in one piece; controllers put nothing together again.";
    ReplyAddress "reply-address" Network Fail
        "PA20 to PA23 must be this machine's address as the controller sees it: that is where it answers and reports.";
    ReplyPort "reply-port" Network Fail
        "PA24 must be the frame port: SMC controllers take frames from that port alone, and answer to it.";
    PortMissing "port-missing" Network Fail
        "The serial port of the link is not there, so none of its drives can be reached.";
    PortTaken "port-taken" Network Fail
        "Another program has the serial port: two masters on one line garble each other.";
    PortForbidden "port-forbidden" Network Fail
        "The system does not let this user open the serial port; the service needs its drop-in for drives.";
    PortUnfit "port-unfit" Network Fail
        "The port is no serial line, or cannot be set as the link needs it.";
    AdapterSlow "adapter-slow" Network Warn
        "The adapter holds answers back, 16 ms unless it is told otherwise, and a link that waits for each plays slowly.";
    EchoDiffers "echo-differs" Network Fail
        "Some two-wire adapters return what is sent; taken for an answer, or an answer for it, no exchange can be trusted.";
    FramePortFree "frame-port-free" Network Info
        "With port 0 in bind the frame port is another each time, so PA24 cannot be compared with it.";

    IntervalLimit "interval-limit" Motion Fail
        "A Time longer than PA0b is cut to it, so the move is made in less time: faster than anyone proved.";
    IntervalUnlimited "interval-unlimited" Motion Warn
        "PA0b = 0 means no limit by the SMC manual alone; the IMAX manual does not say what it does.";
    SignedFilter "signed-filter" Motion Fail
        "An IMAX controller filters positions (PA51); its manual wants that off where positions go below 0 (section 5.7).";
    TimeIgnored "time-ignored" Motion Fail
        "With PA0a = 1 an IMAX controller goes by the time between packets and not by the Time in them: a frame that comes \
         late or early is made slower or faster than anyone proved.";
    HomesUnsearched "homes-unsearched" Motion Fail
        "With PA0e = 1 a reset goes to where the controller believes zero to be, without a search. One that was switched \
         off in between has no zero, and every position after that is wrong by as much; the hall's homing refuses it.";
    Encoder "encoder" Motion Fail
        "PA54 is how many lines the encoders have, 5,000 or 2,500, of which each makes two or four counts. Where \
         pulses_per_rev is neither of these, the seat goes farther or less far than it is sent.";
    EncoderUnsure "encoder-unsure" Motion Warn
        "pulses_per_rev fits the encoder of PA54 with four counts for each line. Most seats have two, and no manual says \
         which; with the wrong one every move is twice as far and twice as fast.";
    EncoderDiffers "encoder-differs" Motion Fail
        "Seats of one type whose controllers have other encoders set (PA54) go to other places by the same pulses.";
    Lead "lead" Motion Fail
        "PA41 is the lead of the screw, and the seat type's lead_mm should be the same: one of them is wrong, and with the \
         seat type's every limit in millimetres; with the controller's the rise after homing (PA40).";
    Stroke "stroke" Motion Fail
        "PA42 is the stroke that the controller knows; the seat type has a longer one, so positions near its end are cut \
         off or run into the stop.";
    WordOrder "word-order" Motion Fail
        "By the word order of its dialect the controller's position registers tell of places outside the stroke, or other \
         than its reports tell, and by the other order they do not: whoever believes them takes the seat for somewhere \
         else, and moves it from there.";
    WordOrderOpen "word-order-open" Motion Warn
        "Both word orders make a place inside the stroke of its position registers, and not the same one; the dialect's is \
         taken.";
    Position "position" Motion Fail
        "An axis that says it is outside its stroke by more than rounding, or elsewhere than a report of the same rest \
         says, is in no known place: its zero was lost, or pulses, lead or stroke of the seat type are not its own.";
    BusPeriod "bus-period" Motion Fail
        "PA59 is the shortest time between commands to the drives; where it is longer than the show's frames these pile up \
         in the controller, which then hurries (PA06) or stops with Err21.";
    MotionLate "motion-late" Motion Warn
        "Filters and delays in the controller (PA50 and PA51 of IMAX, PA4c and PA4d of SMC) make motion later than the \
         film, and smooth what was proved; trim can make up for the delay.";
    AnaloguePosition "analogue-position" Motion Fail
        "With PA60 = 1 positions come from the analogue inputs too (times PA61 over PA62): the seat does not go where it \
         is sent.";
    LinkTooSlow "link-too-slow" Motion Fail
        "The link cannot carry segments as often as its drives are to be told something new.";
    SoftLimits "soft-limits" Motion Fail
        "Registers 38 and 39 of a drive are not those of the seat, which homing wrote: past the stroke nothing but them holds it.";
    ErrorLimits "error-limits" Motion Fail
        "Register 208 of a drive is not what homing wrote: it lets go too soon, or not where something blocks it.";
    DriveTorque "drive-torque" Motion Fail
        "Registers 206 and 207 of a drive are not what homing wrote: it is too weak to hold the seat, or stronger than it may be.";
    BrakeRate "brake-rate" Motion Fail
        "Register 19 of a drive is not what homing wrote: where its link dies it brakes too hard, or past the stroke.";
    AutoReset "auto-reset" Motion Fail
        "With PA0d above 0 the controller resets by itself some time after the last frame: the seat moves without a \
         command, perhaps in a pause with people on it.";
    FastForward "fast-forward" Motion Warn
        "With PA06 = 1 the controller hurries as soon as more than two frames wait, so a burst of late frames is a \
         violent move. With 0 it lags behind instead.";
    FastForwardUnknown "fast-forward-unknown" Motion Fail
        "PA06 is neither 0 nor 1: what the controller does with a backlog is not known.";
    Amplitude "amplitude" Motion Fail
        "PA55 other than 0 scales every position in the controller: the seat does not go where it is sent, and what it \
         acknowledges is not where it stands.";
    OutputsIgnored "outputs-ignored" Motion Warn
        "With PA9d = 1 the controller ignores the outputs in frames: no effect of a cue comes on, and none goes off.";

    OutputsInverted "outputs-inverted" Motion Fail
        "With PA05 = 1 an output is on when a frame says off: every effect runs between shows, and pauses when it is \
         called for.";
    PowerOnOutputs "power-on-outputs" Motion Warn
        "PA9f switches outputs on as soon as the controller has power, with nobody leading it; they stay on until the \
         first frame.";

    SpeedUnlimited "speed-unlimited" Speed Fail
        "PA07 is the last limit on speed that the controller itself keeps; 0 is none that can be relied on.";
    AxisSpeedUnlimited "axis-speed-unlimited" Speed Fail
        "PA80 to PA85 limit the speed of each axis; 0 is no limit, so that only PA07 is left.";
    SpeedTooLow "speed-too-low" Speed Fail
        "The controller's limit is below the seat type's max_velocity_mm_s: it falls behind fast passages, its queue \
         fills, and it then hurries (PA06) or stops with Err21.";
    SpeedTooHigh "speed-too-high" Speed Warn
        "The controller's limit is more than a tenth above the seat type's max_velocity_mm_s: it would not hold back \
         a move that is too fast for people.";

    EstopDisabled "estop-disabled" EmergencyStop Fail
        "With bit 0 of PA90 clear, as it leaves the factory, the controller ignores every emergency stop input.";
    EstopNoInput "estop-no-input" EmergencyStop Fail
        "PA92 = 0 names no input: the emergency stop is enabled, but nothing can trigger it.";
    EstopAnd "estop-and" EmergencyStop Fail
        "PA92 joins its inputs with AND: with two buttons on two inputs, pressing one does nothing. Wire normally \
         closed buttons in series to one input.";
    EstopResumes "estop-resumes" EmergencyStop Fail
        "With PA91 = 0 the seat holds while the button is pressed and moves on by itself once it is let go; no \
         emergency stop may end without a reset.";
    EstopReturns "estop-returns" EmergencyStop Fail
        "With PA91 = 1 the seat moves to zero when the button is pressed, when it should stand still, and moves on by \
         itself once it is let go.";
    EstopAction "estop-action" EmergencyStop Fail
        "PA91 has a value that no manual explains: what the seat does in an emergency stop is not known.";
    EstopIsBelts "estop-is-belts" EmergencyStop Fail
        "PA92 names the inputs of the belts (belt_inputs), as in the second example of the manual's section 5.6. The \
         controller has one such function: so no input of it is an emergency stop, and opening the last belt does to \
         the seat what PA91 says, in mid-show too.";
    BeltsOpen "belts-open" EmergencyStop Warn
        "All belts that PA92 names are open, so the controller takes no motion; it does once one of them is closed.";
    EstopFilter "estop-filter" EmergencyStop Fail
        "PA93 is how long the input must be active before anything happens; over 50 ms the seat moves on too long.";
    EstopRelease "estop-release" EmergencyStop Fail
        "PA94 limits the speed at which the seat leaves an emergency stop; what 0 means is not documented, and may be \
         no limit.";
    EstopReleaseFast "estop-release-fast" EmergencyStop Warn
        "PA94 is not below PA07, so the seat leaves an emergency stop at the full speed of a show.";
    EstopWire "estop-wire" EmergencyStop Warn
        "With PA04 = 1 an input is active when low, and an open one is high: a broken wire looks like a button that \
         nobody presses. PA04 = 0 with a normally closed button stops when the wire breaks.";
    EstopResetInput "estop-reset-input" EmergencyStop Warn
        "With bit 3 of PA90 set and inputs in PA98, a press at an input resets the controller, and the seat moves; so \
         an emergency stop can be ended from there.";
    EstopResetShared "estop-reset-shared" EmergencyStop Fail
        "PA98 and PA92 name the same input: the press that stops the seat also resets it.";
    EstopJog "estop-jog" EmergencyStop Warn
        "Bit 1 or 2 of PA90 is set: inputs can move the seat by hand, also during a show.";
    EstopUnwatched "estop-unwatched" EmergencyStop Warn
        "estop_inputs of the configuration and PA92 name different inputs: what the controller takes for an emergency \
         stop and what kinocue does are not the same.";

    EmergencyStopActive "emergency-stop-active" Status Fail
        "An emergency stop is in effect now.";
    ActiveError "active-error" Status Fail
        "The controller or one of its drives reports an error now (chapter 6 of both manuals).";
    NotHome "not-home" Status Fail
        "A drive counts from where it was switched on until it is homed, and no place of it is known.";
    Restarted "restarted" Status Fail
        "Drives of one seat were not homed together: one of them was off since, and counts from elsewhere.";
    Killed "killed" Status Fail
        "A drive let go of its motor, by an error or by heat, and waits for a person.";
    DriveError "drive-error" Status Fail
        "A drive is farther from its course than it may be: something blocks it, or it is too weak.";
    DriveHot "drive-hot" Status Fail
        "A drive is too hot, and lets go of its motor where it gets hotter.";
    Supply "supply" Status Fail
        "The supply of a drive left its bounds: over them it lets go of its motor, and braking raises it.";
    StatusOff "status-off" Status Fail
        "With PA1f = 0 the controller never reports its state, so a drive's alarm between frames goes unnoticed.";
    StatusElsewhere "status-elsewhere" Status Fail
        "With PA1f = 2 reports go to PA25 to PA29; where that is not this machine, nobody here hears them.";
    StatusUnheard "status-unheard" Status Warn
        "The settings promise status reports to this machine, but none came while it listened: a firewall may be in the \
         way, or the firmware has no such reports.";
    StatusSlow "status-slow" Status Fail
        "PA1e is the interval of status reports: 0 sends one only when an alarm begins, and over 100 ms is no beat by \
         which a loss is noticed in time.";
}

impl Check {
    /// True if a configuration may accept it for good: a setting that was found and understood, but not that a
    /// controller is silent or in trouble at present, and nothing that is only told.
    #[must_use]
    pub(crate) const fn can_be_accepted(self) -> bool {
        !self.is_unknown() && !self.is_present() && !matches!(self.severity(), Severity::Info)
    }

    /// True if it means that something is not known.
    #[must_use]
    pub(crate) const fn is_unknown(self) -> bool {
        matches!(
            self,
            Self::NoAnswer
                | Self::RegisterUnread
                | Self::Route
                | Self::DrivesUnasked
                | Self::DuplicateUnit
                | Self::PortMissing
                | Self::PortTaken
                | Self::PortForbidden
                | Self::PortUnfit
                | Self::EchoDiffers
        )
    }

    /// True if it is about this moment, and no setting.
    #[must_use]
    pub(crate) const fn is_present(self) -> bool {
        matches!(
            self,
            Self::EmergencyStopActive
                | Self::ActiveError
                | Self::BeltsOpen
                | Self::Position
                | Self::NotHome
                | Self::Restarted
                | Self::Killed
                | Self::DriveError
                | Self::DriveHot
                | Self::Supply
        )
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

impl Serialize for Check {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}

/// No check has this name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no check has this name; `kinocue preflight --explain` lists them")]
pub struct UnknownCheck;

impl FromStr for Check {
    type Err = UnknownCheck;

    fn from_str(id: &str) -> Result<Self, UnknownCheck> {
        Self::ALL.iter().copied().find(|check| check.id() == id).ok_or(UnknownCheck)
    }
}

#[cfg(test)]
mod tests;
