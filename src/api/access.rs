//! Access over TCP: the accepted host names, the accepted origins of pages, and the tokens.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::{Arc, PoisonError, RwLock};

use axum::http::header::{AUTHORIZATION, HOST, ORIGIN};
use axum::http::{HeaderMap, HeaderName, Uri};
use sha2::{Digest as _, Sha256};
use subtle::{Choice, ConstantTimeEq as _};

use super::tries::Tries;
use crate::config;
use crate::control::{Code, Problem, Role, Surface, Who};
use crate::time::MonoTime;

/// The longest token that is hashed.
const MAX_TOKEN_LEN: usize = 256;

/// From which site the page is that asks, as browsers say it, and what for.
const SITE: HeaderName = HeaderName::from_static("sec-fetch-site");
const MODE: HeaderName = HeaderName::from_static("sec-fetch-mode");

/// Who may come in to a server.
#[derive(Debug)]
pub(crate) struct Access {
    hosts: OwnHosts,
    origins: Vec<String>,
    open_role: Option<Role>,
    tokens: AccessTokens,
}

/// The names by which a server is asked.
#[derive(Debug)]
enum OwnHosts {
    /// These.
    Named(Vec<String>),
    /// Any address: a page that is let in by its own name has a name.
    Addresses,
}

/// Who has a token; others from one request to the next where the configuration is read anew.
#[derive(Debug, Clone, Default)]
pub(super) struct AccessTokens(Arc<RwLock<Vec<config::ApiToken>>>);

impl AccessTokens {
    /// Has these from now on; says if they were others.
    pub(super) fn set(&self, tokens: &[config::ApiToken]) -> bool {
        let mut known = self.0.write().unwrap_or_else(PoisonError::into_inner);
        let are_others = *known != tokens;
        *known = tokens.to_vec();
        are_others
    }

    /// Whose token it is. Takes as long for a wrong one as for any of the right ones.
    fn holder(&self, token: &str) -> Option<config::ApiToken> {
        let hash = Sha256::digest(token.get(..token.len().min(MAX_TOKEN_LEN))?);
        let (known, mut found) = (self.0.read().unwrap_or_else(PoisonError::into_inner), None);
        for one in known.iter() {
            let same: Choice = one.sha256.as_slice().ct_eq(hash.as_slice());
            if bool::from(same) {
                found = Some(one);
            }
        }
        found.filter(|_| token.len() <= MAX_TOKEN_LEN).cloned()
    }
}

impl Access {
    /// Of a server that listens on `bound`.
    pub(super) fn new(config: &config::Api, bound: &[SocketAddr]) -> Self {
        let hosts = if config.hosts.is_empty() { own_names(bound) } else { config.hosts.clone() };
        let by = |scheme: &str| hosts.iter().map(|host| format!("{scheme}://{host}")).collect::<Vec<_>>();
        let derived = || [by("http"), by("https")].concat();
        let origins = if config.origins.is_empty() { derived() } else { config.origins.clone() };
        let tokens = AccessTokens::default();
        tokens.set(&config.tokens);
        Self { hosts: OwnHosts::Named(hosts), origins, open_role: config.open_role, tokens }
    }

    /// Of a server that has no pages, and is asked by its address.
    pub(crate) fn without_pages() -> Self {
        Self {
            hosts: OwnHosts::Addresses,
            origins: Vec::new(),
            open_role: None,
            tokens: AccessTokens::default(),
        }
    }

    /// Who has a token.
    pub(super) fn tokens(&self) -> AccessTokens {
        self.tokens.clone()
    }

    /// True if a request was meant for this server: a page of another one that resolves its own name to our address is not
    /// let in (DNS rebinding).
    pub(crate) fn check_host(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), Problem> {
        let host = one(headers, &HOST)?.unwrap_or_default();
        let target = uri.authority().map_or(host, |authority| authority.as_str());
        if self.hosts.has(host) && self.hosts.has(target) {
            return Ok(());
        }
        let remedy = match self.hosts {
            OwnHosts::Named(_) => "use a name in hosts of [api], or add this one there",
            OwnHosts::Addresses => "use the address of this machine, such as 192.168.1.10",
        };
        Err(Problem::new(Code::Origin, format!("{host:?} is not a name of this server"), remedy))
    }

    /// True if the page that asks, if a page asks, is one of this server's.
    pub(crate) fn check_origin(&self, headers: &HeaderMap) -> Result<(), Problem> {
        let Some(origin) = one(headers, &ORIGIN)? else { return check_site(headers) };
        if self.origins.iter().any(|known| known.eq_ignore_ascii_case(origin)) {
            return Ok(());
        }
        let detail = format!("pages of {origin:?} may not use this server");
        Err(Problem::new(Code::Origin, detail, "open the page from this server, or list its origin in [api]"))
    }

    /// Whoever asks from `address` without a token, where that is let in.
    pub(super) fn whoever(&self, address: IpAddr) -> Option<Who> {
        self.open_role.map(|role| Who { role, surface: Surface::Http, name: address.to_string() })
    }

