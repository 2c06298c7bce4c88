//! The flight recorder's file: of fixed size, written round and round. Each block of entries has a number and a checksum, so that what
//! was whole when the program was killed is found again, in its order.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt as _, OpenOptionsExt as _};
use std::path::Path;

use super::cursor::Cursor;

/// What the file begins with, its layout in the last octet.
const MAGIC: [u8; 8] = *b"KINOFLT1";
/// What each block begins with.
const BLOCK_MAGIC: [u8; 4] = *b"KFBL";
/// Octets before the opening: magic, its length and checksum u32, octets of the ring u64.
const HEAD_LEN: usize = 24;
/// Octets before the entries of a block: magic, length and checksum u32, number u64.
const BLOCK_HEAD_LEN: usize = 20;
/// Blocks begin at multiples of it, where a reader looks for them.
const STEP: u64 = 512;

/// A message on its way into a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Entry {
    /// Its place among the channels of the opening.
    pub(crate) channel: u16,
    /// When, ns since 1970.
    pub(crate) log_time: u64,
    /// Its octets.
    pub(crate) data: Vec<u8>,
}

/// The file as it is written.
#[derive(Debug)]
pub(crate) struct Flight {
    file: File,
    ring_at: u64,
    room: u64,
    at: u64,
    number: u64,
    block: Vec<u8>,
}

impl Flight {
    /// Begins one with room for so many octets, in the place of any that is there; `opening` is given to whoever reads it.
    ///
    /// # Errors
    /// Where there is no room for it, or no folder.
    pub(crate) fn create(path: &Path, opening: &[u8], room: u64) -> io::Result<Self> {
        // Not that file itself: whoever waits for a disk yet may go on to write to it.
        if let Err(error) = fs::remove_file(path)
            && error.kind() != io::ErrorKind::NotFound
        {
            return Err(error);
        }
        let file = OpenOptions::new().read(true).write(true).create_new(true).mode(0o640).open(path)?;
        let ring_at = (HEAD_LEN as u64 + opening.len() as u64).next_multiple_of(STEP);
        let room = room.next_multiple_of(STEP);
        // So that no other program can take the room later.
        rustix::fs::fallocate(&file, rustix::fs::FallocateFlags::empty(), 0, ring_at + room)?;
        let len = u32::try_from(opening.len()).map_err(io::Error::other)?;
        let mut head = MAGIC.to_vec();
        head.extend_from_slice(&len.to_le_bytes());
        head.extend_from_slice(&crc32fast::hash(opening).to_le_bytes());
        head.extend_from_slice(&room.to_le_bytes());
        head.extend_from_slice(opening);
        file.write_all_at(&head, 0)?;
        Ok(Self { file, ring_at, room, at: 0, number: 0, block: vec![0; BLOCK_HEAD_LEN] })
    }

    /// Adds an entry to the block that is next.
    pub(crate) fn put(&mut self, entry: &Entry) {
        let Ok(len) = u32::try_from(entry.data.len()) else { return };
        self.block.extend_from_slice(&entry.channel.to_le_bytes());
        self.block.extend_from_slice(&entry.log_time.to_le_bytes());
        self.block.extend_from_slice(&len.to_le_bytes());
        self.block.extend_from_slice(&entry.data);
    }

