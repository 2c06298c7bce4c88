//! From the text of a playlist to its entries, noting every fault.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use jiff::civil::Time;
use jiff::tz::TimeZone;
use toml::de::DeTable;

use super::{At, Entry as PlaylistEntry, EntryFilm, EntryPlaces, Playlist, Then};
use crate::config::{ConfigFaults, Entry, Faults, Section, level, stays_below, switches, trim};
use crate::film::timecode::Label;
use crate::library::CueId;

/// Characters of a note at the most.
const LONGEST_NOTE: usize = 200;
/// More than any day has.
const MAX_ENTRIES: usize = 1000;
/// The days of the week, Monday first.
const DAYS: [(&str, i8); 7] =
    [("mon", 0), ("tue", 1), ("wed", 2), ("thu", 3), ("fri", 4), ("sat", 5), ("sun", 6)];

impl Playlist {
    /// Reads a playlist; `path` names it in faults.
    ///
    /// # Errors
    /// [`ConfigFaults::Bad`] with every fault and its place. What only the library and the configuration can tell is not
    /// looked at: [`Playlist::check`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, ConfigFaults> {
        let mut faults = Faults::of(text);
        let (tree, errors) = DeTable::parse_recoverable(text);
        errors.iter().for_each(|error| faults.note_syntax(error));
        let playlist = root(path, tree.get_ref(), &mut faults);
        match playlist {
            Some(playlist) if faults.is_empty() => Ok(playlist),
            _ => Err(ConfigFaults::Bad(faults.into_list(path))),
        }
    }
}

fn root(path: &Path, table: &DeTable<'_>, faults: &mut Faults<'_>) -> Option<Playlist> {
    let mut section = Section::new("the playlist", 0, table, faults);
    section.require(&["title", "entry"]);
    let title = section.text("title");
    let timezone = timezone(&mut section);
    let entries_at = section.get("entry");
    section.finish();
    let entries = entries(entries_at?, faults);
    Some(Playlist { path: path.to_owned(), title: title?, timezone, entries })
}

fn timezone(section: &mut Section<'_, '_, '_>) -> Option<TimeZone> {
    let entry = section.get("timezone")?;
    let name = entry.text(section.faults)?;
    let zone = TimeZone::get(name).ok();
    if zone.is_none() {
        let message = format!("{name:?} is not a time zone here, such as Europe/Berlin (package tzdata)");
        entry.fault(section.faults, &message);
    }
    zone
}

fn entries(entry: Entry<'_>, faults: &mut Faults<'_>) -> Vec<PlaylistEntry> {
    if entry.value.is_table() {
        entry.fault(faults, "write [[entry]], with two brackets, once for each cue");
        return Vec::new();
    }
    let Some(tables) = entry.array(faults) else { return Vec::new() };
    if tables.is_empty() || tables.len() > MAX_ENTRIES {
        entry.fault(faults, &format!("{} entries are outside 1..={MAX_ENTRIES}", tables.len()));
    }
    let mut taken = BTreeMap::new();
    let mut sound = Vec::new();
    for table in tables.iter().take(MAX_ENTRIES) {
        if faults.is_full() {
            break;
        }
        let Some(read) = one(*table, faults) else { continue };
        for day in read.at.iter().flat_map(|at| at.days.iter().map(|day| (at.time, *day))) {
            refuse_repeat(table, day, &mut taken, faults);
        }
        sound.push(read);
    }
    sound
}

/// Notes a time that an entry before has too; `taken` holds time and day and where each was first met.
fn refuse_repeat(
    entry: &Entry<'_>,
    day: (Time, i8),
    taken: &mut BTreeMap<(Time, i8), usize>,
    faults: &mut Faults<'_>,
) {
    let first = *taken.entry(day).or_insert(entry.at);
    if first != entry.at {
        let line = faults.line(first);
        let weekday = DAYS[usize::from(day.1.unsigned_abs())].0;
        entry.fault(faults, &format!("starts at {} on {weekday}, as the one on line {line} does", day.0));
    }
}