    /// Who asks from `address`.
    pub(super) fn who(
        &self,
        headers: &HeaderMap,
        address: IpAddr,
        tries: &Tries,
        now: MonoTime,
    ) -> Result<Who, Problem> {
        let Some(authorization) = one(headers, &AUTHORIZATION)? else {
            return self.whoever(address).ok_or_else(|| {
                let remedy = "send the header Authorization: Bearer TOKEN; `kinocue token` makes one";
                Problem::new(Code::Token, "this server requires a token", remedy)
            });
        };
        // First of all: whoever has the right one is kept waiting by nobody, least of all behind the same address.
        let token = authorization.split_once(' ').filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
        let known = token.and_then(|(_, token)| self.tokens.holder(token.trim()));
        let Some(config::ApiToken { name, role, .. }) = known else {
            if let Some(wait) = tries.wait(address, now) {
                let detail = format!("too many wrong tokens from {address}");
                let remedy = format!("try again in {} s, or with the right one", wait.as_secs() + 1);
                return Err(Problem::new(Code::Busy, detail, remedy));
            }
            tries.count(address, now);
            let remedy = "check it; `kinocue token` makes a new one for the configuration";
            return Err(Problem::new(Code::Token, "unknown token", remedy));
        };
        Ok(Who { role, surface: Surface::Http, name })
    }
}

impl OwnHosts {
    fn has(&self, host: &str) -> bool {
        match self {
            Self::Named(known) => known.iter().any(|known| known.eq_ignore_ascii_case(host)),
            Self::Addresses => is_address(host),
        }
    }
}

/// True of an address, with or without a port, as a Host header has it.
fn is_address(host: &str) -> bool {
    let (name, port) = host.rsplit_once(':').unwrap_or((host, ""));
    let name = if port.parse::<u16>().is_ok() { name } else { host };
    let in_brackets = || name.strip_prefix('[').and_then(|name| name.strip_suffix(']'));
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<Ipv4Addr>().is_ok()
        || in_brackets().is_some_and(|name| name.parse::<Ipv6Addr>().is_ok())
}

/// True if no page of another site asks without saying its origin, as for a picture. A person who follows a link from there may come.
fn check_site(headers: &HeaderMap) -> Result<(), Problem> {
    let (site, mode) = (one(headers, &SITE)?, one(headers, &MODE)?);
    if matches!(site, None | Some("same-origin" | "none")) || mode == Some("navigate") {
        return Ok(());
    }
    let detail = "pages of other sites may not use this server";
    Err(Problem::new(Code::Origin, detail, "open the page from this server"))
}

/// The one value of a header; two of them, or one that is no text, are refused.
pub(super) fn one<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Result<Option<&'h str>, Problem> {
    let mut values = headers.get_all(name).iter();
    let (first, second) = (values.next(), values.next());
    match (first.map(|value| value.to_str()).transpose(), second) {
        (Ok(value), None) => Ok(value),
        _ => {
            let detail = format!("the header {name} occurs more than once, or is not plain text");
            Err(Problem::new(Code::Value, detail, "send it once"))
        }
    }
}

