//! Room for those who are pushed to. It is for whoever leads the show first: where there is none left, one of the least role
//! makes room for a greater one.

use std::sync::{Arc, Mutex};

use tokio::sync::Notify;

use crate::control::{Code, Problem, Surface, Who};
use crate::sys::lock::lock;

/// How many are pushed to at a time over TCP, and over the control socket.
const MOST: (usize, usize) = (32, 16);
/// How many of one name.
const MOST_OF_ONE: usize = 16;

/// Room for those who are pushed to.
#[derive(Debug, Clone, Default)]
pub(super) struct Streams(Arc<Mutex<Vec<Watching>>>);

/// A place among them, free again when it is dropped.
#[derive(Debug)]
pub(super) struct StreamPlace {
    watching: Arc<Mutex<Vec<Watching>>>,
    leave: Arc<Notify>,
}

/// One who is pushed to; the one that came last is the last of all.
#[derive(Debug)]
struct Watching {
    who: Who,
    leave: Arc<Notify>,
}

impl Streams {
    /// A place for `who`.
    ///
    /// # Errors
    /// If there is none, and nobody whose role is less.
    pub(super) fn take(&self, who: &Who) -> Result<StreamPlace, Problem> {
        let mut watching = lock(&self.0);
        let count = |is: &dyn Fn(&Who) -> bool| watching.iter().filter(|one| is(&one.who)).count();
        if count(&|other| other.surface == who.surface && other.name == who.name) >= MOST_OF_ONE {
            return Err(too_many());
        }
        let most = if who.surface == Surface::Socket { MOST.1 } else { MOST.0 };
        if count(&|other| other.surface == who.surface) >= most {
            let same_way = watching.iter().enumerate().filter(|(_, one)| one.who.surface == who.surface);
            let least =
                same_way.min_by_key(|(_, one)| one.who.role).filter(|(_, one)| one.who.role < who.role);
            let (index, _) = least.ok_or_else(too_many)?;
            watching.remove(index).leave.notify_one();
        }
        let leave = Arc::<Notify>::default();
        watching.push(Watching { who: who.clone(), leave: Arc::clone(&leave) });
        Ok(StreamPlace { watching: Arc::clone(&self.0), leave })
    }

    /// Has all leave who came over TCP: whoever still may comes again.
    pub(super) fn part_with_tcp(&self) {
        let all = lock(&self.0);
        let theirs = all.iter().filter(|one| one.who.surface == Surface::Http);
        theirs.for_each(|one| one.leave.notify_one());
    }
}

impl StreamPlace {
    /// Waits until the place has to be left; for good, where it never has to.
    pub(super) async fn leave(&self) {
        self.leave.notified().await;
    }
}

impl Drop for StreamPlace {
    fn drop(&mut self) {
        lock(&self.watching).retain(|one| !Arc::ptr_eq(&one.leave, &self.leave));
    }
}

fn too_many() -> Problem {
    let remedy = "close another page, or poll the status";
    Problem::new(Code::Busy, "too many event streams are open", remedy)
}

#[cfg(test)]
mod tests {
    use std::pin::pin;
    use std::task::{Context, Waker};

    use super::*;
    use crate::control::Role;

    fn who(role: Role, name: &str) -> Who {
        Who { role, surface: Surface::Http, name: name.to_owned() }
    }

    fn has_to_leave(stream: &StreamPlace) -> bool {
        pin!(stream.leave()).poll(&mut Context::from_waker(Waker::noop())).is_ready()
    }

    #[test]
    fn viewers_do_not_shut_out_whoever_leads_the_show() {
        let streams = Streams::default();
        let viewers: Vec<_> =
            (0..MOST.0).map(|n| streams.take(&who(Role::View, &format!("guest {n}"))).unwrap()).collect();
        assert!(streams.take(&who(Role::View, "guest")).is_err(), "there is room for no more of them");
        let booth = streams.take(&who(Role::Operate, "booth")).unwrap();
        assert_eq!(viewers.iter().map(has_to_leave).position(|leaves| leaves), Some(0));
        let chief = streams.take(&who(Role::Engineer, "chief")).unwrap();
        assert!(!has_to_leave(&booth) && !has_to_leave(&chief));
    }

    #[test]
    fn one_person_has_a_share_and_a_place_is_free_again() {
        let streams = Streams::default();
        let mut mine: Vec<_> =
            (0..MOST_OF_ONE).map(|_| streams.take(&who(Role::Engineer, "anna")).unwrap()).collect();
        assert!(streams.take(&who(Role::Engineer, "anna")).is_err());
        assert!(streams.take(&who(Role::View, "guest")).is_ok());
        mine.pop();
        assert!(streams.take(&who(Role::Engineer, "anna")).is_ok());
    }
}
