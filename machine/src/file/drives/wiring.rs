//! Where the machine's inputs and outputs are, on drives that have them.

use super::{find, refuse_others};
use crate::document::{Diagnostics, Named, ProblemKind, Span};
use crate::operating::Operating;

/// What the table of a kind of drives says of inputs and outputs.
pub(super) struct Wiring<'a, T> {
    /// The kind, as its table is called.
    pub(super) drives: &'static str,
    /// The keys of a place.
    pub(super) keys: &'static str,
    /// The table.
    pub(super) span: Span,
    pub(super) inputs: Option<&'a Named<T>>,
    pub(super) outputs: Option<&'a Named<T>>,
}

impl<T> Wiring<'_, T> {
    /// The place of each input and of each output of `operating`, as `read` reads it from its table; an output called
    /// `switched` is switched elsewhere and needs none. Notes places of nothing, and what has none.
    pub(super) fn places<P: Clone + Default>(
        &self,
        operating: &Operating,
        switched: &[&str],
        read: impl Fn(&T, &mut Diagnostics) -> P,
        diagnostics: &mut Diagnostics,
    ) -> (Vec<P>, Vec<Option<P>>) {
        let inputs: Vec<&str> = operating.inputs.iter().map(|input| input.name.as_str()).collect();
        let outputs: Vec<&str> =
            operating.outputs.iter().map(|output| output.name.as_str()).collect();
        refuse_others(self.inputs, "input", &inputs, diagnostics);
        refuse_others(self.outputs, "output", &outputs, diagnostics);
        let mut place = |tables, kind, name: &str| match find(tables, name) {
            Some(table) => read(table, diagnostics),
            None => {
                // A switch that nobody reads would never be active.
                let message = format!("nothing is said of where the {kind} `{name}` is");
                let (drives, keys) = (self.drives, self.keys);
                let help = format!("add [drives.{drives}.{kind}s.{name}] with its {keys}");
                diagnostics.refuse(ProblemKind::MissingKey, self.span, message, Some(help));
                P::default()
            }
        };
        let inputs = inputs.into_iter().map(|name| place(self.inputs, "input", name)).collect();
        let is_elsewhere =
            |name: &str| switched.contains(&name) && find(self.outputs, name).is_none();
        let outputs = outputs.into_iter();
        let outputs =
            outputs.map(|name| (!is_elsewhere(name)).then(|| place(self.outputs, "output", name)));
        (inputs, outputs.collect())
    }
}
