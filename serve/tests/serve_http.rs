//! The interface for programs, through a real server.

#![allow(clippy::unwrap_used)]

mod support;

use serde_json::{Value, json};
use serve::openapi;
use serve::routes::{Gives, table};
use serve::server::{ServeError, Server};
use std::os::unix::fs::PermissionsExt;
use support::{OPERATE, Place, WATCH, ended, options};

/// Asserts that an answer is what the description says of it.
fn assert_described(document: &Value, path: &str, method: &str, answer: &Value) {
    let schema = &document["paths"][path][method]["responses"]["200"]["content"]["application/json"]
        ["schema"];
    let mut whole = schema.clone();
    whole["components"] = document["components"].clone();
    let validator = jsonschema::validator_for(&whole).unwrap();
    let errors: Vec<String> = validator
        .iter_errors(answer)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(errors.is_empty(), "{method} {path}: {errors:#?}\n{answer:#}");
}

#[test]
fn every_answer_is_as_the_description_says() {
    let place = Place::new();
    let run = place.folder.path().join("run");
    place.fake.queue.lock().unwrap().ended = vec![ended(1, &run)];
    let fault = operator::PastFault {
        time: 1,
        code: "overload".to_owned(),
        detail: "too much".to_owned(),
        job: None,
    };
    place.fake.status.lock().unwrap().faults = vec![fault];
    let document = openapi::document();
    assert_eq!(place.get("/openapi.json").done(), document);
    for route in table() {
        let path = route.path.replace("{number}", "1").replace("{verb}", "hold");
        match (route.method.as_str(), route.gives) {
            ("GET", Gives::Json(_)) => {
                assert_described(&document, route.path, "get", &place.get(&path).done());
            }
            ("POST", Gives::Json(_)) if !path.contains("jobs") => {
                let answer =
                    place.post(&path, if path.ends_with("move") { br#"{"place":2}"# } else { b"" });
                assert_described(&document, route.path, "post", &answer.done());
            }
            _ => {}
        }
    }
    assert!(place.get("/api/v1/faults").done()[0]["advice"].as_str().unwrap().contains("cool"));
}

#[test]
fn a_request_is_handed_on_and_a_refusal_is_an_answer() {
    let place = Place::new();
    assert_eq!(place.post("/api/v1/requests/hold", b"").done()["accepted"], true);
    *place.fake.refusal.lock().unwrap() = Some("x would be at 0.4 m".to_owned());
    let step = br#"{"axes":["x"],"value":0.4,"second":0.1,"unit":"m"}"#;
    let reply = place.post("/api/v1/requests/step", step).done();
    assert_eq!((&reply["accepted"], &reply["code"]), (&json!(false), &json!("soft_limit")));
    assert_eq!(reply["refusal"], "x would be at 0.4 m");
    let asked = place.fake.asked();
    assert_eq!(asked[0], json!({"request": "verb", "verb": "hold", "value": 0.0}));
    assert_eq!(asked[1]["verb"], "step");
    assert!(place.post("/api/v1/requests/step", b"{}").error(400).contains("axes"));
    assert!(place.post("/api/v1/requests/fly", b"{}").error(404).contains("enable"));
    assert!(place.post("/api/v1/requests/hold", b"{\"axis\":1}").error(400).contains("axis"));
}

#[test]
fn a_pipeline_that_says_no_is_a_conflict_with_its_words() {
    let place = Place::new();
    place.fake.is_there.store(false, std::sync::atomic::Ordering::Relaxed);
    assert_eq!(place.get("/api/v1/status").error(409), "no pipeline is running");
}

#[test]
fn an_uploaded_file_is_listed_submitted_and_removed() {
    let place = Place::new();
    let path = "/api/v1/jobs?name=..%2FMy%20plate.svg";
    let file = place.post(path, b"<svg/>").done();
    assert_eq!((&file["name"], &file["size"]), (&json!("My plate.svg"), &json!(6)));
    assert_eq!(place.get("/api/v1/jobs").done(), json!([file]));
    let id = file["id"].as_str().unwrap();
    let job = |verb: &str| format!("/api/v1/jobs/{id}/{verb}");
    let number = place.post(&job("submit"), br#"{"set":["marking.power=20 %"]}"#).done();
    assert_eq!(number, json!({ "number": 7 }));
    let asked = place.fake.asked().pop().unwrap();
    assert_eq!((&asked["request"], &asked["detached"]), (&json!("submit"), &json!(true)));
    let spooled = asked["job"]["job"].as_str().unwrap().to_owned();
    assert!(spooled.ends_with(&format!("spool/{id}/My plate.svg")), "{spooled}");
    assert!(
        place.post(&job("submit"), br#"{"set":["machine.home=0"]}"#).error(400).contains("machine")
    );
    // A job that waits needs its file.
    let waiting = operator::QueuedJob { number: 7, file: Some(spooled), ..Default::default() };
    place.fake.queue.lock().unwrap().waiting = vec![waiting];
    let own = [("X-Graver", "1")];
    let remove = || place.send("DELETE", &format!("/api/v1/jobs/{id}"), &own, b"");
    assert!(remove().error(409).contains("job 7"));
    place.fake.queue.lock().unwrap().waiting.clear();
    remove().done();
    assert!(remove().error(404).contains("no uploaded file"));
    assert!(place.post("/api/v1/jobs?name=noending", b"x").error(400).contains("noending"));
    assert!(place.post("/api/v1/jobs?name=a.svg", b"").error(400).contains("empty"));
}

#[test]
fn a_job_is_planned_by_a_process_of_its_own() {
    let place = Place::new();
    let script = r#"#!/bin/sh
case "$*" in
*bad.ngc) echo '{"error":{"file":"/x/bad.ngc","line":2,"column":1,"message":"no such code"}}'; exit 2;;
*preview*) echo '{"strokes":[[[0,0,0],[0.1,0,0]]],"bounds":{"lower":[0,0,0],"upper":[0.1,0,0]}}' > "$5";;
*) echo '{"time":1.5,"strokes":1,"length":0.1,"power":[0.8,0.8],"notes":[],"bounds":{"lower":[0,0,0],"upper":[0.1,0,0]}}';;
esac
"#;
    let program = place.folder.path().join("graver");
    std::fs::write(&program, script).unwrap();
    std::fs::set_permissions(&program, PermissionsExt::from_mode(0o700)).unwrap();
    let document = openapi::document();
    let uploaded = |name: &str| {
        let file = place.post(&format!("/api/v1/jobs?name={name}"), b"G0\n").done();
        format!("/api/v1/jobs/{}", file["id"].as_str().unwrap())
    };
    let (good, bad) = (uploaded("good.ngc"), uploaded("bad.ngc"));
    let check = place.post(&format!("{good}/check"), b"").done();
    assert_described(&document, "/api/v1/jobs/{id}/check", "post", &check);
    assert_eq!(
        (&check["ok"], &check["time"], &check["bounds"]["upper"][0]),
        (&json!(true), &json!(1.5), &json!(0.1))
    );
    let shown = place.post(&format!("{good}/preview"), b"").done();
    assert_described(&document, "/api/v1/jobs/{id}/preview", "post", &shown);
    assert_eq!(shown["strokes"][0][1], json!([0.1, 0.0, 0.0]));
    let check = place.post(&format!("{bad}/check"), b"").done();
    assert_eq!((&check["ok"], &check["error"]["line"]), (&json!(false), &json!(2)));
    assert_eq!(check["error"]["file"], "bad.ngc");
    assert_eq!(place.post(&format!("{bad}/preview"), b"").error(422), "no such code");
}

#[test]
fn of_a_run_its_report_its_summary_and_its_picture_are_handed_out_and_nothing_else() {
    let place = Place::new();
    let run = place.folder.path().join("run");
    std::fs::create_dir(&run).unwrap();
    for (name, text) in [("summary.json", "{}"), ("path.svg", "<svg/>"), ("samples.bin", "secret")]
    {
        std::fs::write(run.join(name), text).unwrap();
    }
    let before = ended(1, &place.folder.path().join("other"));
    place.fake.queue.lock().unwrap().ended = vec![before, ended(2, &run)];
    let runs = place.get("/api/v1/runs").done();
    assert_eq!((&runs[0]["n"], &runs[1]["n"]), (&json!(2), &json!(1)), "the newest first");
    assert_eq!(runs[0]["files"], json!(["summary.json", "path.svg"]));
    assert_eq!((&runs[0]["time"], &runs[1]["files"]), (&json!(30), &json!([])));
    let picture = place.get("/api/v1/runs/2/path.svg");
    assert_eq!((picture.status, picture.body.as_slice()), (200, &b"<svg/>"[..]));
    assert_eq!(picture.headers["content-type"], "image/svg+xml");
    assert!(picture.headers["content-security-policy"].starts_with("sandbox"));
    assert_eq!(place.get("/api/v1/runs/2/summary.json").done(), json!({}));
    assert!(place.get("/api/v1/runs/2/report.html").error(404).contains("no such file"));
    for file in ["samples.bin", "..%2F..%2Ftokens", "%2Fetc%2Fpasswd"] {
        assert!(place.get(&format!("/api/v1/runs/2/{file}")).error(404).contains("path.svg"));
    }
    assert!(place.get("/api/v1/runs/9/path.svg").error(404).contains("no run 9"));
}

#[test]
fn without_a_token_nothing_is_told_and_each_token_gives_its_right() {
    let place = Place::strict();
    let bearer = |token: &str| format!("Bearer {token}");
    for path in
        ["/api/v1/status", "/api/v1/jobs", "/metrics", "/openapi.json", "/api/v1/runs/1/path.svg"]
    {
        assert!(place.get(path).error(401).contains("token"), "{path}");
        let answer = place.send("GET", path, &[("Authorization", &bearer(WATCH))], b"");
        assert_ne!(answer.status, 401, "{path}");
    }
    let stop = |token: &str| {
        place.send("POST", "/api/v1/requests/stop", &[("Authorization", &bearer(token))], b"")
    };
    assert!(place.post("/api/v1/requests/stop", b"").error(401).contains("token"));
    assert!(stop(WATCH).error(403).contains("watching"));
    assert!(stop("operate-0123456780").error(401).contains("wrong"));
    assert_eq!(stop(OPERATE).done()["accepted"], true);
    // The page itself has no secrets; it asks for a token.
    assert_eq!(place.get("/").status, 200);
    assert!(place.get("/login?token=no").error(401).contains("wrong"));
    let login = place.get(&format!("/login?token={WATCH}"));
    assert_eq!((login.status, login.headers["location"].as_str()), (303, "/"));
    let (cookie, _) = login.headers["set-cookie"].split_once(';').unwrap();
    assert_eq!(place.send("GET", "/api/v1/status", &[("Cookie", cookie)], b"").status, 200);
}

#[test]
fn pages_of_other_sites_are_refused_by_their_origin_and_by_our_name() {
    let place = Place::new();
    let own = format!("http://{}", place.address);
    let stop = |headers: &[(&str, &str)]| place.send("POST", "/api/v1/requests/stop", headers, b"");
    stop(&[("Origin", &own)]).done();
    for headers in [&[("Origin", "http://evil.example"), ("X-Graver", "1")][..], &[]] {
        assert!(stop(headers).error(403).contains("Origin"));
    }
    let rebound = [("Host", "evil.example:7180"), ("X-Graver", "1")];
    assert!(stop(&rebound).error(403).contains("--host"));
    assert!(place.send("GET", "/", &rebound, b"").error(403).contains("--host"));
    assert_eq!(place.send("GET", "/", &[("Host", "laser.example:7180")], b"").status, 200);
    assert_eq!(place.fake.asked().len(), 1);
}

#[test]
fn too_many_changes_are_refused_but_a_stop_never_is() {
    let place = Place::new();
    let mut refused = 0;
    for _ in 0..200 {
        let answer = place.post("/api/v1/requests/resume", b"");
        if answer.status != 200 {
            assert!(answer.error(429).contains("wait"));
            refused += 1;
        }
    }
    assert!(refused > 0, "200 in a row are too many");
    for _ in 0..10 {
        place.post("/api/v1/requests/stop", b"").done();
        place.post("/api/v1/requests/hold", b"").done();
    }
}

#[test]
fn what_is_too_large_or_not_there_is_told() {
    let place = Place::new();
    // Told by the length alone, before anything of it has come.
    let large = [("X-Graver", "1"), ("Content-Length", "300000")];
    assert_eq!(place.send("POST", "/api/v1/requests/stop", &large, b"").status, 413);
    let large = [("X-Graver", "1"), ("Content-Length", "70000000")];
    let refused = place.send("POST", "/api/v1/jobs?name=a.svg", &large, b"");
    assert!(refused.error(413).contains("67108864 bytes"));
    assert!(place.get("/nothing.js").error(404).contains("/nothing.js"));
    assert_eq!(place.send("PUT", "/api/v1/status", &[("X-Graver", "1")], b"").status, 405);
    assert_eq!(place.send("POST", "/", &[("X-Graver", "1")], b"").status, 404);
    assert_eq!(place.post("/api/v1/queue/x/cancel", b"").status, 400);
}

#[test]
fn the_page_and_all_answers_have_their_guards() {
    let place = Place::new();
    let page = place.get("/");
    assert_eq!(page.headers["content-type"], "text/html; charset=utf-8");
    assert!(page.headers["content-security-policy"].contains("default-src 'self'"));
    let again = place.send("GET", "/", &[("If-None-Match", &page.headers["etag"])], b"");
    assert_eq!((again.status, again.body.len()), (304, 0));
    for path in ["/", "/api/v1/status", "/nothing"] {
        let answer = place.get(path);
        assert_eq!(answer.headers["x-content-type-options"], "nosniff", "{path}");
        assert!(!answer.headers.contains_key("access-control-allow-origin"), "{path}");
    }
    let metrics = place.get("/metrics");
    assert!(metrics.headers["content-type"].starts_with("text/plain; version=0.0.4"));
    assert!(String::from_utf8(metrics.body).unwrap().contains("\ngraver_clients 0\n"));
}

#[test]
fn an_address_that_others_reach_needs_tokens() {
    let place = Place::new();
    let mut open = options(place.folder.path(), place.folder.path().join("unused"), true);
    (open.listen, open.token_file) = ("0.0.0.0:0".parse().unwrap(), None);
    let error = Server::bind(open, place.fake.clone()).unwrap_err();
    assert!(matches!(error, ServeError::NoTokens(_)), "{error}");
    let mut made = options(place.folder.path(), place.folder.path().join("new/tokens"), true);
    made.listen = "0.0.0.0:0".parse().unwrap();
    let server = Server::bind(made, place.fake.clone()).unwrap();
    assert_eq!(server.made_tokens(), Some(&place.folder.path().join("new/tokens")));
}
