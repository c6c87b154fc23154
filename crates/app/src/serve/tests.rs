//! A served bench, as terminals and hostile neighbours find it.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use stickslip::bench::Wishes;
use stickslip::live::protocol::{Answer, Call};
use stickslip::live::{Live, Start};
use stickslip::parameters::presets;

use super::*;

fn served() -> (Server, tempfile::TempDir) {
    let mut source = presets::find("clm-bench").unwrap();
    source.text =
        stickslip::parameters::set::<stickslip::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let project = tempfile::tempdir().unwrap();
    let start =
        Start { source, io: None, seed: 1, wishes: Wishes::PLAIN, project: project.path().into(), record: None };
    let live = Live::start(start).unwrap();
    let patience = Patience { head: Duration::from_millis(500), whole: Duration::from_secs(3) };
    (Server::start(live, "127.0.0.1:0".parse().unwrap(), project.path(), patience).unwrap(), project)
}

/// What comes back for these bytes.
fn raw(server: &Server, request: &str) -> String {
    let mut stream = TcpStream::connect(server.place.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    answer
}

/// A call with these header lines.
fn posted(server: &Server, lines: &str, body: &str) -> String {
    let place = &server.place;
    let length = body.len();
    raw(
        server,
        &format!(
            "POST /api HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Length: {length}\r\n{lines}\r\n{body}",
            place.address
        ),
    )
}

fn allowed(server: &Server) -> String {
    format!("Authorization: Bearer {}\r\nContent-Type: application/json\r\n", server.place.token)
}

#[test]
fn a_terminal_finds_the_bench_by_its_project_and_leaves_with_it() {
    let (server, project) = served();
    let client = Client::of(project.path()).unwrap();
    assert_eq!(client.status().unwrap().state, "off");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = std::fs::metadata(Place::file(project.path())).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600, "the token is for this user alone");
    }
    let text = client.call(&Call::Parameters {}).unwrap();
    assert!(matches!(text, Answer::Text { text } if text.contains("[bench.controller]")));
    let refused = client.call(&Call::Start {}).unwrap_err().to_string();
    assert!(refused.contains("Home or arm first"), "{refused}");
    assert!(server.stop().is_some());
    let gone = Client::of(project.path()).err().unwrap().to_string();
    assert!(gone.contains("stickslip serve"), "{gone}");
    let gone = client.status().unwrap_err().to_string();
    assert!(gone.contains("does not answer"), "{gone}");
}

#[test]
fn the_file_of_another_bench_is_left() {
    let (server, project) = served();
    let other = Place { token: "other".into(), ..server.place.clone() };
    let left = other.leave(project.path()).unwrap();
    assert!(server.stop().is_some());
    assert_eq!(Place::find(project.path()).unwrap(), other);
    drop(left);
    assert!(Place::find(project.path()).is_err());
}

#[test]
fn a_page_of_another_origin_a_form_and_a_stranger_are_refused() {
    let (server, _project) = served();
    let status = r#"{"call":"status"}"#;
    let good = posted(&server, &allowed(&server), status);
    assert!(good.starts_with("HTTP/1.1 200") && good.contains(r#""state":"off""#), "{good}");
    let token = format!("Authorization: Bearer {}\r\n", server.place.token);
    for (lines, body, expected) in [
        ("Content-Type: application/json\r\n".into(), status, "401"),
        (format!("{}Origin: http://evil.example\r\n", allowed(&server)), status, "403"),
        (format!("{token}Content-Type: text/plain\r\n"), status, "415"),
        (allowed(&server), r#"{"call":"fly"}"#, "400"),
        (allowed(&server), "{\"call\":", "400"),
        (allowed(&server), "\u{0}", "400"),
        (allowed(&server), r#"{"call":"load","name":"../serve"}"#, "422"),
        (allowed(&server), r#"{"call":"undo"}"#, "409"),
    ] {
        let answer = posted(&server, &lines, body);
        assert!(answer.starts_with(&format!("HTTP/1.1 {expected}")), "{lines} {body}: {answer}");
        assert!(answer.contains(r#"{"error":"#), "{answer}");
    }
    let foreign =
        raw(&server, "POST /api HTTP/1.1\r\nHost: evil.example\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    assert!(foreign.starts_with("HTTP/1.1 421"), "{foreign}");
    let schema = raw(
        &server,
        &format!("GET /api/schema HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", server.place.address),
    );
    assert!(schema.contains("position_gain") || schema.contains("\"capture\""), "{schema}");
}

#[test]
fn what_is_too_large_too_slow_or_no_http_ends_and_the_bench_goes_on() {
    let (server, project) = served();
    let large = format!("{{\"call\":\"save\",\"name\":\"{}\"}}", "x".repeat(300 << 10));
    assert!(posted(&server, &allowed(&server), &large).starts_with("HTTP/1.1 413"));
    assert!(raw(&server, "\u{1}\u{2}\u{3} no http\r\n\r\n").starts_with("HTTP/1.1 400"));
    // One that never finishes the head of its request, beside others: it is cut off, they are not kept waiting.
    let mut slow = TcpStream::connect(server.place.address).unwrap();
    slow.write_all(b"POST /api HTTP/1.1\r\nHost: ").unwrap();
    let half_open: Vec<_> = (0..30).map(|_| TcpStream::connect(server.place.address).unwrap()).collect();
    let before = Client::of(project.path()).unwrap().status().unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut rest = Vec::new();
    let _ = slow.read_to_end(&mut rest);
    drop(half_open);
    // One that never finishes its body.
    let mut slow = TcpStream::connect(server.place.address).unwrap();
    let head = format!("POST /api HTTP/1.1\r\nHost: {}\r\nContent-Length: 100\r\n", server.place.address);
    slow.write_all(format!("{head}{}\r\n{{", allowed(&server)).as_bytes()).unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    assert_eq!(slow.read_to_end(&mut rest).unwrap(), 0, "cut off without an answer");
    let after = Client::of(project.path()).unwrap().status().unwrap();
    assert!(after.cycle > before.cycle && after.clock.lost == 0, "{after:?}");
}
