//! The connection of a page: it is told what is new, and says what it wants to see and to move.
//!
//! Nothing waits for a page. Whatever it is sent is made when the message before has left, from the newest there is:
//! a slow page misses states between, and one that reads nothing keeps one message waiting and no more.

mod jog;
mod view;

use crate::access::Right;
use crate::api::ApiError;
use crate::context::Context;
use crate::scope::ScopeRequest;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Extension, State};
use axum::http::HeaderMap;
use axum::response::Response;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use jog::{Jogger, Press};
use serde::Deserialize;
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, watch};
use view::View;

/// The most pages at a time.
pub const MOST_PAGES: i64 = 64;

/// The longest message of a page [bytes].
const LONGEST: usize = 16 << 10;

/// How often a page is told what is new.
const PACE: Duration = Duration::from_millis(50);

/// How long a message may take to leave: a page that reads nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(20);

/// Messages of a page in a second; a page that jogs sends ten.
const MOST_MESSAGES: u32 = 200;

/// What a page says.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum Said {
    Jog { axis: String, speed: f64, unit: Option<String> },
    JogStop,
    Scope(ScopeRequest),
    ScopeOff,
}

/// What the reading half hands to the writing one.
#[derive(Debug)]
enum Order {
    Scope(Option<ScopeRequest>),
    Say(Value),
}

pub(crate) async fn live(
    State(context): State<Context>,
    Extension(right): Extension<Option<Right>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Result<Response, ApiError> {
    context.access.admit_live(&headers)?;
    if context.metrics.clients() >= MOST_PAGES {
        let text = format!("{MOST_PAGES} pages are connected already: close some");
        return Err(ApiError::unavailable(text));
    }
    let right = right.unwrap_or(Right::Watch);
    let upgrade = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST).write_buffer_size(0);
    Ok(upgrade.on_upgrade(move |socket| converse(socket, context, right)))
}

/// Serves a page until it or the server goes.
async fn converse(socket: WebSocket, context: Context, right: Right) {
    let _counted = Counted::new(&context);
    let (sink, stream) = socket.split();
    let (order, orders) = mpsc::channel(8);
    // Dropping the sender is the end of any jog.
    let (pressed, presses) = watch::channel(None);
    let jogger = Jogger::new(context.clone(), order.clone());
    let jog = tokio::spawn(jogger.run(presses));
    let view = View::new(context.clone(), right);
    tokio::select! {
        () = read(stream, right, order, pressed) => {}
        () = write(sink, view, orders) => {}
    }
    // It stops the axis first; there is nobody to tell if it panicked.
    let _ = jog.await;
}

/// Counts a page for as long as it is connected.
struct Counted(Context);

impl Counted {
    fn new(context: &Context) -> Self {
        context.metrics.connected();
        Self(context.clone())
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.metrics.disconnected();
    }
}

/// Takes what the page says, until it has gone.
async fn read(
    mut stream: SplitStream<WebSocket>,
    right: Right,
    order: mpsc::Sender<Order>,
    pressed: watch::Sender<Option<Press>>,
) {
    let refuse = |of: &str, text: String| {
        // A page that does not read what it asked for is told less.
        let _ = order.try_send(Order::Say(json!({ "type": "refusal", "of": of, "text": text })));
    };
    let (mut counted, mut since) = (0, Instant::now());
    // How often the key was up: who presses it again at once means it anew.
    let mut releases = 0;
    while let Some(Ok(message)) = stream.next().await {
        if since.elapsed() > Duration::from_secs(1) {
            (counted, since) = (0, Instant::now());
        }
        counted += 1;
        if counted > MOST_MESSAGES {
            return;
        }
        let text = match message {
            Message::Text(text) => text,
            Message::Close(_) => return,
            Message::Binary(_) | Message::Ping(_) | Message::Pong(_) => continue,
        };
        match serde_json::from_str(&text) {
            Ok(Said::Jog { .. }) if right < Right::Operate => {
                refuse(
                    "jog",
                    "this token is for watching; operating needs the other one".to_owned(),
                );
            }
            Ok(Said::Jog { axis, speed, unit }) => {
                pressed.send_replace(Some(Press::new(axis, speed, unit, releases)));
            }
            Ok(Said::JogStop) => {
                releases += 1;
                pressed.send_replace(None);
            }
            Ok(Said::Scope(request)) => {
                let _ = order.send(Order::Scope(Some(request))).await;
            }
            Ok(Said::ScopeOff) => {
                let _ = order.send(Order::Scope(None)).await;
            }
            Err(error) => refuse("message", format!("this is no message of a page: {error}")),
        }
    }
}

/// Tells the page what is new, until it has gone or the server ends.
async fn write(
    mut sink: SplitSink<WebSocket, Message>,
    mut view: View,
    mut orders: mpsc::Receiver<Order>,
) {
    let mut pace = tokio::time::interval(PACE);
    pace.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            _ = pace.tick() => {}
            order = orders.recv() => match order {
                Some(Order::Say(value)) => view.say(value),
                Some(Order::Scope(request)) => view.show(request),
                None => return,
            },
        }
        if view.is_over() {
            let _ = tokio::time::timeout(PATIENCE, sink.send(Message::Close(None))).await;
            return;
        }
        while let Some(message) = view.next() {
            match tokio::time::timeout(PATIENCE, sink.send(message)).await {
                Ok(Ok(())) => {}
                Ok(Err(_)) | Err(_) => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn what_a_page_says_is_understood_and_nothing_else() {
        let said = |text: &str| serde_json::from_str::<Said>(text);
        let jog = said(r#"{"type":"jog","axis":"x","speed":-0.05,"unit":"m"}"#).unwrap();
        let unit = Some("m".to_owned());
        assert_eq!(jog, Said::Jog { axis: "x".to_owned(), speed: -0.05, unit });
        assert_eq!(said(r#"{"type":"jog_stop"}"#).unwrap(), Said::JogStop);
        let scope = r#"{"type":"scope","signals":["feedback.lit"],"trigger":{"signal":"feedback.lit",
            "level":0.5,"edge":"falling"},"mode":"single","seconds":0.5,"position":0.25}"#;
        assert!(matches!(said(scope).unwrap(), Said::Scope(request) if request.seconds == 0.5));
        for text in ["", "{}", r#"{"type":"fire"}"#, r#"{"type":"jog","axis":"x"}"#] {
            assert!(said(text).is_err(), "{text}");
        }
    }
}
