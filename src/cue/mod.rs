//! Cues: from a file (CSV, MCAP, or a format of the field) to motion in memory, whole, before anything moves. Control
//! thread. Every fault of a file is named with its place. `cues/README.md` teaches our own formats.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

mod builder;
mod bytes;
mod csv;
mod csv_write;
mod declared;
mod fault;
mod header;
pub(crate) mod limits;
mod mcap;
mod number;
mod other_kind;
mod place;
mod problem;
mod rows;
mod splice;
mod spreadsheet;
mod steps;
mod table;
mod tracks;
mod unit;
mod value;

pub(crate) use builder::CueBuilder;
pub(crate) use csv::comments;
pub(crate) use csv_write::CsvError;
pub use csv_write::write as write_csv;
pub(crate) use csv_write::write_with as write_csv_with;
pub use fault::CueFaults;
pub(crate) use fault::{Collector, FAULTS_TOLD, Fault, FaultClass, Place};
pub use mcap::recover;
pub use mcap::write as write_mcap;
use other_kind::{ends_in, refuse_other_kind};
use place::{CueFile, Origin};
pub(crate) use problem::Problem;
pub(crate) use splice::Splice;
pub(crate) use steps::Steps;
pub use steps::TrackStep;
pub(crate) use tracks::{Tracks, Vibration};
pub(crate) use unit::{DeclaredUnit, Interpolation, Unit, Units, UnknownInterpolation};

use crate::channel::{ChannelId, Sample};
use crate::container::MAGIC;
use crate::kind;
use crate::plain;
use crate::sys;
use crate::time::ShowTime;

/// What a file is said to be; nothing about it is guessed but CSV or MCAP.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Source {
    /// A cue of our own: MCAP where it begins as one or its name ends in `.mcap`, else CSV.
    #[default]
    Native,
    /// A CSV cue as a spreadsheet of any language saves it.
    Spreadsheet,
    /// Rows `line,time_ms,x,y,z,u,v,w` of a motion editor, with durations instead of times.
    Rows {
        /// The unit of the positions, which such a file does not say.
        unit: DeclaredUnit,
    },
    /// Raw bytes, one an axis, axis 1 first; 0 to 255 over the stroke.
    U8 {
        /// Axes, 1 to 12.
        axes: usize,
        /// Rows a second, above 0.
        rate_hz: f64,
    },
}

/// What a cue switches over time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Effects {
    /// Effects by name; bit i of a step says whether effect i is on.
    Named {
        /// The effects' names, at most [`limits::MAX_EFFECTS`].
        names: Vec<String>,
        /// Which are on, and from when.
        steps: Steps<u32>,
    },
    /// The raw output word; only its low 12 bits have outputs.
    Words(Steps<u16>),
}

impl Default for Effects {
    fn default() -> Self {
        Self::Named { names: Vec::new(), steps: Steps::default() }
    }
}

/// A named instant of a cue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Marker {
    /// When.
    pub(crate) at: ShowTime,
    /// What it is called.
    pub name: String,
}

/// A cue in memory: at least two rows of positions, the first at show time 0, and what goes with them.
#[derive(Debug, Clone, PartialEq)]
pub struct Cue {
    file: CueFile,
    title: Option<String>,
    units: Units,
    interpolation: Interpolation,
    axes: usize,
    times: Vec<ShowTime>,
    positions: Vec<f64>,
    origin: Origin,
    tracks: Tracks,
    effects: Effects,
    markers: Vec<Marker>,
}

impl Cue {
    /// A cue with nothing in it yet.
    fn blank(path: &Path) -> Self {
        Self {
            file: CueFile { path: path.to_owned(), kept: None },
            title: None,
            units: Units::default(),
            interpolation: Interpolation::default(),
            axes: 0,
            times: Vec::new(),
            positions: Vec::new(),
            origin: Origin::default(),
            tracks: Tracks::default(),
            effects: Effects::default(),
            markers: Vec::new(),
        }
    }

