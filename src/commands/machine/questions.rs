//! Questions on a terminal, with what is usual in brackets.

use std::io::{BufRead, Write};

/// Where answers come from and questions go to.
#[derive(Debug)]
pub(super) struct Questions<Answers, Screen> {
    answers: Answers,
    screen: Screen,
    /// Whether nobody answers any more.
    is_over: bool,
}

impl<Answers: BufRead, Screen: Write> Questions<Answers, Screen> {
    pub(super) fn new(answers: Answers, screen: Screen) -> Self {
        Self { answers, screen, is_over: false }
    }

    /// Asks for `what` until `read` takes the answer; an empty one is `usual`, and so is the end of all
    /// answers.
    pub(super) fn ask<T>(
        &mut self,
        what: &str,
        usual: T,
        written: impl Fn(&T) -> String,
        read: impl Fn(&str) -> Result<T, String>,
    ) -> T {
        while !self.is_over {
            // A terminal that takes no question may still answer.
            let _ = write!(self.screen, "{what} [{}]: ", written(&usual));
            let _ = self.screen.flush();
            let mut line = String::new();
            self.is_over = !matches!(self.answers.read_line(&mut line), Ok(1..));
            match line.trim() {
                "" => return usual,
                text => match read(text) {
                    Ok(value) => return value,
                    Err(why) => {
                        let _ = writeln!(self.screen, "{why}");
                    }
                },
            }
        }
        usual
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use workbench::new::Argument;

    #[test]
    fn an_answer_is_taken_nonsense_is_asked_again_and_nothing_is_the_usual() {
        let mut screen = Vec::new();
        let mut questions = Questions::new(&b"much\n50 kg\n800 g\n\n"[..], &mut screen);
        let head = Argument::HEAD;
        let mut ask = || questions.ask("head", 0.5, |it| head.written(*it), |text| head.read(text));
        assert_eq!([ask(), ask(), ask()], [0.8, 0.5, 0.5]);
        let screen = String::from_utf8(screen).unwrap();
        assert_eq!(screen.matches("head [0.5 kg]: ").count(), 5);
        assert!(screen.contains("--head 50 kg: from 0.01 to 20 kg can be asked for"), "{screen}");
    }
}
