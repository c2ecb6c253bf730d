//! The dashboard for Grafana asks for nothing that is not exported.

#![allow(clippy::unwrap_used)]

use serde_json::{Value, json};
use serve::hub::Hub;
use serve::metrics::Metrics;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Every metric by the name that Prometheus has for it. Those with labels are exported once they have a value.
fn exported() -> BTreeSet<String> {
    let metrics = Arc::new(Metrics::new());
    let hub = Hub::new(metrics.clone());
    hub.post_status(Ok(json!({ "state": "running", "fault": null })));
    hub.post_status(Ok(json!({ "state": "faulted", "fault": "overload", "faults": [] })));
    hub.post_queue(json!({ "waiting": [], "ended": [] }));
    hub.post_queue(json!({ "waiting": [], "ended": [{ "number": 1, "outcome": "completed" }] }));
    let text = metrics.text();
    let samples = text.lines().filter(|line| !line.starts_with('#'));
    samples.map(|line| line.split(['{', ' ']).next().unwrap().to_owned()).collect()
}

/// What is asked for, wherever it stands in the dashboard.
fn asked(value: &Value, names: &mut BTreeSet<String>) {
    match value {
        Value::String(text) => {
            let words = text.split(|it: char| !it.is_ascii_alphanumeric() && it != '_');
            names.extend(words.filter(|word| word.starts_with("graver_")).map(str::to_owned));
        }
        Value::Array(values) => values.iter().for_each(|value| asked(value, names)),
        Value::Object(values) => values.values().for_each(|value| asked(value, names)),
        _ => {}
    }
}

fn dashboard() -> Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../deploy/grafana/graver.json");
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn every_metric_of_the_dashboard_is_exported_and_every_exported_one_is_shown() {
    let mut names = BTreeSet::new();
    asked(&dashboard(), &mut names);
    let exported = exported();
    let unknown: Vec<&String> = names.difference(&exported).collect();
    assert!(unknown.is_empty(), "{unknown:?} of {exported:?}");
    let family = |name: &String| {
        name.trim_end_matches("_bucket")
            .trim_end_matches("_sum")
            .trim_end_matches("_count")
            .to_owned()
    };
    let shown: BTreeSet<String> = names.iter().map(family).collect();
    let missing: BTreeSet<String> =
        exported.iter().map(family).filter(|name| !shown.contains(name)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn panels_have_numbers_of_their_own_and_do_not_lie_on_each_other() {
    let dashboard = dashboard();
    let panels = dashboard["panels"].as_array().unwrap();
    let ids: BTreeSet<u64> = panels.iter().map(|panel| panel["id"].as_u64().unwrap()).collect();
    assert_eq!(ids.len(), panels.len());
    let mut cells = BTreeSet::new();
    for panel in panels {
        let of = |key: &str| panel["gridPos"][key].as_u64().unwrap();
        assert!(of("x") + of("w") <= 24, "{panel:#}");
        for x in of("x")..of("x") + of("w") {
            for y in of("y")..of("y") + of("h") {
                assert!(cells.insert((x, y)), "{}: something else is at {x}, {y}", panel["title"]);
            }
        }
        assert!(panel["targets"].as_array().unwrap().iter().all(|it| it["expr"].is_string()));
    }
}
