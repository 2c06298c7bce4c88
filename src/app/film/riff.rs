//! Samples out of a stream: raw ones, or those behind the header of a WAV file, be its sizes known or not (FFFFFFFF, as programs write them
//! into a pipe, and RF64 in a file of over 4 GB). Wave64 has the same chunks, with longer heads.

use std::fmt;

use crate::kind;

/// What a stream that is raw has: 16 bits, one channel, so many samples a second.
const RAW_SAMPLES_PER_S: u32 = 48_000;
/// How files of RIFF begin; the sizes that RF64 and BW64 have elsewhere are of no use here.
const RIFFS: [&[u8]; 3] = [b"RIFF", b"RF64", b"BW64"];
/// RIFF, its size, WAVE; then chunks, each with its name and its size.
const RIFF: WavForm = WavForm { begin: 12, head: 8, filled_to: 2 };
/// How Wave64 begins: a GUID for each name.
const RIFF_GUID: &[u8] = b"riff\x2e\x91\xcf\x11\xa5\xd6\x28\xdb\x04\xc1\0\0";
const WAVE64: WavForm = WavForm { begin: 40, head: 24, filled_to: 8 };
/// What of a header is kept: more says that it is none.
pub(super) const HEADER: usize = 64 * 1024;
/// SampleStream a second that there are.
const RATES: std::ops::RangeInclusive<u32> = 8_000..=192_000;

/// Why a stream is none that can be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(crate) enum RiffFault {
    #[error(
        "it has {0}; only uncompressed sound of 16 bits, 1 to 64 channels and 8000 to 192000 samples a second is read: make that of \
         it, as with ffmpeg -i IN.wav -c:a pcm_s16le OUT.wav"
    )]
    Format(WavFormat),
    #[error("it begins like a WAV file but does not state its sample format; make it again")]
    NoFormat,
    #[error("it has {has} channels, but timecode is read from channel {wanted}; see channel in [sync.ltc]")]
    Channel { has: usize, wanted: u8 },
    #[error("it begins like a WAV file but has no samples; make it again")]
    NoData,
    #[error("it is empty; make it again")]
    Empty,
    #[error("it is not a WAV file; make one of it, as with ffmpeg -i IN -c:a pcm_s16le OUT.wav")]
    Foreign,
    #[error("it is {0}, not a WAV file; make one of it, as with ffmpeg -i IN -c:a pcm_s16le OUT.wav")]
    Kind(&'static str),
}

impl RiffFault {
    fn of(kind: &'static str) -> Self {
        // What is to be done with it for a cue is of no use for sound.
        Self::Kind(kind.split(':').next().unwrap_or(kind))
    }
}

/// What a header says of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WavFormat {
    kind: u16,
    bits: u16,
    channels: u16,
    samples_per_s: u32,
}

impl fmt::Display for WavFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, bits, channels, samples_per_s } = self;
        let kind = match kind {
            1 | 0xfffe => "uncompressed",
            3 => "floating-point",
            _ => "compressed",
        };
        write!(f, "{kind} sound of {bits} bits, {channels} channels and {samples_per_s} samples a second")
    }
}

/// Makes samples of octets, whichever way they come in pieces.
#[derive(Debug, Default)]
pub(super) struct SampleStream {
    /// What came and was not used: a header that is not whole, or part of a frame.
    kept: Vec<u8>,
    format: Option<SoundFormat>,
    channels: Channels,
}

/// Which of the channels is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Channels {
    /// That one, counted from 1.
    One(u8),
    /// The mean of all.
    Mixed,
}

