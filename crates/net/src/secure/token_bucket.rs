//! A bound on how often something is done.

use cotouch_scene::time::LocalTime;

/// Lets `burst` through at once, and one more every `period_ns`.
#[derive(Clone, Copy, Debug)]
pub(super) struct TokenBucket {
    period_ns: i64,
    burst: i64,
    /// When the next token is there; in the past while there are tokens left over.
    next: LocalTime,
}

impl TokenBucket {
    pub(super) const fn new(period_ns: i64, burst: i64) -> Self {
        Self { period_ns, burst, next: LocalTime(i64::MIN) }
    }

    /// Whether there is a token, which is taken then.
    pub(super) fn take(&mut self, now: LocalTime) -> bool {
        let full = now.plus_ns(-(self.burst - 1) * self.period_ns);
        self.next = self.next.max(full);
        if self.next > now {
            return false;
        }
        self.next = self.next.plus_ns(self.period_ns);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_burst_passes_and_then_the_rate() {
        let mut bucket = TokenBucket::new(10, 5);
        let passed = |bucket: &mut TokenBucket, now| (0..100).filter(|_| bucket.take(LocalTime(now))).count();
        assert_eq!(passed(&mut bucket, 1000), 5);
        assert_eq!(passed(&mut bucket, 1009), 0);
        assert_eq!(passed(&mut bucket, 1010), 1);
        assert_eq!(passed(&mut bucket, 1035), 2);
        assert_eq!(passed(&mut bucket, 5000), 5, "no more than a burst is saved up");
    }
}
