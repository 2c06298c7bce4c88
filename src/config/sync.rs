//! `[sync]`: the film that leads the shows of a hall, and who tells where it is; without the table each show is its own film.

use std::str::FromStr as _;
use std::time::Duration;

use super::fault::Faults;
use super::section::{Entry, Section};
use crate::film::chase::{JOIN_ABOVE, Rejoin};
use crate::film::chooser::MOST_SOURCES;
use crate::film::follower::PaceLimits;
use crate::film::source::{FilmArgs, FilmSource, milliseconds};
use crate::film::timecode::{Label, Timecode};
use crate::time::ShowTime;

/// How far from 1 a film's rate may be, and how much the seats may add to it: no more together than [`PaceLimits::MOST_OFF`].
const BAND: std::ops::RangeInclusive<f64> = 0.0..=0.015;
const SLEW: std::ops::RangeInclusive<f64> = 0.005..=0.02;
/// A tenth of it is 50 ms for a silent line, two timecode frames; with twice of it nobody notices within 4 s that a film stands.
const FREEWHEEL: std::ops::RangeInclusive<f64> = 0.1..=2.0;
/// Less is a source's own jitter, and more is seen in the picture.
const JOIN_MS: std::ops::RangeInclusive<u128> = 10..=200;

/// Kinds of sources; each has a table of its name.
const KINDS: [&str; 8] = ["ltc", "mpv", "mtc", "artnet", "osc", "http", "clock", "sound"];

/// The film that leads.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FilmSync {
    /// Who tells where it is; the first that can leads.
    pub(crate) sources: Vec<FilmArgs>,
    /// True if `start` says where the film is when a cue begins; else no show follows it.
    pub(crate) leads: bool,
    /// How much later than the film's timecode the motion is.
    pub(crate) offset: ShowTime,
    /// The paces that shows are proved at.
    pub(crate) pace: PaceLimits,
    /// Errors beyond it are joined, not slewed.
    pub(crate) join_above: Duration,
    /// For how long a source that falls silent is taken to run on, as a multiple of what its kind and the cause allow.
    pub(crate) freewheel: f64,
    /// When seats that hold may join again.
    pub(crate) rejoin: Rejoin,
    /// True if those may lead as well that have not proved themselves.
    pub(crate) allows_coarse: bool,
}

impl Default for FilmSync {
    fn default() -> Self {
        Self {
            sources: Vec::new(),
            leads: false,
            offset: ShowTime::ZERO,
            pace: PaceLimits::default(),
            join_above: JOIN_ABOVE,
            freewheel: 1.0,
            rejoin: Rejoin::Auto,
            allows_coarse: false,
        }
    }
}

impl FilmSync {
    /// Where the film is when a cue begins that an entry of a playlist may name the timecode of; `None` if no film leads it.
    ///
    /// # Errors
    /// Why the timecode is none of the film, for a person.
    pub(crate) fn begin(&self, named: Option<Label>) -> Result<Option<ShowTime>, String> {
        let Some(label) = named else { return Ok(self.leads.then_some(self.offset)) };
        let (rate, start) =
            self.sources.first().map_or((None, Label::default()), |args| (args.rate, args.start));
        // Without it a label says how many frames there were, and not how long they took.
        let rate = rate.ok_or_else(|| format!("film = \"{label}\" needs film_fps in [sync]"))?;
        let of = |label: Label| Timecode::of(label, rate).map_err(|error| error.to_string());
        let since = of(label)?.media_since(of(Label { drops: label.drops, ..start })?);
        Ok(Some(ShowTime::from_nanos(since.as_nanos().saturating_add(self.offset.as_nanos()))))
    }
}

