//! A control as a page is told of it.

use serde::Serialize;

/// One control; fields as in `page/src/protocol.ts`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Control {
    pub(crate) key: &'static str,
    pub(crate) label: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) help: &'static str,
    pub(crate) kind: &'static str,
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) log: bool,
    pub(crate) choices: Vec<String>,
    pub(crate) restarts: bool,
}

impl Control {
    /// Whether a slider can stand there. The end of one that runs over a logarithm is only nearly what it is.
    pub(crate) fn reaches(&self, number: f64) -> bool {
        let slack = 1e-9 * self.low.abs().max(self.high.abs());
        (self.low - slack..=self.high + slack).contains(&number)
    }
}
