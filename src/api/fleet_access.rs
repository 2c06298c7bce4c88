//! Whose letters count in a hall, and which orders came of late.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError, RwLock};
use std::time::Duration;

use super::problem::bad_value;
use crate::config::{self, FleetKey, FleetWord, Role};
use crate::control::{self, Code, Problem, Surface, Who};
use crate::fleet::{AHEAD, Letter, Order, Wish};
use crate::time::MonoTime;

/// How long the id of an order is remembered; far longer than one may be under way, for clocks may be set.
const REMEMBERED: Duration = Duration::from_secs(600);
/// Orders of one key within that time.
const ORDERS: usize = 1024;

/// Who of the fleet may ask, and what they asked of late.
#[derive(Debug, Clone, Default)]
pub(super) struct FleetAccess {
    fleet: Arc<RwLock<Option<config::Fleet>>>,
    asked: Arc<Mutex<VecDeque<AskedOrder>>>,
}

/// An order that came.
#[derive(Debug)]
struct AskedOrder {
    key: String,
    id: String,
    at: MonoTime,
}

/// What a letter asks, for whom, and when it was asked.
type Opened<T> = (Who, T, MonoTime);

impl FleetAccess {
    /// Of that fleet.
    pub(super) fn of(fleet: Option<&config::Fleet>) -> Self {
        let access = Self::default();
        access.set(fleet);
        access
    }

    /// Has these keys from now on.
    pub(super) fn set(&self, fleet: Option<&config::Fleet>) {
        *self.fleet.write().unwrap_or_else(PoisonError::into_inner) = fleet.cloned();
    }

    /// What a letter asks, as `read` reads its order, where one of the keys has signed it, for this hall, just now, and for the first time.
    pub(super) fn open<T>(
        &self,
        letter: &Letter,
        read: impl FnOnce(&Order) -> Result<T, Problem>,
        wall_ns: u64,
        now: MonoTime,
    ) -> Result<Opened<T>, Problem> {
        let (who, name) = self.sender(letter)?;
        let order = Order::of(letter).map_err(|why| bad_value(format!("no order: {why}"), "send one"))?;
        if order.to != name {
            let detail = format!("{} was asked, and this hall is {name}", order.to);
            return Err(Problem::new(Code::Origin, detail, "ask the hall that is meant"));
        }
        let asked_at = asked_at(&order, wall_ns, now)?;
        let ask = read(&order)?;
        // A cue is fetched in thousands of pieces; they are not to use up the room of its key for orders.
        if !order.only_reads() {
            self.first_time(letter, &order, now)?;
        }
        Ok((who, ask, asked_at))
    }

    /// What a letter wishes, and who wishes it, where one of the keys that may has signed it for this hall, however long ago.
    pub(super) fn open_wish(&self, letter: &Letter, wall_ns: u64) -> Result<(Who, Wish), Problem> {
        let (who, name) = self.sender(letter)?;
        if who.role < Role::Operate {
            return Err(Problem::role("to wish for something", Role::Operate, &who));
        }
        let wish = Wish::of(letter).map_err(|why| bad_value(format!("no wish: {why}"), "send one"))?;
        if wish.to != name {
            let detail = format!("the wish is for {}, and this hall is {name}", wish.to);
            return Err(Problem::new(Code::Origin, detail, "wish for the hall that is meant"));
        }
        // Else one wish of long after would outlast all others.
        if !is_of_now(wish.rev, wall_ns) {
            let detail = format!("the rev of the wish, {}, is of more than a day from now", wish.rev);
            return Err(Problem::new(Code::Late, detail, "set the clocks of desk and hall, and push again"));
        }
        // What of it is not allowed is refused by itself.
        let has_cues = !wish.cues.is_empty() || !wish.drops.cues.is_empty();
        let has_playlists = !wish.playlists.is_empty() || !wish.drops.playlists.is_empty();
        let words = match (has_cues, has_playlists) {
            (true, false) => &[FleetWord::Cues][..],
            (false, true) => &[FleetWord::Playlists],
            _ => &FleetWord::OF_WISHES,
        };
        self.check_allowed(words)?;
        Ok((who, wish))
    }

    /// That the configuration allows one of these words.
    pub(super) fn check_allowed(&self, words: &[FleetWord]) -> Result<(), Problem> {
        let fleet = self.fleet.read().unwrap_or_else(PoisonError::into_inner);
        if fleet.as_ref().is_some_and(|fleet| words.iter().any(|word| fleet.allows(*word))) {
            return Ok(());
        }
        let words: Vec<_> = words.iter().map(ToString::to_string).collect();
        let detail = format!("allow of [fleet] does not name {}", words.join(", "));
        Err(Problem::new(Code::Role, detail, "ask somebody in the hall, or add it there and reload"))
    }

