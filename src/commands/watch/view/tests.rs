#![allow(clippy::unwrap_used)]

use super::*;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;

fn running(tool: [f64; 3]) -> Status {
    Status {
        state: "running".to_owned(),
        planner: "streaming".to_owned(),
        stream: 1,
        job: Some("letters".to_owned()),
        played: 250,
        samples: 1000,
        time_left: Some(3.0),
        stroke: 2,
        lit: true,
        rate: 1.0,
        rate_override: 1.0,
        power_override: 1.0,
        tool,
        cycles: 4711,
        services: [("drives".to_owned(), Some(12)), ("planner".to_owned(), Some(13))].into(),
        ..Status::default()
    }
}

/// A view in which the tool has gone through the middle of the area.
fn view(has_colour: bool) -> View {
    let mut view = View::new("cell1", has_colour);
    for step in 0..=10 {
        let x = 0.05 + 0.01 * f64::from(step);
        view.take(News::Status(Box::new(running([x, 0.1, 0.0]))));
    }
    view
}

fn drawn(view: &View, width: u16, height: u16) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| view.draw(frame)).unwrap();
    terminal.backend().buffer().clone()
}

fn rows(buffer: &Buffer) -> Vec<String> {
    let width = usize::from(buffer.area.width);
    buffer.content.chunks(width).map(|row| row.iter().map(|cell| cell.symbol()).collect()).collect()
}

fn has_braille(rows: &[String]) -> bool {
    rows.iter().any(|row| row.chars().any(|it| ('\u{2801}'..='\u{28ff}').contains(&it)))
}

#[test]
fn a_usual_terminal_shows_state_bar_path_words_and_keys() {
    let rows = rows(&drawn(&view(true), 80, 24));
    assert!(rows[0].starts_with("cell1  running"), "{rows:#?}");
    assert!(
        rows[1].contains("█") && rows[1].contains(" 25 %") && rows[1].contains("left"),
        "{rows:#?}"
    );
    for words in
        ["letters", "150.000   100.000   0.000 mm", "100 %", "4711, 0 overruns", "drives 12"]
    {
        assert!(rows.iter().any(|row| row.contains(words)), "no {words} in {rows:#?}");
    }
    assert!(has_braille(&rows), "{rows:#?}");
    assert!(rows[23].contains("h hold") && rows[23].contains("q leave"));
}

#[test]
fn the_path_is_where_the_tool_was() {
    let rows = rows(&drawn(&view(true), 80, 24));
    // The line at y = 100 mm is in the middle of the area, which is in the middle of rows 2 to 21.
    let marked: Vec<_> = (0..24).filter(|row| has_braille(&rows[*row..=*row])).collect();
    assert!(marked.iter().all(|row| (11..=12).contains(row)), "{marked:?} of {rows:#?}");
    assert!(rows.iter().any(|row| row.contains('+')));
}

#[test]
fn a_small_terminal_shows_what_matters_most() {
    let mut view = view(true);
    let fault = "following error of x".to_owned();
    let status = Status { state: "fault".to_owned(), fault: Some(fault), ..running([0.1; 3]) };
    view.take(News::Status(Box::new(status)));
    let drawn_rows = rows(&drawn(&view, 40, 6));
    assert!(drawn_rows[0].starts_with("cell1  fault"), "{drawn_rows:#?}");
    assert!(drawn_rows[2].contains("following error of x"), "{drawn_rows:#?}");
    for (width, height) in [(1, 1), (5, 2), (10, 3), (59, 24), (200, 8), (80, 1)] {
        let rows = rows(&drawn(&view, width, height));
        assert_eq!(rows.len(), usize::from(height));
    }
    view.turn_help();
    for (width, height) in [(1, 1), (20, 4), (80, 24)] {
        drawn(&view, width, height);
    }
}

#[test]
fn without_colours_nothing_is_coloured_and_a_fault_still_stands_out() {
    let mut view = view(false);
    let status = Status { state: "fault".to_owned(), ..running([0.1; 3]) };
    view.take(News::Status(Box::new(status)));
    let buffer = drawn(&view, 80, 24);
    for cell in &buffer.content {
        assert_eq!((cell.fg, cell.bg), (Color::Reset, Color::Reset));
    }
    assert!(buffer.content[7].modifier.contains(Modifier::REVERSED));
    let coloured = drawn(&super::tests::view(true), 80, 24);
    assert!(coloured.content.iter().any(|cell| cell.fg == Color::Green));
}

#[test]
fn a_pipeline_that_does_not_answer_is_told_and_what_was_known_stays() {
    let mut view = View::new("cell1", true);
    view.take(News::Silence("no pipeline runs in instance cell1".to_owned()));
    assert!(rows(&drawn(&view, 80, 24))[0].contains("no pipeline runs in instance cell1"));
    let mut view = super::tests::view(true);
    view.take(News::Silence("the pipeline does not answer".to_owned()));
    let rows = rows(&drawn(&view, 80, 24));
    assert!(rows[0].contains("does not answer"));
    assert!(rows.iter().any(|row| row.contains("letters")));
}

#[test]
fn what_became_of_a_key_is_told_and_the_help_lists_them_all() {
    let mut view = view(true);
    view.take(News::Answer("refused: the door is open".to_owned()));
    assert!(rows(&drawn(&view, 80, 24))[22].contains("refused: the door is open"));
    view.turn_help();
    let with_help = rows(&drawn(&view, 80, 24));
    for (key, what) in keys::HELP {
        assert!(with_help.iter().any(|row| row.contains(key) && row.contains(what)), "{key}");
    }
    view.turn_help();
    assert!(!rows(&drawn(&view, 80, 24)).iter().any(|row| row.contains("give the job up")));
}

#[test]
fn an_override_in_a_hold_goes_on_from_what_was_asked_for_before_it() {
    let mut view = view(true);
    for (state, rate) in [("running", 0.8), ("holding", 0.3), ("holding", 0.0)] {
        let (state, asked) = (state.to_owned(), (0.8, 1.2));
        let (rate_override, power_override) = asked;
        let status = Status { state, rate, rate_override, power_override, ..running([0.1; 3]) };
        view.take(News::Status(Box::new(status)));
    }
    assert_eq!(view.overrides(), [0.8, 1.2]);
}
