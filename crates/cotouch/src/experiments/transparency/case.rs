//! One user of one scene, and what that user perceives of the object.

use cotouch_analysis::Grid;
use cotouch_analysis::transparency::{Admittance, UserAdmittance, admittance};
use cotouch_scene::Scene;

use crate::experiments::outcome::csv;
use crate::experiments::runs::load;
use crate::figure::chart::Series;

pub(super) const DISTRIBUTED: &str = "single-axis";
pub(super) const CENTRALIZED: &str = "single-axis-centralized";

/// Table 6.1, with settings.
pub(super) fn table_6_1(scene: &str, settings: &[&str]) -> anyhow::Result<Scene> {
    load(scene, settings)
}

/// What one user feels in one case.
pub(super) struct Case {
    pub(super) name: &'static str,
    pub(super) scene: &'static str,
    pub(super) settings: Vec<String>,
    /// From 0.
    pub(super) user: usize,
    pub(super) colour: usize,
    pub(super) felt: Admittance,
}

impl Case {
    pub(super) fn new(
        name: &'static str,
        (scene, user): (&'static str, usize),
        settings: &[&str],
        colour: usize,
        frequencies: &Grid,
    ) -> anyhow::Result<Self> {
        let felt = admittance(&table_6_1(scene, settings)?, frequencies.values())?;
        Ok(Self {
            name,
            scene,
            settings: settings.iter().map(|&setting| setting.to_owned()).collect(),
            user,
            colour,
            felt,
        })
    }

    pub(super) fn of_user(&self) -> &UserAdmittance {
        &self.felt.users[self.user]
    }

    /// The slow-rate response, solid, and the fundamental, dashed and without a name, in a range of frequencies.
    pub(super) fn series(&self, range: (f64, f64)) -> [Series; 2] {
        let user = self.of_user();
        let label = if user.stable { self.name.to_owned() } else { format!("{} (unstable)", self.name) };
        [
            Series::solid(&label, self.colour, self.between(range, &user.magnitude)),
            Series::dashed("", self.colour, self.between(range, &user.fundamental_magnitude)),
        ]
    }

    /// The ideal system, dashed and grey.
    pub(super) fn ideal(&self, label: &str, range: (f64, f64)) -> Series {
        Series::dashed(label, 7, self.between(range, &self.felt.ideal.magnitude))
    }

    pub(super) fn between(&self, (from, to): (f64, f64), values: &[f64]) -> Vec<(f64, f64)> {
        let points = self.felt.frequency_rad_s.iter().copied().zip(values.iter().copied());
        points.filter(|&(frequency, _)| (from..=to).contains(&frequency)).collect()
    }

    /// Mean over the points in a range of |ln(|G|/|ideal|)|: 0.69 is a factor of 2.
    pub(super) fn deviation(&self, range: (f64, f64)) -> f64 {
        let (own, ideal) =
            (self.between(range, &self.of_user().magnitude), self.between(range, &self.felt.ideal.magnitude));
        let sum: f64 = own.iter().zip(&ideal).map(|(own, ideal)| (own.1 / ideal.1).ln().abs()).sum();
        sum / own.len().max(1) as f64
    }

    /// At the lowest frequency.
    pub(super) fn at_rest(&self) -> f64 {
        self.of_user().magnitude[0]
    }

    /// The command that shows the same numbers.
    pub(super) fn command(&self, frequencies: &str, file: &str) -> String {
        let settings: String = self.settings.iter().map(|setting| format!(" --set {setting}")).collect();
        format!(
            "cotouch analyze admittance {} --frequencies {frequencies}{settings} --out {file}.svg",
            self.scene
        )
    }
}

/// All cases, as CSV.
pub(super) fn table(cases: &[&Case]) -> String {
    let mut header = vec!["frequency_rad_s".to_owned()];
    let first = &cases[0].felt;
    let mut columns: Vec<&[f64]> = vec![&first.frequency_rad_s];
    for case in cases {
        let name: String =
            case.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let user = case.of_user();
        for (what, values) in [
            ("magnitude", &user.magnitude),
            ("phase_rad", &user.phase_rad),
            ("fundamental_magnitude", &user.fundamental_magnitude),
            ("fundamental_phase_rad", &user.fundamental_phase_rad),
        ] {
            header.push(format!("{name}_{what}"));
            columns.push(values);
        }
    }
    header.extend(["ideal_magnitude".to_owned(), "ideal_phase_rad".to_owned()]);
    columns.extend([&first.ideal.magnitude[..], &first.ideal.phase_rad]);
    csv(&header, &columns)
}