    /// Whose key has signed a letter, and what the hall is called in the fleet.
    fn sender(&self, letter: &Letter) -> Result<(Who, String), Problem> {
        let fleet = self.fleet.read().unwrap_or_else(PoisonError::into_inner);
        let fleet = fleet.as_ref().ok_or_else(|| {
            Problem::new(
                Code::Off,
                "this hall is in no fleet",
                "configure [fleet], and start the service again",
            )
        })?;
        let known: Option<&FleetKey> = fleet.keys.iter().find(|key| key.public == letter.key);
        let key = known.filter(|_| letter.is_signed()).ok_or_else(|| {
            let detail = "no key of [fleet] has signed this";
            Problem::new(
                Code::Token,
                detail,
                "sign it with a key that the hall has, or add the key there and reload",
            )
        })?;
        Ok((Who { role: key.role, surface: Surface::Fleet, name: key.name.clone() }, fleet.name.clone()))
    }

    /// Remembers an order, which must not have come before.
    fn first_time(&self, letter: &Letter, order: &Order, now: MonoTime) -> Result<(), Problem> {
        let mut asked = self.asked.lock().unwrap_or_else(PoisonError::into_inner);
        while asked.pop_front_if(|oldest| now.since(oldest.at) >= REMEMBERED).is_some() {}
        let of_key = || asked.iter().filter(|one| one.key == letter.key);
        if of_key().any(|one| one.id == order.id) {
            let detail = format!("the order {} came before", order.id);
            return Err(Problem::new(Code::Late, detail, "check the status, then give a new order"));
        }
        if of_key().count() >= ORDERS {
            let detail =
                format!("{ORDERS} orders of this key came within {} minutes", REMEMBERED.as_secs() / 60);
            return Err(Problem::new(Code::Busy, detail, "wait a minute, or ask somebody in the hall"));
        }
        asked.push_back(AskedOrder { key: letter.key.clone(), id: order.id.clone(), at: now });
        Ok(())
    }
}

/// True of the rev of a wish that is of no later time than tomorrow.
pub(super) fn is_of_now(rev: u64, wall_ns: u64) -> bool {
    u128::from(rev) <= (Duration::from_nanos(wall_ns) + AHEAD).as_millis()
}

/// When an order was given, by our own clock.
fn asked_at(order: &Order, wall_ns: u64, now: MonoTime) -> Result<MonoTime, Problem> {
    let age_ms = i128::from(wall_ns / 1_000_000) - i128::from(order.sent_ms);
    control::asked_at(age_ms, now).map_err(|most| {
        let (when, most) = (if age_ms < 0 { "from now" } else { "ago" }, most.as_millis());
        let detail = format!("{} was asked {} ms {when}, more than {most}", order.word, age_ms.abs());
        Problem::new(Code::Late, detail, "if this happens every time, the clocks of desk and hall differ")
    })
}

#[cfg(test)]
mod tests {
    use nkeys::KeyPair;

    use super::*;
    use crate::config::Fleet;
    use crate::control::Command;
    use crate::fleet::new_letter_key;

    const NOW_MS: i64 = 1_795_306_800_123;

    fn fleet(keys: Vec<FleetKey>) -> Fleet {
        let (name, allow, start, start_bound) = ("berlin.h3".to_owned(), Vec::new(), false, Duration::ZERO);
        Fleet { name, allow, start, start_bound, keys }
    }

    fn access() -> (FleetAccess, KeyPair) {
        let pair = new_letter_key();
        let key = FleetKey { name: "office".to_owned(), role: Role::Operate, public: pair.public_key() };
        let fleet = fleet(vec![key]);
        (FleetAccess::of(Some(&fleet)), pair)
    }

    fn open(access: &FleetAccess, letter: &Letter) -> Result<Opened<Command>, Code> {
        let wall_ns = u64::try_from(NOW_MS).unwrap() * 1_000_000;
        let now = MonoTime::from_nanos(0) + Duration::from_secs(1000);
        access.open(letter, |_| Ok(Command::Pause), wall_ns, now).map_err(|problem| problem.code)
    }

    fn letter(pair: &KeyPair, id: &str, to: &str, word: &str, args: &str, sent_ms: i64) -> Letter {
        let body = format!(
            "{{\"id\":\"{id}\",\"to\":\"{to}\",\"word\":\"{word}\",\"args\":{args},\"sent_ms\":{sent_ms}}}"
        );
        Letter::sign(pair, body).unwrap()
    }

