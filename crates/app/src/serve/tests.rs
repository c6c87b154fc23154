//! A running bench with well-behaved, slow and hostile clients.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use stickslip::bench::ThreadSettings;
use stickslip::live::protocol::{Answer, Call, MarkKind};
use stickslip::live::{Live, Start};
use stickslip::parameters::presets;

use serde_json::json;

use super::*;

fn start_server() -> (Server, tempfile::TempDir) {
    start_server_with(Timeouts {
        head: Duration::from_millis(500),
        whole: Duration::from_secs(3),
        silence: Duration::from_secs(1),
    })
}

fn start_server_with(timeouts: Timeouts) -> (Server, tempfile::TempDir) {
    let mut source = presets::find("clm-bench").unwrap();
    source.text =
        stickslip::parameters::set::<stickslip::Preset<f64>>(&source.text, "t", "bench.tick_rate", "1000").unwrap();
    let project = tempfile::tempdir().unwrap();
    let start = Start { thread_settings: ThreadSettings::PLAIN, ..Start::new(source, project.path()) };
    let live = Live::start(start).unwrap();
    (
        Server::start(live, &["127.0.0.1:0".parse().unwrap()], Known::default(), project.path(), timeouts).unwrap(),
        project,
    )
}

/// The response to these bytes.
fn send_raw(server: &Server, request: &str) -> String {
    let mut stream = TcpStream::connect(server.place.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    answer
}

/// Makes a call with these header lines.
fn post(server: &Server, lines: &str, body: &str) -> String {
    let place = &server.place;
    let length = body.len();
    send_raw(
        server,
        &format!(
            "POST /api HTTP/1.1\r\nHost: {}\r\nConnection: close\r\nContent-Length: {length}\r\n{lines}\r\n{body}",
            place.address
        ),
    )
}

fn header_lines(server: &Server) -> String {
    format!("Authorization: Bearer {}\r\nContent-Type: application/json\r\n", server.place.token)
}

#[test]
fn a_client_finds_the_bench_by_its_project_until_the_bench_stops() {
    let (server, project) = start_server();
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
    let error = Client::of(project.path()).err().unwrap().to_string();
    assert!(error.contains("stickslip serve"), "{error}");
    let error = client.status().unwrap_err().to_string();
    assert!(error.contains("does not answer"), "{error}");
}

#[test]
fn the_address_file_of_another_bench_is_not_removed() {
    let (server, project) = start_server();
    let other = Place { token: "other".into(), ..server.place.clone() };
    let file = other.write(project.path()).unwrap();
    assert!(server.stop().is_some());
    assert_eq!(Place::find(project.path()).unwrap(), other);
    drop(file);
    assert!(Place::find(project.path()).is_err());
}

#[test]
fn pages_of_another_origin_forms_and_calls_without_token_are_refused() {
    let (server, _project) = start_server();
    let status = r#"{"call":"status"}"#;
    let good = post(&server, &header_lines(&server), status);
    assert!(good.starts_with("HTTP/1.1 200") && good.contains(r#""state":"off""#), "{good}");
    let token = format!("Authorization: Bearer {}\r\n", server.place.token);
    for (lines, body, expected) in [
        ("Content-Type: application/json\r\n".into(), status, "401"),
        (format!("{}Origin: http://evil.example\r\n", header_lines(&server)), status, "403"),
        (format!("{token}Content-Type: text/plain\r\n"), status, "415"),
        (header_lines(&server), r#"{"call":"fly"}"#, "400"),
        (header_lines(&server), "{\"call\":", "400"),
        (header_lines(&server), "\u{0}", "400"),
        (header_lines(&server), r#"{"call":"load","name":"../serve"}"#, "422"),
        (header_lines(&server), r#"{"call":"undo"}"#, "409"),
    ] {
        let answer = post(&server, &lines, body);
        assert!(answer.starts_with(&format!("HTTP/1.1 {expected}")), "{lines} {body}: {answer}");
        assert!(answer.contains(r#"{"error":"#), "{answer}");
    }
    let other_host =
        send_raw(&server, "POST /api HTTP/1.1\r\nHost: evil.example\r\nContent-Length: 0\r\nConnection: close\r\n\r\n");
    assert!(other_host.starts_with("HTTP/1.1 421"), "{other_host}");
    // A tunnel from another local port.
    let (lines, length) = (header_lines(&server), status.len());
    let hosts = "Host: localhost:9000\r\nOrigin: http://localhost:9000\r\n";
    let tunnel =
        format!("POST /api HTTP/1.1\r\n{hosts}Connection: close\r\nContent-Length: {length}\r\n{lines}\r\n{status}");
    let answer = send_raw(&server, &tunnel);
    assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    let schema = send_raw(
        &server,
        &format!("GET /api/schema HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", server.place.address),
    );
    assert!(schema.contains("position_gain") || schema.contains("\"capture\""), "{schema}");
}

#[test]
fn requests_that_are_too_large_too_slow_or_not_http_end_and_the_bench_continues() {
    let (server, project) = start_server();
    let large = format!("{{\"call\":\"save\",\"name\":\"{}\"}}", "x".repeat(300 << 10));
    assert!(post(&server, &header_lines(&server), &large).starts_with("HTTP/1.1 413"));
    assert!(send_raw(&server, "\u{1}\u{2}\u{3} no http\r\n\r\n").starts_with("HTTP/1.1 400"));
    // A client that never finishes the head of its request is disconnected; other clients do not wait.
    let mut slow = TcpStream::connect(server.place.address).unwrap();
    slow.write_all(b"POST /api HTTP/1.1\r\nHost: ").unwrap();
    let half_open: Vec<_> = (0..30).map(|_| TcpStream::connect(server.place.address).unwrap()).collect();
    let before = Client::of(project.path()).unwrap().status().unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut rest = Vec::new();
    let _ = slow.read_to_end(&mut rest);
    drop(half_open);
    // A client that never finishes its body.
    let mut slow = TcpStream::connect(server.place.address).unwrap();
    let head = format!("POST /api HTTP/1.1\r\nHost: {}\r\nContent-Length: 100\r\n", server.place.address);
    slow.write_all(format!("{head}{}\r\n{{", header_lines(&server)).as_bytes()).unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    assert_eq!(slow.read_to_end(&mut rest).unwrap(), 0, "cut off without an answer");
    let after = Client::of(project.path()).unwrap().status().unwrap();
    assert!(after.cycle > before.cycle && after.clock.lost == 0, "{after:?}");
}

#[test]
fn two_hundred_slow_clients_do_not_delay_another_one() {
    // No time limit ends them within this test.
    let hour = Duration::from_secs(3600);
    let (server, _project) = start_server_with(Timeouts { head: hour, whole: hour, silence: hour });
    let token = header_lines(&server);
    let head = format!("POST /api HTTP/1.1\r\nHost: {}\r\nContent-Length: 100\r\n", server.place.address);
    for half in ["POST /api HTTP/1.1\r\nHost: ".into(), format!("{head}{token}\r\n{{"), format!("{head}\r\n{{")] {
        let slow: Vec<TcpStream> = (0..200)
            .map(|_| {
                let mut stream = TcpStream::connect(server.place.address).unwrap();
                stream.write_all(half.as_bytes()).unwrap();
                stream
            })
            .collect();
        let answer = post(&server, &token, r#"{"call":"status"}"#);
        assert!(answer.starts_with("HTTP/1.1 200"), "{half:?}: {answer}");
        drop(slow);
    }
}

type Socket = tungstenite::WebSocket<tungstenite::stream::MaybeTlsStream<TcpStream>>;

fn connect(server: &Server, query: &str, origin: Option<&str>) -> Result<Socket, String> {
    use tungstenite::client::IntoClientRequest as _;
    let mut request = format!("ws://{}/api/live{query}", server.place.address).into_client_request().unwrap();
    if let Some(origin) = origin {
        request.headers_mut().insert("Origin", origin.parse().unwrap());
    }
    tungstenite::connect(request).map(|(socket, _)| socket).map_err(|error| error.to_string())
}

fn open(server: &Server, client: &str) -> Socket {
    connect(server, &format!("?token={}&client={client}", server.place.token), None).unwrap()
}

fn next(socket: &mut Socket) -> serde_json::Value {
    loop {
        if let tungstenite::Message::Text(text) = socket.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

/// Makes a call and returns its answer; points before it are ignored.
fn call(socket: &mut Socket, call: serde_json::Value) -> serde_json::Value {
    socket.send(call.to_string().into()).unwrap();
    loop {
        let message = next(socket);
        if message.get("id") == call.get("id") {
            return message;
        }
    }
}

#[test]
fn streams_are_sent_without_a_gap_and_end_with_their_connection() {
    let (server, project) = start_server();
    let mut socket = open(&server, "page");
    let started = call(&mut socket, json!({"id": 1, "call": "stream", "signals": ["angle", "state"], "every": 0.02}));
    assert_eq!(started["stage"], "streaming", "{started}");
    let mut last: Option<u64> = None;
    let mut points = 0;
    while points < 40 {
        let message = next(&mut socket);
        assert_eq!(message["stream"], started["capture"], "{message}");
        for point in message["points"].as_array().unwrap() {
            assert_eq!((&point["missing"], point["min"].as_array().unwrap().len()), (&json!(0), 2), "{point}");
            let from = point["from"].as_u64().unwrap();
            assert!(last.is_none_or(|last| from == last + 1), "{last:?} {point}");
            last = point["to"].as_u64();
            points += 1;
        }
    }
    // Calls are possible at the same time, by the same rules.
    let set = call(&mut socket, json!({"id": "a", "call": "save", "name": "mine"}));
    assert_eq!(set["answer"], "done", "{set}");
    let other = call(&mut open(&server, "another"), json!({"id": 2, "call": "save", "name": "mine"}));
    assert!(other["error"].as_str().unwrap().contains("page"), "{other}");
    let number = started["capture"].as_u64().unwrap();
    drop(socket);
    let client = Client::of(project.path()).unwrap();
    let ended = (0..200).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        client.call(&Call::Points { capture: number }).is_err()
    });
    assert!(ended, "the stream ends with its connection");
}

/// A binary message: stream, first cycle, missing cycles before it, rows, columns.
struct Frame {
    words: [u64; 3],
    rows: u64,
    columns: Vec<Vec<f64>>,
}

fn frame(bytes: &[u8]) -> Frame {
    let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    let half = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let values: Vec<f64> = bytes[32..].chunks_exact(8).map(|v| f64::from_le_bytes(v.try_into().unwrap())).collect();
    let (rows, signals) = (half(24), half(28) as usize);
    assert_eq!(values.len(), rows as usize * signals);
    Frame {
        words: [word(0), word(8), word(16)],
        rows: rows.into(),
        columns: values.chunks_exact(rows as usize).map(<[f64]>::to_vec).collect(),
    }
}

/// The next binary message.
fn next_frame(socket: &mut Socket) -> Frame {
    loop {
        if let tungstenite::Message::Binary(bytes) = socket.read().unwrap() {
            return frame(&bytes);
        }
    }
}

#[test]
fn every_cycle_of_a_stream_is_delivered_or_counted_as_missing() {
    let (server, project) = start_server();
    let client = Client::of(project.path()).unwrap();
    let mut socket = open(&server, "scope");
    let signals = ["setpoint.velocity", "angle", "state"];
    let started = call(&mut socket, json!({"id": 1, "call": "samples", "signals": signals}));
    assert_eq!(started["answer"], "samples", "{started}");
    let (mut first, mut next, mut delivered, mut missing) = (None, 0, 0, 0);
    let mut account = |frame: Frame| {
        let [stream, from, before] = frame.words;
        assert_eq!((stream, frame.columns.len()), (started["capture"].as_u64().unwrap(), 3));
        assert_eq!(from - before, *first.get_or_insert(from - before).max(&mut next), "no cycle twice, none left out");
        assert!(frame.columns[2].iter().all(|state| *state == 0.0), "switched off");
        next = from + frame.rows;
        delivered += frame.rows;
        missing += before;
        (next - first.unwrap(), delivered, missing)
    };
    for _ in 0..30 {
        account(next_frame(&mut socket));
    }
    // A client that pauses delays no other.
    std::thread::sleep(Duration::from_millis(400));
    assert_eq!(client.status().unwrap().clock.lost, 0);
    let until = client.status().unwrap().cycle;
    let (mut produced, mut got, mut lacking) = account(next_frame(&mut socket));
    while got < until - 5 {
        (produced, got, lacking) = account(next_frame(&mut socket));
    }
    assert_eq!(produced, got + lacking);
    // The call `drop` ends the stream, not the connection.
    let number = started["capture"].as_u64().unwrap();
    let dropped = call(&mut socket, json!({"id": 2, "call": "drop", "capture": number}));
    assert_eq!(dropped["answer"], "done", "{dropped}");
    assert_eq!(call(&mut socket, json!({"id": 3, "call": "status"}))["answer"], "status");
}

#[test]
fn marks_have_the_cycle_of_each_event() {
    let (server, project) = start_server();
    let client = Client::of(project.path()).unwrap();
    let values = [("bench.controller.position_gain".to_owned(), "11".to_owned())].into();
    let Answer::Entered { cycle, .. } = client.call(&Call::Set { values }).unwrap() else { panic!("not entered") };
    client.call(&Call::Home {}).unwrap();
    while client.status().unwrap().doing.is_some() {
        std::thread::sleep(Duration::from_millis(20));
    }
    let Answer::Marks { marks } = client.call(&Call::Marks {}).unwrap() else { panic!("no marks") };
    let kinds: Vec<_> = marks.iter().map(|mark| mark.kind).collect();
    assert_eq!(kinds, [MarkKind::Change, MarkKind::Begin, MarkKind::End], "{marks:?}");
    assert_eq!((marks[0].cycle, &*marks[0].text), (cycle, "bench.controller.position_gain"));
    assert!(marks[1].cycle < marks[2].cycle && marks[1].text == "home", "{marks:?}");
    assert_eq!(client.status().unwrap().marks, 3);
    drop(server);
}

#[test]
fn a_client_that_never_reads_is_disconnected_and_delays_no_other() {
    let (server, project) = start_server();
    let client = Client::of(project.path()).unwrap();
    let Answer::Signals { signals, .. } = client.call(&Call::Signals {}).unwrap() else { panic!("no signals") };
    let names: Vec<_> = signals.iter().map(|signal| &signal.name).collect();
    let mut deaf = open(&server, "deaf");
    // The largest number of streams, so that the buffers of the system fill soon.
    for id in 0..16 {
        deaf.send(json!({"id": id, "call": "samples", "signals": names}).to_string().into()).unwrap();
    }
    let free = || {
        (0..400).any(|_| {
            std::thread::sleep(Duration::from_millis(50));
            let status = client.status().unwrap();
            assert_eq!(status.clock.lost, 0, "{status:?}");
            let mut socket = open(&server, "other");
            let started = call(&mut socket, json!({"id": 1, "call": "samples", "signals": ["angle"]}));
            started["answer"] == "samples"
        })
    };
    assert!(free(), "the streams of a disconnected client have ended");
    drop(deaf);
}

#[test]
fn an_invalid_stream_of_every_cycle_is_refused_with_the_valid_choices() {
    let (server, _project) = start_server();
    let mut socket = open(&server, "scope");
    let many: Vec<_> = (0..65).map(|n| format!("s{n}")).collect();
    for (signals, message) in [
        (json!(["angel"]), "Did you mean angle?"),
        (json!(many), "At most 64"),
        (json!(["angle", "state", "angle"]), "angle twice"),
        (json!([]), "Choose at least one"),
        (json!("angle"), "invalid call"),
        (json!([1]), "invalid call"),
    ] {
        let refused = call(&mut socket, json!({"id": 1, "call": "samples", "signals": signals}));
        assert!(refused["error"].as_str().is_some_and(|error| error.contains(message)), "{signals} {refused}");
    }
    let points = call(&mut socket, json!({"id": 2, "call": "points", "capture": 1}));
    assert!(points["error"].is_string(), "{points}");
    let elsewhere = post(&server, &header_lines(&server), r#"{"call":"samples","signals":["angle"]}"#);
    assert!(elsewhere.starts_with("HTTP/1.1 422") && elsewhere.contains("WebSocket"), "{elsewhere}");
}

#[test]
fn a_socket_of_another_origin_without_token_or_with_invalid_messages_does_no_harm() {
    let (server, project) = start_server();
    let token = format!("?token={}", server.place.token);
    for (query, origin, status) in [
        ("", None, "401"),
        ("?token=0", None, "401"),
        (&*token, Some("http://evil.example"), "403"),
        (&*token, Some("null"), "403"),
    ] {
        let refused = connect(&server, query, origin).err().unwrap();
        assert!(refused.contains(status), "{query} {origin:?}: {refused}");
    }
    assert!(connect(&server, &token, Some(&format!("http://{}", server.place.address))).is_ok());
    let mut socket = open(&server, "x");
    for nonsense in ["", "{", "7", "[]", "null", "{\"id\":1}", "{\"id\":1,\"call\":\"fly\"}"] {
        socket.send(nonsense.into()).unwrap();
        assert!(next(&mut socket)["error"].is_string(), "{nonsense}");
    }
    // Calls above the rate are refused.
    for _ in 0..600 {
        socket.send("{\"call\":\"sets\"}".into()).unwrap();
    }
    let flooded = (0..600).filter(|_| next(&mut socket)["error"].as_str().is_some_and(|e| e.contains("too many")));
    assert!(flooded.count() > 50);
    // A message that is too large ends the connection, and so does silence.
    let _ = socket.send(format!("\"{}\"", "x".repeat(300 << 10)).into());
    assert!((0..1000).any(|_| socket.read().is_err()));
    let silent = TcpStream::connect(server.place.address).unwrap();
    silent.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let url = format!("ws://{}/api/live{token}", server.place.address);
    let (mut silent, _) = tungstenite::client(url, silent).unwrap();
    let stream = silent.get_mut();
    let mut bytes = [0; 4096];
    // Pings are read and not answered.
    while stream.read(&mut bytes).unwrap() > 0 {}
    let status = Client::of(project.path()).unwrap().status().unwrap();
    assert!(status.clock.lost == 0, "{status:?}");
}

/// Status and text of a page.
fn fetch(server: &Server, path: &str, headers: &str) -> (String, String) {
    let head = format!("GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n", server.place.address);
    let mut stream = TcpStream::connect(server.place.address).unwrap();
    stream.write_all(format!("{head}{headers}\r\n").as_bytes()).unwrap();
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).unwrap();
    let text = String::from_utf8_lossy(&bytes).into_owned();
    (text.split(' ').nth(1).unwrap_or_default().to_owned(), text)
}

#[test]
fn the_printed_address_gives_access_and_other_requests_get_instructions() {
    let (server, _project) = start_server();
    let (status, text) = fetch(&server, "/", "");
    assert!(status == "401" && text.contains("Open the address that the program printed"), "{text}");
    let (status, _) = fetch(&server, "/?token=0", "");
    assert_eq!(status, "401");
    let (status, text) = fetch(&server, &format!("/?token={}", server.place.token), "");
    let port = server.place.address.port();
    let cookie = format!("stickslip-{port}={}", server.place.token);
    assert!(status == "303" && text.contains("location: /\r\n"), "{text}");
    assert!(text.contains(&format!("set-cookie: {cookie}; HttpOnly; SameSite=Strict")), "{text}");
    let (status, text) = fetch(&server, "/friction", &format!("Cookie: {cookie}\r\n"));
    assert_eq!(status, "200");
    for header in ["content-security-policy: default-src 'self'", "nosniff", "no-referrer", "frame-ancestors 'none'"] {
        assert!(text.contains(header), "{header}: {text}");
    }
    // A program that was built without Node has instructions in place of the page.
    assert_eq!(text.contains("built without its page"), stickslip_page::missing().is_some());
    let (status, _) = fetch(&server, "/none.js", &format!("Cookie: {cookie}\r\n"));
    assert!(status == "404" || stickslip_page::missing().is_some());
}

#[test]
fn a_valid_token_is_kept_after_a_restart_and_an_invalid_one_is_replaced() {
    let project = tempfile::tempdir().unwrap();
    let first = super::token(project.path()).unwrap();
    assert_eq!(super::token(project.path()).unwrap(), first);
    std::fs::write(project.path().join("serve-token"), "short").unwrap();
    let second = super::token(project.path()).unwrap();
    assert!(second != first && second.len() == 32, "{second}");
}

#[test]
fn a_figure_is_shown_and_other_files_are_saved() {
    assert_eq!(super::page::shown("run-1-trial.svg"), ("image/svg+xml", "inline"));
    assert_eq!(super::page::shown("run-1-run.mf4"), ("application/octet-stream", "attachment"));
}

#[test]
fn files_of_runs_and_of_the_implementation_require_the_token_and_other_files_are_refused() {
    let (server, project) = start_server();
    let cookie = format!("Cookie: stickslip-{}={}\r\n", server.place.address.port(), server.place.token);
    for order in [r#"{"call":"record","name":"taken"}"#, r#"{"call":"end_record"}"#] {
        let answer = post(&server, &header_lines(&server), order);
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }
    let listed = || post(&server, &header_lines(&server), r#"{"call":"runs"}"#);
    while !listed().contains("\"number\":1") {
        std::thread::sleep(Duration::from_millis(20));
    }
    let (status, text) = fetch(&server, "/run/1/run.mf4", &cookie);
    assert!(status == "200" && text.contains("filename=\"run-1-run.mf4\"") && text.contains("\r\nMDF"), "{text:.400}");
    let (status, text) = fetch(&server, "/run/1/run.mf4?as=csv", &cookie);
    assert!(
        status == "200" && text.contains("filename=\"run-1-run.csv\"") && text.contains("\r\ntime [s],"),
        "{text:.400}"
    );
    let (status, text) = fetch(&server, "/implementation/tick.h", &cookie);
    assert!(status == "200" && text.contains("#ifndef"), "{text:.400}");
    std::fs::write(project.path().join("secret"), "hidden").unwrap();
    for path in [
        "/run/1/none",
        "/run/1/..%2F..%2Fsecret",
        "/run/1/run.json%00",
        "/run/9/run.mf4",
        "/run/x/run.mf4",
        "/run/1/run.mf4?as=exe",
        "/run/1/run.mf4?as=..%2F..%2Fsecret",
        "/run/1/run.json?as=csv",
        "/implementation/..%2Fsecret",
    ] {
        let (status, text) = fetch(&server, path, &cookie);
        assert!(status.starts_with('4') && !text.contains("hidden"), "{path}: {text}");
    }
    for path in ["/run/1/run.mf4", "/implementation/tick.h"] {
        assert_eq!(fetch(&server, path, "").0, "401", "{path}");
    }
}
