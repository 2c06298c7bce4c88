//! Films for players: sound without a picture.

/// A film of that length: silence, eight thousand samples of eight bits a second.
pub(crate) fn silent_film(seconds: u32) -> Vec<u8> {
    let length = 8_000 * seconds;
    let word = |value: u32| value.to_le_bytes();
    let rates = [&word(8_000)[..], &word(8_000)].concat();
    let format = [b"WAVEfmt ", &word(16)[..], &[1, 0, 1, 0], &rates, &[1, 0, 8, 0]].concat();
    let silence = vec![128; length as usize];
    [b"RIFF", &word(36 + length)[..], &format, b"data", &word(length), &silence].concat()
}
