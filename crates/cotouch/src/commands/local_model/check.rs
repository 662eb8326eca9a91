//! `cotouch local-model check`.

use cotouch_analysis::local_model::{
    HandImpedance, LocalModelError, PiLocalModel, SimulationLoop, hand_spectral_radius, stable_int, stable_kh,
};
use std::fmt::Write as _;

use cotouch_analysis::{eigenvalues, spectral_radius};
use serde::Serialize;

use super::words::{gain, how_it_is_closed, radius};
use crate::arguments::LocalModelCheck;
use crate::failure::{Failure, Verdict};
use crate::output::Output;

#[derive(Serialize)]
struct Answer {
    /// Per slow period, the hand held still: the roots of the characteristic polynomial.
    spectral_radius: f64,
    stable: bool,
    /// The same by lifting the loop tick by tick.
    lifted_spectral_radius: f64,
    /// a_0 first, without the leading 1.
    characteristic_polynomial: Vec<f64>,
    /// The largest stable K_h with this INT, and the largest stable INT with this K_h; `None` where there is none.
    largest_kh_n_per_m: Option<f64>,
    largest_int_n_per_m: Option<f64>,
    /// Haptic loop and simulation loop together, with the hand that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    hand_spectral_radius: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    hand_stable: Option<bool>,
}

/// Says whether the slow loop is stable, and with a hand whether both loops together are. The verdict is bad when either
/// is not.
pub(super) fn check(check: &LocalModelCheck, output: &Output) -> Result<Verdict, Failure> {
    let answer = answer(check)?;
    output.answer_as(&answer, &text(check, &answer))?;
    let good = answer.stable && answer.hand_stable != Some(false);
    Ok(if good { Verdict::Good } else { Verdict::Bad })
}

fn answer(check: &LocalModelCheck) -> Result<Answer, LocalModelError> {
    let model = PiLocalModel::new(check.kh, check.int, check.ko)?;
    let slow_loop = SimulationLoop::new(check.ratio, check.returned_force, check.hold)?;
    let hand = check.hand.map(|[mass_kg, damping_n_s_per_m, stiffness_n_per_m]| HandImpedance {
        mass_kg,
        damping_n_s_per_m,
        stiffness_n_per_m,
    });
    let with_hand = |hand| hand_spectral_radius(hand, &model, &slow_loop, check.fast_hz);
    let hand_spectral_radius = hand.map(with_hand).transpose()?;
    let largest = |intervals: Vec<(f64, f64)>| intervals.last().map(|interval| interval.1);
    Ok(Answer {
        spectral_radius: slow_loop.spectral_radius(&model),
        stable: slow_loop.is_stable(&model),
        lifted_spectral_radius: spectral_radius(&eigenvalues(&slow_loop.lifted(&model))?),
        characteristic_polynomial: slow_loop.characteristic(&model).coefficients().to_vec(),
        largest_kh_n_per_m: largest(stable_kh(&slow_loop, check.int, check.ko)),
        largest_int_n_per_m: largest(stable_int(&slow_loop, check.kh, check.ko)),
        hand_stable: hand_spectral_radius.map(|radius| radius < 1.0),
        hand_spectral_radius,
    })
}

fn text(check: &LocalModelCheck, answer: &Answer) -> String {
    let word = |stable| if stable { "stable" } else { "unstable" };
    let mut text = format!(
        "K_h = {}, INT = {} on K_o = {}\n{}\n\n",
        gain(check.kh),
        gain(check.int),
        gain(check.ko),
        how_it_is_closed(check.ratio, check.returned_force, check.hold)
    );
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22} {value}");
    };
    let still = format!("{}, spectral radius {}", word(answer.stable), radius(answer.spectral_radius));
    row("hand held still", format!("{still} a slow period"));
    if let (Some(hand), Some(stable), Some([mass, damping, stiffness])) =
        (answer.hand_spectral_radius, answer.hand_stable, check.hand)
    {
        let of = format!("{mass} kg, {damping} N·s/m, {stiffness} N/m, haptic rate {} Hz", check.fast_hz);
        row("hand free to move", format!("{}, spectral radius {} ({of})", word(stable), radius(hand)));
    }
    let limit = |limit: Option<f64>| limit.map_or_else(|| "none is stable".to_owned(), gain);
    row("largest K_h", format!("{} with this INT, hand held still", limit(answer.largest_kh_n_per_m)));
    row("largest INT", format!("{} with this K_h, hand held still", limit(answer.largest_int_n_per_m)));
    row("eigenvalues solve", format!("{} = 0", polynomial(&answer.characteristic_polynomial)));
    text
}

/// `z² − 0.353·z − 0.347`, from a_0 up.
fn polynomial(coefficients: &[f64]) -> String {
    let power = |order: usize| ["", "z", "z²", "z³"][order.min(3)];
    let mut text = power(coefficients.len()).to_owned();
    for (order, &coefficient) in coefficients.iter().enumerate().rev() {
        let sign = if coefficient < 0.0 { '−' } else { '+' };
        let dot = if order == 0 { "" } else { "·" };
        let _ = write!(text, " {sign} {:.6}{dot}{}", coefficient.abs(), power(order));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use cotouch_scene::scene::{ReturnedForce, SurfaceHold};

    fn asked(hand: Option<[f64; 3]>) -> LocalModelCheck {
        let (returned_force, hold) = (ReturnedForce::Mean, SurfaceHold::Zero);
        let fast_hz = "1000".parse().unwrap();
        LocalModelCheck { kh: 500.0, int: 300.0, ko: 1000.0, ratio: 50, returned_force, hold, hand, fast_hz }
    }

    #[test]
    fn a_check_reads_well() {
        let check = asked(None);
        insta::assert_snapshot!(text(&check, &answer(&check).unwrap()), @r"
        K_h = 500 N/m, INT = 300 N/m on K_o = 1000 N/m
        50 haptic ticks a slow period, the mean force goes to the simulation, the surface jumps (zero-order hold)

        hand held still        stable, spectral radius 0.791441 a slow period
        largest K_h            1003 N/m with this INT, hand held still
        largest INT            2941 N/m with this K_h, hand held still
        eigenvalues solve      z² − 0.353000·z − 0.347000 = 0
        ");
    }

    #[test]
    fn a_free_hand_has_a_verdict_of_its_own() {
        let swings = answer(&asked(Some([0.1, 0.5, 0.0]))).unwrap();
        assert!(swings.stable && swings.hand_stable == Some(false));
        let json = serde_json::to_value(answer(&asked(None)).unwrap()).unwrap();
        assert!(json.get("hand_stable").is_none());
        assert!((json["spectral_radius"].as_f64().unwrap() - 0.7914).abs() < 1e-4);
    }
}
