//! LTC as sound: made for technicians and tests, and looked for in a recording.

use serde::Serialize;

use super::riff::{Channels, HEADER, RiffFault, SampleStream};
use crate::film::ltc::{LtcDecoder, LtcFrame, LtcGenerator};
use crate::film::source::FilmArgError;
use crate::film::timecode::{FrameRate, Timecode};

/// SampleStream a second of the sound that is made.
pub(crate) const SAMPLES_PER_S: u32 = 48_000;
/// A fifth of full scale, about as loud as a line is driven.
const LEVEL: f64 = 0.2;

/// The samples of LTC, without an end.
#[derive(Debug)]
pub(crate) struct LtcSound(LtcGenerator);

impl LtcSound {
    /// From a label on, at so many frames a second.
    ///
    /// # Errors
    /// [`FilmArgError`] where there is no such rate, or no such label at it.
    pub(crate) fn new(fps: &str, start: &str) -> Result<Self, FilmArgError> {
        let words = |error: crate::film::timecode::TimecodeError| FilmArgError::of(&error);
        let rate: FrameRate = fps.parse().map_err(words)?;
        let frame = Timecode::parse(start, rate).map_err(words)?;
        Ok(Self(LtcGenerator::new(frame, SAMPLES_PER_S, LEVEL)))
    }
}

impl Iterator for LtcSound {
    type Item = i16;

    fn next(&mut self) -> Option<i16> {
        Some(self.0.sample())
    }
}

/// The header of a WAV file of one channel and so many samples, or of a stream of nobody knows how many.
#[must_use]
pub(crate) fn wav_header(samples: Option<u32>) -> Vec<u8> {
    let octets = samples.map_or(u32::MAX, |samples| 2 * samples);
    let mut header = b"RIFF".to_vec();
    header.extend(octets.saturating_add(36).to_le_bytes());
    header.extend(b"WAVEfmt \x10\0\0\0\x01\0\x01\0");
    header.extend(SAMPLES_PER_S.to_le_bytes());
    header.extend((2 * SAMPLES_PER_S).to_le_bytes());
    header.extend(b"\x02\0\x10\0data");
    header.extend(octets.to_le_bytes());
    header
}

/// What timecode is in a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct LtcFound {
    /// How long the recording is.
    pub(crate) seconds: f64,
    /// The channel that was looked in: the first, unless another one has timecode and that has none.
    pub(crate) channel: u8,
    /// How many there are.
    pub(crate) channels: u8,
    /// Frames whose labels are sure.
    pub(crate) frames: u64,
    /// The first label, and the last.
    pub(crate) first: Option<String>,
    /// See above.
    pub(crate) last: Option<String>,
    /// Frames a second, by their labels over the samples between them.
    pub(crate) fps: Option<f64>,
    /// How loud the signal is at the end, of full scale, dB.
    pub(crate) level_db: f64,
    /// How often a label did not follow the one before it.
    pub(crate) jumps: u64,
    /// Frames that were played backwards.
    pub(crate) backwards: u64,
}

/// Looks for timecode in the octets of a WAV file: in its first channel, else in those after it.
///
/// # Errors
/// In words, where it is none that can be read.
pub(crate) fn look_for_ltc(
    octets: &[u8],
) -> Result<LtcFound, impl std::error::Error + Send + Sync + 'static> {
    SampleStream::default().check(&octets[..octets.len().min(HEADER)])?;
    let first = look_in(octets, 1)?;
    let mut others = (2..=first.channels).map(|channel| look_in(octets, channel));
    let other = if first.frames > 0 {
        None
    } else {
        others.find(|found| !matches!(found, Ok(found) if found.frames == 0))
    };
    other.unwrap_or(Ok::<_, RiffFault>(first))
}

