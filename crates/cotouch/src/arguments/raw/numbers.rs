//! Numbers of flags: what is allowed, said when it is not.

fn number(text: &str, is_allowed: impl Fn(f64) -> bool, allowed: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|&number: &f64| number.is_finite() && is_allowed(number));
    number.ok_or_else(|| format!("it must be {allowed}"))
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number(text, |number| number > 0.0, "a number above 0")
}

pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number(text, |number| number >= 0.0, "a number, 0 or more")
}

pub(super) fn below_one(text: &str) -> Result<f64, String> {
    number(text, |number| (0.0..1.0).contains(&number), "a number from 0 to below 1")
}

/// Ticks in a slow period, or contacts.
pub(super) fn ratio() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=10_000)
}

/// N, as `governor.max_force_n`.
pub(super) fn max_force(text: &str) -> Result<f64, String> {
    number(text, |newtons| (0.1..=1000.0).contains(&newtons), "a force from 0.1 to 1000 N")
}

const LONGEST_DURATION_S: f64 = 7.0 * 86_400.0;

pub(super) fn duration(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "a number of seconds is needed".to_owned())?;
    if seconds > 0.0 && seconds <= LONGEST_DURATION_S {
        Ok(seconds)
    } else {
        Err(format!("it must be above 0 and at most {LONGEST_DURATION_S} s (a week)"))
    }
}

/// Three numbers with commas between them.
pub(super) fn point(text: &str) -> Result<glam::DVec3, String> {
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|number: &f64| number.is_finite()))
        .collect();
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(glam::DVec3::new(x, y, z)),
        _ => {
            Err("it must be three numbers with commas between them, such as 0.35,0.05,0.0375 (m)".to_owned())
        }
    }
}

/// The longest outage that can be asked about, s.
const MAX_OUTAGE_S: f64 = 60.0;

pub(super) fn outage_s(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|&seconds: &f64| seconds > 0.0 && seconds <= MAX_OUTAGE_S);
    seconds.ok_or_else(|| format!("--outage {text} is no duration above 0 and up to {MAX_OUTAGE_S} seconds"))
}
