//! A recording made harder: fixes or the field withheld, messages dropped or late.

use crate::suggestion::near;
use std::str::FromStr;

/// Nanoseconds since the Unix epoch.
pub(crate) type Time = i64;

/// The inputs of filters by name, as filters declare them.
pub(crate) const INPUTS: [&str; 9] =
    ["imu", "gnss", "odometry", "pose", "relative", "magnetic_field", "gnss_velocity", "gnss_heading", "start"];
/// Places among [`INPUTS`].
pub(crate) const IMU: usize = 0;
pub(crate) const GNSS: usize = 1;
pub(crate) const MAGNETIC_FIELD: usize = 5;
pub(crate) const GNSS_VELOCITY: usize = 6;
pub(crate) const GNSS_HEADING: usize = 7;
pub(crate) const START: usize = 8;

/// The option of [`Disturbances::outage`].
const OUTAGE: &str = "--outage";

/// Changes to the messages of a recording before a filter gets them.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args), command(next_help_heading = "Made harder"))]
pub struct Disturbances {
    /// Withholds the fixes with the receiver's velocities and headings, or of an attitude filter the magnetic field, for LENGTH at the end of each PERIOD, as 30s/90s. The
    /// errors without them are shown.
    #[cfg_attr(feature = "clap", arg(long, value_name = "LENGTH/PERIOD"))]
    pub outage: Option<Spell>,
    /// Gives every N-th fix, or reading of the magnetic field, to the filter, and withholds the others.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = every))]
    pub every: Option<u32>,
    /// Stamps and delivers the messages of an input later, as gnss=125ms, or earlier, as magnetic_field=-12ms. Several.
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
    /// Place among [`INPUTS`].
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

#[cfg(feature = "clap")]
fn every(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|every| *every >= 2).ok_or_else(|| "write a whole number, at least 2".to_owned())
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

/// Changes made to the messages of one recording, in the order of their times.
#[derive(Debug)]
pub(crate) struct Disturber<'a> {
    disturbances: &'a Disturbances,
    /// The input that `--outage` and `--every` withhold.
    aiding: usize,
    first_ns: Time,
    /// Messages that the outage and each of the drops withheld.
    dropped: Vec<u64>,
    /// Messages of the aiding input, and those that were not in their turn.
    aids: u64,
    thinned: u64,
    /// Messages that each of the delays moved.
    delayed: Vec<u64>,
}

impl Disturbances {
    /// Returns whether nothing is changed.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Changes to a recording that begins at `first_ns`.
    pub(crate) fn of(&self, aiding: usize, first_ns: Time) -> Disturber<'_> {
        let (dropped, delayed) = (vec![0; self.drop.len() + 1], vec![0; self.delay.len()]);
        Disturber { disturbances: self, aiding, first_ns, dropped, aids: 0, thinned: 0, delayed }
    }
}

impl Disturber<'_> {
    /// The spells, each with its input and its option.
    fn spells(&self) -> impl Iterator<Item = (usize, Spell, &'static str)> {
        let drops = self.disturbances.drop.iter().map(|drop| (drop.input, drop.spell, "--drop"));
        drops.chain(self.disturbances.outage.map(|spell| (self.aiding, spell, OUTAGE)))
    }

    /// Returns whether the aiding input is withheld at a time by the outage.
    pub(crate) fn is_out(&self, stamp_ns: Time) -> bool {
        self.disturbances.outage.is_some_and(|spell| spell.contains(stamp_ns - self.first_ns))
    }

    /// Returns whether a filter gets this message.
    pub(crate) fn keeps(&mut self, input: usize, stamp_ns: Time) -> bool {
        let since_ns = stamp_ns - self.first_ns;
        let mut dropped = std::mem::take(&mut self.dropped);
        let mut is_kept = true;
        for ((of, spell, option), count) in self.spells().zip(&mut dropped) {
            let is_of_receiver = of == GNSS && option == OUTAGE && [GNSS_VELOCITY, GNSS_HEADING].contains(&input);
            if (of == input || is_of_receiver) && spell.contains(since_ns) {
                is_kept = false;
                *count += 1;
            }
        }
        self.dropped = dropped;
        if let Some(every) = self.disturbances.every.filter(|_| input == self.aiding) {
            let is_its_turn = self.aids.is_multiple_of(u64::from(every.max(1)));
            self.aids += 1;
            self.thinned += u64::from(!is_its_turn);
            is_kept &= is_its_turn;
        }
        is_kept
    }

    /// Returns the time by which a message comes later, ns.
    pub(crate) fn delay_ns(&mut self, input: usize) -> Time {
        let mut delay_ns = 0;
        for (delay, count) in self.disturbances.delay.iter().zip(&mut self.delayed) {
            if delay.input == input && delay.time_ns != 0 {
                delay_ns += delay.time_ns;
                *count += 1;
            }
        }
        delay_ns
    }

    /// Checks that each option has changed something.
    ///
    /// # Errors
    /// The option that has not, in words.
    pub(crate) fn check(&self) -> Result<(), String> {
        for ((input, _, option), count) in self.spells().zip(&self.dropped) {
            if *count == 0 {
                return Err(format!("{option} changes nothing: no message of `{}` falls in it", INPUTS[input]));
            }
        }
        if self.disturbances.every.is_some() && self.thinned == 0 {
            return Err(format!(
                "--every changes nothing: there are too few messages of `{}`",
                INPUTS[self.aiding]
            ));
        }
        for (delay, count) in self.disturbances.delay.iter().zip(&self.delayed) {
            if *count == 0 {
                return Err(format!(
                    "--delay changes nothing: there is no message of `{}` to delay",
                    INPUTS[delay.input]
                ));
            }
        }
        Ok(())
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
