//! SampleStream out of a stream: raw ones, or those behind a RIFF header, be its sizes known or not (FFFFFFFF, as programs write them into a
//! pipe).

use std::fmt;

/// What a stream that is raw has: 16 bits, one channel, so many samples a second.
const RAW_SAMPLES_PER_S: u32 = 48_000;
/// RIFF, its size, WAVE; the name and the size of a chunk.
const RIFF: usize = 12;
const CHUNK: usize = 8;
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
            [b'R', b'I', b'F', b'F', ..] => {}
            _ => return Err(RiffFault::Foreign),
        }
        self.push(begin, &mut Vec::new())?;
        self.format.map(drop).ok_or(RiffFault::NoData)
    }

    /// SampleStream a second; none before that is known.
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

/// The format, and how long the header is; none while it is not whole.
fn header(octets: &[u8]) -> Result<Option<(SoundFormat, usize)>, RiffFault> {
    let is_riff = octets.iter().zip(b"RIFF").all(|(one, other)| one == other);
    if !is_riff {
        return Ok(Some((SoundFormat { samples_per_s: RAW_SAMPLES_PER_S, channels: 1 }, 0)));
    }
    let (mut at, mut format) = (RIFF, None);
    while let Some(chunk) = octets.get(at..at + CHUNK) {
        let size = u32::from_le_bytes([chunk[4], chunk[5], chunk[6], chunk[7]]) as usize;
        match &chunk[..4] {
            b"data" => return format.map(|format| Some((format, at + CHUNK))).ok_or(RiffFault::NoFormat),
            b"fmt " => {
                let Some(fields) = octets.get(at + CHUNK..at + CHUNK + 16) else { break };
                format = Some(read_format(fields)?);
            }
            _ => {}
        }
        // Chunks begin at even places.
        at = at.saturating_add(CHUNK).saturating_add(size).saturating_add(size % 2);
        if at > HEADER {
            return Err(RiffFault::NoData);
        }
    }
    Ok(None)
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
        assert_eq!(read(b"RIFX\0\0", 1).0.len(), 3, "it is none");
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
