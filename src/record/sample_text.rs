//! Samples of seats out of their JSON as the recorder writes it, which is most of what a recording has. What is written in any other way,
//! be it as right, is left to whoever reads all JSON.

use super::sampled::SeatSample;
use crate::motion::MAX_AXES;
use crate::wire::PerAxis;

/// Digits of a number that is the quotient of two whole ones which a float holds: rounded once, so as right as can be.
const EXACT_DIGITS: usize = 15;
/// Powers of ten that a float holds.
const TENS: [f64; EXACT_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// The sample that this says; `None` where that is to be read in another way.
pub(super) fn seat_sample(json: &[u8]) -> Option<SeatSample> {
    let mut text = SampleText(json);
    let mut sample = SeatSample {
        film_s: text.behind(b"{\"film_s\":")?.number()?,
        asked_mm: text.behind(b",\"asked_mm\":")?.numbers()?,
        sent_mm: text.behind(b",\"sent_mm\":")?.numbers()?,
        level: text.behind(b",\"level\":")?.number()?,
        sent: text.behind(b",\"sent\":")?.count()?,
        unsent: text.behind(b",\"unsent\":")?.count()?,
        clamps: text.behind(b",\"clamps\":")?.count()?,
        measured_mm: text.behind(b",\"measured_mm\":")?.numbers()?,
        acked: text.behind(b",\"acked\":")?.count()?,
        refused: text.behind(b",\"refused\":")?.count()?,
        lost: text.behind(b",\"lost\":")?.count()?,
        ..SeatSample::default()
    };
    if let Some(text) = text.behind(b",\"ack_us\":") {
        sample.ack_us = Some(text.number()?);
    }
    if let Some(text) = text.behind(b",\"ack_max_us\":") {
        sample.ack_max_us = Some(text.number()?);
    }
    if let Some(text) = text.behind(b",\"standing\":") {
        sample.standing = Some(text.count()?);
    }
    (text.0 == b"}").then_some(sample)
}

/// What is left of the text.
struct SampleText<'a>(&'a [u8]);

