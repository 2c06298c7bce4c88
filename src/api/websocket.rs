//! WebSocket (RFC 6455), the part of a server that a page needs: the handshake, and messages of one frame. A frame that is longer, in
//! pieces or not masked ends the connection. The crates for it bring nine others, two further generations of `rand` among them.

use std::io::{self, ErrorKind};

use axum::body::Body;
use axum::extract::Request;
use axum::http::header::{
    CONNECTION, HeaderName, SEC_WEBSOCKET_ACCEPT, SEC_WEBSOCKET_KEY, SEC_WEBSOCKET_VERSION, UPGRADE,
};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::Response;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use hyper::upgrade::OnUpgrade;
use sha1::{Digest as _, Sha1};
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};

use super::access::one;
use super::problem::bad_value;
use crate::control::Problem;

/// The longest message that is taken, bytes.
const LONGEST: usize = 1024;
/// With what a server shows that it has read the key of the handshake (RFC 6455 1.3).
const GUID: &str = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";
/// The frame is whole.
const FIN: u8 = 0x80;
/// The payload is masked, as all that a client sends.
const MASKED: u8 = 0x80;

const TEXT: u8 = 1;
const BINARY: u8 = 2;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;

/// What a client sent.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Message {
    /// A message in words.
    Text(String),
    /// A question whether we are there, to be answered by its own bytes.
    Ping(Vec<u8>),
    /// The answer to a question of ours.
    Pong,
}

/// The reply to a handshake, and the connection that it makes a WebSocket of.
///
/// # Errors
/// If it is no handshake.
pub(super) fn accept(request: &mut Request) -> Result<(Response, OnUpgrade), Problem> {
    let headers = request.headers();
    let is_handshake = names(headers, &CONNECTION, "upgrade")
        && names(headers, &UPGRADE, "websocket")
        && names(headers, &SEC_WEBSOCKET_VERSION, "13");
    let key = one(headers, &SEC_WEBSOCKET_KEY)?.filter(|_| is_handshake);
    let key = key.ok_or_else(|| {
        bad_value("this is a WebSocket, and the request is no handshake of one", "see docs/http.md")
    })?;
    let accepted = HeaderValue::from_str(&acceptance(key)).expect("base64 is plain text");
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::SWITCHING_PROTOCOLS;
    response.headers_mut().insert(CONNECTION, HeaderValue::from_static("Upgrade"));
    response.headers_mut().insert(UPGRADE, HeaderValue::from_static("websocket"));
    response.headers_mut().insert(SEC_WEBSOCKET_ACCEPT, accepted);
    Ok((response, hyper::upgrade::on(request)))
}

/// True if a header has that word in its list.
fn names(headers: &HeaderMap, name: &HeaderName, word: &str) -> bool {
    let lists = headers.get_all(name).iter().filter_map(|list| list.to_str().ok());
    lists.flat_map(|list| list.split(',')).any(|one| one.trim().eq_ignore_ascii_case(word))
}

fn acceptance(key: &str) -> String {
    STANDARD.encode(Sha1::new().chain_update(key).chain_update(GUID).finalize())
}

/// Reads the next message of a client; an error at the end of the connection. Not to be called again after it was given up halfway.
pub(super) async fn read(from: &mut (impl AsyncRead + Unpin)) -> io::Result<Message> {
    let [first, second] = bytes(from).await?;
    let len = match second & !MASKED {
        126 => usize::from(u16::from_be_bytes(bytes(from).await?)),
        len => usize::from(len), // 127, a longer one, has more bytes than are taken here
    };
    if first & !0x0f != FIN || second & MASKED == 0 || second & !MASKED == 127 || len > LONGEST {
        return Err(ErrorKind::InvalidData.into());
    }
    let mask: [u8; 4] = bytes(from).await?;
    let mut payload = vec![0; len];
    from.read_exact(&mut payload).await?;
    payload.iter_mut().zip(mask.iter().cycle()).for_each(|(byte, mask)| *byte ^= mask);
    match first & 0x0f {
        TEXT | BINARY => {
            String::from_utf8(payload).map(Message::Text).map_err(|_| ErrorKind::InvalidData.into())
        }
        PING => Ok(Message::Ping(payload)),
        PONG => Ok(Message::Pong),
        CLOSE => Err(ErrorKind::UnexpectedEof.into()),
        _ => Err(ErrorKind::InvalidData.into()),
    }
}

