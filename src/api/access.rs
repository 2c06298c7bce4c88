//! Access over TCP: the accepted host names, the accepted origins of pages, and the tokens.

use std::net::{IpAddr, SocketAddr};
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

/// What the configuration says of who may come in.
#[derive(Debug)]
pub(super) struct Access {
    hosts: Vec<String>,
    origins: Vec<String>,
    open_role: Option<Role>,
    tokens: AccessTokens,
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
        Self { hosts, origins, open_role: config.open_role, tokens }
    }

    /// Who has a token.
    pub(super) fn tokens(&self) -> AccessTokens {
        self.tokens.clone()
    }

    /// True if a request was meant for this server: a page of another one that resolves its own name to our address is not
    /// let in (DNS rebinding).
    pub(super) fn check_host(&self, headers: &HeaderMap, uri: &Uri) -> Result<(), Problem> {
        let host = one(headers, &HOST)?.unwrap_or_default();
        let target = uri.authority().map_or(host, |authority| authority.as_str());
        let known = |host: &str| self.hosts.iter().any(|known| known.eq_ignore_ascii_case(host));
        if known(host) && known(target) {
            return Ok(());
        }
        let detail = format!("{host:?} is not a name of this server");
        Err(Problem::new(Code::Origin, detail, "use a name in hosts of [api], or add this one there"))
    }

    /// True if the page that asks, if a page asks, is one of this server's.
    pub(super) fn check_origin(&self, headers: &HeaderMap) -> Result<(), Problem> {
        let Some(origin) = one(headers, &ORIGIN)? else { return Ok(()) };
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
    use std::net::Ipv4Addr;

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