/// The addresses as a Host header names them.
fn own_names(bound: &[SocketAddr]) -> Vec<String> {
    let mut names = Vec::new();
    for address in bound {
        let loopback = address.ip().is_loopback().then(|| format!("localhost:{}", address.port()));
        for name in [Some(address.to_string()), loopback].into_iter().flatten() {
            names.extend(name.strip_suffix(":80").map(str::to_owned)); // as browsers leave it out
            names.push(name);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    const TABLET: &str = "correct-horse";
    const FROM: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 9));
    const NOW: MonoTime = MonoTime::from_nanos(1);

    fn api() -> config::Api {
        let token = |name: &str, role, token: &str| config::ApiToken {
            name: name.to_owned(),
            role,
            sha256: Sha256::digest(token).into(),
        };
        let tokens = vec![token("chief", Role::Engineer, "x"), token("tablet", Role::Operate, TABLET)];
        config::Api { tokens, ..config::Api::default() }
    }

    fn access() -> Access {
        Access::new(&api(), &["127.0.0.1:8480".parse().unwrap(), "10.0.0.2:80".parse().unwrap()])
    }

    fn headers(pairs: &[(&'static str, &str)]) -> HeaderMap {
        let pair = |&(name, value): &(&'static str, &str)| {
            (HeaderName::from_static(name), HeaderValue::from_str(value).unwrap())
        };
        pairs.iter().map(pair).collect()
    }

    fn host(host: &str, uri: &'static str) -> Result<(), Code> {
        access().check_host(&headers(&[("host", host)]), &Uri::from_static(uri)).map_err(|p| p.code)
    }

    #[test]
    fn a_server_answers_to_its_own_names_alone() {
        for known in ["127.0.0.1:8480", "LocalHost:8480", "10.0.0.2", "10.0.0.2:80"] {
            assert_eq!(host(known, "/"), Ok(()), "{known}");
        }
        for other in ["evil.example", "127.0.0.1", "127.0.0.1:8480.evil.example", "", "localhost:80"] {
            assert_eq!(host(other, "/"), Err(Code::Origin), "{other}");
        }
        assert_eq!(host("localhost:8480", "http://evil.example/"), Err(Code::Origin));
        let twice = headers(&[("host", "localhost:8480"), ("host", "evil.example")]);
        assert_eq!(access().check_host(&twice, &Uri::from_static("/")).unwrap_err().code, Code::Value);
        assert!(access().check_host(&HeaderMap::new(), &Uri::from_static("/")).is_err());
    }

    #[test]
    fn pages_of_others_may_not_ask() {
        let origin = |origin| access().check_origin(&headers(&[("origin", origin)])).map_err(|p| p.code);
        assert_eq!(access().check_origin(&HeaderMap::new()), Ok(()), "no browser asks");
        assert_eq!(origin("http://127.0.0.1:8480"), Ok(()));
        assert_eq!(origin("https://10.0.0.2"), Ok(()));
        for other in ["null", "http://evil.example", "http://127.0.0.1", "file://"] {
            assert_eq!(origin(other), Err(Code::Origin), "{other}");
        }
    }

    #[test]
    fn a_page_of_another_site_asks_for_nothing_either_where_it_does_not_say_its_origin() {
        let of = |pairs: &[(&'static str, &str)]| {
            access().check_origin(&headers(pairs)).map_err(|problem| problem.code)
        };
        for site in ["same-origin", "none"] {
            assert_eq!(of(&[("sec-fetch-site", site), ("sec-fetch-mode", "cors")]), Ok(()));
        }
        for site in ["cross-site", "same-site", "anything"] {
            assert_eq!(of(&[("sec-fetch-site", site), ("sec-fetch-mode", "no-cors")]), Err(Code::Origin));
            assert_eq!(of(&[("sec-fetch-site", site)]), Err(Code::Origin));
            assert_eq!(of(&[("sec-fetch-site", site), ("sec-fetch-mode", "navigate")]), Ok(()), "a link");
        }
        let own = ("origin", "http://127.0.0.1:8480");
        assert_eq!(of(&[own, ("sec-fetch-site", "cross-site")]), Ok(()), "the origin says more");
    }

    #[test]
    fn a_server_without_pages_is_asked_by_its_address_and_by_no_page() {
        let access = Access::without_pages();
        let host = |host: &str, uri| access.check_host(&headers(&[("host", host)]), &Uri::from_static(uri));
        for known in ["10.0.0.2:8431", "10.0.0.2", "[fd00::2]:8431", "localhost:8431", "LOCALHOST"] {
            assert!(host(known, "/").is_ok(), "{known}");
        }
        for other in
            ["evil.example", "evil.example:8431", "10.0.0.2.evil.example", "me@10.0.0.2", "", "[10.0.0.2]x"]
        {
            assert_eq!(host(other, "/").map_err(|problem| problem.code), Err(Code::Origin), "{other}");
        }
        assert!(host("10.0.0.2:8431", "http://evil.example/").is_err());
        let page = headers(&[("origin", "http://10.0.0.2:8431")]);
        assert!(access.check_origin(&page).is_err(), "it has none");
    }

    fn who(authorization: &str, tries: &Tries) -> Result<Who, Code> {
        let headers = headers(&[("authorization", authorization)]);
        access().who(&headers, FROM, tries, NOW).map_err(|problem| problem.code)
    }

    #[test]
    fn a_token_says_who_asks_and_what_they_may() {
        let tries = Tries::default();
        let tablet = who("Bearer correct-horse", &tries).unwrap();
        assert_eq!(
            (tablet.role, tablet.name.as_str(), tablet.surface),
            (Role::Operate, "tablet", Surface::Http)
        );
        let long = format!("Bearer {}", "a".repeat(10_000));
        for wrong in ["Bearer wrong", "Basic correct-horse", "correct-horse", long.as_str()] {
            assert_eq!(who(wrong, &tries), Err(Code::Token), "{wrong}");
        }
    }

    #[test]
    fn after_five_wrong_tokens_an_address_waits_and_the_right_one_passes_all_the_same() {
        let tries = Tries::default();
        for _ in 0..5 {
            assert_eq!(who("Bearer wrong", &tries), Err(Code::Token));
        }
        assert_eq!(who("Bearer wrong", &tries), Err(Code::Busy));
        assert_eq!(who("Bearer correct-horse", &tries).unwrap().name, "tablet");
    }

    #[test]
    fn without_a_token_one_is_what_the_configuration_says() {
        let who = |access: &Access| access.who(&HeaderMap::new(), FROM, &Tries::default(), NOW);
        assert_eq!(who(&access()).unwrap_err().code, Code::Token);
        let open = config::Api { open_role: Some(Role::View), ..api() };
        let guest = who(&Access::new(&open, &[])).unwrap();
        assert_eq!((guest.role, guest.name.as_str()), (Role::View, "10.0.0.9"));
    }
}
