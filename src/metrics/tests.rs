use std::collections::BTreeMap;

use super::*;
use crate::control::model::FrameCounts;
use crate::control::{
    Coded, ControllerStatus, FilmDisagreement, FilmSourceStatus, FilmStatus, Health, Histogram, Levels,
    LinkAxisStatus, LinkStatus, Percentiles, PreflightStatus, RealTimeStatus, RecordStatus, Severity,
    ShowStatus, Times, Warning,
};
use crate::state::{PlayMode, State};

pub(super) mod strict;

use strict::{Page, check};

fn times() -> Times {
    let histogram =
        Histogram { bounds_us: vec![10.0, 20.0, 40.0], counts: vec![5, 3, 0, 2], sum_s: 0.001_25 };
    let percentiles =
        Percentiles { p50_us: Some(10.0), p99_us: Some(40.0), p999_us: Some(90.0), max_us: Some(90.0) };
    Times { percentiles, histogram }
}

fn controller(name: &str, row: Option<&str>) -> ControllerStatus {
    ControllerStatus {
        name: name.to_owned(),
        row: row.map(str::to_owned),
        seat: "bench3".to_owned(),
        address: "127.0.0.1:7408".to_owned(),
        group: name.to_owned(),
        enabled: true,
        health: Health::Ok,
        why: "it answers".to_owned(),
        why_coded: Coded::default(),
        heard_s: Some(0.25),
        ack_rate: Some(1.0),
        ack_p50_us: Some(40.0),
        ack_p99_us: None,
        frames: FrameCounts { sent: 1_000, asked: 900, acked: 890, refused: 2, lost: 8, withdrawn: 0 },
        send_failed: 1,
        clamps: 3,
        homed: Some(true),
        emergency_stop: false,
        error: Some(0),
        servo_errors: None,
        forces: Some(vec![12, -3]),
        belts_open: None,
        inputs: Some(0),
        outputs: None,
        left_on: false,
        positions_mm: None,
        commanded: None,
        measured: None,
        axis_offset: 0,
        rotary_axis: None,
    }
}

/// A film whose first source is silent.
fn film() -> FilmStatus {
    let silent = FilmSourceStatus {
        source: "ltc:alsa:hw:2,0".to_owned(),
        state: "lost".to_owned(),
        dropouts: 3,
        freewheel_s: 4.5,
        level_dbfs: Some(-60.0),
        ..FilmSourceStatus::default()
    };
    let leading = FilmSourceStatus {
        source: "artnet:10.0.0.20".to_owned(),
        state: "locked".to_owned(),
        rate_ppm: Some(12.5),
        sigma_ms: Some(0.25),
        jumps: 1,
        ..FilmSourceStatus::default()
    };
    FilmStatus {
        state: "locked".to_owned(),
        leads: true,
        source: Some(leading.source.clone()),
        error_ms: Some(-0.5),
        disagrees: Some(FilmDisagreement { source: silent.source.clone(), ahead_s: 3.25 }),
        switches: 2,
        joins: 4,
        sources: vec![silent, leading],
        ..FilmStatus::default()
    }
}

/// A hall in the middle of a show.
fn playing() -> Status {
    let warning = |controller: &str| Warning {
        id: "controller-lost".to_owned(),
        severity: Severity::Error,
        controller: Some(controller.to_owned()),
        text: "silent".to_owned(),
        remedy: "look at its power".to_owned(),
        ..Warning::default()
    };
    Status {
        broadcasts: vec![],
        buttons: vec![],
        notify: vec![],
        test: None,
        record: RecordStatus {
            mode: "sampled".to_owned(),
            recording: Some("2026-01-31T19-00-00-show-storm.mcap".to_owned()),
            incidents: [("mark".to_owned(), 2)].into(),
            ..RecordStatus::default()
        },
        hall: "1".to_owned(),
        format: 2,
        version: "9.9.9".to_owned(),
        uptime_s: 60.5,
        state: State::Playing(PlayMode::Following).into(),
        cause: "somebody asked".to_owned(),
        cause_coded: Coded::default(),
        next: "nothing".to_owned(),
        next_coded: Coded::default(),
        arm_homes: false,
        may_clear: false,
        since_s: 5.0,
        timezone: "UTC".to_owned(),
        lapses_s: None,
        moving: true,
        job: None,
        film: Some(film()),
        osc: Some([("received".to_owned(), 12), ("refused".to_owned(), 3)].into()),
        show: Some(ShowStatus {
            cue: "storm".to_owned(),
            title: None,
            sha256: "00".to_owned(),
            length_s: 120.0,
            position_s: 12.5,
            join_s: 1.5,
            resume_s: None,
            axes: 6,
            effects: vec![],
            margins: vec![],
        }),
        playlist: None,
        fleet: None,
        trim_ms: -80,
        levels: Levels {
            motion: 0.6,
            vibration: 1.0,
            effects: BTreeMap::from([("water".to_owned(), false)]),
            rows: BTreeMap::from([("A".to_owned(), 0.5)]),
        },
        presets: vec![],
        ticks: 6_050,
        missed_ticks: 2,
        rate_hz: 100.0,
        lateness: times(),
        ack_latency: times(),
        link_ack_latency: times(),
        realtime: RealTimeStatus {
            policy: "fifo".to_owned(),
            priority: 50,
            memory_locked: true,
            refusals: vec![],
        },
        controllers: vec![controller("A1", Some("A")), controller("B1", None)],
        links: vec![link()],
        preflight: Some(PreflightStatus { passed: true, age_s: 300.0, answered: 2, findings: vec![] }),
        warnings: vec![warning("A1"), warning("B1")],
        journal: vec![],
    }
}

