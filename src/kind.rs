//! The first octets of a file into what it is, for whoever expected another one. Files of ours are not among them.

/// Octets at the begin of a file by which its kind is known.
pub(crate) const FRONT: usize = 64;

/// Where they stand, the octets, and the kind, with what to do where that is plain. The first that fits counts.
const KINDS: &[(usize, &[u8], &str)] = &[
    (0, b"#ROSBAG V", "a bag of ROS 1"),
    (0, b"SQLite format 3\0", "an SQLite database, as a bag of ROS 2 (.db3) is"),
    (0, b"PK\x03\x04", "a spreadsheet or an archive: save it as CSV"),
    (0, b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls) or document: save it as CSV"),
    (0, b"\xff\xfe", "text in UTF-16: save it as UTF-8"),
    (0, b"\xfe\xff", "text in UTF-16: save it as UTF-8"),
    (0, b"fLaC", "FLAC sound"),
    (0, b"OggS", "Ogg sound or film"),
    (0, b"ID3", "MP3 sound"),
    (0, b"FORM", "AIFF sound"),
    (0, b"caff", "CAF sound"),
    (0, b".snd", "AU sound"),
    (0, b"RIFX", "WAV sound with its octets the other way round (RIFX)"),
    (0, b"RIFF", "sound or a film in RIFF, as WAV and AVI files are"),
    (0, b"RF64", "WAV sound of over 4 GB (RF64)"),
    (0, b"BW64", "WAV sound of over 4 GB (BW64)"),
    (0, b"riff\x2e\x91\xcf\x11", "Wave64 sound (W64)"),
    (0, b"\x30\x26\xb2\x75\x8e\x66\xcf\x11", "WMA sound or a WMV film"),
    (4, b"ftyp", "an MP4 or MOV file"),
    (0, b"\x1a\x45\xdf\xa3", "a Matroska or WebM file"),
    (0, b"MThd", "a MIDI file"),
    (0, b"\x89PNG", "a picture"),
    (0, b"\xff\xd8\xff", "a picture"),
    (0, b"%PDF", "a PDF"),
    (0, b"\x1f\x8b", "compressed by gzip: unpack it"),
    (0, b"\x28\xb5\x2f\xfd", "compressed by zstd: unpack it"),
    (0, b"\xfd7zXZ", "compressed by xz: unpack it"),
    (0, b"<", "XML or HTML"),
    (0, b"{", "JSON"),
    (0, b"[", "TOML or JSON"),
];

/// Octets that no samples are by chance.
const SURE: usize = 4;

/// What a file is that begins so, if that is known; of `front` the first [`FRONT`] octets count.
pub(crate) fn of(front: &[u8]) -> Option<&'static str> {
    let begins = |at: usize, magic: &[u8]| front.get(at..).is_some_and(|rest| rest.starts_with(magic));
    KINDS.iter().find(|(at, magic, _)| begins(*at, magic)).map(|(.., kind)| *kind)
}

/// The same of a stream that may be raw samples, as of which few octets tell nothing: a whole number of samples may be any.
pub(crate) fn of_stream(front: &[u8]) -> Option<&'static str> {
    let sure = KINDS.iter().filter(|(_, magic, _)| magic.len() >= SURE);
    sure.filter(|(at, magic, _)| front.get(*at..).is_some_and(|rest| rest.starts_with(magic)))
        .map(|(.., kind)| *kind)
        .next()
}

/// True if that is not known yet of a stream of which no more than `front` has come.
pub(crate) fn is_open(front: &[u8]) -> bool {
    let agrees = |at: usize, magic: &[u8]| {
        front.len() < at + magic.len()
            && front.get(at..).unwrap_or_default().iter().zip(magic).all(|(a, b)| a == b)
    };
    KINDS.iter().any(|(at, magic, _)| magic.len() >= SURE && agrees(*at, magic))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_of_samples_is_of_no_kind_as_soon_as_it_can_be_none() {
        assert_eq!(of_stream(b"fLaC\0\0"), Some("FLAC sound"));
        assert_eq!((of_stream(b"\xff\xfe\x01\x02"), of_stream(b"[[\0\0")), (None, None), "samples may be so");
        assert!(is_open(b"") && is_open(b"fLa") && is_open(&[1, 0, 2]) && !is_open(&[1, 0, 2, 0, 9]));
    }

    #[test]
    fn each_kind_is_known_by_its_begin_and_a_cue_is_none_of_them() {
        for (at, magic, kind) in KINDS {
            let front = [&vec![0; *at][..], magic, b"rest"].concat();
            assert!(at + magic.len() <= FRONT && of(&front) == Some(*kind), "{kind}");
        }
        for cue in
            ["", "# title: A nod", "time_ms,a1", "\u{feff}time_s,a1", "\"time_ms\"", "sep=;", "\n\ntime_ms"]
        {
            assert_eq!(of(cue.as_bytes()), None, "{cue:?}");
        }
    }
}
