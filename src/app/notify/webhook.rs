//! Alarms by HTTP: a POST of JSON. No address is followed that an answer names.

use std::time::Duration;

use http_body_util::{BodyExt as _, Full, Limited};
use hyper::body::Bytes;
use hyper::client::conn::http1;
use hyper::header::{CONTENT_TYPE, HOST, USER_AGENT};
use hyper::{Method, Request};
use hyper_util::rt::TokioIo;
use tokio::net::TcpStream;
use tokio::time::timeout;

use super::outbox::AlarmMessage;
use crate::config::WebHook;

/// How long all of it may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// Of an answer so much is read, bytes.
const ANSWER: usize = 4_096;

/// Posts a message.
///
/// # Errors
/// Why nobody has it now, with what to do.
pub(super) fn post(hook: &WebHook, message: &AlarmMessage) -> Result<(), String> {
    let body = serde_json::to_vec(message).map_err(|error| error.to_string())?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime =
        runtime.map_err(|error| format!("no runtime could be started: {error}; restart the service"))?;
    let posted = runtime.block_on(async { timeout(PATIENCE, exchange(hook, message, body)).await });
    // A name that nobody resolves holds up a thread of its own.
    runtime.shutdown_background();
    posted.unwrap_or_else(|_| {
        Err(format!(
            "{} did not answer within {} s; look at whoever receives there",
            hook.authority,
            PATIENCE.as_secs()
        ))
    })
}

async fn exchange(hook: &WebHook, message: &AlarmMessage, body: Vec<u8>) -> Result<(), String> {
    let WebHook { authority, path } = hook;
    let failed = |error: &dyn std::fmt::Display| {
        format!("{authority}: {error}; check url in [notify.webhook], and whoever receives there")
    };
    let stream = TcpStream::connect(authority).await.map_err(|error| failed(&error))?;
    let (mut sender, connection) =
        http1::handshake(TokioIo::new(stream)).await.map_err(|error| failed(&error))?;
    tokio::spawn(connection); // what goes wrong on it, the request is told
    let request = Request::builder().method(Method::POST).uri(path).header(HOST, authority);
    let request =
        request.header(CONTENT_TYPE, "application/json").header("Idempotency-Key", &message.message);
    let request = request.header(USER_AGENT, concat!("kinocue/", env!("CARGO_PKG_VERSION")));
    let request = request.body(Full::new(Bytes::from(body))).map_err(|error| failed(&error))?;
    let response = sender.send_request(request).await.map_err(|error| failed(&error))?;
    let status = response.status();
    let _ = Limited::new(response.into_body(), ANSWER).collect().await; // what it says besides is for nobody
    if status.is_success() { Ok(()) } else { Err(failed(&format_args!("it answered {status}"))) }
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::net::TcpListener;
    use std::thread;

    use super::super::outbox::alarm;
    use super::*;

    fn message() -> AlarmMessage {
        AlarmMessage {
            hall: "Hall 1".to_owned(),
            message: "m-1".to_owned(),
            alarms: vec![alarm("A1 is silent")],
            omitted: 0,
        }
    }

    /// Posts to a receiver that answers so; gives what it got.
    fn posted(answer: &'static str) -> (Result<(), String>, String) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let hook = WebHook {
            authority: listener.local_addr().unwrap().to_string(),
            path: "/hook?hall=1".to_owned(),
        };
        let receiver = thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut got = Vec::new();
            let mut octets = [0; 4_096];
            // Its end is where its JSON ends.
            while !got.ends_with(b"\"omitted\":0}") {
                let count = stream.read(&mut octets).unwrap();
                assert!(count > 0, "{}", String::from_utf8_lossy(&got));
                got.extend_from_slice(&octets[..count]);
            }
            stream.write_all(answer.as_bytes()).unwrap();
            String::from_utf8(got).unwrap()
        });
        let result = post(&hook, &message());
        (result, receiver.join().unwrap())
    }

    #[test]
    fn a_message_is_posted_as_json_and_known_again_if_it_comes_twice() {
        let (result, got) = posted("HTTP/1.1 204 No Content\r\n\r\n");
        assert_eq!(result, Ok(()));
        let (head, body) = got.split_once("\r\n\r\n").unwrap();
        let head = head.to_lowercase();
        assert!(head.starts_with("post /hook?hall=1 http/1.1"), "{head}");
        assert!(
            head.contains("content-type: application/json") && head.contains("idempotency-key: m-1"),
            "{head}"
        );
        let body: serde_json::Value = serde_json::from_str(body).unwrap();
        assert_eq!((&body["hall"], &body["alarms"][0]["what"]), (&"Hall 1".into(), &"raised".into()));
        assert_eq!(
            (&body["alarms"][0]["controller"], &body["alarms"][0]["text"]),
            (&"A1".into(), &"A1 is silent".into())
        );
    }

    #[test]
    fn no_answer_but_a_good_one_counts_and_none_is_followed_elsewhere() {
        for (answer, says) in [
            (
                "HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:1/\r\nContent-Length: 0\r\n\r\n",
                "it answered 302",
            ),
            ("HTTP/1.1 500 Internal Server Error\r\nContent-Length: 0\r\n\r\n", "it answered 500"),
            ("nonsense", "check url in [notify.webhook]"),
            ("", "check url in [notify.webhook]"),
        ] {
            let error = posted(answer).0.unwrap_err();
            assert!(error.contains(says), "{answer:?}: {error}");
        }
        let gone = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let error = post(&WebHook { authority: gone, path: "/".to_owned() }, &message()).unwrap_err();
        assert!(error.contains("check url in [notify.webhook]"), "{error}");
    }
}