/// Looks for it in a channel, counted from 1.
fn look_in(octets: &[u8], channel: u8) -> Result<LtcFound, RiffFault> {
    let (mut samples, mut sound) = (SampleStream::of(Channels::One(channel)), Vec::new());
    samples.push(octets, &mut sound)?;
    let (per_s, channels) = samples.samples_per_s().zip(samples.channels()).ok_or(RiffFault::NoData)?;
    let mut decoder = LtcDecoder::new(per_s);
    let frames: Vec<LtcFrame> = sound.iter().filter_map(|sample| decoder.push(*sample)).collect();
    let step_s = |pair: &[LtcFrame]| (pair[1].end - pair[0].end) / f64::from(per_s);
    let mut steps: Vec<f64> = frames.windows(2).map(step_s).collect();
    steps.sort_by(f64::total_cmp);
    let middle = steps.get(steps.len() / 2).copied();
    let is_jump = |step: &&f64| middle.is_some_and(|length| **step > 1.5 * length || **step < 0.5 * length);
    let label = |frame: &LtcFrame| frame.label.to_string();
    #[expect(clippy::cast_precision_loss, reason = "some hours of samples")]
    let seconds = sound.len() as f64 / f64::from(per_s);
    Ok(LtcFound {
        seconds,
        channel,
        channels: u8::try_from(channels).unwrap_or(u8::MAX),
        frames: frames.len() as u64,
        first: frames.first().map(label),
        last: frames.last().map(label),
        fps: middle.map(|length| 1.0 / length),
        level_db: 20.0 * f64::from(decoder.level()).max(1e-6).log10(),
        jumps: steps.iter().filter(is_jump).count() as u64,
        backwards: frames.iter().filter(|frame| frame.backwards).count() as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(seconds: u32, sound: impl Iterator<Item = i16>) -> Vec<u8> {
        let samples = seconds * SAMPLES_PER_S;
        let octets = sound.take(samples as usize).flat_map(i16::to_le_bytes);
        wav_header(Some(samples)).into_iter().chain(octets).collect()
    }

    #[test]
    fn what_is_made_is_found_with_its_labels_its_rate_and_where_it_is_broken() {
        let sound = LtcSound::new("25", "01:00:00:00").unwrap();
        let found = look_for_ltc(&file(4, sound)).unwrap();
        assert!((95..=100).contains(&found.frames) && found.jumps == 0 && found.backwards == 0, "{found:?}");
        assert!(
            found.first.as_deref().unwrap() < "01:00:00:05" && found.last.as_deref().unwrap() > "01:00:03:20"
        );
        assert!((found.fps.unwrap() - 25.0).abs() < 0.01 && (found.level_db + 14.0).abs() < 2.0, "{found:?}");
        let gap = |(at, sample): (usize, i16)| if (96_000..115_200).contains(&at) { 0 } else { sample };
        let broken = LtcSound::new("25", "01:00:00:00").unwrap().enumerate().map(gap);
        assert_eq!(look_for_ltc(&file(4, broken)).unwrap().jumps, 1);
        assert_eq!(look_for_ltc(&file(1, std::iter::repeat(0))).unwrap().frames, 0);
    }

    #[test]
    fn timecode_in_another_channel_is_found_there() {
        let both = |channel: usize| {
            let frame = move |sample: i16| {
                (1..=3).flat_map(move |one| if one == channel { sample } else { 0 }.to_le_bytes())
            };
            let sound = LtcSound::new("25", "01:00:00:00").unwrap().take(2 * SAMPLES_PER_S as usize);
            let mut octets = wav_header(None);
            octets[22] = 3;
            octets.extend(sound.flat_map(frame));
            look_for_ltc(&octets).unwrap()
        };
        for channel in 1..=3 {
            let found = both(channel);
            assert!(found.frames > 40 && found.channels == 3, "{found:?}");
            assert_eq!(usize::from(found.channel), channel);
        }
        let none = both(4);
        assert_eq!((none.frames, none.channel, none.channels), (0, 1, 3));
    }

    #[test]
    fn a_recording_of_another_kind_is_refused_and_one_of_over_4_gb_is_read() {
        let sound = || LtcSound::new("25", "01:00:00:00").unwrap();
        let mut rf64 = file(2, sound());
        rf64[..4].copy_from_slice(b"RF64");
        let found = look_for_ltc(&rf64).unwrap();
        assert!(found.frames > 40 && (found.fps.unwrap() - 25.0).abs() < 0.01, "{found:?}");
        for begin in [&b"fLaC"[..], b"raw samples"] {
            let told = look_for_ltc(&[begin, &file(1, sound())[44..]].concat()).unwrap_err().to_string();
            assert!(told.contains("not a WAV file"), "{told}");
        }
    }

    #[test]
    fn a_label_that_there_is_not_is_refused_in_words() {
        for (fps, start) in
            [("12", "00:00:00:00"), ("25", "00:00:00:25"), ("29.97", "00:01:00;00"), ("25", "now")]
        {
            let error = LtcSound::new(fps, start).expect_err("there is none").to_string();
            assert!(error.len() > 20, "{error}");
        }
    }
}
