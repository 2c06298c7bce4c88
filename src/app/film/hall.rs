//! The film of a hall: its sources are read for as long as the configuration says so, whatever the hall does meanwhile.

use std::io;
use std::sync::Arc;

use super::{FilmReader, SharedTable, SourceRules};
use crate::app::player::{Player, PlayerLink};
use crate::config::{Config, FilmPlayer, FilmSync};
use crate::film::point::PublishedPoint;
use crate::film::source::{FilmArgs, FilmSource};

/// The sources of a hall, and its player, over all its configurations.
#[derive(Debug, Default)]
pub(crate) struct HallFilm {
    player: Option<(FilmPlayer, Player)>,
    reader: Option<(FilmSync, FilmReader)>,
}

impl HallFilm {
    /// Reads what that configuration names, and no longer what another did. Gives where the film is published.
    ///
    /// # Errors
    /// The system starts no thread. What is wrong with a source itself is noted beside it.
    pub(crate) fn follow(&mut self, config: &Config) -> io::Result<Option<Arc<PublishedPoint>>> {
        let film = config.film.as_ref();
        if self.player.as_ref().map(|(before, _)| before) != film {
            (self.reader, self.player) = (None, None);
            self.player =
                film.map(|film| Ok::<_, io::Error>((film.clone(), Player::start(film)?))).transpose()?;
        }
        let sync = config.sync.as_ref();
        if self.reader.as_ref().map(|(before, _)| before) != sync {
            // What holds a port or a device goes first.
            self.reader = None;
            let player = self.player.as_ref().map(|(_, player)| player);
            self.reader =
                sync.map(|sync| Ok::<_, io::Error>((sync.clone(), open(sync, player)?))).transpose()?;
        }
        Ok(self.reader.as_ref().map(|(_, reader)| reader.point()))
    }

    /// The way to the player, where there is one.
    pub(crate) fn player(&self) -> Option<PlayerLink> {
        self.player.as_ref().map(|(_, player)| player.link())
    }

    /// What is heard of it, for people.
    pub(crate) fn table(&self) -> Option<SharedTable> {
        self.reader.as_ref().map(|(_, reader)| reader.table())
    }
}

fn open(sync: &FilmSync, player: Option<&Player>) -> io::Result<FilmReader> {
    let rules =
        SourceRules { allows_coarse: sync.allows_coarse, band: sync.pace.band, freewheel: sync.freewheel };
    let mut sources = sync.sources.clone();
    // A film that is shown from here leads before all others; while there is none it is heard of nowhere, and others may.
    sources.splice(..0, player.map(|player| FilmArgs::of(FilmSource::Mpv(player.socket().to_owned()))));
    FilmReader::open(&sources, rules, player.map(Player::gate)).map_err(io::Error::other)
}
