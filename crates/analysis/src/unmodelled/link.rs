//! What links do to packets that is in no loop.

use cotouch_scene::names::HostIndex;
use cotouch_scene::scene::{Architecture, Impairment, PlayOut, Scene};

use crate::left_out::LeftOut;

/// What happens to fewer packets than this share does not count: at 1 kHz, one in a quarter of an hour. A loop that is stable has
/// settled long before the next one.
const SELDOM: f64 = 1e-6;

/// A direction in which samples travel.
struct Way<'a> {
    scene: &'a Scene,
    from: HostIndex,
    to: HostIndex,
    impairment: &'a Impairment,
}

/// Loss, jitter and queues on any way, and peers that are taken to have left.
pub(super) fn unmodelled(scene: &Scene) -> Vec<LeftOut> {
    let mut left_out = Vec::new();
    let ways: Vec<Way> = ways(scene).collect();
    let lossy = ways.iter().filter(|way| way.impairment.loss_rate > SELDOM);
    if let Some(worst) = worst(lossy, |way| way.impairment.loss_rate) {
        left_out.push(LeftOut::new(
            format!(
                "Loss of up to {:.3} % of the packets ({})",
                100.0 * worst.impairment.loss_rate,
                worst.key("loss_rate")
            ),
            "every sample is taken to arrive, and each that does not is felt as a jump; up to which loss the mean square of \
             such jumps dies out is told by `cotouch analyze margin`",
        ));
    }
    let late = ways.iter().filter(|way| way.late_share() > SELDOM);
    if let Some(worst) = worst(late, |way| way.impairment.jitter_s) {
        let used = match scene.link.play_out {
            PlayOut::OnArrival => "samples are used on arrival (link.play_out)",
            PlayOut::Scheduled => "samples come later than they are to be used",
        };
        left_out.push(LeftOut::new(
            format!(
                "Transit times that vary by {:.3} ms in the mean ({})",
                1e3 * worst.impairment.jitter_s,
                worst.key("jitter_s")
            ),
            format!("the constant part of the latency is taken, and {used}"),
        ));
    }
    let cut = ways.iter().filter(|way| way.impairment.outage_duration_s > 0.0);
    if let Some(worst) = worst(cut, |way| way.impairment.outage_duration_s) {
        left_out.push(LeftOut::new(
            format!(
                "An outage of {} s ({})",
                worst.impairment.outage_duration_s,
                worst.key("outage_duration_s")
            ),
            "every sample is taken to arrive; what comes of an outage is told by `cotouch analyze margin`",
        ));
    }
    let limited = ways.iter().find(|way| way.impairment.rate_limit_bytes_per_s > 0.0);
    if let Some(way) = limited {
        left_out.push(LeftOut::new(
            format!("The queue of a link that limits its rate ({})", way.key("rate_limit_bytes_per_s")),
            "packets are taken to pass at once",
        ));
    }
    let session = &scene.session;
    if ways.iter().any(|way| way.silent_share(session.peer_timeout_s) > SELDOM) {
        left_out.push(LeftOut::new(
            "Peers that are taken to have left, and come back (session.peer_timeout_s)",
            "every peer is taken to be there, and may be silent for longer than that",
        ));
    }
    let rejoins = session.rejoin_s > 0.0 && session.rejoin_after_s < session.peer_timeout_s;
    if rejoins && ways.iter().any(|way| way.silent_share(session.rejoin_after_s) > SELDOM) {
        left_out.push(LeftOut::new(
            "What is brought together slowly after a gap between samples (session.rejoin_after_s)",
            "samples are taken to be held, and their gaps may be longer than that",
        ));
    }
    left_out
}

fn worst<'a, 'b>(ways: impl Iterator<Item = &'b Way<'a>>, how_bad: fn(&Way) -> f64) -> Option<&'b Way<'a>>
where
    'a: 'b,
{
    ways.max_by(|one, other| how_bad(one).total_cmp(&how_bad(other)))
}

/// All ways that samples take.
fn ways(scene: &Scene) -> impl Iterator<Item = Way<'_>> {
    let is_used = |from: HostIndex, to: HostIndex| match scene.session.architecture {
        Architecture::Distributed => true,
        Architecture::Centralized => from == HostIndex::FIRST || to == HostIndex::FIRST,
    };
    scene.hosts().flat_map(move |from| {
        let others = from.others(scene.session.users).filter(move |&to| is_used(from, to));
        others.map(move |to| Way { scene, from, to, impairment: scene.impairment(from, to) })
    })
}

impl Way<'_> {
    /// The scene key of one of its impairments.
    fn key(&self, name: &str) -> String {
        let is_own = self.scene.link.ways.iter().any(|way| (way.from, way.to) == (self.from, self.to));
        format!("{}.{name}", if is_own { "link.way" } else { "link.impairment" })
    }

    /// The share of packets that jitter brings at another instant than the analysis takes: after they are to be played out.
    fn late_share(&self) -> f64 {
        let &Impairment { latency_s, jitter_s, .. } = self.impairment;
        let slack_s = match self.scene.link.play_out {
            PlayOut::Scheduled => {
                f64::from(self.scene.play_out_periods(self.from)) * self.period_s() - latency_s
            }
            PlayOut::OnArrival => 0.0,
        };
        exceeds(slack_s, jitter_s)
    }

    /// The share of packets after which nothing is heard for so long.
    fn silent_share(&self, timeout_s: f64) -> f64 {
        let Impairment { jitter_s, loss_rate, loss_burst_packets, .. } = *self.impairment;
        let missing = (timeout_s / self.period_s()).ceil() - 1.0;
        if missing < 1.0 {
            return 1.0;
        }
        let burst = loss_burst_packets.max(loss_rate / (1.0 - loss_rate)).max(1.0);
        let lost = loss_rate * (1.0 - burst.recip()).powf(missing - 1.0);
        lost.max(exceeds(timeout_s - self.period_s(), jitter_s))
    }

    fn period_s(&self) -> f64 {
        self.scene.rates.network_hz.period_s()
    }
}

/// How often an exponentially distributed time of the given mean is longer than `limit_s`.
fn exceeds(limit_s: f64, mean_s: f64) -> f64 {
    if mean_s > 0.0 { (-limit_s.max(0.0) / mean_s).exp() } else { 0.0 }
}
