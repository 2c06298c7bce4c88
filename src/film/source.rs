//! Which source leads a show, as it is written.

use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use jiff::civil::{DateTime, Time};
use jiff::{Timestamp, Zoned};

pub(crate) use super::lines::{LineKind, MtcInput, SoundLine};
use super::timecode::{FrameRate, Label, Timecode, TimecodeError};
use super::tracker::SourceKind;
use crate::time::{ShowTime, is_second_60};

/// A film that is found by its own sound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FilmSound {
    pub(crate) line: SoundLine,
    /// The index of the show's film, and those of others that may be heard.
    pub(crate) indexes: Vec<PathBuf>,
}

/// Who says where the film is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FilmSource {
    /// Linear timecode.
    Ltc(SoundLine),
    /// The film's own sound.
    Sound(FilmSound),
    /// mpv, by its socket (`--input-ipc-server`).
    Mpv(PathBuf),
    /// Timecode by MIDI.
    Mtc(MtcInput),
    /// Art-Net timecode of one sender.
    ArtNet(NamedSender),
    /// Positions that one player tells by OSC.
    Osc(NamedSender),
    /// Positions that one player tells by HTTP.
    Http(NamedSender),
    /// The clock of the day.
    Clock(ClockStart),
}

/// The one sender that is heard, and where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NamedSender {
    pub(crate) from: Ipv4Addr,
    pub(crate) bind: SocketAddrV4,
}

/// A film that begins at an hour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ClockStart {
    at: ClockTime,
    /// How far off the clock may be by its own account.
    pub(crate) max_error: Duration,
}

/// A time as people write it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ClockTime {
    Instant(Timestamp),
    /// Of the zone that this machine is in.
    Here(DateTime),
    Today(Time),
}

/// Where each is heard unless it is said otherwise; Art-Net has a port of its own.
const ARTNET_PORT: u16 = 6454;
const OSC_PORT: u16 = 8430;
const HTTP_PORT: u16 = 8431;
/// A clock that is off by more is no film clock: what is felt begins at some ten times that.
const CLOCK_ERROR: Duration = Duration::from_millis(1);
/// Films that a line is held against at once: each takes its share of the processor.
const MOST_INDEXES: usize = 8;
/// What there is to choose from.
const FORMS: &str = "use mpv:SOCKET, ltc:pipe:COMMAND, ltc:fifo:PATH, ltc:alsa:DEVICE, ltc:relay:SOCKET, ltc:-, ltc:FILE.wav, \
                     sound:INPUT,index=FILE.kidx with an INPUT as for ltc, mtc:DEVICE, artnet:FROM, osc:FROM, http:FROM or clock:TIME";

/// How a film is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct FilmArgs {
    /// Its source.
    pub(crate) source: FilmSource,
    /// Frames a second; found where none are given.
    pub(crate) rate: Option<FrameRate>,
    /// The timecode of the cue's beginning.
    pub(crate) start: Label,
    /// How long sound takes from the line to a block.
    pub(crate) latency: Duration,
    /// The channel of a line that has the timecode, counted from 1.
    pub(crate) channel: u8,
    /// The files that a player may lead with, by name or path; any where none is named.
    pub(crate) films: Vec<String>,
}

/// Why something that was written is none of this.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(crate) struct FilmArgError(String);

impl FilmArgError {
    pub(crate) fn of(error: &TimecodeError) -> Self {
        Self(error.to_string())
    }
}

impl FilmArgs {
    /// True if the file that a player has open is one that it may lead with.
    pub(crate) fn counts(&self, open: Option<&str>) -> bool {
        let is_it = |open: &str| {
            let name = open.rsplit('/').next().unwrap_or_default();
            self.films.iter().any(|film| film == open || film == name)
        };
        self.films.is_empty() || open.is_some_and(is_it)
    }

    /// Where a film is whose first frame is labelled 00:00:00:00 when the cue begins.
    pub(crate) fn begin(&self) -> ShowTime {
        let rate = self.rate.unwrap_or(FrameRate::F24);
        let of = |label| Timecode::of(label, rate).map(|code| rate.quarters(4 * i64::from(code.index())));
        of(self.start).unwrap_or(ShowTime::ZERO)
    }

    /// A source that tells the film's own time, from the cue's beginning on.
    pub(crate) fn of(source: FilmSource) -> Self {
        let (start, latency) = (Label::default(), Duration::ZERO);
        Self { source, rate: None, start, latency, channel: 1, films: Vec::new() }
    }

