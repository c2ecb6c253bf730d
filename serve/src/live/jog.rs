//! Moving an axis for as long as a key is pressed on a page.
//!
//! Two dead men stand behind each other: the page says every tenth of a second that the key is still pressed, and as
//! long as that is not old, the controller is asked to go on, several times within its own dead man's time. Whatever
//! stops one of them stops the axis: the key, the page, its connection, this process.

use super::Order;
use crate::context::Context;
use operator::{Request, Verb, VerbReply};
use serde_json::json;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, watch};

/// How old a word of the page may be.
const PATIENCE: Duration = Duration::from_millis(300);

/// How often the controller is asked at least and at most, whatever its dead man's time.
const SLOWEST: Duration = Duration::from_millis(50);
const FASTEST: Duration = Duration::from_millis(10);

/// A key that is pressed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Press {
    axis: String,
    /// With its sign.
    speed: f64,
    unit: Option<String>,
    /// How often the key was up before: the newest press alone is seen, not what was between.
    releases: u64,
    at: Instant,
}

impl Press {
    pub(super) fn new(axis: String, speed: f64, unit: Option<String>, releases: u64) -> Self {
        Self { axis, speed, unit, releases, at: Instant::now() }
    }

    fn is_fresh(&self) -> bool {
        self.at.elapsed() < PATIENCE
    }

    /// Whether it is the same press, that lasts.
    fn is_same(&self, other: &Self) -> bool {
        (self.releases, &self.axis, self.speed, &self.unit)
            == (other.releases, &other.axis, other.speed, &other.unit)
    }
}

/// What is done about the key that is pressed.
pub(super) struct Jogger {
    context: Context,
    order: mpsc::Sender<Order>,
    /// The motion under way, and the number of the reply to its beginning.
    moving: Option<(Press, u32)>,
    /// The press that was refused, or that the machine ended: it is not begun anew before the key was up.
    spent: Option<Press>,
}

impl Jogger {
    pub(super) fn new(context: Context, order: mpsc::Sender<Order>) -> Self {
        Self { context, order, moving: None, spent: None }
    }

    /// Moves what is pressed until the page has gone, and stops it then.
    pub(super) async fn run(mut self, mut presses: watch::Receiver<Option<Press>>) {
        let dead_man = self.context.hub.machine().map_or(0.2, |machine| machine.safety.dead_man);
        let pause = Duration::from_secs_f64(dead_man.clamp(0.0, 10.0) / 4.0);
        let pause = pause.clamp(FASTEST, SLOWEST);
        loop {
            tokio::select! {
                changed = presses.changed(), if self.moving.is_none() => {
                    if changed.is_err() {
                        return;
                    }
                }
                () = tokio::time::sleep(pause), if self.moving.is_some() => {}
            }
            let is_gone = presses.has_changed().is_err();
            let press = presses.borrow_and_update().clone();
            let press = press.filter(|press| press.is_fresh() && !is_gone);
            self.follow(press).await;
            if is_gone {
                return;
            }
        }
    }

    async fn follow(&mut self, press: Option<Press>) {
        match (self.moving.take(), press) {
            (None, None) => self.spent = None,
            (None, Some(press)) => self.begin(press).await,
            (Some((moving, number)), Some(press)) if moving.is_same(&press) => {
                let request = operate(Verb::JogOn, &press, f64::from(number), None);
                match self.ask(request).await {
                    Ok(_) => self.moving = Some((press, number)),
                    Err(why) => self.give_up(press, why),
                }
            }
            (Some((moving, _)), Some(press)) => {
                if moving.axis != press.axis {
                    self.stop(&moving).await;
                }
                self.begin(press).await;
            }
            (Some((moving, _)), None) => self.stop(&moving).await,
        }
    }

    async fn begin(&mut self, press: Press) {
        let goes_on = |spent: &Press| spent.is_same(&press) && press.at < spent.at + PATIENCE;
        if let Some(spent) = self.spent.take().filter(goes_on) {
            self.spent = Some(Press { at: press.at, ..spent });
            return;
        }
        let request = operate(Verb::Jog, &press, press.speed, press.unit.clone());
        match self.ask(request).await {
            Ok(number) => self.moving = Some((press, number)),
            Err(why) => self.give_up(press, why),
        }
    }

    fn give_up(&mut self, press: Press, why: String) {
        self.spent = Some(press);
        let said = json!({ "type": "refusal", "of": "jog", "text": why });
        // A page that does not read has no need to know.
        let _ = self.order.try_send(Order::Say(said));
    }

    async fn stop(&self, moving: &Press) {
        // Where this is not heard, the controller's own dead man stops it.
        let _ = self.ask(operate(Verb::Jog, moving, 0.0, None)).await;
    }

    /// The number of the reply, or why it is refused.
    async fn ask(&self, request: Request) -> Result<u32, String> {
        let reply =
            crate::api::ask(&self.context, request).await.map_err(|error| error.to_string())?;
        let reply: VerbReply = serde_json::from_value(reply).map_err(|error| error.to_string())?;
        if reply.accepted {
            return Ok(reply.number);
        }
        let state = reply.state;
        Err(reply.refusal.unwrap_or_else(|| format!("not possible while the machine is {state}")))
    }
}

fn operate(verb: Verb, press: &Press, value: f64, unit: Option<String>) -> Request {
    Request::Operate { verb, axes: vec![press.axis.clone()], value, second: 0.0, unit }
}