fn one(entry: Entry<'_>, faults: &mut Faults<'_>) -> Option<PlaylistEntry> {
    let table = entry.table(faults)?;
    let mut section = Section::new("[[entry]]", entry.at, table, faults);
    section.require(&["cue"]);
    let cue = cue(&mut section);
    let preset = section.text("preset");
    let motion = level(&mut section, "level");
    let vibration = level(&mut section, "vibration");
    let trim_ms = trim(&mut section, "trim_ms");
    let film = film(&mut section);
    let movie = movie(&mut section, film.is_some());
    let effects_at = section.get("effects");
    let then = section.choice("then", &[("hold", Then::Hold), ("go", Then::Go)]);
    let at = at(&mut section);
    let note = note(&mut section);
    section.finish();
    let effects = effects_at.map(|entry| switches(entry, None, faults)).unwrap_or_default();
    let place = |key: &str| faults.place(table.get(key).map_or(entry.at, |value| value.span().start));
    Some(PlaylistEntry {
        cue: cue?,
        preset,
        level: motion,
        vibration,
        trim_ms,
        film: EntryFilm { begin: film, movie },
        effects,
        then: then.unwrap_or_default(),
        at,
        note,
        places: EntryPlaces {
            cue: place("cue"),
            preset: place("preset"),
            effects: place("effects"),
            film: place("film"),
            movie: place("movie"),
        },
    })
}

fn film(section: &mut Section<'_, '_, '_>) -> Option<Label> {
    let entry = section.get("film")?;
    let label = entry.text(section.faults)?.parse::<Label>();
    label.map_err(|error| entry.fault(section.faults, &error.to_string())).ok()
}

/// `"feature.mkv"`, below the folder of films.
fn movie(section: &mut Section<'_, '_, '_>, has_begin: bool) -> Option<String> {
    let entry = section.get("movie")?;
    let text = entry.text(section.faults)?;
    if !stays_below(text) {
        let message = format!("{text:?} is not a file in the folder of films; write it as \"feature.mkv\"");
        entry.fault(section.faults, &message);
    }
    if has_begin {
        entry.fault(
            section.faults,
            "its cue begins with it; film = is for a film that another player shows; omit one of them",
        );
    }
    Some(text.to_owned())
}

fn note(section: &mut Section<'_, '_, '_>) -> Option<String> {
    let entry = section.get("note")?;
    let text = entry.text(section.faults)?;
    let length = text.chars().count();
    if length > LONGEST_NOTE {
        entry.fault(section.faults, &format!("{length} characters are outside 1..={LONGEST_NOTE}"));
    }
    Some(text.to_owned())
}

fn cue(section: &mut Section<'_, '_, '_>) -> Option<CueId> {
    let entry = section.get("cue")?;
    let id = entry.text(section.faults)?.parse::<CueId>();
    id.map_err(|error| entry.fault(section.faults, &error.to_string())).ok()
}

fn at(section: &mut Section<'_, '_, '_>) -> Option<At> {
    let at = section.get("at");
    let time = at.and_then(|entry| entry.time(section.faults));
    let days_at = section.get("days");
    let days = days_at.map(|entry| days(entry, section.faults));
    if let (None, Some(entry)) = (at, days_at) {
        entry.fault(section.faults, "there is no time to start at on these days; add at = \"19:00\"");
    }
    Some(At { time: time?, days: days.unwrap_or_else(|| (0..7).collect()) })
}

/// `["mon", "tue"]`.
fn days(entry: Entry<'_>, faults: &mut Faults<'_>) -> BTreeSet<i8> {
    let Some(names) = entry.array(faults) else { return BTreeSet::new() };
    if names.is_empty() {
        entry.fault(faults, "is empty; omit it for all days");
    }
    names.iter().filter_map(|name| name.choice(&DAYS, faults)).collect()
}
