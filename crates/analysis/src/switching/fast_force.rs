//! The force above 8 Hz, of many fingers at once: what the verdict of a run counts.
//!
//! A Butterworth high pass of the fourth order (Butterworth 1930) by the bilinear transform, as in the observer of runs, whose
//! notches for what scripts ask for are not needed here: after their policy hands push constantly.

/// Above this, force counts as oscillation rather than as what users do, Hz.
const CORNER_HZ: f64 = 8.0;

/// `y = (b0 + b1·z⁻¹ + b2·z⁻²)/(1 + a1·z⁻¹ + a2·z⁻²)·x`.
#[derive(Clone, Copy, Debug)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl Section {
    fn high_pass(damping: f64, period_s: f64) -> Self {
        // Below about four ticks a cycle a corner cannot be told from the tick itself.
        let w = (std::f64::consts::PI * (CORNER_HZ * period_s).min(0.25)).tan();
        let norm = 1.0 / (1.0 + 2.0 * damping * w + w * w);
        Self {
            b: [norm, -2.0 * norm, norm],
            a: [2.0 * (w * w - 1.0) * norm, (1.0 - 2.0 * damping * w + w * w) * norm],
        }
    }
}

/// What one number of a force does above 8 Hz.
#[derive(Clone, Copy, Debug, Default)]
struct Filtered {
    /// Of both sections, transposed direct form II.
    memory: [[f64; 2]; 2],
    last: f64,
    squares: f64,
    changes: f64,
}

/// Observes rows of forces, a column for each trajectory.
#[derive(Debug)]
pub(super) struct FastForce {
    sections: [Section; 2],
    columns: usize,
    numbers: Vec<Filtered>,
    ticks: u64,
    period_s: f64,
}

/// Of a force above 8 Hz over a while.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Strength {
    /// N².
    pub(super) mean_square: f64,
    /// Of a sinusoid that changes as much from tick to tick, Hz.
    pub(super) hz: f64,
}

impl FastForce {
    pub(super) fn new(rows: usize, columns: usize, period_s: f64) -> Self {
        // Damping ratios of the two sections.
        let sections =
            [1.0, 3.0].map(|odd: f64| Section::high_pass((odd * std::f64::consts::PI / 8.0).sin(), period_s));
        Self { sections, columns, numbers: vec![Filtered::default(); rows * columns], ticks: 0, period_s }
    }

    /// One tick of one row; in the first, what is there counts as having been there for ever.
    pub(super) fn observe(&mut self, row: usize, forces: &[f64]) {
        let is_first = self.ticks == 0;
        let numbers = &mut self.numbers[row * self.columns..(row + 1) * self.columns];
        for (number, &force) in numbers.iter_mut().zip(forces) {
            if is_first {
                number.settle(&self.sections, force);
            }
            number.step(&self.sections, force);
        }
    }

    /// All rows of a tick were observed.
    pub(super) fn end_tick(&mut self) {
        self.ticks += 1;
    }

    /// What the rows `first` to `first + rows` did together in a column since the last block's end, in `ticks` ticks.
    pub(super) fn strength(&self, first: usize, rows: usize, column: usize, ticks: u64) -> Strength {
        let sum = |of: fn(&Filtered) -> f64| {
            (first..first + rows).map(|row| of(&self.numbers[row * self.columns + column])).sum::<f64>()
        };
        let (squares, changes) = (sum(|number| number.squares), sum(|number| number.changes));
        // Of a sinusoid of frequency f, changes are 4·sin²(π·f·T) times the squares.
        let share = if squares > 0.0 { (changes / squares).sqrt() / 2.0 } else { 0.0 };
        Strength {
            mean_square: squares / ticks as f64,
            hz: share.min(1.0).asin() / (std::f64::consts::PI * self.period_s),
        }
    }

    pub(super) fn end_block(&mut self) {
        self.numbers.iter_mut().for_each(|number| (number.squares, number.changes) = (0.0, 0.0));
    }
}

impl Filtered {
    fn settle(&mut self, sections: &[Section; 2], input: f64) {
        let mut input = input;
        for (section, memory) in sections.iter().zip(&mut self.memory) {
            // A high pass lets nothing of a constant through.
            *memory = [-section.b[0] * input, section.b[2] * input];
            input = 0.0;
        }
    }

    fn step(&mut self, sections: &[Section; 2], input: f64) {
        let mut value = input;
        for (section, memory) in sections.iter().zip(&mut self.memory) {
            let output = section.b[0] * value + memory[0];
            memory[0] = section.b[1] * value - section.a[0] * output + memory[1];
            memory[1] = section.b[2] * value - section.a[1] * output;
            value = output;
        }
        let change = value - self.last;
        self.last = value;
        self.squares += value * value;
        self.changes += change * change;
    }
}

#[cfg(test)]
mod tests {
    use super::FastForce;

    const T: f64 = 1.0 / 1024.0;

    /// The mean square of the last of two seconds of a unit sinusoid about 3 N, and its frequency.
    fn strength(hz: f64) -> super::Strength {
        let mut force = FastForce::new(1, 2, T);
        for tick in 0..2048 {
            if tick == 1024 {
                force.end_block();
            }
            let value = 3.0 + (f64::from(tick) * T * hz * std::f64::consts::TAU).sin();
            force.observe(0, &[0.0, value]);
            force.end_tick();
        }
        assert_eq!(force.strength(0, 1, 0, 1024).mean_square, 0.0);
        force.strength(0, 1, 1, 1024)
    }

    #[test]
    fn the_high_pass_is_a_butterworth_of_the_fourth_order() {
        // |H|²: r²/(1 + r²), r = (f/f_c)⁴.
        for hz in [2.0, 4.0, 8.0, 16.0, 100.0] {
            let ratio = (hz / 8.0_f64).powi(8);
            let expected = 0.5 * ratio / (1.0 + ratio);
            let found = strength(hz);
            assert!((found.mean_square / expected - 1.0).abs() < 0.04, "{hz} Hz: {found:?}");
            assert!((found.hz / hz - 1.0).abs() < 0.05, "{hz} Hz: {found:?}");
        }
    }
}