    #[test]
    fn a_letter_counts_for_whose_key_has_signed_it_for_this_hall_and_once() {
        let (access, pair) = access();
        let pause = |id, to, sent_ms| letter(&pair, id, to, "pause", "{}", sent_ms);
        let (who, ask, _) = open(&access, &pause("1", "berlin.h3", NOW_MS - 500)).unwrap();
        assert_eq!((who.name.as_str(), who.role, who.surface), ("office", Role::Operate, Surface::Fleet));
        assert_eq!(ask, Command::Pause);
        assert_eq!(open(&access, &pause("1", "berlin.h3", NOW_MS)).err(), Some(Code::Late), "again");
        assert!(open(&access, &pause("2", "berlin.h3", NOW_MS)).is_ok());
        assert_eq!(open(&access, &pause("3", "berlin.h4", NOW_MS)).err(), Some(Code::Origin));
        for age in [2001, 60_000, -251, -1_900, -2001] {
            assert_eq!(
                open(&access, &pause("4", "berlin.h3", NOW_MS - age)).err(),
                Some(Code::Late),
                "{age}"
            );
        }
        let stranger = letter(&new_letter_key(), "5", "berlin.h3", "pause", "{}", NOW_MS);
        assert_eq!(open(&access, &stranger).err(), Some(Code::Token));
        let forged = Letter { key: pair.public_key(), ..stranger };
        assert_eq!(open(&access, &forged).err(), Some(Code::Token));
        let pull = |sent_ms| letter(&pair, "8", "berlin.h3", "pull", "{}", sent_ms);
        assert!(
            open(&access, &pull(NOW_MS)).is_ok() && open(&access, &pull(NOW_MS)).is_ok(),
            "it only reads"
        );
        assert_eq!(open(&access, &pull(NOW_MS - 2001)).err(), Some(Code::Late));
        access.set(Some(&fleet(Vec::new())));
        assert_eq!(open(&access, &pause("6", "berlin.h3", NOW_MS)).err(), Some(Code::Token), "revoked");
        access.set(None);
        assert_eq!(open(&access, &pause("7", "berlin.h3", NOW_MS)).err(), Some(Code::Off));
    }

    #[test]
    fn a_wish_counts_for_a_key_that_may_operate_in_this_hall_where_cues_are_allowed_however_old_it_is() {
        let (access, pair) = access();
        let fleet = |role, allow: &[FleetWord]| {
            let key = FleetKey { name: "office".to_owned(), role, public: pair.public_key() };
            Some(Fleet { allow: allow.to_vec(), ..fleet(vec![key]) })
        };
        let wall_ns = u64::try_from(NOW_MS).unwrap() * 1_000_000;
        let open = |pair: &KeyPair, to: &str, rev: i64| {
            let body = format!("{{\"to\":\"{to}\",\"rev\":{rev},\"cues\":{{}}}}");
            let opened = access.open_wish(&Letter::sign(pair, body).unwrap(), wall_ns);
            opened.map(|(who, wish)| (who.name, wish.rev)).map_err(|problem| problem.code)
        };
        assert_eq!(open(&pair, "berlin.h3", 5), Err(Code::Role), "nothing by default");
        access.set(fleet(Role::View, &[FleetWord::Cues]).as_ref());
        assert_eq!(open(&pair, "berlin.h3", 5), Err(Code::Role), "who may look wishes nothing");
        access.set(fleet(Role::Operate, &[FleetWord::Load]).as_ref());
        assert_eq!(open(&pair, "berlin.h3", 5), Err(Code::Role), "to load is another thing");
        access.set(fleet(Role::Operate, &[FleetWord::Cues]).as_ref());
        assert_eq!(open(&pair, "berlin.h3", 5), Ok(("office".to_owned(), 5)));
        assert_eq!(open(&pair, "berlin.h4", 5), Err(Code::Origin));
        assert_eq!(open(&new_letter_key(), "berlin.h3", 5), Err(Code::Token));
        let day = 86_400_000;
        assert!(open(&pair, "berlin.h3", NOW_MS + day).is_ok());
        assert_eq!(open(&pair, "berlin.h3", NOW_MS + day + 1), Err(Code::Late));
    }

    #[test]
    fn one_key_fills_no_more_than_its_own_room_and_ids_are_kept_for_ten_minutes() {
        let (access, pair) = access();
        let letter = letter(&pair, "x", "berlin.h3", "pause", "{}", NOW_MS);
        let at = |seconds| MonoTime::from_nanos(0) + Duration::from_secs(seconds);
        let first = |key: &str, id: &str, now| {
            let order = Order { id: id.to_owned(), ..Order::of(&letter).unwrap() };
            access.first_time(&Letter { key: key.to_owned(), ..letter.clone() }, &order, now)
        };
        for n in 0..ORDERS {
            first("one", &n.to_string(), at(0)).unwrap();
        }
        assert_eq!(first("one", "more", at(599)).unwrap_err().code, Code::Busy);
        assert!(first("two", "0", at(599)).is_ok());
        assert_eq!(first("one", "0", at(599)).unwrap_err().code, Code::Late);
        assert!(first("one", "0", at(600)).is_ok());
    }
}