/// Before anything was read, loaded or played.
fn booting() -> Status {
    Status {
        state: State::Boot.into(),
        moving: false,
        film: None,
        osc: None,
        show: None,
        lateness: Times::default(),
        ack_latency: Times::default(),
        link_ack_latency: Times::default(),
        realtime: RealTimeStatus::default(),
        controllers: vec![],
        links: vec![],
        preflight: None,
        warnings: vec![],
        ..playing()
    }
}

/// One with an axis that had trouble.
fn link() -> LinkStatus {
    let axis = LinkAxisStatus {
        controller: "L1".to_owned(),
        axis: 2,
        made: 90,
        acked: 80,
        dry: 1,
        error_mm: 2.5,
        ..<_>::default()
    };
    let (name, port) = ("stalls".to_owned(), "/dev/ttyUSB0".to_owned());
    LinkStatus {
        name,
        port,
        asked: 700,
        answered: 690,
        delay_p99_us: 1_500.0,
        axes: vec![axis],
        ..<_>::default()
    }
}

#[test]
fn each_link_and_each_axis_on_it_has_its_figures() {
    let page = render(&playing());
    for line in [
        "kinocue_link_up{link=\"stalls\"} 1.0",
        "kinocue_link_answer_delay_seconds{link=\"stalls\"} 0.0015",
        "kinocue_link_ack_latency_seconds_count 10",
        "kinocue_link_exchanges_total{link=\"stalls\",result=\"answered\"} 690",
        "kinocue_axis_segments_total{link=\"stalls\",controller=\"L1\",axis=\"a2\",result=\"acked\"} 80",
        "kinocue_axis_queue_dry_total{link=\"stalls\",controller=\"L1\",axis=\"a2\"} 1",
        "kinocue_axis_error_meters{link=\"stalls\",controller=\"L1\",axis=\"a2\"} 0.0025",
    ] {
        assert!(page.lines().any(|one| one == line), "{line}: {page}");
    }
    assert!(!render(&booting()).contains("kinocue_link"), "a hall without links has none of it");
}

fn page(status: &Status) -> Page {
    check(&render(status)).unwrap()
}

#[test]
fn every_page_is_what_the_format_asks_for() {
    for status in [playing(), booting()] {
        let page = page(&status);
        assert!(page.families.iter().all(|family| family.starts_with("kinocue_")), "{:?}", page.families);
    }
}

#[test]
fn the_checker_of_these_tests_finds_what_is_wrong() {
    let good = render(&playing());
    let broken = [
        (good.replace("# EOF\n", ""), "EOF"),
        (good.replace("kinocue_ticks_total 6050", "kinocue_ticks 6050"), "suffix"),
        (good.replace("kinocue_moving 1.0", "kinocue_moving yes"), "value"),
        (good.replace("le=\"+Inf\"} 10", "le=\"+Inf\"} 9"), "count"),
        (good.replace("kinocue_moving 1.0", "kinocue_moving 1.0\nkinocue_moving 1.0"), "twice"),
        (good.replace("{group=\"motion\"}", "{group=motion}"), "label"),
        (good.replace("# TYPE kinocue_moving gauge\n", ""), "TYPE"),
    ];
    for (text, why) in broken {
        assert_ne!(text, good, "{why}: nothing was broken");
        let fault = check(&text).map(drop).unwrap_err();
        assert!(fault.contains(why), "{why}: {fault}");
    }
}

