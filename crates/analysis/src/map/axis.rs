//! One direction of a map: its values, and where a coarse look at them may skip some.

use cotouch_scene::{Scene, Value};

use crate::sweep::Sweep;

/// About so many values are looked at first.
const COARSE: usize = 24;
/// At most every so manyeth value, a power of two.
const LARGEST_STEP: usize = 16;
/// Keys that end so are masses and gains: the loop depends on them smoothly.
const SMOOTH: [&str; 5] =
    ["stiffness_n_per_m", "damping_n_s_per_m", "mass_kg", "stiffness_n_m_per_rad", "s_per_rad"];

/// One direction of a map.
#[derive(Clone, Debug)]
pub(super) struct SweptAxis {
    pub(super) values: Vec<f64>,
    logarithmic: bool,
    /// Whether values between two others are allowed; whole numbers and rates are not divided.
    pub(super) divisible: bool,
    smooth: bool,
}

/// Places of values, both ends included.
pub(super) type Span = (usize, usize);

impl SweptAxis {
    /// The direction of a sweep.
    pub(super) fn new(scene: &Scene, sweep: &Sweep) -> Self {
        let divisible = matches!(scene.get(&sweep.key), Some(Value::Number(_)));
        Self {
            values: sweep.values.values().to_vec(),
            logarithmic: sweep.values.is_logarithmic(),
            divisible,
            smooth: divisible && SMOOTH.iter().any(|ending| sweep.key.ends_with(ending)),
        }
    }

    /// The direction that a map of one key does not have.
    pub(super) fn single() -> Self {
        Self { values: vec![f64::NAN], logarithmic: false, divisible: false, smooth: false }
    }

    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// The value at `share` of the way from place `first` to the next.
    pub(super) fn between(&self, first: usize, share: f64) -> f64 {
        let (from, to) = (self.values[first], self.values[first + 1]);
        match share {
            0.0 => from,
            1.0 => to,
            _ if self.logarithmic => from * (to / from).powf(share),
            _ => from + share * (to - from),
        }
    }

    /// Places that are looked at first, in runs within which the loop depends smoothly on the value. The value 0 is a
    /// run of its own, because a gain of 0 ties nothing to anything.
    pub(super) fn coarse_runs(&self) -> Vec<Vec<usize>> {
        let step = self.coarse_step();
        let mut runs = Vec::new();
        let mut first = 0;
        for place in 0..=self.len() {
            let ends = place == self.len() || self.values[place] == 0.0;
            if ends && first < place {
                let mut run: Vec<usize> = (first..place).step_by(step).collect();
                if run.last() != Some(&(place - 1)) {
                    run.push(place - 1);
                }
                runs.push(run);
            }
            if ends {
                if place < self.len() {
                    runs.push(vec![place]);
                }
                first = place + 1;
            }
        }
        runs
    }

    fn coarse_step(&self) -> usize {
        let wanted = self.len().saturating_sub(1) / COARSE;
        if self.smooth && wanted > 1 { (1 << wanted.ilog2()).min(LARGEST_STEP) } else { 1 }
    }
}

/// The spans between neighbours of a run; a run of one place is a span of one place.
pub(super) fn spans(run: &[usize]) -> Vec<Span> {
    match run {
        [only] => vec![(*only, *only)],
        _ => run.windows(2).map(|pair| (pair[0], pair[1])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(from: f64, to: f64, count: usize) -> SweptAxis {
        let scene = cotouch_scene::load("single-axis", &[]).unwrap();
        let values = crate::sweep::Grid::new(from, to, count, false).unwrap();
        SweptAxis::new(&scene, &Sweep { key: "object.damping_n_s_per_m".into(), values })
    }

    #[test]
    fn every_place_lies_in_a_span() {
        for (from, to, count) in
            [(0.0, 5.0, 200), (-2.0, 2.0, 101), (1.0, 2.0, 97), (1.0, 2.0, 1), (0.0, 1.0, 2), (-1.0, 0.0, 50)]
        {
            let mut covered = vec![false; count];
            for run in axis(from, to, count).coarse_runs() {
                for (first, last) in spans(&run) {
                    covered[first..=last].fill(true);
                }
            }
            assert!(covered.into_iter().all(|covered| covered), "{from}..{to}:{count}");
        }
    }

    #[test]
    fn zero_stands_alone() {
        let runs = axis(-2.0, 2.0, 101).coarse_runs();
        assert_eq!(runs.len(), 3);
        assert_eq!((runs[0].last(), &runs[1][..], runs[2].first()), (Some(&49), &[50][..], Some(&51)));
    }
}