impl Default for Channels {
    fn default() -> Self {
        Self::One(1)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct SoundFormat {
    samples_per_s: u32,
    channels: usize,
}

impl SampleStream {
    pub(super) fn of(channels: Channels) -> Self {
        Self { channels, ..Self::default() }
    }

    /// Whether a file that begins so can be read; `begin` is all of it, or [`HEADER`] octets. Only streams may be raw: of a file that is
    /// none, all that would be known is that nothing was heard in it.
    pub(super) fn check(mut self, begin: &[u8]) -> Result<(), RiffFault> {
        match begin {
            [] => return Err(RiffFault::Empty),
            _ if is_wav(begin) => {}
            _ => return Err(kind::of(begin).map_or(RiffFault::Foreign, RiffFault::of)),
        }
        self.push(begin, &mut Vec::new())?;
        self.format.map(drop).ok_or(RiffFault::NoData)
    }

    /// Channels; none before that is known.
    pub(super) fn channels(&self) -> Option<usize> {
        self.format.map(|format| format.channels)
    }

    /// Samples a second; none before that is known.
    pub(super) fn samples_per_s(&self) -> Option<u32> {
        self.format.map(|format| format.samples_per_s)
    }

    /// Takes octets; adds to `out` the samples of the channel that is read.
    pub(super) fn push(&mut self, octets: &[u8], out: &mut Vec<i16>) -> Result<(), RiffFault> {
        self.kept.extend_from_slice(octets);
        let format = match self.format {
            Some(format) => format,
            None => match header(&self.kept)? {
                None => return Ok(()),
                Some((format, length)) => {
                    self.kept.drain(..length);
                    *self.format.insert(format)
                }
            },
        };
        let frame = 2 * format.channels;
        let whole = self.kept.len() / frame * frame;
        let sample = |octets: &[u8]| i16::from_le_bytes([octets[0], octets[1]]);
        let frames = self.kept[..whole].chunks_exact(frame);
        match self.channels {
            Channels::One(wanted) if usize::from(wanted) > format.channels => {
                return Err(RiffFault::Channel { has: format.channels, wanted });
            }
            Channels::One(wanted) => {
                let at = 2 * (usize::from(wanted).max(1) - 1);
                out.extend(frames.map(|one| sample(&one[at..])));
            }
            Channels::Mixed => out.extend(frames.map(|one| mean(one.chunks_exact(2).map(sample)))),
        }
        self.kept.drain(..whole);
        Ok(())
    }
}

fn mean(samples: impl Iterator<Item = i16>) -> i16 {
    let (sum, count) = samples.fold((0_i32, 0), |(sum, count), sample| (sum + i32::from(sample), count + 1));
    i16::try_from(sum / count.max(1)).expect("a mean is among its samples")
}

/// True if a file that begins so is one of those that are read.
pub(super) fn is_wav(begin: &[u8]) -> bool {
    RIFFS.into_iter().chain([RIFF_GUID]).any(|magic| begin.starts_with(magic))
}

/// The format, and how long the header is; none while it is not whole.
fn header(octets: &[u8]) -> Result<Option<(SoundFormat, usize)>, RiffFault> {
    let is_begun = |magic: &[u8]| octets.iter().zip(magic).all(|(one, other)| one == other);
    if RIFFS.into_iter().any(is_begun) {
        return RIFF.header(octets);
    }
    if is_begun(RIFF_GUID) {
        return WAVE64.header(octets);
    }
    match kind::of_stream(octets) {
        Some(kind) => Err(RiffFault::of(kind)),
        None if kind::is_open(octets) => Ok(None),
        None => Ok(Some((SoundFormat { samples_per_s: RAW_SAMPLES_PER_S, channels: 1 }, 0))),
    }
}

/// How the chunks of a file lie: where the first begins, how long the head of each is, and to a multiple of what its content is filled.
struct WavForm {
    begin: usize,
    head: usize,
    filled_to: usize,
}

impl WavForm {
    fn header(&self, octets: &[u8]) -> Result<Option<(SoundFormat, usize)>, RiffFault> {
        let (mut at, mut format) = (self.begin, None);
        while let Some(head) = octets.get(at..at + self.head) {
            let content = at + self.head;
            match &head[..4] {
                b"data" => return format.map(|format| Some((format, content))).ok_or(RiffFault::NoFormat),
                b"fmt " => {
                    let Some(fields) = octets.get(content..content + 16) else { break };
                    format = Some(read_format(fields)?);
                }
                _ => {}
            }
            at = content + self.length(head).next_multiple_of(self.filled_to);
            if at > HEADER {
                return Err(RiffFault::NoData);
            }
        }
        Ok(None)
    }

    /// How long the content of a chunk with that head is, if that is not beyond what is kept.
    fn length(&self, head: &[u8]) -> usize {
        let octets = |range: std::ops::Range<usize>| {
            head[range].iter().rev().fold(0, |n: u64, octet| n << 8 | u64::from(*octet))
        };
        // Wave64 counts the head as well.
        let length = if self.head == WAVE64.head { octets(16..24).saturating_sub(24) } else { octets(4..8) };
        usize::try_from(length).unwrap_or(HEADER).min(HEADER)
    }
}

fn read_format(fields: &[u8]) -> Result<SoundFormat, RiffFault> {
    let word = |at: usize| u16::from_le_bytes([fields[at], fields[at + 1]]);
    let samples_per_s = u32::from(word(4)) | u32::from(word(6)) << 16;
    let (kind, channels, bits) = (word(0), word(2), word(14));
    // 1: uncompressed; FFFE: the same, with more said of its channels.
    let is_plain = matches!(kind, 1 | 0xfffe) && bits == 16 && (1..=64).contains(&channels);
    let is_known = is_plain && RATES.contains(&samples_per_s);
    let said = WavFormat { kind, bits, channels, samples_per_s };
    is_known
        .then_some(SoundFormat { samples_per_s, channels: channels.into() })
        .ok_or(RiffFault::Format(said))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wav(kind: u16, channels: u16, bits: u16, size: u32, samples: &[i16]) -> Vec<u8> {
        let mut octets = b"RIFF".to_vec();
        octets.extend(size.to_le_bytes());
        octets.extend(b"WAVEfmt ");
        octets.extend(16_u32.to_le_bytes());
        for word in [kind, channels, 0xbb80, 0, 0, 0, 2 * channels, bits] {
            octets.extend(word.to_le_bytes());
        }
        octets.extend(b"LIST\x03\0\0\0abc\0data");
        octets.extend(size.to_le_bytes());
        octets.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
        octets
    }

    fn read(octets: &[u8], piece: usize) -> (Vec<i16>, Option<u32>) {
        let (mut samples, mut out) = (SampleStream::default(), Vec::new());
        for piece in octets.chunks(piece) {
            samples.push(piece, &mut out).expect("it is sound");
        }
        (out, samples.samples_per_s())
    }

    #[test]
    fn samples_are_the_same_however_a_stream_comes_in_pieces_and_whatever_sizes_its_header_has() {
        for size in [6, u32::MAX] {
            let octets = wav(1, 2, 16, size, &[1, -1, 2, -2, 3, -3]);
            for piece in [1, 3, 7, 4_096] {
                assert_eq!(read(&octets, piece), (vec![1, 2, 3], Some(48_000)), "pieces of {piece}");
            }
        }
        let mut second = (SampleStream::of(Channels::One(2)), Vec::new());
        second.0.push(&wav(1, 2, 16, 8, &[1, -1, 2, -2]), &mut second.1).expect("it has two");
        assert_eq!(second.1, [-1, -2]);
        let missing = SampleStream::of(Channels::One(2)).check(&wav(1, 1, 16, 4, &[1]));
        assert_eq!(missing, Err(RiffFault::Channel { has: 1, wanted: 2 }));
        let mut mixed = (SampleStream::of(Channels::Mixed), Vec::new());
        mixed.0.push(&wav(1, 2, 16, 8, &[4, 2, i16::MIN, i16::MIN]), &mut mixed.1).expect("it is sound");
        assert_eq!(mixed.1, [3, i16::MIN], "of both channels");
        assert_eq!(read(&[1, 0, 2, 0, 9], 2), (vec![1, 2], Some(48_000)), "raw");
        assert_eq!(read(b"RAFX\0\0", 1).0.len(), 3, "it is none");
    }

    /// The same sound in a file of another form.
    fn of_form(form: &str, samples: &[i16]) -> Vec<u8> {
        let riff = wav(1, 2, 16, u32::MAX, samples);
        let (format, sound) = (&riff[20..36], &riff[56..]);
        let guid = |name: &[u8]| [name, b"\xf3\xac\xd3\x11\x8c\xd1\x00\xc0\x4f\x8e\xdb\x8a"].concat();
        let size = |length: usize| (length as u64 + 24).to_le_bytes();
        let ds64 = [&b"ds64"[..], &28_u32.to_le_bytes(), &[0; 28]].concat();
        match form {
            "RF64" | "BW64" => [form.as_bytes(), &riff[4..12], &ds64, &riff[12..]].concat(),
            _ => [
                RIFF_GUID,
                &[0xff; 8],
                &guid(b"wave"),
                &guid(b"junk"),
                &size(3),
                &[7; 8],
                &guid(b"fmt "),
                &size(16),
                format,
                &guid(b"data"),
                &size(sound.len()),
                sound,
            ]
            .concat(),
        }
    }

    #[test]
    fn files_of_over_4_gb_are_read_as_others_are_in_all_their_forms() {
        for form in ["RF64", "BW64", "W64"] {
            let octets = of_form(form, &[1, -1, 2, -2, 3, -3]);
            for piece in [1, 7, 4_096] {
                assert_eq!(
                    read(&octets, piece),
                    (vec![1, 2, 3], Some(48_000)),
                    "{form} in pieces of {piece}"
                );
            }
            assert_eq!(SampleStream::default().check(&octets), Ok(()), "{form}");
            assert!(
                is_wav(&octets) && SampleStream::default().check(&octets[..30]) == Err(RiffFault::NoData)
            );
        }
        let endless = [RIFF_GUID, &[0; 24], b"junk", &[0xff; 20]].concat();
        assert_eq!(SampleStream::default().check(&endless), Err(RiffFault::NoData));
    }

    #[test]
    fn sound_of_another_kind_is_called_that_in_a_file_and_on_a_line() {
        for (begin, name) in [
            (&b"fLaC\0\0\0\x22"[..], "it is FLAC sound, not a WAV file"),
            (b"OggS\0\x02\0\0", "it is Ogg sound or film, not"),
            (b"\0\0\0\x20ftypM4A ", "it is an MP4 or MOV file, not"),
            (b"RIFX\0\0\0\0WAVE", "(RIFX), not a WAV file"),
            (b"PK\x03\x04\0\0\0\0", "it is a spreadsheet or an archive, not a WAV file; make one"),
        ] {
            let mut stream = SampleStream::default();
            let on_a_line =
                begin.chunks(1).try_for_each(|piece| stream.push(piece, &mut Vec::new())).unwrap_err();
            assert_eq!(SampleStream::default().check(begin), Err(on_a_line), "{name}");
            assert!(on_a_line.to_string().contains(name), "{on_a_line}");
        }
    }

    #[test]
    fn what_is_no_sound_of_16_bits_is_refused() {
        let push = |octets: &[u8]| SampleStream::default().push(octets, &mut Vec::new());
        let deep = push(&wav(1, 2, 24, 4, &[])).unwrap_err().to_string();
        assert!(
            deep.starts_with(
                "it has uncompressed sound of 24 bits, 2 channels and 48000 samples a second; only"
            ) && deep.contains("-c:a pcm_s16le"),
            "{deep}"
        );
        for wrong in [wav(3, 1, 32, 4, &[]), wav(1, 0, 16, 4, &[]), wav(2, 1, 16, 4, &[])] {
            assert!(matches!(push(&wrong), Err(RiffFault::Format(_))));
            assert_eq!(SampleStream::default().check(&wrong), push(&wrong));
        }
        let check = |octets: &[u8]| SampleStream::default().check(octets);
        assert_eq!((check(&wav(1, 1, 16, 4, &[])), check(b"RIFF")), (Ok(()), Err(RiffFault::NoData)));
        assert_eq!((check(b""), check(b"01:00:00:00")), (Err(RiffFault::Empty), Err(RiffFault::Foreign)));
        let mut endless = b"RIFF\0\0\0\0WAVE".to_vec();
        endless.extend(b"junk\xff\xff\xff\xff");
        assert_eq!(push(&endless), Err(RiffFault::NoData));
        assert_eq!(
            push(b"RIFF\0\0\0\0WAVEdata\0\0\0\0"),
            Err(RiffFault::NoFormat),
            "nothing says of what kind"
        );
    }
}
