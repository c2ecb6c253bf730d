//! `graver watch`: a live view of a pipeline in the terminal, for those who come by SSH. It asks as every operator does and reads
//! samples as the page does; the machine waits for neither.

mod asking;
mod keys;
mod observing;
mod panel;
mod trail;
mod view;

use crate::arguments::WatchArguments;
use crate::exit::{Exit, Failure};
use asking::News;
use keys::Action;
use operator::Client;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyEventKind};
use runtime::{Instance, signal};
use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;
use view::View;

/// How long a key is waited for before the view is drawn again.
const FRAME: Duration = Duration::from_millis(50);

/// Shows a pipeline until a person leaves; one that is not there is waited for.
///
/// # Errors
/// No terminal, or one that fails.
pub fn run(arguments: &WatchArguments) -> Result<Exit, Failure> {
    let instance = Instance::new(&arguments.instance).map_err(Failure::bad_input)?;
    if !io::stdout().is_terminal() || !io::stdin().is_terminal() {
        return Err(Failure::bad_input(
            "graver watch draws on a terminal, and there is none: take graver status",
        ));
    }
    signal::install().map_err(Failure::service)?;
    let has_colour = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let view = View::new(instance.name(), has_colour);
    let (requests, asked) = channel();
    let (news, heard) = channel();
    let is_over = Arc::new(AtomicBool::new(false));
    let (observed, measured, ends) = (instance.clone(), news.clone(), is_over.clone());
    let observing = std::thread::Builder::new()
        .name("observing".to_owned())
        .spawn(move || observing::observe(&observed, &measured, &ends))
        .map_err(Failure::service)?;
    let client = Client::new(instance);
    std::thread::Builder::new()
        .name("asking".to_owned())
        .spawn(move || asking::ask(&client, &asked, &news))
        .map_err(Failure::service)?;
    // From here on the terminal is ours, and is given back in a panic too.
    let terminal = ratatui::try_init().map_err(Failure::output)?;
    let shown = show(terminal, view, &heard, &requests);
    ratatui::restore();
    is_over.store(true, Ordering::Relaxed);
    // One that panicked has left the domain too.
    let _ = observing.join();
    shown.map_err(Failure::output)
}

fn show(
    mut terminal: DefaultTerminal,
    mut view: View,
    heard: &Receiver<News>,
    requests: &Sender<operator::Request>,
) -> io::Result<Exit> {
    while signal::termination().is_none() {
        for news in heard.try_iter() {
            view.take(news);
        }
        terminal.draw(|frame| view.draw(frame))?;
        if !event::poll(FRAME)? {
            continue;
        }
        let Event::Key(key) = event::read()? else { continue };
        if key.kind == KeyEventKind::Release {
            continue;
        }
        match keys::action(&key, view.overrides()) {
            Some(Action::Leave) => return Ok(Exit::Done),
            Some(Action::Help) => view.turn_help(),
            // Who asks lives as long as this view.
            Some(Action::Ask(request)) => drop(requests.send(request)),
            None => {}
        }
    }
    Ok(Exit::Stopped)
}
