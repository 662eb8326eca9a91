//! temporary
use crate::record::RecordItem;
/// temporary
pub trait RecordSink: Send {
    /// temporary
    fn record(&mut self, item: &RecordItem);
}
