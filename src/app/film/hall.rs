//! The film of a hall: its sources are read for as long as the configuration says so, whatever the hall does meanwhile.

use std::io;
use std::sync::Arc;

use super::{FilmReader, SharedTable, SourceRules};
use crate::config::FilmSync;
use crate::film::point::PublishedPoint;

/// The sources of a hall, over all its configurations.
#[derive(Debug, Default)]
pub(crate) struct HallFilm {
    reader: Option<(FilmSync, FilmReader)>,
}

impl HallFilm {
    /// Reads what that configuration names, and no longer what another did. Gives where the film is published.
    ///
    /// # Errors
    /// The system starts no thread. What is wrong with a source itself is noted beside it.
    pub(crate) fn follow(&mut self, sync: Option<&FilmSync>) -> io::Result<Option<Arc<PublishedPoint>>> {
        if self.reader.as_ref().map(|(before, _)| before) != sync {
            // What holds a port or a device goes first.
            self.reader = None;
            self.reader = sync.map(|sync| Ok::<_, io::Error>((sync.clone(), open(sync)?))).transpose()?;
        }
        Ok(self.reader.as_ref().map(|(_, reader)| reader.point()))
    }

    /// What is heard of it, for people.
    pub(crate) fn table(&self) -> Option<SharedTable> {
        self.reader.as_ref().map(|(_, reader)| reader.table())
    }
}

fn open(sync: &FilmSync) -> io::Result<FilmReader> {
    let rules = SourceRules { allows_coarse: sync.allows_coarse, band: sync.pace.band };
    FilmReader::open(&sync.sources, rules).map_err(io::Error::other)
}
