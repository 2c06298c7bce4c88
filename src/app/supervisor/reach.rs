//! Addresses that this machine does not have yet, and controllers to which it knows no way: a network that is switched on later. What is
//! looked up is in the kernel, which answers at once.

use std::net::IpAddr;
use std::time::Duration;

use crate::config::{Config, Controller};
use crate::film::source::FilmSource;
use crate::health::HealthState;
use crate::net::route;
use crate::rt::Row;
use crate::sys::listen;
use crate::time::MonoTime;

/// From one look to the next.
const EVERY: Duration = Duration::from_secs(1);

/// What is not there.
#[derive(Debug, Default)]
pub(super) struct Reach {
    looked: Option<MonoTime>,
    /// Addresses, and the table of the configuration that names each.
    missing: Vec<(&'static str, IpAddr)>,
    /// By controller.
    unreached: Vec<bool>,
}

impl Reach {
    /// Looks again, once a second.
    pub(super) fn look(&mut self, config: &Config, table: &[Row], now: MonoTime) {
        if self.looked.is_some_and(|looked| now.since(looked) < EVERY) {
            return;
        }
        self.looked = Some(now);
        self.missing = addresses(config);
        self.missing.retain(|(_, address)| !listen::is_here(*address));
        // Also before anything was told of it: the first word about it names the cause.
        let is_unreached = |(lane, controller): (usize, &Controller)| {
            let is_lost = table.get(lane).is_none_or(|row| row.standing == HealthState::Lost);
            let station = controller.station().filter(|_| is_lost);
            station.is_some_and(|station| route(*config.show.bind.ip(), station.address).is_err())
        };
        self.unreached = config.controllers.iter().enumerate().map(is_unreached).collect();
    }

    /// True if no way leads to that controller, which is lost.
    pub(super) fn is_unreached(&self, lane: usize) -> bool {
        self.unreached.get(lane).is_some_and(|unreached| *unreached)
    }

    /// What a person should know of addresses that are not there, with what to do; `None` where all are.
    pub(super) fn trouble(&self) -> Option<String> {
        let of = |(table, address): &(&str, IpAddr)| format!("{address} of [{table}]");
        let missing = self.missing.iter().map(of).collect::<Vec<_>>().join(", ");
        (!missing.is_empty()).then(|| {
            format!(
                "this machine does not have {missing} yet, and begins there once it has; check switch, cable and DHCP, or correct the \
                 configuration"
            )
        })
    }
}

/// The addresses of this machine that a configuration names.
fn addresses(config: &Config) -> Vec<(&'static str, IpAddr)> {
    let api = config.api.listen.iter().map(|address| ("api", address.ip()));
    let osc = config.osc.iter().map(|osc| ("osc", IpAddr::from(*osc.listen.ip())));
    let text = config.text.iter().map(|text| ("text", IpAddr::from(*text.listen.ip())));
    let sources = config.sync.iter().flat_map(|sync| &sync.sources);
    let film = sources.filter_map(|source| match &source.source {
        FilmSource::ArtNet(sender) | FilmSource::Osc(sender) | FilmSource::Http(sender) => {
            Some(("sync", IpAddr::from(*sender.bind.ip())))
        }
        _ => None,
    });
    let mut all: Vec<_> = [("show", IpAddr::from(*config.show.bind.ip()))].into_iter().collect();
    all.extend(api.chain(osc).chain(text).chain(film));
    all.sort_unstable();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_address_that_is_not_here_is_named_with_its_table_and_one_that_is_here_is_not() {
        let mut config = crate::config::from_to_args(&["127.0.0.1:9".to_owned()], &[], 1).unwrap();
        let mut reach = Reach::default();
        let now = MonoTime::default();
        reach.look(&config, &[], now);
        assert_eq!(reach.trouble(), None);
        // Addresses of documentation, which no machine should have (RFC 5737, RFC 3849).
        config.show.bind = "198.51.100.1:0".parse().unwrap();
        let listen = ["127.0.0.1:8480", "198.51.100.1:8480", "[2001:db8::1]:8480"];
        config.api.listen = listen.map(|one| one.parse().unwrap()).into();
        reach.look(&config, &[], now);
        assert_eq!(reach.trouble(), None, "it looks once a second");
        reach.look(&config, &[], now + EVERY);
        let said = reach.trouble().unwrap();
        let missing = "does not have 198.51.100.1 of [api], 2001:db8::1 of [api], 198.51.100.1 of [show] yet";
        assert!(said.contains(missing), "{said}");
    }
}
