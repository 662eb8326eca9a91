//! Which counters have come.

const WORD_BITS: u64 = u64::BITS as u64;
const WORDS: u64 = 32;
/// Counters further than this behind the newest are rejected, whether they came or not.
const SPAN: u64 = (WORDS - 1) * WORD_BITS;

/// A window over counters that has each pass once: a ring of bits whose oldest word makes room for the newest (Zhang & Tsou 2012,
/// RFC 6479).
#[derive(Clone, Debug, Default)]
pub(super) struct ReplayWindow {
    /// One more than the newest counter that came.
    next: u64,
    words: [u64; WORDS as usize],
}

impl ReplayWindow {
    /// Whether this counter may pass.
    pub(super) fn allows(&self, counter: u64) -> bool {
        if counter >= self.next {
            return true;
        }
        self.next - counter <= SPAN && self.words[word(counter)] & bit(counter) == 0
    }

    /// Marks a counter that passed, below `u64::MAX`; whether it is the newest.
    pub(super) fn mark(&mut self, counter: u64) -> bool {
        let is_newest = counter >= self.next;
        if is_newest {
            let newest_word = self.next.saturating_sub(1) / WORD_BITS;
            let new_words = (counter / WORD_BITS - newest_word).min(WORDS);
            for step in 1..=new_words {
                self.words[((newest_word + step) % WORDS) as usize] = 0;
            }
            self.next = counter + 1;
        }
        self.words[word(counter)] |= bit(counter);
        is_newest
    }
}

const fn word(counter: u64) -> usize {
    (counter / WORD_BITS % WORDS) as usize
}

const fn bit(counter: u64) -> u64 {
    1 << (counter % WORD_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Steps back and forth, small and as long as the window and longer.
    fn walks() -> impl Strategy<Value = Vec<i64>> {
        let step = prop_oneof![-3i64..4, -70i64..70, -2100i64..2100, Just(5000), Just(1 << 40)];
        proptest::collection::vec(step, 1..400)
    }

    proptest! {
        #[test]
        fn it_is_a_set_of_what_came_with_an_edge(walk in walks()) {
            let (mut window, mut came) = (ReplayWindow::default(), BTreeSet::new());
            let mut counter = 0u64;
            for step in walk {
                counter = counter.saturating_add_signed(step);
                let newest = came.last().copied();
                let is_too_old = newest.is_some_and(|newest: u64| newest + 1 > counter + SPAN);
                let expected = !is_too_old && !came.contains(&counter);
                prop_assert_eq!(window.allows(counter), expected, "{} after {:?}", counter, newest);
                if expected {
                    prop_assert_eq!(window.mark(counter), newest.is_none_or(|newest| counter > newest));
                    came.insert(counter);
                }
            }
        }
    }
}