async fn bytes<const N: usize>(from: &mut (impl AsyncRead + Unpin)) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    from.read_exact(&mut bytes).await?;
    Ok(bytes)
}

/// Sends a message in words, given in parts.
pub(super) async fn send(to: &mut (impl AsyncWrite + Unpin), parts: &[&[u8]]) -> io::Result<()> {
    to.write_all(&frame(TEXT, parts)).await
}

/// Answers a ping.
pub(super) async fn pong(to: &mut (impl AsyncWrite + Unpin), payload: &[u8]) -> io::Result<()> {
    to.write_all(&frame(PONG, &[payload])).await
}

/// A frame of a server, which masks nothing.
fn frame(opcode: u8, parts: &[&[u8]]) -> Vec<u8> {
    let len: usize = parts.iter().map(|part| part.len()).sum();
    let mut frame = Vec::with_capacity(len + 10);
    frame.push(FIN | opcode);
    match (u8::try_from(len), u16::try_from(len)) {
        (Ok(len), _) if len < 126 => frame.push(len),
        (_, Ok(len)) => {
            frame.push(126);
            frame.extend_from_slice(&len.to_be_bytes());
        }
        _ => {
            frame.push(127);
            frame.extend_from_slice(&(len as u64).to_be_bytes());
        }
    }
    parts.iter().for_each(|part| frame.extend_from_slice(part));
    frame
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn taken(mut bytes: &[u8]) -> Result<Message, ErrorKind> {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(read(&mut bytes)).map_err(|error| error.kind())
    }

    /// As a client sends it.
    fn masked(opcode: u8, payload: &[u8]) -> Vec<u8> {
        let mask = [0x37, 0xfa, 0x21, 0x3d];
        let mut frame = frame(opcode, &[payload]);
        frame[1] |= MASKED;
        let head = frame.len() - payload.len();
        frame[head..].iter_mut().zip(mask.iter().cycle()).for_each(|(byte, mask)| *byte ^= mask);
        frame.splice(head..head, mask);
        frame
    }

    #[test]
    fn the_examples_of_the_standard_are_read_and_written_as_it_has_them() {
        assert_eq!(acceptance("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo="); // 1.3
        let hello = [0x81, 0x85, 0x37, 0xfa, 0x21, 0x3d, 0x7f, 0x9f, 0x4d, 0x51, 0x58]; // 5.7
        assert_eq!(taken(&hello), Ok(Message::Text("Hello".to_owned())));
        assert_eq!(masked(TEXT, b"Hello"), hello);
        assert_eq!(frame(TEXT, &[b"Hel", b"lo"]), [0x81, 5, 0x48, 0x65, 0x6c, 0x6c, 0x6f]);
        assert_eq!(frame(BINARY, &[&[7; 256]])[..4], [0x82, 126, 1, 0]);
        assert_eq!(frame(BINARY, &[&vec![7; 65_536]])[..10], [0x82, 127, 0, 0, 0, 0, 0, 1, 0, 0]);
        assert_eq!(taken(&masked(PING, b"Hello")), Ok(Message::Ping(b"Hello".to_vec())));
    }

    #[test]
    fn what_is_too_long_in_pieces_bare_or_no_text_ends_it() {
        assert!(taken(&masked(TEXT, &[b'x'; LONGEST])).is_ok());
        let mut in_pieces = masked(TEXT, b"stop");
        in_pieces[0] &= !FIN;
        let refused = [
            masked(TEXT, &[b'x'; LONGEST + 1]),
            masked(TEXT, &vec![b'x'; 70_000]),
            masked(TEXT, &[0xff]),
            masked(3, b"stop"),
            frame(TEXT, &[b"stop"]),
            in_pieces,
        ];
        for bytes in refused {
            assert_eq!(taken(&bytes), Err(ErrorKind::InvalidData), "{:?}", &bytes[..2]);
        }
        assert_eq!(taken(&masked(CLOSE, &[])), Err(ErrorKind::UnexpectedEof));
        assert_eq!(taken(&masked(TEXT, b"stop")[..7]), Err(ErrorKind::UnexpectedEof));
    }

    proptest! {
        #[test]
        fn a_message_is_read_as_it_was_sent(text in ".{0,200}") {
            prop_assert_eq!(taken(&masked(TEXT, text.as_bytes())), Ok(Message::Text(text)));
        }

        #[test]
        fn nothing_that_comes_is_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let _ = taken(&bytes);
        }
    }
}