#[test]
fn the_state_is_the_one_of_all_states_that_is_1() {
    let page = page(&playing());
    let states: Vec<_> =
        page.samples.iter().filter(|(series, _)| series.starts_with("kinocue_state{")).collect();
    assert_eq!(states.len(), 14);
    let on: Vec<_> =
        states.iter().filter(|(_, value)| **value == 1.0).map(|(series, _)| series.as_str()).collect();
    assert_eq!(on, ["kinocue_state{state=\"playing\"}"]);
}

#[test]
fn figures_are_in_base_units() {
    let page = page(&playing());
    for (series, value) in [
        ("kinocue_show_position_seconds", 12.5),
        ("kinocue_trim_seconds", -0.08),
        ("kinocue_level_ratio{group=\"motion\"}", 0.6),
        ("kinocue_row_level_ratio{row=\"A\"}", 0.5),
        ("kinocue_effect_allowed{effect=\"water\"}", 0.0),
        ("kinocue_ticks_missed_total", 2.0),
        ("kinocue_realtime", 1.0),
        ("kinocue_rt_scheduling_info{policy=\"fifo\",priority=\"50\",memlock=\"yes\"}", 1.0),
        ("kinocue_build_info{version=\"9.9.9\"}", 1.0),
        ("kinocue_warnings{id=\"controller-lost\",severity=\"error\"}", 2.0),
        ("kinocue_frames_sent_total{controller=\"A1\",row=\"A\"}", 1_000.0),
        ("kinocue_acks_total{controller=\"B1\",result=\"lost\"}", 8.0),
        ("kinocue_limit_interventions_total{controller=\"B1\"}", 3.0),
        ("kinocue_controller_ack_latency_seconds{controller=\"B1\",quantile=\"0.5\"}", 40e-6),
        ("kinocue_controller_torque{controller=\"B1\",axis=\"2\"}", -3.0),
        ("kinocue_osc_messages_total{result=\"refused\"}", 3.0),
    ] {
        assert_eq!(page.samples.get(series), Some(&value), "{series}");
    }
}

#[test]
fn a_film_is_told_by_each_of_its_sources_and_not_at_all_where_none_is_followed() {
    let page = page(&playing());
    for (series, value) in [
        ("kinocue_sync_state{state=\"locked\"}", 1.0),
        ("kinocue_sync_follows", 1.0),
        ("kinocue_sync_error_seconds", -0.000_5),
        ("kinocue_sync_disagreement_seconds", 3.25),
        ("kinocue_sync_switches_total", 2.0),
        ("kinocue_sync_joins_total", 4.0),
        ("kinocue_sync_freewheel_seconds_total{source=\"ltc:alsa:hw:2,0\"}", 4.5),
        ("kinocue_sync_leads{source=\"ltc:alsa:hw:2,0\"}", 0.0),
        ("kinocue_sync_leads{source=\"artnet:10.0.0.20\"}", 1.0),
        ("kinocue_sync_chosen{source=\"artnet:10.0.0.20\"}", 0.0),
        ("kinocue_sync_source_state{source=\"ltc:alsa:hw:2,0\",state=\"lost\"}", 1.0),
        ("kinocue_sync_rate_ppm{source=\"artnet:10.0.0.20\"}", 12.5),
        ("kinocue_sync_sigma_seconds{source=\"artnet:10.0.0.20\"}", 0.000_25),
        ("kinocue_sync_level_dbfs{source=\"ltc:alsa:hw:2,0\"}", -60.0),
        ("kinocue_sync_dropouts_total{source=\"ltc:alsa:hw:2,0\"}", 3.0),
        ("kinocue_sync_jumps_total{source=\"artnet:10.0.0.20\"}", 1.0),
    ] {
        assert_eq!(page.samples.get(series), Some(&value), "{series}");
    }
    let silent = "kinocue_sync_rate_ppm{source=\"ltc:alsa:hw:2,0\"}";
    assert_eq!(page.samples.get(silent), None, "nobody knows it");
    let without = self::page(&booting());
    assert!(!without.samples.keys().any(|series| series.starts_with("kinocue_sync_")));
}

