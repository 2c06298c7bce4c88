use super::*;
use crate::harness::shown::{Luck, mono};

fn view(t: f64, ahead_s: f64, state: FilmState) -> SourceView {
    let media = ShowTime::from_secs_f64(t + ahead_s);
    SourceView { point: FilmPoint { at: mono(t), media, rate: 1.0, epoch: 0, state }, may_lead: true }
}

/// Two sources by their states, and how far the first is ahead.
fn two(t: f64, states: (FilmState, FilmState), ahead_s: f64) -> [SourceView; 2] {
    [view(t, ahead_s, states.0), view(t, 0.0, states.1)]
}

use FilmState::{Absent, Freewheeling, Locked, Lost, Stopped, Unusable};

#[test]
fn the_highest_that_can_leads_and_a_lower_one_takes_over_when_it_is_lost() {
    let mut chooser = Chooser::default();
    assert_eq!(chooser.choose(&two(0.0, (Absent, Absent), 0.0), None, mono(0.0)).point.state, Absent);
    assert_eq!(chooser.choose(&two(1.0, (Locked, Locked), 0.0), None, mono(1.0)).source, Some(0));
    assert_eq!(chooser.choose(&two(2.0, (Freewheeling, Locked), 0.0), None, mono(2.0)).source, Some(0));
    let chosen = chooser.choose(&two(3.0, (Lost, Locked), 0.01), None, mono(3.0));
    assert_eq!((chosen.source, chosen.point.epoch), (Some(1), 0), "within a frame it is slewed");
    let mut chooser = Chooser::default();
    chooser.choose(&two(1.0, (Locked, Locked), 5.0), None, mono(1.0));
    let chosen = chooser.choose(&two(3.0, (Unusable, Locked), 5.0), None, mono(3.0));
    assert_eq!(
        (chosen.source, chosen.point.epoch, chooser.switches()),
        (Some(1), 1, 1),
        "further off it is a jump"
    );
}

#[test]
fn a_told_stop_is_obeyed_though_another_source_runs() {
    let mut chooser = Chooser::default();
    chooser.choose(&two(0.0, (Locked, Locked), 0.0), None, mono(0.0));
    for t in 1..100 {
        let chosen = chooser.choose(&two(t.into(), (Stopped, Locked), 0.0), None, mono(t.into()));
        assert_eq!((chosen.source, chosen.point.state), (Some(0), Stopped));
    }
}

#[test]
fn a_higher_source_takes_over_after_ten_seconds_if_it_agrees_and_a_person_decides_if_not() {
    for (ahead_s, agrees) in [(0.03, true), (3.2, false)] {
        let mut chooser = Chooser::default();
        chooser.choose(&two(0.0, (Absent, Locked), 0.0), None, mono(0.0));
        for t in 1..=10 {
            let chosen = chooser.choose(&two(t.into(), (Locked, Locked), ahead_s), None, mono(t.into()));
            assert_eq!((chosen.source, chosen.disagrees), (Some(1), None), "{t} s");
        }
        let chosen = chooser.choose(&two(11.0, (Locked, Locked), ahead_s), None, mono(11.0));
        let disagrees = (!agrees).then_some((0, ShowTime::from_secs_f64(ahead_s)));
        assert_eq!((chosen.source, chosen.disagrees), (Some(usize::from(!agrees)), disagrees));
        assert_eq!(chosen.point.epoch, 0);
    }
}

#[test]
fn one_that_comes_and_goes_never_takes_over() {
    let mut chooser = Chooser::default();
    chooser.choose(&two(0.0, (Absent, Locked), 0.0), None, mono(0.0));
    for t in 1..200 {
        let first = if t % 9 == 0 { Lost } else { Locked };
        assert_eq!(
            chooser.choose(&two(t.into(), (first, Locked), 0.0), None, mono(t.into())).source,
            Some(1)
        );
    }
    assert_eq!(chooser.switches(), 0);
}

#[test]
fn what_a_person_chose_leads_until_they_choose_anew_and_that_another_says_something_else_is_told() {
    let mut chooser = Chooser::default();
    chooser.choose(&two(0.0, (Locked, Locked), 9.0), None, mono(0.0));
    for t in 1..60 {
        let chosen = chooser.choose(&two(t.into(), (Locked, Locked), 9.0), Some(1), mono(t.into()));
        assert_eq!((chosen.source, chosen.point.epoch), (Some(1), 1), "what is far off is told as a jump");
        let disagrees = (t >= 10).then_some((0, ShowTime::from_secs_f64(9.0)));
        assert_eq!(chosen.disagrees, disagrees, "{t} s");
    }
    let far = chooser.choose(&two(60.0, (Locked, Locked), 9.0), None, mono(60.0));
    assert_eq!((far.source, far.point.epoch), (Some(1), 1), "by the ranking a person decides again");
    assert!(far.disagrees.is_some());
    assert_eq!(chooser.choose(&two(61.0, (Locked, Locked), 9.0), Some(7), mono(61.0)).source, Some(1));
    let near = chooser.choose(&two(62.0, (Locked, Locked), 0.0), Some(0), mono(62.0));
    assert_eq!((near.source, near.point.epoch), (Some(0), 1), "what says the same is slewed to");
}

#[test]
fn a_chosen_source_that_stops_or_is_lost_is_not_bypassed() {
    for state in [Stopped, Lost] {
        let mut chooser = Chooser::default();
        chooser.choose(&two(0.0, (Locked, Locked), 0.0), Some(1), mono(0.0));
        let chosen = chooser.choose(&two(1.0, (Locked, state), 0.0), Some(1), mono(1.0));
        assert_eq!((chosen.source, chosen.point.state), (Some(1), state));
    }
}

#[test]
fn a_source_that_is_only_coarse_leads_nobody() {
    let mut chooser = Chooser::default();
    let coarse = SourceView { may_lead: false, ..view(0.0, 0.0, Locked) };
    let chosen = chooser.choose(&[coarse], None, mono(0.0));
    assert_eq!((chosen.source, chosen.point.state), (None, Unusable));
    assert_eq!(chooser.choose(&[coarse, view(0.0, 0.0, Locked)], None, mono(0.0)).source, Some(1));
}

#[test]
fn a_jump_of_the_source_is_told_as_one() {
    let mut chooser = Chooser::default();
    let mut one = view(0.0, 0.0, Locked);
    one.point.epoch = 5;
    assert_eq!(chooser.choose(&[one], None, mono(0.0)).point.epoch, 0);
    one.point.epoch = 6;
    assert_eq!(chooser.choose(&[one], None, mono(1.0)).point.epoch, 1);
    assert_eq!(chooser.choose(&[one], None, mono(2.0)).point.epoch, 1);
}

#[test]
fn whatever_sources_say_the_point_that_leads_is_one_that_may() {
    let mut luck = Luck::new(8);
    for _ in 0..200 {
        let mut chooser = Chooser::default();
        for t in 0..200 {
            let views: Vec<SourceView> = (0..luck.below(10))
                .map(|_| {
                    let mut view =
                        view(f64::from(t), luck.between(-1.0, 1.0), FilmState::ALL[1 + luck.below(11)]);
                    view.may_lead = luck.is(0.7);
                    view
                })
                .collect();
            let chosen = chooser.choose(&views, None, mono(f64::from(t)));
            if chosen.point.state.may_lead() {
                let source = chosen.source.expect("there is one");
                assert!(views[source].leads() && source < MOST_SOURCES);
            }
        }
    }
}
