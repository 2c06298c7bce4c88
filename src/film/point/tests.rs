use super::*;

fn ms(ms: u64) -> MonoTime {
    MonoTime::from_nanos(ms * 1_000_000)
}

fn tick(at_ms: u64, missed: u64) -> Tick {
    Tick { index: 0, deadline: ms(at_ms), late: Duration::ZERO, missed }
}

fn point(at_ms: u64, media_ms: i64, rate: f64, epoch: u32, state: FilmState) -> FilmPoint {
    FilmPoint { at: ms(at_ms), media: ShowTime::from_millis(media_ms), rate, epoch, state }
}

#[test]
fn a_point_runs_on_at_its_rate_both_ways() {
    let runs = point(10_000, 60_000, 1.001, 0, FilmState::Locked);
    assert_eq!(runs.media_at(ms(11_000)).as_nanos(), 61_001_000_000);
    assert_eq!(runs.media_at(ms(9_000)).as_nanos(), 58_999_000_000);
    let stands = point(10_000, 60_000, 0.0, 0, FilmState::Stopped);
    assert_eq!(stands.media_at(ms(99_000)), stands.media);
}

#[test]
fn what_is_published_is_read_in_every_state() {
    let published = PublishedPoint::default();
    assert_eq!(published.read(), None);
    for (epoch, state) in (7..).zip(FilmState::ALL) {
        let point = point(1, -5, -2.5, epoch, state);
        published.publish(&point);
        assert_eq!(published.read(), Some(point));
    }
}

#[test]
fn a_reader_never_sees_two_points_mixed() {
    let published = Arc::new(PublishedPoint::default());
    let writer = Arc::clone(&published);
    let of = |n: u32| FilmPoint {
        at: MonoTime::from_nanos(n.into()),
        media: ShowTime::from_nanos(n.into()),
        rate: n.into(),
        epoch: n,
        state: FilmState::ALL[n as usize % 12],
    };
    let writes = std::thread::spawn(move || (0..20_000).for_each(|n| writer.publish(&of(n))));
    while !writes.is_finished() {
        if let Some(seen) = published.read() {
            assert_eq!(seen, of(seen.epoch));
        }
    }
    writes.join().expect("it panics nowhere");
    assert_eq!(published.read(), Some(of(19_999)));
}

#[test]
fn a_point_that_nobody_renews_is_lost_after_half_a_second() {
    let published = Arc::new(PublishedPoint::default());
    let mut clock = ChasedFilm::new(Arc::clone(&published));
    assert_eq!(clock.at(&tick(0, 0)), None);
    published.publish(&point(1_000, 60_000, 1.0, 0, FilmState::Locked));
    assert_eq!(clock.at(&tick(1_500, 0)).map(|point| point.state), Some(FilmState::Locked));
    assert_eq!(clock.at(&tick(1_501, 0)).map(|point| point.state), Some(FilmState::Lost));
    published.publish(&point(1_490, 60_490, 1.0, 0, FilmState::Locked));
    assert_eq!(clock.at(&tick(1_501, 0)).map(|point| point.state), Some(FilmState::Locked));
}