#[test]
fn lateness_is_a_histogram_of_seconds_that_counts_all_below_each_bound() {
    let page = page(&playing());
    assert_eq!(["0.00001", "0.00002", "0.00004", "+Inf"].map(|le| bucket(&page, le)), [5.0, 8.0, 8.0, 10.0]);
    assert_eq!(page.samples["kinocue_tick_lateness_seconds_count"], 10.0);
    assert_eq!(page.samples["kinocue_tick_lateness_seconds_sum"], 0.001_25);
}

/// By the value of the bound, however it is written.
fn bucket(page: &Page, le: &str) -> f64 {
    let bound = |text: &str| if text == "+Inf" { f64::INFINITY } else { text.parse().unwrap() };
    let of = |series: &str| {
        let text = series.strip_prefix("kinocue_tick_lateness_seconds_bucket{le=\"")?.strip_suffix("\"}")?;
        Some(bound(text))
    };
    let found = page.samples.iter().find(|(series, _)| of(series) == Some(bound(le)));
    *found.unwrap().1
}

#[test]
fn what_nobody_knows_is_left_out_rather_than_told_as_0() {
    let mut status = playing();
    status.controllers[0].health = Health::Unwatched;
    status.controllers[0].heard_s = None;
    status.controllers[1].health = Health::Lost;
    status.show = None;
    let page = page(&status);
    assert_eq!(page.samples.get("kinocue_controller_up{controller=\"A1\",row=\"A\"}"), None);
    assert_eq!(page.samples.get("kinocue_controller_silence_seconds{controller=\"A1\",row=\"A\"}"), None);
    assert_eq!(page.samples.get("kinocue_controller_up{controller=\"B1\"}"), Some(&0.0));
    assert_eq!(page.samples.get("kinocue_show_position_seconds"), None);
}

#[test]
fn a_name_cannot_break_out_of_its_label() {
    let mut status = playing();
    status.controllers[0].name = "a\"} 1\nkinocue_realtime 0\\".to_owned();
    let page = page(&status);
    assert_eq!(page.samples["kinocue_realtime"], 1.0);
    assert!(page.samples.contains_key(
        "kinocue_controller_enabled{controller=\"a\\\"} 1\\nkinocue_realtime 0\\\\\",row=\"A\"}"
    ));
}

/// Every name that begins with `kinocue_` in a text.
fn names(text: &str) -> Vec<&str> {
    let end = |c: char| !(c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    let found = text.match_indices("kinocue_").map(|(at, _)| text[at..].split(end).next().unwrap());
    found.collect()
}

#[test]
fn alerts_and_dashboard_ask_for_figures_that_exist() {
    let (page, of_desk) = (page(&playing()), halls::of_two_halls());
    let exists = |name: &str| {
        let suffixes = ["", "_total", "_info", "_bucket", "_sum", "_count"];
        let of = |series: &String| series.split('{').next() == Some(name);
        suffixes
            .iter()
            .any(|suffix| name.strip_suffix(suffix).is_some_and(|family| page.families.contains(family)))
            && page.samples.keys().any(of)
            || of_desk.samples.keys().any(of)
    };
    let rules = include_str!("../../systemd/prometheus/kinocue.rules.yml");
    let dashboard = include_str!("../../systemd/grafana/kinocue.json");
    let board: serde_json::Value = serde_json::from_str(dashboard).unwrap();
    let panels = board["panels"].as_array().unwrap();
    for target in panels.iter().flat_map(|panel| panel["targets"].as_array().unwrap()) {
        let of = |key: &str| target[key].as_str().unwrap_or_default();
        let labels = of("legendFormat").split("{{").skip(1).map(|rest| rest.split_once("}}").unwrap().0);
        for label in labels.filter(|label| *label != "instance") {
            let has = |series: &String| {
                let (name, labels) = series.split_once('{').unwrap_or((series, ""));
                names(of("expr")).contains(&name) && labels.contains(&format!("{label}=\""))
            };
            assert!(page.samples.keys().any(has), "no {label} in {}", of("expr"));
        }
    }
    for (file, text) in [("rules", rules), ("dashboard", dashboard)] {
        let asked = names(text);
        assert!(asked.len() > 10, "{file}");
        assert!(
            asked.iter().all(|name| exists(name)),
            "{file}: {:?}",
            asked.iter().find(|name| !exists(name))
        );
    }
}