impl SampleText<'_> {
    /// The same behind a text that it begins with; `None` where it does not.
    #[inline]
    fn behind<const N: usize>(&mut self, text: &[u8; N]) -> Option<&mut Self> {
        let (front, rest) = self.0.split_first_chunk()?;
        (front == text).then(|| self.0 = rest)?;
        Some(self)
    }

    /// Takes digits, and gives how many there are with the number that they make behind `before`; of more than nineteen digits that
    /// is no number.
    fn digits(&mut self, before: u64) -> (usize, u64) {
        let (mut count, mut value) = (0, before);
        while let Some(digit) =
            self.0.get(count).map(|octet| octet.wrapping_sub(b'0')).filter(|digit| *digit < 10)
        {
            value = value.wrapping_mul(10).wrapping_add(digit.into());
            count += 1;
        }
        self.0 = &self.0[count..];
        (count, value)
    }

    fn count<T: TryFrom<u64>>(&mut self) -> Option<T> {
        let is_zero = self.0.first() == Some(&b'0');
        let (digits, value) = self.digits(0);
        let is_written_so = if is_zero { digits == 1 } else { (1..=EXACT_DIGITS).contains(&digits) };
        let is_whole = !matches!(self.0.first(), Some(b'.' | b'e' | b'E'));
        if is_written_so && is_whole { value.try_into().ok() } else { None }
    }

    fn number(&mut self) -> Option<f64> {
        let whole = self.0;
        let is_negative = self.behind(b"-").is_some();
        let is_zero = self.0.first() == Some(&b'0');
        let (before, value) = self.digits(0);
        let (behind, value) = match self.behind(b".") {
            Some(text) => text.digits(value),
            None => (0, value),
        };
        let has_point = whole.len() - self.0.len() > before + usize::from(is_negative);
        let is_written_so = if is_zero { before == 1 } else { before > 0 };
        if !is_written_so || (has_point && behind == 0) || matches!(self.0.first(), Some(b'e' | b'E')) {
            return None;
        }
        if before + behind > EXACT_DIGITS {
            // As near as a float is, by the same rule.
            let length = whole.len() - self.0.len();
            return str::from_utf8(&whole[..length]).ok()?.parse().ok();
        }
        #[expect(clippy::cast_precision_loss, reason = "fifteen digits")]
        let value = value as f64 / TENS[behind];
        Some(if is_negative { -value } else { value })
    }

    fn numbers(&mut self) -> Option<PerAxis<f64>> {
        self.behind(b"[")?;
        let (mut numbers, mut count) = ([0.0; MAX_AXES], 0);
        if self.behind(b"]").is_none() {
            loop {
                *numbers.get_mut(count)? = self.number()?;
                count += 1;
                if self.behind(b"]").is_some() {
                    break;
                }
                self.behind(b",")?;
            }
        }
        Some(PerAxis::new(&numbers[..count]))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Places as they are recorded, and any floats.
    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![
            (-3_000_000_i32..3_000_000).prop_map(|value| f64::from(value) / 1e4),
            (0_i32..100_000).prop_map(|value| f64::from(value) / 1e3),
            Just(0.0),
            Just(-0.0),
            any::<f64>(),
            any::<u64>().prop_map(f64::from_bits),
        ]
    }

    fn places() -> impl Strategy<Value = PerAxis<f64>> {
        prop::collection::vec(number(), 0..=MAX_AXES).prop_map(|places| PerAxis::new(&places))
    }

    prop_compose! {
        fn sample()(
            [film_s, level] in [number(), number()],
            [asked_mm, sent_mm, measured_mm] in [places(), places(), places()],
            [sent, unsent, acked, refused] in any::<[u32; 4]>(),
            [clamps, lost] in prop_oneof![any::<[u64; 2]>(), Just([0, 7])],
            [ack_us, ack_max_us] in [prop::option::of(number()), prop::option::of(number())],
            standing in any::<Option<u8>>(),
        ) -> SeatSample {
            SeatSample {
                film_s, asked_mm, sent_mm, level, sent, unsent, clamps, measured_mm, acked, refused, lost, ack_us, ack_max_us, standing,
            }
        }
    }

    /// Also in the bits of its numbers.
    fn written(sample: &SeatSample) -> Vec<u8> {
        serde_json::to_vec(sample).unwrap()
    }

    /// Times of acks apart: one that is no number is written as none, and read so.
    fn is_of_finite(sample: &SeatSample) -> bool {
        let SeatSample { film_s, level, asked_mm, sent_mm, measured_mm, .. } = sample;
        [*film_s, *level]
            .into_iter()
            .chain([asked_mm, sent_mm, measured_mm].into_iter().flat_map(|places| places.iter().copied()))
            .all(f64::is_finite)
    }

    #[test]
    fn a_sample_as_it_is_recorded_is_read_here() {
        let text = br#"{"film_s":12.345,"asked_mm":[75.0,0.0003,-1.25],"sent_mm":[75.0005,0.0,-1.25],"level":0.8,"sent":5,"unsent":0,"clamps":0,"measured_mm":[],"acked":5,"refused":0,"lost":0,"ack_us":163.211,"ack_max_us":249.0,"standing":3}"#;
        let sample = seat_sample(text).expect("it is written so");
        assert_eq!(sample, serde_json::from_slice(text).unwrap());
        assert_eq!(written(&sample), text);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        #[test]
        fn what_is_read_here_is_what_is_read_of_all_json(sample in sample()) {
            let text = written(&sample);
            let general = serde_json::from_slice::<SeatSample>(&text).ok();
            let own = seat_sample(&text);
            // To the bit, as both are written alike.
            if let Some(own) = &own {
                prop_assert_eq!(Some(written(own)), general.as_ref().map(written));
            }
            prop_assert!(general.is_none() || is_of_finite(&sample));
        }

        #[test]
        fn a_text_that_is_no_sample_is_none_here(
            sample in sample(),
            places in prop::collection::vec((any::<prop::sample::Index>(), prop::sample::select(b"0123456789.,-+eE[]{}\": n".to_vec())), 1..4),
            end in any::<prop::sample::Index>(),
        ) {
            let mut text = written(&sample);
            for (place, octet) in places {
                let place = place.index(text.len());
                text[place] = octet;
            }
            for text in [&text[..], &text[..end.index(text.len())]] {
                if let Some(own) = seat_sample(text) {
                    let general: SeatSample = serde_json::from_slice(text).map_err(|error| TestCaseError::fail(error.to_string()))?;
                    prop_assert_eq!(written(&own), written(&general));
                }
            }
        }
    }
}