    /// What is written for them: a source, frames a second, and the timecode at which the cue begins.
    ///
    /// # Errors
    /// [`FilmArgError`] where one of them is nothing known.
    pub(crate) fn new(
        source: FilmSource,
        rate: Option<&str>,
        start: Option<&str>,
    ) -> Result<Self, FilmArgError> {
        let rate = rate.map(FrameRate::from_str).transpose().map_err(|error| FilmArgError::of(&error))?;
        let start = start.map(Label::from_str).transpose().map_err(|error| FilmArgError::of(&error))?;
        if let (Some(start), Some(rate)) = (start, rate) {
            Timecode::of(start, rate).map_err(|error| FilmArgError::of(&error))?;
        }
        Ok(Self { rate, start: start.unwrap_or_default(), ..Self::of(source) })
    }
}

impl FilmSource {
    pub(crate) const fn kind(&self) -> SourceKind {
        match self {
            Self::Ltc(_) => SourceKind::Ltc,
            Self::Sound(_) => SourceKind::Sound,
            Self::Mpv(_) => SourceKind::Mpv,
            Self::Mtc(_) => SourceKind::Mtc,
            Self::ArtNet(_) => SourceKind::ArtNet,
            Self::Osc(_) | Self::Http(_) => SourceKind::Message,
            Self::Clock(_) => SourceKind::WallClock,
        }
    }
}

impl fmt::Display for FilmSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ltc(line) => write!(f, "ltc:{line}"),
            Self::Sound(sound) => write!(f, "sound:{}", sound.line),
            Self::Mpv(path) => write!(f, "mpv:{}", path.display()),
            Self::Mtc(MtcInput::Device(path)) => write!(f, "mtc:{}", path.display()),
            Self::Mtc(MtcInput::Relay(socket)) => write!(f, "mtc:relay:{}", socket.display()),
            Self::ArtNet(sender) => write!(f, "artnet:{}", sender.from),
            Self::Osc(sender) => write!(f, "osc:{}", sender.from),
            Self::Http(sender) => write!(f, "http:{}", sender.from),
            Self::Clock(_) => f.write_str("clock"),
        }
    }
}

impl FromStr for FilmSource {
    type Err = FilmArgError;

    fn from_str(text: &str) -> Result<Self, FilmArgError> {
        let refuse = || FilmArgError(format!("{text} is not a source; {FORMS}"));
        let (kind, input) = text.split_once(':').filter(|(_, input)| !input.is_empty()).ok_or_else(refuse)?;
        match kind {
            // Paths and commands are taken as they are: a comma in one is no option.
            "ltc" => Ok(Self::Ltc(SoundLine::of(input))),
            "sound" => FilmSound::of(input).map(Self::Sound),
            "mpv" => Ok(Self::Mpv(input.into())),
            "mtc" => Ok(Self::Mtc(MtcInput::of(input))),
            "artnet" => NamedSender::of(input, ARTNET_PORT).map(Self::ArtNet),
            "osc" => NamedSender::of(input, OSC_PORT).map(Self::Osc),
            "http" => NamedSender::of(input, HTTP_PORT).map(Self::Http),
            "clock" => input.parse().map(Self::Clock),
            _ => Err(refuse()),
        }
    }
}

/// What stands before the comma, and the option behind it; an empty one where that is another.
fn with_option<'t>(text: &'t str, key: &str) -> (&'t str, Option<&'t str>) {
    let Some((first, more)) = text.split_once(',') else { return (text, None) };
    (first, Some(more.strip_prefix(key).unwrap_or_default()))
}

impl NamedSender {
    fn of(text: &str, port: u16) -> Result<Self, FilmArgError> {
        let (from, bind) = with_option(text, "bind=");
        let refuse = || {
            FilmArgError(format!(
                "{text} has no sender; give its address, such as 10.0.0.20, and optionally, after a comma, bind=0.0.0.0:{port}"
            ))
        };
        let from: Ipv4Addr = from.parse().map_err(|_| refuse())?;
        // Of these nobody sends: who writes one wants to hear everybody, and a stranger's timecode moves seats.
        if from.is_unspecified() || from.is_multicast() || from.is_broadcast() {
            return Err(refuse());
        }
        let anywhere = SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port);
        let bind = bind.map_or(Ok(anywhere), str::parse).map_err(|_| refuse())?;
        Ok(Self { from, bind })
    }
}

impl FromStr for ClockStart {
    type Err = FilmArgError;