    /// The file it was read from.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.file.path
    }

    /// Its title, where it has one.
    #[must_use]
    pub fn title(&self) -> Option<&str> {
        self.title.as_deref()
    }

    /// Gives it another title.
    pub(crate) fn set_title(&mut self, title: String) {
        self.title = Some(title_of(&title));
    }

    /// The units of positions and amplitudes in memory.
    #[must_use]
    pub(crate) const fn units(&self) -> Units {
        self.units
    }

    /// The word for these in a file.
    #[must_use]
    pub(crate) fn unit_words(&self) -> String {
        self.units.words(self.axes)
    }

    /// How the curve runs between the rows.
    #[must_use]
    pub(crate) const fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Axes, 1 to 12.
    #[must_use]
    pub const fn axes(&self) -> usize {
        self.axes
    }

    /// Rows, 2 to [`limits::MAX_ROWS`].
    #[must_use]
    pub fn rows(&self) -> usize {
        self.times.len()
    }

    /// Show times of the rows, strictly increasing from 0.
    #[must_use]
    pub fn times(&self) -> &[ShowTime] {
        &self.times
    }

    /// Positions `[row][axis]`, row after row, each in the unit of its axis.
    #[must_use]
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// Positions of one row, axis 1 first.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub(crate) fn row(&self, row: usize) -> &[f64] {
        &self.positions[row * self.axes..][..self.axes]
    }

    /// The time of the last row.
    #[must_use]
    pub(crate) fn duration(&self) -> ShowTime {
        self.times.last().copied().unwrap_or_default()
    }

    /// What the channels of the table carry; one that the file does not have has no steps.
    #[must_use]
    pub const fn tracks(&self) -> &Tracks {
        &self.tracks
    }

    /// What the cue switches.
    #[must_use]
    pub(crate) const fn effects(&self) -> &Effects {
        &self.effects
    }

    /// True if something that it switches changes at that very time.
    #[must_use]
    pub(crate) fn switches_at(&self, at: ShowTime) -> bool {
        let switches = match &self.effects {
            Effects::Named { steps, .. } => steps.changes_at(at),
            Effects::Words(steps) => steps.changes_at(at),
        };
        switches || self.tracks.used().any(|(_, steps)| steps.changes_at(at))
    }

    /// Named instants, in order of time.
    #[must_use]
    pub fn markers(&self) -> &[Marker] {
        &self.markers
    }

    /// The same with its file as it was opened, for whoever may open nothing any more once a place in it is asked for.
    pub(crate) fn keeping(mut self, file: Arc<File>) -> Self {
        self.file.kept = Some(file);
        self
    }

    /// The line a row came from, or the number of its message or byte row, from 1.
    #[must_use]
    pub(crate) fn line(&self, row: usize) -> u64 {
        self.origin.line(row)
    }

    /// Where a row's position of an axis stands in the file. Reads the file again for the column; where it has
    /// changed since, the column is 1.
    #[must_use]
    pub(crate) fn place(&self, row: usize, axis: usize) -> Place {
        let time = self.times.get(row).copied().unwrap_or_default();
        self.origin.place(&self.file, row, axis, time)
    }

    /// Where the header of its file names a column, or where that column has what holds from `at` on; the file as a whole where
    /// it has no such header. Reads the file again.
    #[must_use]
    pub(crate) fn column_place(&self, column: &str, at: Option<ShowTime>) -> Place {
        let row = at.map(|at| self.times.partition_point(|time| *time <= at).saturating_sub(1));
        self.origin.column_place(&self.file, column, row)
    }

    /// The same cue with other rows. What has a place in it is then placed by the number of its row.
    ///
    /// # Panics
    /// If there are not as many positions as rows times axes.
    #[must_use]
    pub(crate) fn with_rows(
        &self,
        times: Vec<ShowTime>,
        positions: Vec<f64>,
        interpolation: Interpolation,
    ) -> Self {
        assert_eq!(positions.len(), times.len() * self.axes, "each row has a position for each axis");
        Self {
            file: self.file.clone(),
            title: self.title.clone(),
            origin: Origin::Messages,
            tracks: self.tracks.clone(),
            effects: self.effects.clone(),
            markers: self.markers.clone(),
            times,
            positions,
            interpolation,
            ..*self
        }
    }

    /// The same cue with other vibrations, one for each change of each axis.
    #[must_use]
    pub(crate) fn with_vibration(self, tracks: &[Vec<Vibration>]) -> Self {
        let mut changed = self.tracks.clone();
        for (axis, values) in tracks.iter().enumerate() {
            let values: Vec<Sample> = values.iter().copied().map(Sample::from).collect();
            let steps = changed.of_mut(ChannelId::Vibration.on(axis));
            *steps = steps.with_values(&values);
        }
        Self { tracks: changed, ..self }
    }

    /// Sets a marker.
    ///
    /// # Errors
    /// Where it is outside the cue, or its name is too long.
    pub(crate) fn mark(&mut self, at: ShowTime, name: &str) -> Result<(), Problem> {
        if at > self.duration() {
            return Err(Problem::MarkerOutside(at, self.duration()));
        }
        if name.len() > limits::MAX_MARKER_NAME {
            return Err(Problem::MarkerName(name.len()));
        }
        let place = self.markers.partition_point(|marker| marker.at <= at);
        self.markers.insert(place, Marker { at, name: name.to_owned() });
        Ok(())
    }

    fn shrink(&mut self) {
        self.times.shrink_to_fit();
        self.positions.shrink_to_fit();
        self.tracks.shrink();
        match &mut self.effects {
            Effects::Named { steps, .. } => steps.shrink(),
            Effects::Words(steps) => steps.shrink(),
        }
    }
}

/// Reads a whole cue from a file.
///
/// # Errors
/// Every fault of the file with its place, the first [`FAULTS_TOLD`] in words.
pub fn load(path: &Path, source: &Source) -> Result<Cue, CueFaults> {
    read(path, open(path)?, source)
}