/// Reads the table.
pub(super) fn sync(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<FilmSync> {
    let mut section = Section::new("[sync]", entry.at, entry.table(faults)?, faults);
    section.require(&["sources"]);
    let names = section.get("sources").and_then(|entry| entry.array(section.faults)).unwrap_or_default();
    if names.len() > MOST_SOURCES {
        names[MOST_SOURCES]
            .fault(section.faults, &format!("{MOST_SOURCES} sources can be ranked, not {}", names.len()));
    }
    let [fps, start] = ["film_fps", "start"].map(|key| section.text(key));
    let sources = names.iter().filter_map(|name| source(*name, &mut section)).collect::<Vec<_>>();
    refuse_twice(&sources, section.faults);
    let [ltc, sound] =
        ["ltc", "sound"].map(|kind| section.get(kind).and_then(|entry| latency(entry, section.faults)));
    let channel = section.get("ltc").and_then(|entry| channel(entry, section.faults)).unwrap_or(1);
    let films = section.get("mpv").map(|entry| films(entry, section.faults)).unwrap_or_default();
    let args = |(name, source): (Entry<'_>, FilmSource)| {
        let films = if matches!(source, FilmSource::Mpv(_)) { films.clone() } else { Vec::new() };
        let latency = match source {
            FilmSource::Ltc(_) => ltc,
            FilmSource::Sound(_) => sound,
            _ => None,
        };
        let latency = latency.unwrap_or_default();
        let args = FilmArgs::new(source, fps.as_deref(), start.as_deref());
        let args = args.map_err(|error| name.fault(section.faults, &error.to_string())).ok()?;
        Some(FilmArgs { latency, films, channel, ..args })
    };
    let sources = sources.into_iter().filter_map(args).collect();
    let pace = pace(&mut section);
    let freewheel = share(&mut section, "freewheel", FREEWHEEL).unwrap_or(1.0);
    let join_above = section.get("join_above").and_then(|entry| apart(entry, section.faults));
    let offset = section.get("offset").and_then(|entry| signed_ms(entry, section.faults)).unwrap_or_default();
    let rejoin =
        section.choice("rejoin", &[("auto", Rejoin::Auto), ("ask", Rejoin::Ask)]).unwrap_or(Rejoin::Auto);
    let allows_coarse = section.get("allow_coarse").and_then(|entry| entry.switch(section.faults));
    section.finish();
    let (leads, allows_coarse) = (start.is_some(), allows_coarse.unwrap_or(false));
    let join_above = join_above.unwrap_or(JOIN_ABOVE);
    Some(FilmSync { sources, leads, offset, pace, join_above, freewheel, rejoin, allows_coarse })
}

/// A source: by the name of its table, or whole, as `play --chase` takes it.
fn source<'t>(name: Entry<'t>, section: &mut Section<'t, '_, '_>) -> Option<(Entry<'t>, FilmSource)> {
    let text = name.text(section.faults)?;
    let whole = if text.contains(':') { text.to_owned() } else { of_table(name, text, section)? };
    let source = FilmSource::from_str(&whole);
    source.map_err(|error| name.fault(section.faults, &error.to_string())).ok().map(|source| (name, source))
}