    /// An instant with its offset, a date and time of this machine's zone, or a time of today.
    fn from_str(text: &str) -> Result<Self, FilmArgError> {
        let (time, most) = with_option(text, "max_error=");
        let at = ClockTime::of(time).ok_or_else(|| {
            FilmArgError(format!(
                "{time} is not a time; write 2026-11-21T19:00:00+01:00, 2026-11-21T19:00 or 19:00"
            ))
        })?;
        let max_error = match most {
            None => CLOCK_ERROR,
            Some(text) => milliseconds(text).ok_or_else(|| {
                FilmArgError(format!("{text} is not an error of a clock; write max_error=1ms, up to 20000ms"))
            })?,
        };
        Ok(Self { at, max_error })
    }
}

impl ClockStart {
    /// Nanoseconds since 1970; `None` if the day has no such time.
    pub(crate) fn at_ns(self, now: &Zoned) -> Option<i64> {
        let of = |civil: DateTime| civil.to_zoned(now.time_zone().clone()).ok().map(|at| at.timestamp());
        let at = match self.at {
            ClockTime::Instant(at) => Some(at),
            ClockTime::Here(civil) => of(civil),
            ClockTime::Today(time) => of(now.date().to_datetime(time)),
        };
        i64::try_from(at?.as_nanosecond()).ok()
    }
}

impl ClockTime {
    fn of(text: &str) -> Option<Self> {
        if is_second_60(text) {
            return None;
        }
        // A date alone would be midnight, which nobody means who writes no time.
        let here = || text.parse().ok().filter(|_| text.contains(['T', ' '])).map(Self::Here);
        let today = || text.parse().ok().map(Self::Today);
        text.parse().ok().map(Self::Instant).or_else(here).or_else(today)
    }
}

/// A time as it is written in a configuration, `10.6ms`.
pub(crate) fn milliseconds(text: &str) -> Option<Duration> {
    let ms = text.strip_suffix("ms")?.parse::<f64>().ok().filter(|ms| (0.0..=20_000.0).contains(ms))?;
    Some(Duration::from_secs_f64(ms / 1e3))
}