/// Opens a cue file.
///
/// # Errors
/// A fault of class [`FaultClass::NoInput`] where there is none, it is a folder, a pipe or a device, or the system refuses; one of class
/// [`FaultClass::BadCue`] where it is over [`limits::MAX_FILE`].
pub(crate) fn open(path: &Path) -> Result<File, CueFaults> {
    let file = sys::file::open(path).map_err(|error| {
        let problem = match error.kind() {
            io::ErrorKind::NotFound => Problem::Missing,
            io::ErrorKind::IsADirectory => Problem::Folder,
            io::ErrorKind::PermissionDenied => Problem::Denied,
            _ => Problem::Unopened(error.to_string()),
        };
        CueFaults::one(path, problem)
    })?;
    match file.metadata() {
        Ok(metadata) if metadata.len() > limits::MAX_FILE => Err(CueFaults::one(path, Problem::FileTooLarge)),
        _ => Ok(file),
    }
}

/// Reads a whole cue from `input`; `path` names it in faults.
///
/// # Errors
/// Every fault of the content with its place, the first [`FAULTS_TOLD`] in words.
pub fn read(path: &Path, input: impl Read, source: &Source) -> Result<Cue, CueFaults> {
    let mut cue = match *source {
        Source::Native => read_native(path, input)?,
        Source::Spreadsheet => spreadsheet::read(path, input)?,
        Source::Rows { unit } => rows::read(path, input, unit)?,
        Source::U8 { axes, rate_hz } => bytes::read(path, input, axes, rate_hz)?,
    };
    cue.shrink();
    Ok(cue)
}

/// A title as it is kept: one line that does nothing but be read, in reports, on pages and in the files that are made of the cue.
fn title_of(text: &str) -> String {
    plain::escaped(text, limits::MAX_TITLE).into_owned()
}

/// True if a file that begins so is MCAP.
#[must_use]
pub(crate) fn is_mcap(front: &[u8]) -> bool {
    front.starts_with(MAGIC)
}

/// Reads a cue of our own: the content says whether it is MCAP, and a name in `.mcap` that it should be.
fn read_native(path: &Path, mut input: impl Read) -> Result<Cue, CueFaults> {
    let mut front = Vec::new();
    if let Err(error) = input.by_ref().take(kind::FRONT as u64).read_to_end(&mut front) {
        return Err(CueFaults::one(path, Problem::Unread(error.to_string())));
    }
    let (named_so, begins_so) = (ends_in(path, "mcap"), is_mcap(&front));
    if !named_so && !begins_so {
        refuse_other_kind(path, &front)?;
    }
    let input = front.as_slice().chain(input);
    if named_so || begins_so { mcap::read(path, input) } else { csv::read(path, input) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timeline::Timeline;

    #[test]
    fn a_missing_file_and_a_folder_are_told_from_bad_data() {
        let folder = tempfile::tempdir().unwrap();
        let class = |path: &Path| load(path, &Source::Native).unwrap_err().class();
        assert_eq!(class(&folder.path().join("none.csv")), FaultClass::NoInput);
        assert_eq!(class(folder.path()), FaultClass::NoInput);
        assert_eq!(class(Path::new("/dev/zero")), FaultClass::NoInput);
        let path = folder.path().join("empty.csv");
        File::create(&path).unwrap();
        assert_eq!(class(&path), FaultClass::BadCue);
        File::create(&path).unwrap().set_len(limits::MAX_FILE + 1).unwrap(); // a hole, it takes no space
        let faults = load(&path, &Source::Native).unwrap_err();
        assert!(
            faults.to_string().ends_with("has more than 2147483648 bytes, the limit of a cue file"),
            "{faults}"
        );
    }

    #[test]
    fn a_failing_disk_is_told_from_bad_data() {
        struct Failing;
        impl Read for Failing {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("gone"))
            }
        }
        for (name, source) in [("a.csv", Source::Native), ("a.u8", Source::U8 { axes: 1, rate_hz: 1.0 })] {
            let begun = "time_ms,a1\n0,0\n".as_bytes().chain(Failing);
            let faults = read(Path::new(name), begun, &source).unwrap_err();
            assert_eq!(faults.class(), FaultClass::Io, "{faults}");
        }
    }

    #[test]
    fn what_is_found_after_loading_still_has_its_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "# units: mm\ntime_ms,fx_air,a1,a2\n0,0,1,1\n\n10,0,2, 160\n").unwrap();
        let timeline = Timeline::new(load(&path, &Source::Native).unwrap());
        let seat = crate::motion::SeatType::bench3(2);
        let faults = timeline.fits_stroke(0..2, Some(&seat)).faults.unwrap();
        assert_eq!(faults.told()[0].to_string(), "5:9: a2: 160 is outside the stroke, 0 to 150 mm");
        let air = |at| timeline.cue().column_place("fx_air", at);
        assert_eq!(air(None), Place::Text { line: 2, column: 9 });
        assert_eq!(air(Some(ShowTime::from_millis(10))), Place::Text { line: 5, column: 4 });
        std::fs::remove_file(&path).unwrap();
        assert_eq!(timeline.cue().place(1, 1), Place::Text { line: 5, column: 1 });
    }
}
