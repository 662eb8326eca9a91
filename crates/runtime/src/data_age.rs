//! How old the data in use are, beyond what the session was made for.

use cotouch_host::{HostModel, HostState};
use cotouch_scene::scene::{PlayOut, Scene};

/// Ages that are told apart, in network periods beyond the intended one; the last stands for all above.
const AGES: usize = 32;
/// What is older in a smaller share of the network steps is an exception.
const LEAST_SHARE: f64 = 0.01;

/// Counts network steps by how old what is in use from any peer is. No allocation after it was made.
#[derive(Clone, Debug)]
pub(crate) struct DataAge {
    /// The intended age of each peer's data, network periods, in the order of hosts.
    intended: Vec<u64>,
    steps: [u64; AGES],
}

impl DataAge {
    pub(crate) fn new(scene: &Scene) -> Self {
        // What is used as it arrives has no intended age.
        let is_scheduled = scene.link.play_out == PlayOut::Scheduled;
        let intended = scene.hosts().map(|from| match is_scheduled {
            true => u64::from(scene.play_out_periods(from)),
            false => u64::MAX,
        });
        Self { intended: intended.collect(), steps: [0; AGES] }
    }

    /// At network step `step`, after what is due has come into use.
    pub(crate) fn observe(&mut self, model: &HostModel, state: &HostState, step: u64) {
        let excess = |from: usize| {
            let peer = state.peers.get(from).filter(|peer| peer.present)?;
            let age = step.saturating_sub(peer.samples.held()?.step);
            Some(age.saturating_sub(*self.intended.get(from)?))
        };
        if let Some(excess) = model.sources().filter_map(|from| excess(from.index())).max() {
            self.steps[(excess as usize).min(AGES - 1)] += 1;
        }
    }

    /// By how many network periods the data were older than intended in at least one of a hundred network steps.
    pub(crate) fn excess_periods(&self) -> u32 {
        let least = LEAST_SHARE * self.steps.iter().sum::<u64>() as f64;
        let mut older = 0.0;
        for (excess, &steps) in self.steps.iter().enumerate().rev() {
            older += steps as f64;
            if steps > 0 && older >= least {
                return excess as u32;
            }
        }
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_rare_is_an_exception() {
        let mut age = DataAge::new(&cotouch_scene::load("single-axis", &[]).expect("a built-in scene"));
        assert_eq!(age.excess_periods(), 0);
        age.steps[0] = 990;
        age.steps[4] = 5;
        assert_eq!(age.excess_periods(), 0);
        age.steps[2] = 6;
        assert_eq!(age.excess_periods(), 2);
        age.steps[4] = 20;
        assert_eq!(age.excess_periods(), 4);
    }
}