    /// Writes the block that is next, over the oldest; one that is larger than half of all the room is lost.
    ///
    /// # Errors
    /// Where writing fails; the block is lost then.
    pub(crate) fn write(&mut self) -> io::Result<()> {
        let Self { file, ring_at, room, at, number, block } = self;
        let len = block.len() as u64;
        if block.len() == BLOCK_HEAD_LEN {
            return Ok(());
        }
        if len > *room / 2 {
            block.truncate(BLOCK_HEAD_LEN);
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        if *at + len > *room {
            *at = 0;
        }
        let entries = u32::try_from(block.len() - BLOCK_HEAD_LEN).map_err(io::Error::other)?;
        block[..4].copy_from_slice(&BLOCK_MAGIC);
        block[4..8].copy_from_slice(&entries.to_le_bytes());
        block[12..20].copy_from_slice(&number.to_le_bytes());
        let sum = crc32fast::hash(&block[12..]);
        block[8..12].copy_from_slice(&sum.to_le_bytes());
        let written = file.write_all_at(block, *ring_at + *at);
        *at = (*at + len).next_multiple_of(STEP);
        *number += 1;
        block.truncate(BLOCK_HEAD_LEN);
        written
    }

    /// What it holds, oldest first.
    ///
    /// # Errors
    /// Where reading fails.
    pub(crate) fn read(&self) -> io::Result<Vec<Entry>> {
        Ok(read(&self.file)?.map(|(_, entries)| entries).unwrap_or_default())
    }
}

/// The opening of a file and what it holds, oldest first: all that is whole and that no gap parts from the newest. `None` where it is no
/// such file.
///
/// # Errors
/// Where reading fails.
pub(crate) fn read(file: &File) -> io::Result<Option<(Vec<u8>, Vec<Entry>)>> {
    let mut octets = vec![0; usize::try_from(file.metadata()?.len()).map_err(io::Error::other)?];
    file.read_exact_at(&mut octets, 0)?;
    Ok(parse(&octets))
}

fn parse(octets: &[u8]) -> Option<(Vec<u8>, Vec<Entry>)> {
    let mut from = Cursor(octets);
    let (magic, len, sum, _room): ([u8; 8], _, _, _) = (from.take()?, from.u32()?, from.u32()?, from.u64()?);
    let opening = from.slice(usize::try_from(len).ok()?)?;
    if magic != MAGIC || crc32fast::hash(opening) != sum {
        return None;
    }
    let step = usize::try_from(STEP).ok()?;
    let (mut blocks, mut at) = (Vec::new(), (HEAD_LEN + opening.len()).next_multiple_of(step));
    while let Some(rest) = octets.get(at..).filter(|rest| !rest.is_empty()) {
        let found = block(rest);
        let len = found.map_or(1, |(_, entries)| BLOCK_HEAD_LEN + entries.len());
        blocks.extend(found);
        at = (at + len).next_multiple_of(step);
    }
    blocks.sort_unstable_by_key(|(number, _)| *number);
    let whole = blocks.windows(2).rposition(|pair| pair[0].0 + 1 != pair[1].0).map_or(0, |at| at + 1);
    let mut all = Vec::new();
    for (_, entries) in &blocks[whole..] {
        let mut from = Cursor(entries);
        while let Some(entry) = entry(&mut from) {
            all.push(entry);
        }
    }
    Some((opening.to_vec(), all))
}

/// The block that begins there, if a whole one does: its number and its entries.
fn block(octets: &[u8]) -> Option<(u64, &[u8])> {
    let mut from = Cursor(octets);
    let magic: [u8; 4] = from.take()?;
    if magic != BLOCK_MAGIC {
        return None;
    }
    let (len, sum, number) = (usize::try_from(from.u32()?).ok()?, from.u32()?, from.u64()?);
    let summed = octets.get(12..BLOCK_HEAD_LEN.checked_add(len)?)?;
    (crc32fast::hash(summed) == sum).then(|| (number, &summed[8..]))
}

fn entry(from: &mut Cursor<'_>) -> Option<Entry> {
    let (channel, log_time, len) = (from.u16()?, from.u64()?, from.u32()?);
    Some(Entry { channel, log_time, data: from.slice(usize::try_from(len).ok()?)?.to_vec() })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn numbered(number: u64, len: usize) -> Entry {
        Entry { channel: 3, log_time: number, data: vec![u8::try_from(number % 251).unwrap(); len] }
    }

    #[test]
    fn the_newest_that_found_room_is_read_in_its_order() {
        let on_disk = tempfile::NamedTempFile::new().unwrap();
        let mut flight = Flight::create(on_disk.path(), b"opening", 64 << 10).unwrap();
        let size = on_disk.as_file().metadata().unwrap().len();
        for number in 0..1_000 {
            flight.put(&numbered(number, 300));
            flight.write().unwrap();
        }
        let (opening, entries) = read(&File::open(on_disk.path()).unwrap()).unwrap().unwrap();
        assert_eq!(opening, b"opening");
        let first = entries[0].log_time;
        assert!((800..900).contains(&first), "{first}");
        assert_eq!(entries, (first..1_000).map(|number| numbered(number, 300)).collect::<Vec<_>>());
        assert_eq!(entries, flight.read().unwrap());
        assert_eq!(on_disk.as_file().metadata().unwrap().len(), size, "its size is fixed");
    }

    #[test]
    fn a_block_that_was_being_written_when_the_program_was_killed_costs_that_block_alone() {
        let on_disk = tempfile::NamedTempFile::new().unwrap();
        let mut flight = Flight::create(on_disk.path(), b"", 64 << 10).unwrap();
        for number in 0..500 {
            flight.put(&numbered(number, 700));
            flight.write().unwrap();
        }
        let before = flight.read().unwrap();
        // Half of the next block, over the oldest.
        let torn = [&BLOCK_MAGIC[..], &[200, 2, 0, 0], &[7; 300]].concat();
        flight.file.write_all_at(&torn, flight.ring_at + flight.at).unwrap();
        let after = flight.read().unwrap();
        assert_eq!(after.last(), before.last());
        assert!(after.len() + 2 >= before.len(), "{} of {}", after.len(), before.len());
    }

    #[test]
    fn whoever_still_writes_to_one_that_was_there_before_writes_nothing_into_the_new_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.ring");
        let mut before = Flight::create(&path, b"before", 8 << 10).unwrap();
        let mut flight = Flight::create(&path, b"now", 8 << 10).unwrap();
        flight.put(&numbered(1, 90));
        flight.write().unwrap();
        before.put(&numbered(2, 90));
        before.write().unwrap();
        assert_eq!(flight.read().unwrap(), [numbered(1, 90)]);
        assert_eq!(read(&File::open(&path).unwrap()).unwrap().unwrap().0, b"now");
    }

    #[test]
    fn one_that_is_larger_than_the_room_is_refused_and_the_next_is_written() {
        let on_disk = tempfile::NamedTempFile::new().unwrap();
        let mut flight = Flight::create(on_disk.path(), b"", 8 << 10).unwrap();
        flight.put(&numbered(1, 9_000));
        assert!(flight.write().is_err());
        flight.put(&numbered(2, 90));
        flight.write().unwrap();
        assert_eq!(flight.read().unwrap(), [numbered(2, 90)]);
    }

    proptest! {
        #[test]
        fn no_file_panics(mut octets in prop::collection::vec(any::<u8>(), 0..3_000), at in 0_usize..3_000, octet: u8) {
            parse(&octets);
            let on_disk = tempfile::NamedTempFile::new().unwrap();
            let mut flight = Flight::create(on_disk.path(), b"x", 2_048).unwrap();
            flight.put(&numbered(1, 100));
            flight.write().unwrap();
            octets = std::fs::read(on_disk.path()).unwrap();
            let place = at % octets.len();
            octets[place] = octet;
            parse(&octets);
        }
    }
}