impl FilmSound {
    /// An input, and behind it each index: whatever else a command or a path holds is its own.
    fn of(text: &str) -> Result<Self, FilmArgError> {
        let mut parts = text.split(",index=");
        let line = parts.next().unwrap_or_default();
        let indexes: Vec<PathBuf> = parts.map(PathBuf::from).collect();
        let is_named = |path: &PathBuf| !path.as_os_str().is_empty();
        if line.is_empty()
            || indexes.is_empty()
            || !indexes.iter().all(is_named)
            || indexes.len() > MOST_INDEXES
        {
            return Err(FilmArgError(format!(
                "sound:{text} is not an input with 1 to {MOST_INDEXES} indexes; write sound:alsa:hw:2,0,index=FILM.kidx, the show's film \
                 first, and make the index with `kinocue sync index FILM -o FILM.kidx`"
            )));
        }
        Ok(Self { line: SoundLine::of(line), indexes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_form_of_a_source_is_read_and_others_are_told_what_there_is() {
        let of = |text: &str| text.parse::<FilmSource>();
        let ltc = |input| Ok(FilmSource::Ltc(input));
        assert_eq!(of("ltc:-"), ltc(SoundLine::Stdin));
        assert_eq!(of("ltc:pipe:sox a.wav -t raw -"), ltc(SoundLine::Pipe("sox a.wav -t raw -".to_owned())));
        assert_eq!(of("ltc:fifo:/run/ltc"), ltc(SoundLine::Fifo("/run/ltc".into())));
        assert_eq!(of("ltc:alsa:hw:2,0"), ltc(SoundLine::Alsa("hw:2,0".to_owned())));
        assert_eq!(of("mpv:/run/mpv.sock"), Ok(FilmSource::Mpv("/run/mpv.sock".into())));
        assert_eq!(of("ltc:reel:1.wav"), ltc(SoundLine::File("reel:1.wav".into())));
        let mtc = |input| Ok(FilmSource::Mtc(input));
        assert_eq!(of("mtc:/dev/snd/midiC1D0"), mtc(MtcInput::Device("/dev/snd/midiC1D0".into())));
        assert_eq!(of("mtc:relay:/run/mtc.sock"), mtc(MtcInput::Relay("/run/mtc.sock".into())));
        assert_eq!(of("ltc:relay:/run/ltc.sock"), ltc(SoundLine::Relay("/run/ltc.sock".into())));
        let named = |from: &str, bind: &str| NamedSender {
            from: from.parse().expect("an address"),
            bind: bind.parse().expect("an address and a port"),
        };
        assert_eq!(of("artnet:10.0.0.20"), Ok(FilmSource::ArtNet(named("10.0.0.20", "0.0.0.0:6454"))));
        let osc = named("10.0.0.20", "127.0.0.1:9000");
        assert_eq!(of("osc:10.0.0.20,bind=127.0.0.1:9000"), Ok(FilmSource::Osc(osc)));
        assert_eq!(of("http:127.0.0.1"), Ok(FilmSource::Http(named("127.0.0.1", "0.0.0.0:8431"))));
        let sound = FilmSound {
            line: SoundLine::Alsa("hw:2,0".to_owned()),
            indexes: vec!["film.kidx".into(), "trailer.kidx".into()],
        };
        let text = "sound:alsa:hw:2,0,index=film.kidx,index=trailer.kidx";
        assert_eq!(of(text), Ok(FilmSource::Sound(sound)));
        assert_eq!(of(text).map(|source| source.to_string()), Ok("sound:alsa:hw:2,0".to_owned()));
        for text in ["sound:-", "sound:,index=film.kidx", "sound:-,index="] {
            let error = of(text).expect_err(text).to_string();
            assert!(error.contains("kinocue sync index"), "{error}");
        }
        for text in ["", "ltc", "ltc:", "tape:1"] {
            let error = of(text).expect_err(text).to_string();
            assert!(error.contains("ltc:FILE.wav"), "{error}");
        }
    }

    #[test]
    fn a_sender_has_to_be_named_and_a_clock_to_be_a_time() {
        let refused = [
            ("artnet:", "artnet:FROM"),
            ("artnet:0.0.0.0", "has no sender"),
            ("osc:255.255.255.255", "has no sender"),
            ("http:10.0.0.20,port=80", "bind=0.0.0.0:8431"),
            ("artnet:hall.local", "has no sender"),
            ("clock:soon", "19:00"),
            ("clock:2026-11-21", "2026-11-21T19:00"),
            ("clock:19:00:60", "19:00"),
            ("clock:190060", "19:00"),
            ("clock:2026-11-21 19:00:60", "19:00"),
            ("clock:2026-11-21T19:00:60.5+01:00", "19:00"),
            ("clock:19:00,max_error=1", "max_error=1ms"),
            ("clock:19:00,max_error=-1ms", "20000ms"),
        ];
        for (text, says) in refused {
            let error = text.parse::<FilmSource>().expect_err(text).to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
        let now = "2026-11-21T12:00[Europe/Berlin]".parse().expect("a time");
        let read = |text: &str| text.parse::<ClockStart>().expect(text);
        let at_ns = |text: &str| read(text).at_ns(&now);
        let evening = Some(1_795_284_000_000_000_000);
        for text in ["2026-11-21T19:00:00+01:00", "2026-11-21T18:00Z", "2026-11-21T19:00", "19:00"] {
            assert_eq!(at_ns(text), evening, "{text}");
        }
        assert_eq!(read("19:00,max_error=2.5ms").max_error, Duration::from_micros(2_500));
        assert_eq!(read("19:00").max_error, CLOCK_ERROR);
    }

    #[test]
    fn a_player_leads_with_the_films_that_are_named_by_name_or_path_and_with_any_where_none_is() {
        let mut args = FilmArgs::of(FilmSource::Mpv("/s".into()));
        assert!(args.counts(None) && args.counts(Some("/srv/trailer.mkv")));
        args.films = vec!["feature.mkv".to_owned(), "/srv/two.mkv".to_owned()];
        let counts = ["/srv/feature.mkv", "feature.mkv", "/srv/two.mkv"].map(|open| args.counts(Some(open)));
        assert_eq!(counts, [true; 3]);
        let others =
            ["/srv/trailer.mkv", "two.mkv", "/srv/feature.mkv/", ""].map(|open| args.counts(Some(open)));
        assert_eq!((others, args.counts(None)), ([false; 4], false));
    }

    #[test]
    fn rate_and_start_are_read_and_refused_in_words() {
        let args = |rate, start| FilmArgs::new(FilmSource::Ltc(SoundLine::Stdin), rate, start);
        let read = args(Some("29.97"), Some("01:00:00;02")).expect("both are sound");
        assert_eq!((read.start.hours, read.start.drops), (1, true));
        for (rate, start) in [(Some("26"), None), (None, Some("1:2"))] {
            let error = args(rate, start).expect_err("it is not").to_string();
            assert!(error.contains("use") || error.contains("take") || error.contains("write"), "{error}");
        }
    }
}
