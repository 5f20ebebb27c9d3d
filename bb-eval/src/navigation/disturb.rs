//! A recording made harder: fixes withheld, messages dropped or late.

use super::feed::{Feed, INPUTS, Time, What};
use crate::filters::near;
use bb_core::payload::GnssFix;
use std::str::FromStr;

/// Changes to the messages of a recording before a filter gets them.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args), command(next_help_heading = "Made harder"))]
pub struct Disturbances {
    /// Withholds the fixes for LENGTH at the end of each PERIOD, as 30s/90s. The errors in these are shown by their age.
    #[cfg_attr(feature = "clap", arg(long, value_name = "LENGTH/PERIOD"))]
    pub outage: Option<Spell>,
    /// Gives every N-th fix to the filter, and withholds the others.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub every: Option<u32>,
    /// Stamps and delivers the messages of an input later, as gnss=125ms. Several.
    #[cfg_attr(feature = "clap", arg(long, value_name = "INPUT=TIME"))]
    pub delay: Vec<Delay>,
    /// Drops the messages of an input for LENGTH at the end of each PERIOD, as imu=300ms/10s. Several.
    #[cfg_attr(feature = "clap", arg(long, value_name = "INPUT=LENGTH/PERIOD"))]
    pub drop: Vec<Dropped>,
}

/// A part of each period.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spell {
    length_ns: Time,
    period_ns: Time,
}

/// A delay of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Delay {
    input: usize,
    time_ns: Time,
}

/// Gaps of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dropped {
    input: usize,
    spell: Spell,
}

impl FromStr for Spell {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (length, period) = text.split_once('/').ok_or("write LENGTH/PERIOD, as 30s/90s")?;
        let (length_ns, period_ns) = (time(length)?, time(period)?);
        match 0 < length_ns && length_ns < period_ns {
            true => Ok(Self { length_ns, period_ns }),
            false => Err(format!("`{text}`: the length must be more than zero and less than the period")),
        }
    }
}

impl FromStr for Delay {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (input, value) = named(text, "gnss=125ms")?;
        Ok(Self { input, time_ns: time(value)? })
    }
}

impl FromStr for Dropped {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (input, value) = named(text, "imu=300ms/10s")?;
        Ok(Self { input, spell: value.parse()? })
    }
}

fn named<'a>(text: &'a str, example: &str) -> Result<(usize, &'a str), String> {
    let (name, value) = text.split_once('=').ok_or_else(|| format!("no `=` in it; write it as {example}"))?;
    let input = INPUTS.iter().position(|input| *input == name.trim());
    let input = input.ok_or_else(|| format!("no input `{}`; {}", name.trim(), near(name.trim(), &INPUTS)))?;
    Ok((input, value))
}

/// A time with its unit, ns.
fn time(text: &str) -> Result<Time, String> {
    let text = text.trim();
    let end = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(end);
    let number: Option<f64> = number.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let scale = match unit {
        "us" => Some(1e3),
        "ms" => Some(1e6),
        "s" => Some(1e9),
        "min" => Some(60e9),
        _ => None,
    };
    let ns = number.zip(scale).map(|(number, scale)| (number * scale).round() as Time);
    ns.ok_or_else(|| format!("`{text}` is no time; write it with its unit, as 125ms, 30s or 2min"))
}

impl Spell {
    /// Returns whether a time since the beginning is in the spell.
    fn contains(&self, since_ns: Time) -> bool {
        since_ns.rem_euclid(self.period_ns) >= self.period_ns - self.length_ns
    }
}

/// Messages withheld from a feed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Withheld {
    /// Fixes that the filter does not get, with their own stamps.
    pub(crate) fixes: Vec<(Time, GnssFix)>,
}

impl Disturbances {
    /// Returns whether nothing is changed.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Changes a feed.
    ///
    /// # Errors
    /// An option changes nothing; names it.
    pub(crate) fn apply(&self, feed: &mut Feed) -> Result<Withheld, String> {
        let first_ns = feed.messages.iter().map(|message| message.stamp_ns).min().unwrap_or(0);
        let mut drops: Vec<_> =
            self.drop.iter().map(|Dropped { input, spell }| (*input, *spell, "--drop")).collect();
        drops.extend(self.outage.map(|spell| (1, spell, "--outage")));
        let mut withheld = Withheld::default();
        let mut dropped = vec![0_u64; drops.len()];
        let (mut fixes, mut thinned) = (0_u32, 0_u64);
        feed.messages.retain(|message| {
            let input = message.what.input();
            let since_ns = message.stamp_ns - first_ns;
            let mut is_kept = true;
            for ((of, spell, _), count) in drops.iter().zip(&mut dropped) {
                if *of == input && spell.contains(since_ns) {
                    is_kept = false;
                    *count += 1;
                }
            }
            let What::Gnss(fix) = &message.what else { return is_kept };
            if let Some(every) = self.every {
                let is_its_turn = fixes.is_multiple_of(every.max(1));
                fixes += 1;
                thinned += u64::from(!is_its_turn);
                is_kept &= is_its_turn;
            }
            if !is_kept {
                withheld.fixes.push((message.stamp_ns, *fix));
            }
            is_kept
        });
        for ((input, _, option), count) in drops.iter().zip(&dropped) {
            if *count == 0 {
                return Err(format!("{option} changes nothing: no message of `{}` falls in it", INPUTS[*input]));
            }
        }
        if self.every.is_some() && thinned == 0 {
            return Err("--every changes nothing: there are too few fixes".to_owned());
        }
        for Delay { input, time_ns } in &self.delay {
            let mut count = 0_u64;
            for message in feed.messages.iter_mut().filter(|message| message.what.input() == *input) {
                message.stamp_ns += time_ns;
                message.arrival_ns += time_ns;
                count += 1;
            }
            if count == 0 || *time_ns == 0 {
                return Err(format!(
                    "--delay changes nothing: there is no message of `{}` to delay",
                    INPUTS[*input]
                ));
            }
        }
        feed.sort();
        Ok(withheld)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_what_is_meant() {
        assert_eq!("30s/90s".parse(), Ok(Spell { length_ns: 30_000_000_000, period_ns: 90_000_000_000 }));
        assert_eq!("gnss=125ms".parse(), Ok(Delay { input: 1, time_ns: 125_000_000 }));
        let spell: Spell = "300ms/10s".parse().expect("is one");
        assert_eq!("imu= 300 ms / 10 s".parse(), Ok(Dropped { input: 0, spell }));
        assert!(!spell.contains(9_699_999_999) && spell.contains(9_700_000_000) && !spell.contains(10_000_000_000));
        for (text, fault) in [
            ("gps=1s", "no input `gps`; did you mean `gnss`?"),
            ("gnss=125", "`125` is no time; write it with its unit"),
            ("gnss", "no `=` in it"),
        ] {
            let said = text.parse::<Delay>().expect_err("not accepted");
            assert!(said.contains(fault), "{said}");
        }
        assert!("90s/30s".parse::<Spell>().expect_err("not accepted").contains("less than the period"));
    }
}
