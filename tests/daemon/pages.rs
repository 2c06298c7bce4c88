//! Pages of anybody, in a browser of this house: none of them leads a hall by any door that it has.

use std::collections::BTreeSet;
use std::fs;
use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};

use serde_json::Value;

use crate::hall::Hall;
use crate::http::{Request, To};
use crate::process::PATIENCE;

/// Every TCP port at which a process listens.
fn doors(pid: u32) -> BTreeSet<u16> {
    let open =
        fs::read_dir(format!("/proc/{pid}/fd")).unwrap().filter_map(|fd| fs::read_link(fd.ok()?.path()).ok());
    let open: BTreeSet<_> = open.map(|to| to.to_string_lossy().into_owned()).collect();
    let port = |row: &str| {
        let fields: Vec<&str> = row.split_whitespace().collect();
        let listens = fields.get(3) == Some(&"0A") && open.contains(&format!("socket:[{}]", fields.get(9)?));
        u16::from_str_radix(fields[1].rsplit(':').next()?, 16).ok().filter(|_| listens)
    };
    let tables =
        ["tcp", "tcp6"].map(|name| fs::read_to_string(format!("/proc/{pid}/net/{name}")).unwrap_or_default());
    tables.iter().flat_map(|table| table.lines().filter_map(port)).collect()
}

/// The `Host` of a request, where it is another than that of the port, and the headers beside it.
type Headers = (Option<String>, Vec<(&'static str, String)>);

/// Headers that a browser sends for a page of somebody else: led by its own name (DNS rebinding), from its own origin, without one, or for
/// a picture.
fn pages(address: SocketAddr) -> Vec<Headers> {
    let port = address.port();
    let own = |text: &str| text.to_owned();
    let evil = format!("evil.example:{port}");
    vec![
        (
            Some(evil.clone()),
            vec![("Origin", format!("http://{evil}")), ("Sec-Fetch-Site", own("same-origin"))],
        ),
        (Some(evil.clone()), vec![("Sec-Fetch-Site", own("same-origin"))]),
        (Some(evil), vec![]),
        (None, vec![("Origin", own("http://evil.example")), ("Sec-Fetch-Site", own("cross-site"))]),
        (None, vec![("Origin", own("null"))]),
        (None, vec![("Sec-Fetch-Site", own("cross-site")), ("Sec-Fetch-Mode", own("no-cors"))]),
        (None, vec![("Sec-Fetch-Site", own("same-site")), ("Sec-Fetch-Mode", own("no-cors"))]),
    ]
}

/// What such a page asks for.
const ASKED: [(&str, &str, &str); 9] = [
    ("POST", "/api/v1/show/go", ""),
    ("POST", "/api/v1/show/stop", ""),
    ("POST", "/api/v1/show/park", ""),
    ("POST", "/api/v1/levels", "{\"motion\":0.1}"),
    ("PUT", "/api/v1/sync/position", "{\"media_ms\":61500,\"playing\":true}"),
    ("GET", "/api/v1/status", ""),
    ("GET", "/api/v1/events", ""),
    ("POST", "/", "\r\ngo\r\nlevel 10%\r\n"),
    ("GO", "/", ""),
];

/// The first line of what a door answers.
fn answered(request: &Request, to: SocketAddr) -> String {
    let mut stream = TcpStream::connect(to).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    let _ = stream.write_all(&request.bytes(&To::Tcp(to))); // it may be turned away before it is whole
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).lines().next().unwrap_or_default().to_owned()
}

#[test]
fn a_page_of_anybody_leads_a_hall_by_none_of_its_doors() {
    let mut hall = Hall::open_with(|config| {
        config
            + "[api]\nlisten = [\"127.0.0.1:0\"]\nopen_role = \"view\"\n\
               [text]\nlisten = \"127.0.0.1:0\"\nsources = [\"127.0.0.1\"]\n\
               [sync]\nsources = [\"http\"]\nfilm_fps = \"25\"\nstart = \"00:01:00:00\"\n\
               [sync.http]\nfrom = \"127.0.0.1\"\nbind = \"127.0.0.1:0\"\n"
    });
    hall.arm("night");
    let led = |status: &Value| ["state", "levels", "trim_ms", "journal"].map(|key| status[key].clone());
    let before = led(&hall.status());
    let doors = doors(hall.serving().pid());
    let mut refused = 0;
    for port in &doors {
        let address = SocketAddr::from(([127, 0, 0, 1], *port));
        for (host, headers) in pages(address) {
            for (method, path, body) in ASKED {
                let mut request = Request::new(method, path).sent_ago(0);
                request = host.iter().fold(request, |request, host| request.host(host));
                request = headers.iter().fold(request, |request, (name, value)| request.header(name, value));
                request = if body.is_empty() {
                    request
                } else {
                    request.header("Content-Type", "application/json").body(body)
                };
                let answer = answered(&request, address);
                let is_text = answer.starts_with("error ") || answer.is_empty();
                assert!(is_text || answer.starts_with("HTTP/1.1 403 "), "{port}: {answer}: {request:?}");
                refused += usize::from(!is_text);
            }
        }
    }
    assert_eq!((doors.len(), refused), (3, 2 * 7 * ASKED.len()), "two of the doors speak HTTP");
    let after = hall.status();
    assert_eq!((led(&after), &after["film"]["state"]), (before, &"absent".into()), "{after}");
    assert_eq!((hall.relay(0).count(), hall.relay(1).count()), (0, 0));
    // Who belongs there is let in at each.
    let heard = |door: u16, request: Request| answered(&request, SocketAddr::from(([127, 0, 0, 1], door)));
    let position = || Request::new("PUT", "/api/v1/sync/position").body("{\"media_ms\":61500}");
    let answers = doors
        .iter()
        .map(|door| (heard(*door, Request::new("GET", "/api/v1/status")), heard(*door, position())));
    let answers: Vec<_> = answers.collect();
    for begin in ["HTTP/1.1 200 ", "HTTP/1.1 204 "] {
        assert!(
            answers.iter().any(|(read, put)| read.starts_with(begin) || put.starts_with(begin)),
            "{answers:?}"
        );
    }
    hall.close();
}
