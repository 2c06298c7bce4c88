//! How the links of a hall play: on which grid, and how far ahead.

use std::time::Duration;

use super::link::{Family as _, Lead, StreamTerms};
use super::rates::LinkLoad;
use super::silvermax::SilverMax;
use super::sixpack2::Sixpack2;
use crate::config::drive::DriveFamily;
use crate::config::{Config, Link};
use crate::motion::MAX_LEAD;
use crate::time::Rate;

impl StreamTerms {
    /// Those of a link of a hall that has seats on it; none where it has none.
    ///
    /// # Errors
    /// Why it cannot play, with what would.
    pub(crate) fn of(link: &Link, config: &Config) -> Result<Option<Self>, String> {
        let Some(load) = LinkLoad::of(link, config) else { return Ok(None) };
        let fault = |why: String| format!("[link.{}]: {why}", link.name);
        let period = load.period_for(link.rate_hz).map_err(|slow| fault(slow.to_string()))?;
        let terms = Self { period, tick: Rate::from_hz(config.show.rate_hz).period() };
        let (lead, most) = (terms.lead(load.family), MAX_LEAD);
        if lead > most {
            let Lead { periods, ticks } = Lead::of(load.family);
            let least_hz = f64::from(periods) / most.saturating_sub(ticks * terms.tick).as_secs_f64();
            let (lead, most, remedy) = (lead.as_millis(), most.as_millis(), load.remedy(least_hz));
            return Err(fault(format!("its seats would follow {lead} ms ahead, over {most} ms; {remedy}")));
        }
        Ok(Some(terms))
    }

    /// How long before a seat is there its poses have to come.
    pub(crate) fn lead(self, family: DriveFamily) -> Duration {
        Lead::of(family).over(self)
    }
}

impl Lead {
    const fn of(family: DriveFamily) -> Self {
        match family {
            DriveFamily::SilverMax => SilverMax::LEAD,
            DriveFamily::Sixpack2 => Sixpack2::LEAD,
        }
    }
}