/// Of two that are one a person could choose neither, and a rank would mean nothing.
fn refuse_twice(sources: &[(Entry<'_>, FilmSource)], faults: &mut Faults<'_>) {
    for (place, (name, source)) in sources.iter().enumerate() {
        if sources[..place].iter().any(|(_, before)| before == source) {
            name.fault(faults, &format!("{source} is named twice; name each source once, the best first"));
        }
    }
}

/// What a table says, as `play --chase` takes it.
fn of_table<'t>(name: Entry<'t>, text: &str, section: &mut Section<'t, '_, '_>) -> Option<String> {
    let Some(kind) = KINDS.into_iter().find(|kind| *kind == text) else {
        name.fault(section.faults, &format!("{text:?} is not one of {}", KINDS.join(", ")));
        return None;
    };
    // The key that says who, and the one that may be beside it.
    let (needed, more) = match kind {
        "ltc" => ("input", ""),
        "sound" => ("input", "index"),
        "mpv" => ("socket", ""),
        "mtc" => ("device", ""),
        "clock" => ("at", "max_error"),
        _ => ("from", "bind"),
    };
    let Some(entry) = section.get(kind) else {
        name.fault(section.faults, &format!("there is no [sync.{kind}]; it has to have {needed}"));
        return None;
    };
    let mut table =
        Section::new(format!("[sync.{kind}]"), entry.at, entry.table(section.faults)?, section.faults);
    table.require(if kind == "sound" { &["input", "index"] } else { std::slice::from_ref(&needed) });
    let said = table.text(needed);
    let beside = if more.is_empty() { None } else { table.text(more) };
    // How late it is, and which films count, are read for themselves.
    match kind {
        "ltc" => table.get("latency").or(table.get("channel")),
        "sound" => table.get("latency"),
        "mpv" => table.get("films"),
        _ => None,
    };
    table.finish();
    let beside = beside.map(|value| format!(",{more}={value}"));
    Some(format!("{kind}:{}{}", said?, beside.unwrap_or_default()))
}

/// The films that a player may lead with.
fn films(entry: Entry<'_>, faults: &mut Faults<'_>) -> Vec<String> {
    let films = entry.value.as_table().and_then(|table| table.get("films"));
    let films = films.and_then(|value| Entry::new("films", value).array(faults)).unwrap_or_default();
    films.iter().filter_map(|film| film.text(faults)).map(str::to_owned).collect()
}

fn latency(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Duration> {
    let table = entry.value.as_table()?;
    let entry = table.get("latency").map(|value| Entry::new("latency", value))?;
    let late = milliseconds(entry.text(faults)?).filter(|late| *late <= Duration::from_secs(1));
    if late.is_none() {
        entry.fault(faults, "is not a latency of up to a second; write it as \"10.6ms\"");
    }
    late
}

/// The channel of a line that has the timecode.
fn channel(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<u8> {
    let value = entry.value.as_table()?.get("channel")?;
    Entry::new("channel", value).whole_in(1..=64, faults)
}

/// `"40ms"`.
fn apart(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<Duration> {
    let text = entry.text(faults)?;
    let span = milliseconds(text).filter(|span| JOIN_MS.contains(&span.as_millis()));
    if span.is_none() {
        let (least, most) = (JOIN_MS.start(), JOIN_MS.end());
        entry.fault(
            faults,
            &format!("{text:?} is not a time within {least}ms to {most}ms; write it as \"40ms\""),
        );
    }
    span
}

/// How far the pace may be from the film's own, and that from 1: what seats cannot follow is not promised.
fn pace(section: &mut Section<'_, '_, '_>) -> PaceLimits {
    let default = PaceLimits::default();
    let band = share(section, "rate_band", BAND).unwrap_or(default.band);
    let pace = PaceLimits { band, slew: share(section, "slew", SLEW).unwrap_or(default.slew) };
    let named = section.get("rate_band").or_else(|| section.get("slew"));
    if let Some(entry) = named.filter(|_| !pace.is_kept_by_seats()) {
        let [both, most] = [pace.band + pace.slew, PaceLimits::MOST_OFF].map(|share| 100.0 * share);
        let what = format!(
            "rate_band and slew are {both:.2}% together; seats change their pace by at most {most}%: lower one"
        );
        entry.fault(section.faults, &what);
    }
    pace
}

/// `"0.15%"`.
fn share(
    section: &mut Section<'_, '_, '_>,
    key: &'static str,
    range: std::ops::RangeInclusive<f64>,
) -> Option<f64> {
    let entry = section.get(key)?;
    let text = entry.text(section.faults)?;
    let share = text.strip_suffix('%').and_then(|percent| percent.trim_end().parse::<f64>().ok());
    let share = share.map(|percent| percent / 100.0).filter(|share| range.contains(share));
    if share.is_none() {
        let (least, most) = (100.0 * range.start(), 100.0 * range.end());
        entry.fault(
            section.faults,
            &format!("{text:?} is not a share within {least}% to {most}%; write it as \"1%\""),
        );
    }
    share
}

/// `"-40ms"`, up to ten seconds either way.
fn signed_ms(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<ShowTime> {
    let text = entry.text(faults)?;
    let later =
        milliseconds(text.strip_prefix('-').unwrap_or(text)).filter(|span| *span <= Duration::from_secs(10));
    let Some(later) = later else {
        entry.fault(faults, &format!("{text:?} is not a time of up to 10000ms; write it as \"-40ms\""));
        return None;
    };
    Some(if text.starts_with('-') { ShowTime::ZERO - later } else { ShowTime::ZERO + later })
}

#[cfg(test)]
mod tests {
    use crate::config::tests::{faults_of, hall_with, with};
    use crate::film::source::FilmSource;

    #[test]
    fn without_the_table_each_show_is_its_own_film() {
        assert_eq!(with("").unwrap().sync, None);
    }

    #[test]
    fn sources_are_ranked_by_the_names_of_their_tables_or_whole() {
        let text = "[sync]\nsources = [\"ltc\", \"artnet\", \"mpv:/run/hall.sock\"]\nfilm_fps = \"25\"\nstart = \"01:00:00:00\"\n\
                    rate_band = \"0.2%\"\nslew = \"0.5 %\"\noffset = \"-40ms\"\nallow_coarse = true\n\
                    join_above = \"25ms\"\nfreewheel = \"50%\"\n\
                    [sync.ltc]\ninput = \"alsa:hw:2,0\"\nchannel = 2\nlatency = \"10.6ms\"\n\
                    [sync.artnet]\nfrom = \"10.0.0.20\"\nbind = \"10.0.0.2:6454\"\n";
        let sync = hall_with(text).sync.unwrap();
        let names: Vec<_> = sync.sources.iter().map(|args| args.source.to_string()).collect();
        assert_eq!(names, ["ltc:alsa:hw:2,0", "artnet:10.0.0.20", "mpv:/run/hall.sock"]);
        let late: Vec<_> = sync.sources.iter().map(|args| args.latency.as_micros()).collect();
        assert_eq!(late, [10_600, 0, 0]);
        assert!((sync.pace.band - 0.002).abs() < 1e-9 && (sync.pace.slew - 0.005).abs() < 1e-9);
        assert!(sync.leads && sync.allows_coarse && sync.offset.as_nanos() == -40_000_000);
        assert_eq!((sync.join_above.as_millis(), sync.freewheel, sync.sources[0].channel), (25, 0.5, 2));
        let bare = hall_with("[sync]\nsources = [\"mpv:/run/hall.sock\"]").sync.unwrap();
        assert!(!bare.leads && !bare.allows_coarse, "nobody follows what begins nowhere");
    }

    #[test]
    fn the_films_of_a_player_may_be_named() {
        let text = "[sync]\nsources = [\"mpv\"]\n[sync.mpv]\nsocket = \"/s\"\nfilms = [\"feature.mkv\"]\n";
        assert_eq!(hall_with(text).sync.unwrap().sources[0].films, ["feature.mkv"]);
        let wrong = faults_of(&text.replace("[\"feature.mkv\"]", "\"feature.mkv\""));
        assert!(wrong.iter().any(|fault| fault.contains("films")), "{wrong:?}");
    }

    #[test]
    fn the_sound_of_a_film_has_an_input_an_index_and_a_latency() {
        let table = "[sync.sound]\ninput = \"alsa:hw:2,0\"\nlatency = \"5ms\"\n";
        let sync =
            hall_with(&format!("[sync]\nsources = [\"sound\"]\n{table}index = \"/films/storm.kidx\"\n")).sync;
        let args = &sync.unwrap().sources[0];
        let FilmSource::Sound(sound) = &args.source else { panic!("{args:?}") };
        assert_eq!((sound.indexes[0].to_str(), args.latency.as_millis()), (Some("/films/storm.kidx"), 5));
        let faults = faults_of(&format!("[sync]\nsources = [\"sound\"]\n{table}"));
        assert!(faults.iter().any(|fault| fault.contains("index")), "{faults:?}");
    }

    #[test]
    fn an_entry_of_a_playlist_may_begin_elsewhere_in_the_film() {
        let sync = |more: &str| {
            hall_with(&format!("[sync]\nsources = [\"mpv:/s\"]\noffset = \"40ms\"\n{more}")).sync.unwrap()
        };
        let reel = sync("film_fps = \"25\"\nstart = \"01:00:00:00\"");
        let at =
            |text: &str| reel.begin(Some(text.parse().unwrap())).map(|at| at.unwrap().as_nanos() / 1_000_000);
        assert_eq!((at("01:10:00:05"), at("00:59:59:00")), (Ok(600_240), Ok(-960)));
        assert!(at("01:00:00:25").unwrap_err().contains("outside 0..=24"));
        assert_eq!(reel.begin(None).unwrap().map(|at| at.as_nanos()), Some(40_000_000));
        let loose = sync("");
        assert_eq!(loose.begin(None), Ok(None), "no film leads it");
        assert!(loose.begin(Some("01:00:00:00".parse().unwrap())).unwrap_err().contains("needs film_fps"));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place_and_what_to_write() {
        let wrong = [
            ("", "[sync] has no sources, which is needed"),
            ("sources = [\"tape\"]", "sources: \"tape\" is not one of ltc, mpv"),
            ("sources = [\"artnet\"]", "there is no [sync.artnet]; it has to have from"),
            ("sources = [\"artnet\"]\n[sync.artnet]\nbind = \"0.0.0.0:6454\"", "[sync.artnet] has no from"),
            ("sources = [\"artnet:anybody\"]", "has no sender"),
            ("sources = [\"mpv:/s\", \"osc:10.0.0.2\", \"mpv:/s\"]", "sources: mpv:/s is named twice"),
            (
                "sources = [\"mpv:/s\", \"mpv\"]\n[sync.mpv]\nsocket = \"/s\"",
                "sources: mpv:/s is named twice",
            ),
            ("sources = [\"mpv:/s\"]\nfilm_fps = \"26\"", "is not a frame rate; take 23.976"),
            ("sources = [\"mpv:/s\"]\nstart = \"1:2\"", "is not a timecode"),
            ("sources = [\"mpv:/s\"]\nrate_band = \"9%\"", "is not a share within 0% to 1.5%"),
            ("sources = [\"mpv:/s\"]\nrate_band = \"1.2%\"", "rate_band and slew are 2.20% together"),
            (
                "sources = [\"mpv:/s\"]\nslew = \"2%\"",
                "are 2.15% together; seats change their pace by at most 2%",
            ),
            ("sources = [\"mpv:/s\"]\nslew = 0.01", "expected a string"),
            ("sources = [\"mpv:/s\"]\noffset = \"1s\"", "write it as \"-40ms\""),
            (
                "sources = [\"ltc\"]\n[sync.ltc]\ninput = \"-\"\nlatency = \"2000ms\"",
                "not a latency of up to a second",
            ),
            ("sources = [\"mpv:/s\"]\njoin_above = \"9ms\"", "is not a time within 10ms to 200ms"),
            ("sources = [\"mpv:/s\"]\nfreewheel = \"5%\"", "is not a share within 10% to 200%"),
            ("sources = [\"ltc\"]\n[sync.ltc]\ninput = \"-\"\nchannel = 0", "0 is outside 1..=64"),
            ("sources = [\"mpv:/s\"]\nrank = 1", "rank: unknown key in [sync]"),
        ];
        for (text, says) in wrong {
            let faults = faults_of(&format!("[sync]\n{text}\n"));
            assert!(faults.iter().any(|fault| fault.contains(says)), "{text}: {faults:?}");
        }
    }
}
