//! `bb eval families FOLDER`: attitude filters compared on families of motions, fields and faults.

use bb_estimators::attitude::FilterParams;
use bb_eval::filters::near;
use bb_eval::{
    Axes, Chosen, FAMILIES, Family, Half, Setting, families_json, families_list, families_table, score_families,
};
use clap::Args;
use std::path::PathBuf;

pub(crate) const EXAMPLES: &str = "Exit code: 0; 1 if a family could not be scored; 2 for a wrong use.

Examples:
  bb eval families recordings/
  bb eval families recordings/ --filter mekf,vqf --half A --set mekf.magnetometer=calibrated
  bb eval families --family car,boat";

#[derive(Debug, Args)]
pub(crate) struct FamiliesArguments {
    /// The folder of the recordings, with `broad`, `phones` and `navigation` in it. Without one, the simulated families are
    /// scored.
    #[arg(value_name = "FOLDER")]
    folder: Option<PathBuf>,
    /// The filters, or `all`. VQF is always run, because the ratios refer to it.
    #[arg(long = "filter", value_name = "NAME", value_delimiter = ',', default_value = "all", value_parser = filter)]
    filters: Vec<Vec<FilterParams>>,
    /// The families; by default all. `--list` describes them.
    #[arg(long = "family", value_name = "NAME", value_delimiter = ',', value_parser = family)]
    families: Vec<&'static Family>,
    /// Only the families of one half: numbers that are chosen on one half are reported on the other.
    #[arg(long, value_enum)]
    half: Option<Half>,
    /// Sets a parameter, in SI or with a unit, for all chosen filters that have it; FILTER.NAME=VALUE for one filter.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<Setting>,
    /// Only describes the families.
    #[arg(long)]
    list: bool,
    /// Prints an array of objects instead of the table.
    #[arg(long)]
    json: bool,
}

fn filter(name: &str) -> Result<Vec<FilterParams>, String> {
    let all = || FilterParams::ALL.iter().map(|default| default()).filter(|filter| Axes::Nine.suit(filter));
    if name == "all" {
        return Ok(all().collect());
    }
    let names: Vec<_> = all().map(|filter| filter.name()).chain(["all"]).collect();
    let filter = all().find(|filter| filter.name() == name);
    Ok(vec![filter.ok_or_else(|| format!("no filter `{name}` of nine axes; {}", near(name, &names)))?])
}

fn family(name: &str) -> Result<&'static Family, String> {
    let names = FAMILIES.map(|family| family.name);
    Family::named(name).ok_or_else(|| format!("no family `{name}`; {}", near(name, &names)))
}

impl FamiliesArguments {
    /// The text to print, and whether all went well.
    pub(crate) fn run(&self) -> Result<(String, bool), String> {
        let is_asked = |family: &&&Family| match &*self.families {
            [] => self.folder.is_some() || !family.is_recorded(),
            families => families.iter().any(|asked| asked.name == family.name),
        };
        let of_half = |family: &&&Family| self.half.is_none_or(|half| family.half == Some(half));
        let families: Vec<_> = FAMILIES.iter().filter(is_asked).filter(of_half).copied().collect();
        if self.list {
            return Ok((families_list(if self.families.is_empty() { &FAMILIES } else { &families }), true));
        }
        let filters = Chosen::all(&self.filters.concat(), Axes::Nine, &self.settings)?;
        let scores = score_families(self.folder.as_deref(), &families, &filters)?;
        let text = if self.json { families_json(&scores)? } else { families_table(&scores) };
        Ok((text, true))
    }
}
