//! Files are opened by `sys::file` and `sys::folder` alone, which never wait, take regular files, follow no link out of a folder of ours, and
//! read up to a bound.

use super::source;

/// What opens a file, or reads or writes one whole, by the standard library. A new file (`create_new`) follows nothing and waits for nobody.
const PLAIN: &[&str] = &[
    "File::open(",
    "File::create(",
    "File::options()",
    "OpenOptions::new()",
    "fs::copy(",
    "fs::read(",
    "fs::read_to_string(",
    "fs::write(",
];

/// Who may, how often, and why.
const EXCEPT: &[(&str, usize, &str)] = &[
    ("src/api/socket.rs", 1, "a folder, to lock it"),
    ("src/app/film/left.rs", 1, "a FIFO or a device is meant"),
    ("src/cli/convert.rs", 1, "create_new"),
    ("src/cli/decode/input.rs", 1, "a person may pipe a capture into it"),
    ("src/cli/decode/serial.rs", 1, "a person may pipe octets into it"),
    ("src/cli/fleet/demo.rs", 7, "files of a folder that it has just made for itself"),
    ("src/cli/fleet/made.rs", 1, "create_new"),
    ("src/cli/fleet/part.rs", 1, "to go on with it; no link, and it waits for nobody"),
    ("src/cli/sim.rs", 1, "a log, which a person may have a terminal or a pipe for"),
    ("src/cli/sync/index.rs", 1, "a person names where it goes"),
    ("src/cli/sync/send.rs", 2, "a device or a FIFO is meant; a sound of its own"),
    ("src/doctor/facts.rs", 2, "a device of the kernel"),
    ("src/record/flight.rs", 1, "create_new"),
];

/// True of a line with one of these; `CueFile::open(` is another.
fn is_plain(line: &str) -> bool {
    let is_word = |(at, _): (usize, &str)| !line[..at].ends_with(|letter: char| letter.is_alphanumeric());
    PLAIN.iter().any(|plain| line.match_indices(plain).any(is_word))
}

#[test]
fn no_room_opens_files_in_a_way_of_its_own() {
    let mut wrong = Vec::new();
    for file in source::read().iter().filter(|file| file.room() != "sys") {
        let opens: Vec<&str> = file.code().filter(|line| is_plain(line)).collect();
        let may = EXCEPT.iter().find(|(path, ..)| *path == file.path).map_or(0, |(_, often, _)| *often);
        if opens.len() != may {
            wrong.push(format!("{}: {} where {may} are noted: {opens:#?}", file.path, opens.len()));
        }
    }
    assert!(wrong.is_empty(), "open them by sys::file, or note here why not:\n{}", wrong.join("\n"));
}
