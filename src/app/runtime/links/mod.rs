//! The serial links of a hall: their ports are opened, and each gets a loop and its ends of the rings between.

mod errands;

pub(super) use errands::{Homed, home, survey};

use std::sync::Arc;

use rtrb::{Producer, RingBuffer};

use super::{Purpose, RuntimeError};
use crate::config::{Config, Controller, Link};
use crate::drive::link::{LedPose, LinkLine, StreamTerms};
use crate::drive::{Lane, LinkStream};
use crate::rt::{LinkEnd, LinkLane, LinkLoop, LinkNews, Live, Port, Watch};
use crate::sys::serial::SerialError;

/// Poses of a lane that wait for the thread of its link: a tenth of a second at 1 kHz.
const POSES: usize = 128;
/// Events of a link that wait for the ack thread.
const EVENTS: usize = 4_096;

/// What becomes of the links of a hall.
#[derive(Debug, Default)]
pub(super) struct Links {
    /// The tick thread's ends of their rings, and which lane goes to which.
    pub(super) poses: Vec<Producer<LedPose>>,
    pub(super) led: Vec<LinkLane>,
    /// The ack thread's ends.
    pub(super) news: Vec<LinkNews>,
    /// What becomes their threads.
    pub(super) loops: Vec<LinkLoop>,
    /// The control plane's ends.
    pub(super) ends: Vec<LinkEnd>,
}

/// Opens the ports of those links of a hall that have seats on them. A hall that lives on lives with one that is not plugged in: its
/// seats are lost as long.
pub(super) fn open(config: &Config, purpose: &Purpose) -> Result<Vec<Port>, RuntimeError> {
    let port = |link: &Link| match (LinkLine::open(link), purpose) {
        (Ok(line), _) => Ok(Box::new(line) as Port),
        (Err(_), Purpose::Hall { .. }) => Ok(Box::new(LinkLine::closed(link)) as Port),
        (Err(error), Purpose::Play { .. }) => {
            let why = format!("[link.{}]: {error}", link.name);
            Err(match error {
                SerialError::Taken(_) => RuntimeError::PortTaken(why),
                _ => RuntimeError::Link(why),
            })
        }
    };
    used(config).map(port).collect()
}

/// The links that have seats on them which take part.
fn used(config: &Config) -> impl Iterator<Item = &Link> {
    config.links.iter().filter(|link| seats(config, link).next().is_some())
}

/// The seats on a link, each with its lane.
fn seats<'c>(config: &'c Config, link: &Link) -> impl Iterator<Item = (usize, &'c Controller)> {
    let all = config.controllers.iter().enumerate();
    all.filter(|(_, one)| is_on(one, link))
}

fn is_on(one: &Controller, link: &Link) -> bool {
    one.drives().is_some_and(|drives| drives.link == link.name)
}

impl Links {
    /// Over ports that are open, one for each link that has seats.
    pub(super) fn over(
        config: &Config,
        lanes: &[Lane],
        watch: &Watch,
        ports: Vec<Port>,
        live: &Arc<Live>,
    ) -> Result<Self, RuntimeError> {
        let mut links = Self::default();
        let none = LinkLane { link: usize::MAX, lane: 0, lead: std::time::Duration::ZERO };
        links.led = vec![none; config.on_links().count()];
        for (link, port) in used(config).zip(ports) {
            links.add(config, link, lanes, watch, port, live).map_err(RuntimeError::Link)?;
        }
        Ok(links)
    }

    fn add(
        &mut self,
        config: &Config,
        link: &Link,
        lanes: &[Lane],
        watch: &Watch,
        port: Port,
        live: &Arc<Live>,
    ) -> Result<(), String> {
        let terms = StreamTerms::of(link, config)?.ok_or("no seat is on it")?;
        let family = link.family.ok_or("no seat is on it")?;
        let on_it: Vec<_> = seats(config, link).collect();
        let stations = config.controllers.len() - self.led.len();
        for (own, (lane, ..)) in (0..).zip(&on_it) {
            let lead = lanes[*lane].window.lead();
            self.led[*lane - stations] = LinkLane { link: self.poses.len(), lane: own, lead };
        }
        let seats: Vec<&Controller> = on_it.iter().map(|(_, controller)| *controller).collect();
        let (poses, from_tick) = RingBuffer::new(POSES * on_it.len());
        let (to_acks, events) = RingBuffer::new(EVENTS);
        let absent = config.named().skip(config.controllers.len()).filter(|one| is_on(one, link));
        let all = (&*seats, &*absent.collect::<Vec<_>>());
        let stream = LinkStream::new(port, (link, terms), all, from_tick, to_acks);
        let stream = stream.map_err(|error| format!("[link.{}]: {error}", link.name))?;
        let wants = on_it.iter().filter_map(|(lane, ..)| watch.wants(*lane)).collect();
        self.poses.push(poses);
        self.news.push(LinkNews { events, controllers: on_it.iter().map(|(lane, ..)| *lane).collect() });
        let controllers = on_it.iter().map(|(lane, ..)| *lane).collect();
        let (end, told) = LinkEnd::new(link.name.clone(), (family, terms), controllers);
        self.loops.push(LinkLoop::new(stream, wants, Arc::clone(live), told));
        self.ends.push(end);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
