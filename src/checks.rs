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
        "A controller that does not answer can be neither checked nor monitored, so its seat must not take part. \
         PA15 = 0 silences a controller that works.";
    RegisterUnread "register-unread" Answers Fail
        "A setting that could not be read cannot be known to be safe.";
    RepliesDisabled "replies-disabled" Answers Fail
        "With PA15 other than 1 no frame is acknowledged, and the loss of a controller goes unnoticed.";
    RepliesLost "replies-lost" Answers Fail
        "More than 2 of 20 reads had no answer within 100 ms: a show that loses as many frames degrades.";
    RepliesMissed "replies-missed" Answers Warn
        "One or two of 20 reads had no answer within 100 ms: the network loses datagrams.";
    SlowReplies "slow-replies" Answers Warn
        "An answer took over 20 ms: a show notices a silent controller after 250 ms, and late replies hide one. On a serial link: \
         answers are so late that the link cannot carry both motion and monitoring.";
    BrokenReplies "broken-replies" Answers Warn
        "Datagrams from the controller's address are not messages of the protocol: a broken cable or switch, or another device.";

    Address "address" Identity Fail
        "The controller has another address or port in its settings (PA10 to PA14) than it was reached at: its station \
         code and its reports then belong to another seat.";
    Dialect "dialect" Identity Fail
        "It reports or refuses as controllers of the other dialect do: what it tells, and where its seat stands, would be misread.";
    DuplicateAddress "duplicate-address" Identity Fail
        "Two controllers of the configuration share an address, or a hardware address (PA16 to PA1b): frames for one seat \
         move another.";
    DuplicateUnit "duplicate-unit" Identity Fail
        "Two drives on a link share a unit number: both obey commands for one, and their answers garble each other.";
    TwoAnswer "two-answer" Identity Warn
        "A request was answered more than once: two controllers may share an address, or the network repeats datagrams.";
    Contradiction "contradiction" Identity Fail
        "A register read twice gave two values although this program did not write it: two controllers share an address, \
         or somebody else is changing the settings.";
    ForeignReplies "foreign-replies" Identity Warn
        "Answers came without a request: another program talks to this controller from this machine's address, or two \
         controllers share an address.";
    OtherMaster "other-master" Identity Fail
        "The controller counts more packets (DP34) than were sent from here: another machine sends to it, and a \
         controller obeys every sender.";
    AxisCount "axis-count" Identity Fail
        "PA02 differs from the axes of the seat type: some axes do not move, or missing motors raise errors.";
    AxisCountOpen "axis-count-open" Identity Info
        "Neither a configuration, nor axes= in --to, nor a cue says how many axes the seat has.";
    WorkMode "work-mode" Identity Fail
        "PA00 must be the work mode: 10, or 0 on RS-485 controllers of the IMAX manual. Other modes are for tests and \
         effects; frames do not move the seat as intended.";
    WorkModeOpen "work-mode-open" Identity Warn
        "PA00 = 0 is the work mode of RS-485 units (SMC manual 5.2) but not of CAN units, whose work mode is 10; no \
         register tells which kind this is.";
    RotaryAxis "rotary-axis" Identity Fail
        "PA03 names the axis whose zero is its position at a reset or start; the others search for zero at an end. If that is \
         not the axis with unit = \"deg\" of the seat type, positions are wrong, or a turntable runs in search of an end.";
    RotaryZero "rotary-zero" Identity Warn
        "A rotary axis has no search for its zero: its position when its controller starts or is homed becomes 0, the middle of \
         its range. Homed a quarter turn off, it may be moved a quarter turn past its end.";
    AxisOffset "axis-offset" Identity Fail
        "PA95 must be 0 if kinocue sends each controller its own axes (fan_out = slice), and equal axis_offset if each takes \
         its own part of a shared frame (shared). Otherwise the seat plays axes that are not its own.";
    Version "version" Identity Info
        "The version of the controller's software, DPFF and DPFE.";
    VersionDiffers "version-differs" Identity Warn
        "Controllers of one dialect with different software may behave differently, for instance in an emergency stop.";
    NotAsked "not-asked" Identity Info
        "MBOX controllers lack some registers, so the settings in them remain unknown.";

    Route "route" Network Fail
        "The system has no way to the controller's address.";
    Mtu "mtu" Network Fail
        "The largest datagram does not fit through the interface in one piece; controllers put nothing together again.";
    ReplyAddress "reply-address" Network Fail
        "PA20 to PA23 must be this machine's address as the controller sees it: that is where it answers and reports.";
    ReplyPort "reply-port" Network Fail
        "PA24 must be the frame port: SMC controllers take frames from that port alone, and answer to it.";
    PortMissing "port-missing" Network Fail
        "The serial port of the link does not exist, so none of its drives can be reached.";
    PortTaken "port-taken" Network Fail
        "Another program has the serial port: two masters on one line garble each other.";
    PortForbidden "port-forbidden" Network Fail
        "The system does not let this user open the serial port; the service needs its drop-in for drives.";
    PortUnfit "port-unfit" Network Fail
        "The port is not a serial line, or cannot be set as the link needs it.";
    AdapterSlow "adapter-slow" Network Warn
        "The adapter delays answers, by 16 ms unless set otherwise, and a link that waits for each answer plays slowly.";
    EchoDiffers "echo-differs" Network Fail
        "Some two-wire adapters echo what is sent. If echoes and answers are confused, no exchange can be trusted.";
    LineNoise "line-noise" Network Warn
        "More came over the link than its units sent: by noise a request becomes another one, which a drive obeys, since neither family \
         has a checksum on a serial line.";
    FramePortFree "frame-port-free" Network Info
        "With port 0 in bind the frame port changes at every start, so PA24 cannot be compared with it.";

    IntervalLimit "interval-limit" Motion Fail
        "A Time longer than PA0b is cut to it, so the move takes less time: it is faster than what was proved.";
    IntervalUnlimited "interval-unlimited" Motion Warn
        "PA0b = 0 means no limit in the SMC manual; the IMAX manual does not say what it means.";
    SignedFilter "signed-filter" Motion Fail
        "An IMAX controller filters positions (PA51); its manual wants the filter off if positions go below 0 (section 5.7).";
    TimeIgnored "time-ignored" Motion Fail
        "With PA0a = 1 an IMAX controller uses the time between packets instead of the Time in them: a frame that comes \
         late or early is executed slower or faster than was proved.";
    HomesUnsearched "homes-unsearched" Motion Fail
        "With PA0e = 1 a reset moves to where the controller believes zero to be, without a search. After a power cycle it \
         has no zero, and every later position is off by the error; homing refuses this setting.";
    Encoder "encoder" Motion Fail
        "PA54 sets the lines of the encoders, 5,000 or 2,500, each of which makes two or four counts. If \
         pulses_per_rev matches neither, the seat moves too far or not far enough.";
    EncoderUnsure "encoder-unsure" Motion Warn
        "pulses_per_rev fits the encoder of PA54 with four counts for each line. Most seats have two, and no manual says \
         which; with the wrong one every move is twice as far and twice as fast.";
    EncoderDiffers "encoder-differs" Motion Fail
        "Controllers of one seat type have different encoder settings (PA54), so the same pulses mean different positions.";
    Lead "lead" Motion Fail
        "PA41, the lead of the screw, differs from the seat type's lead_mm, so one of them is wrong. If it is lead_mm, every \
         limit in millimetres is wrong too; if it is PA41, the rise after homing (PA40).";
    Stroke "stroke" Motion Fail
        "PA42 is the stroke set in the controller; that of the seat type is longer, so positions near its end are cut off \
         or run into the end stop.";
    Rise "rise" Motion Fail
        "Position 0 lies the rise after homing (PA40, or PA43 to PA48 where it is 0) above the mechanical zero. Rise and stroke \
         together are longer than the cylinder (PA42), so the upper end of the stroke is its end stop.";
    WordOrder "word-order" Motion Fail
        "In the word order of its dialect the controller's position registers read outside the stroke, or differ from its \
         reports; in the other order they do not. With the wrong order a motion would start from a position at which the \
         seat is not.";
    WordOrderOpen "word-order-open" Motion Warn
        "Both word orders make its position registers a position inside the stroke, but a different one; that of the dialect \
         is used.";
    Position "position" Motion Fail
        "An axis reads outside its stroke by more than rounding, or differs from a report at the same rest, so its position \
         is unknown: it lost its zero, or pulses, lead or stroke of the seat type are wrong.";
    BusPeriod "bus-period" Motion Fail
        "PA59 is the shortest time between commands to the drives. If it is longer than the frame period, frames pile up in \
         the controller, which then shortens their Time (PA06) or stops with Err21.";
    MotionLate "motion-late" Motion Warn
        "Filters and delays in the controller (PA50 and PA51 of IMAX, PA4c and PA4d of SMC) make motion later than the \
         film, and smooth it; trim can compensate for the delay.";
    AnaloguePosition "analogue-position" Motion Fail
        "With PA60 = 1 the analogue inputs also set positions (times PA61 over PA62): the seat does not go where it is sent.";
    LinkTooSlow "link-too-slow" Motion Fail
        "The link cannot carry segments at the rate set for it.";
    SoftLimits "soft-limits" Motion Fail
        "Registers 38 and 39 of a drive are not what homing wrote: past the stroke only these limits stop it.";
    ErrorLimits "error-limits" Motion Fail
        "Register 208 of a drive is not what homing wrote: it releases its motor too soon, or not when something blocks it.";
    DriveTorque "drive-torque" Motion Fail
        "Registers 206 and 207 of a drive are not what homing wrote: it is too weak to hold the seat, or too strong.";
    BrakeRate "brake-rate" Motion Fail
        "Register 19 of a drive is not what homing wrote: if its link dies it brakes too hard, or past the stroke.";
    AutoReset "auto-reset" Motion Fail
        "With PA0d above 0 the controller resets by itself some time after the last frame: the seat moves without a \
         command, perhaps in a pause with people on it.";
    FastForward "fast-forward" Motion Warn
        "With PA06 = 1 the controller shortens Time as soon as more than two frames are queued, so a burst of late frames \
         becomes a violent move. With 0 it lags behind instead.";
    FastForwardUnknown "fast-forward-unknown" Motion Fail
        "PA06 is neither 0 nor 1: no manual says what the controller does with a backlog.";
    Amplitude "amplitude" Motion Fail
        "PA55 other than 0 scales every position in the controller: the seat does not go where it is sent, and is not where \
         its acks say.";
    OutputsIgnored "outputs-ignored" Motion Warn
        "With PA9d = 1 the controller ignores the outputs in frames: no effect of a cue comes on, and none goes off.";

    OutputsInverted "outputs-inverted" Motion Fail
        "With PA05 = 1 an output is on when a frame says off: every effect runs between shows, and pauses when it is \
         called for.";
    PowerOnOutputs "power-on-outputs" Motion Warn
        "PA9f switches outputs on as soon as the controller has power; they stay on until the first frame.";

    SpeedUnlimited "speed-unlimited" Speed Fail
        "PA07 is the last limit on speed that the controller itself keeps; 0 is none that can be relied on.";
    AxisSpeedUnlimited "axis-speed-unlimited" Speed Fail
        "PA80 to PA85 limit the speed of each axis; 0 is no limit, so that only PA07 is left.";
    SpeedTooLow "speed-too-low" Speed Fail
        "The controller's limit is below the seat type's max_velocity_mm_s: it falls behind in fast passages, its queue \
         fills, and it then shortens Time (PA06) or stops with Err21.";
    SpeedTooHigh "speed-too-high" Speed Warn
        "The controller's limit is more than a tenth above the seat type's max_velocity_mm_s: it would not hold back \
         a move that is too fast for people.";

    EstopDisabled "estop-disabled" EmergencyStop Fail
        "With bit 0 of PA90 clear, the factory setting, the controller ignores every emergency stop input.";
    EstopNoInput "estop-no-input" EmergencyStop Fail
        "PA92 = 0 names no input: the emergency stop is enabled, but nothing can trigger it.";
    EstopAnd "estop-and" EmergencyStop Fail
        "PA92 joins its inputs with AND: with two buttons on two inputs, pressing one does nothing. Wire normally \
         closed buttons in series to one input.";
    EstopResumes "estop-resumes" EmergencyStop Fail
        "With PA91 = 0 the seat holds while the button is pressed and moves on by itself once it is let go; no \
         emergency stop may end without a reset.";
    EstopReturns "estop-returns" EmergencyStop Fail
        "With PA91 = 1 the seat moves to zero when the button is pressed, instead of stopping, and moves on by itself once \
         it is let go.";
    EstopAction "estop-action" EmergencyStop Fail
        "No manual explains this value of PA91, so it is unknown what the seat does in an emergency stop.";
    EstopIsBelts "estop-is-belts" EmergencyStop Fail
        "PA92 names the inputs of the belts (belt_inputs), as in the second example of the manual's section 5.6. The \
         controller has only one such function, so none of its inputs is an emergency stop, and opening the last belt \
         does to the seat what PA91 says, even in mid-show.";
    BeltsOpen "belts-open" EmergencyStop Warn
        "All belts that PA92 names are open, so the controller takes no motion; it does once one of them is closed.";
    EstopFilter "estop-filter" EmergencyStop Fail
        "PA93 is the time for which the input must be active before the seat stops; over 50 ms it moves on too long.";
    EstopRelease "estop-release" EmergencyStop Fail
        "PA94 limits the speed at which the seat leaves an emergency stop; 0 is not documented, and may mean no limit.";
    EstopReleaseFast "estop-release-fast" EmergencyStop Warn
        "PA94 is not below PA07, so the seat leaves an emergency stop at the full speed of a show.";
    EstopWire "estop-wire" EmergencyStop Warn
        "With PA04 = 1 an input is active when low, and an open one is high: a broken wire looks like a button that is not \
         pressed. With PA04 = 0 and a normally closed button, a broken wire stops the seat.";
    EstopResetInput "estop-reset-input" EmergencyStop Warn
        "With bit 3 of PA90 set and inputs in PA98, a press at an input resets the controller, and the seat moves; so \
         an emergency stop can be ended from there.";
    EstopResetShared "estop-reset-shared" EmergencyStop Fail
        "PA98 and PA92 name the same input: the press that stops the seat also resets it.";
    EstopJog "estop-jog" EmergencyStop Warn
        "Bit 1 or 2 of PA90 is set: inputs can move the seat by hand, also during a show.";
    EstopUnwatched "estop-unwatched" EmergencyStop Warn
        "estop_inputs of the configuration and PA92 name different inputs: controller and kinocue do not agree on what is \
         an emergency stop.";

    EmergencyStopActive "emergency-stop-active" Status Fail
        "An emergency stop is in effect now.";
    ActiveError "active-error" Status Fail
        "The controller or one of its drives reports an error now (chapter 6 of both manuals).";
    NotHome "not-home" Status Fail
        "Until it is homed, a drive counts from where it was switched on, so its position is unknown.";
    Restarted "restarted" Status Fail
        "The drives of a seat were not homed together: one of them has been off since, and counts from elsewhere.";
    OffPark "off-park" Status Warn
        "The seat stands elsewhere than at its park pose: a show was cut off, it was moved, or something pushes it. It is led slowly \
         from where it was read.";
    Killed "killed" Status Fail
        "A drive released its motor, because of an error or heat, and waits for a person.";
    DriveError "drive-error" Status Fail
        "A drive has a larger position error than allowed: something blocks it, or it is too weak.";
    DriveHot "drive-hot" Status Fail
        "A drive is too hot, and releases its motor if it gets hotter.";
    Supply "supply" Status Fail
        "The supply voltage of a drive left its range. Above it the drive releases its motor, and braking raises it.";
    StatusOff "status-off" Status Fail
        "With PA1f = 0 the controller never reports its state, so a drive's alarm between frames goes unnoticed.";
    StatusElsewhere "status-elsewhere" Status Fail
        "With PA1f = 2 reports go to PA25 to PA29; if that is not this machine, they are not received here.";
    StatusUnheard "status-unheard" Status Warn
        "By its settings the controller sends status reports to this machine, but none came: a firewall may be in the way, \
         or the firmware has no such reports.";
    StatusSlow "status-slow" Status Fail
        "PA1e is the interval of status reports: 0 sends one only when an alarm begins, and over 100 ms is too slow to \
         notice a loss in time.";
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
                | Self::OffPark
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
