//! The thread behind the taps in virtual time, at a folder that is there.

use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use super::*;
use crate::motion::{MAX_AXES, Pulses, SeatType, Slot, Window};
use crate::net::Delivery;
use crate::record::{
    About, AckRecord, Asked, Contents, EventNote, FrameKind, Judging, RecordedSeat, Recording, Taps,
    TickHead, Told, Wanted, each_chunk, read, summarize,
};
use crate::replay::replay;
use crate::time::{Rate, ShowTime};
use crate::tracker::{Fate, Reply};
use crate::wire::{Analogue, Code, FrameNo, MAX_LEN, Motion, ReplyCode, Timing, VibrationPort};

const LANES: usize = 8;
const MS: u64 = 1_000_000;

/// A worker whose taps are at hand: a thousand ticks a second, each frame acked.
struct Bench {
    worker: Worker,
    taps: Taps,
    folder: tempfile::TempDir,
    tick: u64,
    sent: Vec<Vec<u8>>,
}

fn at(tick: u64) -> MonoTime {
    MonoTime::from_nanos((1_000 + tick) * MS)
}

impl Bench {
    fn new() -> Self {
        let seat = SeatType::bench3(MAX_AXES);
        let slots = (0..MAX_AXES).map(|axis| Slot::new(&seat, axis, Some(axis), 1.0)).collect();
        let window = Window::new(slots);
        let kind = FrameKind::Datagram(VibrationPort::Two);
        let seats: Vec<_> =
            (0..LANES).map(|lane| RecordedSeat::new(&format!("A{lane}"), &window, kind)).collect();
        let controller = r#"{"group":0,"dialect":"smc","estop_inputs":0,"station":[1,1],"acked_after_ns":0}"#;
        let controllers = [controller; LANES].join(",");
        let judging = format!(r#"{{"ack_every":1,"is_hall":false,"controllers":[{controllers}]}}"#);
        let judging: Judging = serde_json::from_str(&judging).expect("a hall");
        let (rate, clocks) = (Rate::from_hz(1_000.0), (MonoTime::default(), 0));
        let opening = Opening::new(&About::of_hall("hall", rate, clocks), &seats).judged(&judging);
        let (taps, intake) = Intake::new(seats, rate, 20);
        let record = Record {
            mode: RecordMode::Full,
            part_mib: 1,
            flight_s: 0,
            min_free_gib: 0.0,
            ..Record::default()
        };
        let folder = tempfile::tempdir().expect("a folder");
        let disk = Disk::new(&record, folder.path());
        let ((link, asks), maker) = (RecordLink::new(), EntryMaker::new(LANES, clocks));
        let worker = Worker::new(intake, asks, link, opening, maker, disk, record);
        Self { worker, taps, folder, tick: 0, sent: Vec::new() }
    }

    fn begin(&mut self) {
        self.worker.keep(at(self.tick), Note::Hall(HallNote::default()));
        let start = ShowStart { kind: "show", cue: "ride".to_owned(), ..ShowStart::default() };
        self.worker.begin(start, at(self.tick));
    }

    /// A tick: frames to anywhere, which columns make no smaller, and what the ack thread makes of them.
    fn tick(&mut self) {
        let Taps { ticks, acks } = &mut self.taps;
        let (tick, due) = (self.tick, at(self.tick));
        let frame = FrameNo(u32::try_from(tick + 1).expect("few"));
        if tick == 0 {
            (0..LANES).for_each(|lane| acks.take(&AckRecord::First(lane, frame)));
            acks.take(&AckRecord::Watched);
        }
        for lane in 0..LANES {
            let place = |axis: usize| {
                let number = (tick * 97 + lane as u64) * 31 + axis as u64;
                let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                Pulses(((mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 33) as i32)
            };
            let motion = Motion {
                timing: Timing::Relative,
                channel: 2,
                accept: Code(0x101),
                reply: Code(0x101),
                frame,
                time_ms: 1,
                positions: &std::array::from_fn::<_, MAX_AXES, _>(place),
                outputs: 0,
                analogue: Analogue::default(),
                vibration: None,
            };
            let mut buf = [0; MAX_LEN];
            let datagram = motion.emit(&mut buf);
            self.sent.push(datagram.to_vec());
            ticks.asked(Asked { pose: [0.5; MAX_AXES], slots: MAX_AXES, level: 1.0, clamps: 0 });
            ticks.frame(lane, datagram, due, Delivery::Sent);
        }
        let film = ShowTime::from_millis(tick.cast_signed());
        let state = crate::state::State::Playing(crate::state::PlayMode::Following);
        ticks.tick(&TickHead { index: tick, deadline: due, late_ns: 0, missed: 0, film, state });
        let (code, received) = (ReplyCode::Running, due + Duration::from_micros(200));
        for controller in 0..LANES {
            let reply = Reply { controller, frame, code, error: 0, inputs: 0, at: received };
            acks.take(&AckRecord::Reply(reply));
        }
        acks.take(&AckRecord::Posted(u32::try_from(LANES).expect("few"), LANES - 1, frame));
        for controller in 0..LANES {
            acks.take(&AckRecord::Fate(controller, frame, Fate::Answered(code), 200_000));
        }
        acks.drained(due + Duration::from_micros(500));
        self.tick += 1;
    }

    /// So many ticks, and a look at each twentieth.
    fn ticks(&mut self, count: u64) {
        for _ in 0..count {
            self.tick();
            if self.tick.is_multiple_of(20) {
                self.worker.look(at(self.tick));
            }
        }
    }

    /// Looks on without ticks until that holds; gives how long that took.
    fn until(&mut self, holds: impl Fn(&Worker) -> bool) -> Duration {
        let began = self.tick;
        while !holds(&self.worker) {
            assert!(self.tick - began < 60_000, "not within a minute");
            self.tick += 20;
            self.worker.look(at(self.tick));
        }
        Duration::from_millis(self.tick - began)
    }

    fn files(&self) -> Vec<PathBuf> {
        let mut all: Vec<PathBuf> = std::fs::read_dir(self.folder.path())
            .expect("it is there")
            .map(|entry| entry.expect("it is there").path())
            .collect();
        // Part 1 has no number.
        all.sort_by_key(|path| (path.to_string_lossy().len(), path.clone()));
        all
    }
}

fn is_recording(worker: &Worker) -> bool {
    worker.link.status().recording.is_some()
}

#[test]
fn a_show_that_passes_the_size_of_a_part_goes_on_in_the_next_and_each_part_stands_alone() {
    let mut bench = Bench::new();
    bench.begin();
    bench.ticks(8_000);
    bench.worker.close_show(at(bench.tick));
    let files = bench.files();
    assert!(files.len() >= 3, "{files:?}");
    let (mut datagrams, mut ticks) = (Vec::new(), 0);
    for (number, path) in (1_usize..).zip(&files) {
        let file = std::fs::read(path).expect("it is there");
        let mut first = None;
        let mut take = |_: &Contents, _, told: Told<'_>| match told {
            Told::Chunks(chunks) => each_chunk(&chunks, |chunk| {
                datagrams.extend(chunk.frames().map(|frame| frame.datagram.to_vec()));
            }),
            Told::State(state) => drop(first.get_or_insert(state)),
            _ => {}
        };
        let contents = read(file.as_slice(), Wanted::ALL, &mut take).expect("a recording");
        assert!(contents.trouble.is_none() && contents.faults.is_empty(), "{contents:?}");
        assert_eq!([contents.entry("part"), contents.entry("cue")], [&*number.to_string(), "ride"]);
        assert_eq!((contents.seats.len(), first.is_some()), (LANES, true), "part {number}");
        let (contents, summary) = summarize(file.as_slice()).expect("a recording");
        assert_eq!(contents.end["ticks"], summary.ticks.to_string(), "part {number}");
        ticks += summary.ticks;
        let (_, verdict) = replay(file.as_slice()).expect("a recording");
        assert_eq!(verdict.differences, [], "part {number}");
        assert_eq!((verdict.gaps, verdict.from_the_start), (0, number == 1), "part {number}");
    }
    assert_eq!(ticks, bench.tick);
    assert!(datagrams == bench.sent, "each frame is in one part, in its order");
}

#[test]
fn a_show_that_follows_at_once_has_the_counts_of_its_own_and_says_how_the_hall_stands() {
    let mut bench = Bench::new();
    bench.worker.record.mode = RecordMode::Sampled;
    let shows = [1_700, 900, 400];
    for ticks in shows {
        bench.begin();
        bench.ticks(ticks);
    }
    bench.worker.close_show(at(bench.tick));
    let mut files = bench.files();
    files.sort();
    assert_eq!(files.len(), shows.len(), "{files:?}");
    for (path, ticks) in files.iter().zip(shows) {
        let file = std::fs::read(path).expect("it is there");
        let (mut counted, mut stands) = (0, false);
        let mut take = |_: &Contents, _, told: Told<'_>| match told {
            Told::Tick(sample) => counted += u64::from(sample.ticks),
            Told::State(_) => stands = true,
            _ => {}
        };
        read(file.as_slice(), Wanted::ALL, &mut take).expect("a recording");
        assert!(stands, "{path:?}");
        assert_eq!(counted, ticks, "{path:?}");
    }
}

#[test]
fn a_disk_that_stands_still_for_a_second_and_a_half_loses_nothing_and_for_ten_what_its_file_says() {
    let mut bench = Bench::new();
    bench.worker.record.part_mib = 1_000;
    bench.begin();
    bench.ticks(1_000);
    let says = |bench: &Bench| bench.worker.link.status_at(at(bench.tick)).troubles.remove("show");
    // What was dropped is told by the next tick that found room.
    let still = |bench: &mut Bench, ticks: u64| {
        for tick in 0..ticks {
            bench.tick();
            let trouble = says(bench);
            assert!(trouble.is_some() || tick < 4_000, "nothing is said after {tick} ms");
            assert!(trouble.is_none_or(|text| tick > 2_000 && text.contains("answers no write")), "{tick}");
        }
        bench.worker.look(at(bench.tick));
        bench.ticks(1_000);
        bench.worker.intake.counts().dropped
    };
    assert_eq!(still(&mut bench, 1_500), 0);
    let dropped = still(&mut bench, 10_000);
    assert!((7_000..=8_000).contains(&dropped), "at least two of ten seconds are held: {dropped}");
    bench.worker.close_show(at(bench.tick));
    let file = std::fs::read(&bench.files()[0]).expect("it is there");
    let (mut ticks, mut gaps, mut last) = (0, 0, None);
    let mut take = |_: &Contents, _, told: Told<'_>| {
        let Told::Chunks(chunks) = told else { return };
        each_chunk(&chunks, |chunk| {
            let index = chunk.head.index;
            let before = last.replace(index).map_or(0, |last: u64| last + 1);
            assert_eq!(index - before, u64::from(chunk.dropped), "at tick {index}");
            (ticks, gaps) = (ticks + 1, gaps + index - before);
        });
    };
    let contents = read(file.as_slice(), Wanted::ALL, &mut take).expect("a recording");
    assert_eq!((gaps, ticks + gaps), (dropped, bench.tick));
    assert_eq!(contents.end["dropped"], dropped.to_string());
    assert_eq!(says(&bench), None, "the next look found the disk as it was");
    assert_eq!(bench.worker.link.status().errors, 1);
}

/// A file that takes no more than it has, whoever writes.
fn full(begin: impl FnOnce(File) -> Recording<BufWriter<File>>) -> Recording<BufWriter<File>> {
    let place =
        rustix::fs::memfd_create("full", rustix::fs::MemfdFlags::ALLOW_SEALING).expect("Linux has it");
    let place = File::from(place);
    let mut file = begin(place.try_clone().expect("another handle"));
    file.flush().expect("it takes this yet");
    rustix::fs::fcntl_add_seals(&place, rustix::fs::SealFlags::WRITE | rustix::fs::SealFlags::GROW)
        .expect("it may be sealed");
    file
}

#[test]
fn a_disk_that_takes_no_more_is_told_within_five_seconds_and_tried_again_after_thirty() {
    let mut bench = Bench::new();
    bench.begin();
    bench.ticks(100);
    let worker = &mut bench.worker;
    let file = full(|out| {
        begun(BufWriter::new(out), &worker.opening, worker.maker, None, [].iter()).expect("it takes this yet")
    });
    worker.show.as_mut().and_then(|show| show.file.as_mut()).expect("it is recorded").file = file;
    let broken = bench.tick;
    while bench.worker.link.status().troubles.is_empty() {
        assert!(bench.tick - broken < 5_000, "nothing is said in five seconds");
        bench.ticks(20);
    }
    let trouble = bench.worker.link.status().troubles.remove("show").expect("it was told");
    assert!(trouble.contains("not permitted") && trouble.contains("[record] dir"), "{trouble}");
    assert!(!is_recording(&bench.worker));
    bench.ticks(1_000);
    let again = bench.until(is_recording) + Duration::from_secs(1);
    assert!((29..=31).contains(&again.as_secs()), "another after {again:?}");
    assert!(bench.worker.link.status().troubles.is_empty(), "all is well again");
    bench.ticks(100);
    bench.worker.close_show(at(bench.tick));
    assert_eq!(bench.worker.intake.counts().dropped, 0, "the show did not notice");
    let is_second = |path: &PathBuf| path.to_string_lossy().ends_with("-2.mcap");
    let last = bench.files().into_iter().find(is_second).expect("the second");
    let (contents, summary) = summarize(File::open(last).expect("it is there")).expect("a recording");
    assert!(contents.entry("part") == "2" && contents.trouble.is_none(), "{contents:?}");
    // With those of the window that was open when it was begun.
    assert!((100..150).contains(&summary.ticks), "{} ticks", summary.ticks);
}

#[test]
fn a_folder_that_takes_no_files_is_told_at_once_and_tried_until_it_does() {
    let mut bench = Bench::new();
    let record = bench.worker.record.clone();
    let good = std::mem::replace(&mut bench.worker.disk, Disk::new(&record, Path::new("/proc/self")));
    bench.begin();
    let trouble = bench.worker.link.status().troubles.remove("show").expect("it was told");
    assert!(trouble.contains("/proc/self") && trouble.contains("every 30 s"), "{trouble}");
    let tried_until = at(bench.tick + 31_000);
    bench.until(|worker| worker.flush_at > tried_until);
    assert!(!is_recording(&bench.worker));
    bench.worker.disk = good;
    let again = bench.until(is_recording);
    assert!(again <= Duration::from_secs(30), "{again:?}");
    assert!(bench.worker.link.status().troubles.is_empty());
    assert_eq!(bench.worker.intake.counts().dropped, 0);
}

/// Topics and log times of a file, as its messages stand there.
fn as_written(path: &Path) -> Vec<(String, u64)> {
    let file = std::fs::read(path).expect("it is there");
    let messages = mcap::MessageStream::new(&file).expect("a recording").map(|one| one.expect("it is whole"));
    messages.map(|one| (one.channel.topic.clone(), one.log_time)).collect()
}

#[test]
fn messages_stand_in_a_file_in_the_order_of_their_times_whenever_they_were_told() {
    for mode in [RecordMode::Full, RecordMode::Sampled] {
        let mut bench = Bench::new();
        (bench.worker.record.mode, bench.worker.record.part_mib) = (mode, 1_000);
        bench.ticks(100);
        bench.begin();
        for number in 0..300 {
            bench.ticks(11);
            // Wherever in a window, of which the sample is told later.
            let text = number.to_string();
            bench
                .worker
                .keep(at(bench.tick), Note::Event(EventNote { kind: "trouble", seat: String::new(), text }));
        }
        bench.worker.close_show(at(bench.tick));
        let messages = as_written(&bench.files()[0]);
        assert_eq!(messages.iter().filter(|(topic, _)| topic == "/event").count(), 300);
        let mut pairs = messages.windows(2);
        assert_eq!(pairs.find(|pair| pair[1].1 < pair[0].1), None, "{mode:?}");
    }
}

#[test]
fn an_incident_begins_with_how_the_hall_stood_then_and_not_with_how_it_stands_now() {
    let mut bench = Bench::new();
    bench.worker.record.flight_s = 2;
    let ring = bench.folder.path().join("flight.ring");
    let mut bench = Bench { worker: bench.worker.flying(&ring, 16 << 20, 1), ..bench };
    for (state, ticks) in [(4, 3_000), (9, 500), (12, 200)] {
        let note = HallNote { state, ..HallNote::default() };
        bench.worker.keep(at(bench.tick), Note::Hall(note));
        bench.ticks(ticks);
    }
    bench.worker.on_incident(IncidentCause::Dump, at(bench.tick), at(bench.tick));
    bench.worker.close_incident(at(bench.tick));
    let path = bench.files().into_iter().find(|path| path != &ring).expect("an incident");
    let file = std::fs::read(&path).expect("it is there");
    let mut states = Vec::new();
    let mut take = |_: &Contents, _, told: Told<'_>| {
        if let Told::State(state) = told {
            states.push(state);
        }
    };
    read(file.as_slice(), Wanted::ALL, &mut take).expect("a recording");
    assert_eq!(states, [4, 9, 12]);
}

#[test]
fn a_flight_recorder_that_so_many_seats_fill_sooner_says_how_far_back_it_reaches() {
    for (octets_a_s, reaches_s) in [(1 << 10, 60.0), (1 << 18, 8.0)] {
        let mut bench = Bench::new();
        bench.worker.record.flight_s = 60;
        let ring = bench.folder.path().join("flight.ring");
        let mut bench = Bench { worker: bench.worker.flying(&ring, 2 << 20, octets_a_s), ..bench };
        bench.ticks(20);
        assert_eq!(bench.worker.link.status().flight_s, reaches_s);
    }
}

#[test]
fn the_hall_is_in_the_state_of_its_ticks_however_late_the_supervisor_hears_of_it() {
    let mut bench = Bench::new();
    bench.begin();
    bench.ticks(100);
    let playing = state_number(State::Playing(crate::state::PlayMode::Following));
    for state in [playing - 1, playing] {
        bench.tick();
        bench.worker.link.keep_of(at(bench.tick), Note::Hall(HallNote { state, ..HallNote::default() }));
    }
    bench.ticks(60);
    bench.worker.close_show(at(bench.tick));
    let (mut states, file) = (Vec::new(), std::fs::read(&bench.files()[0]).expect("it is there"));
    let mut take = |_: &Contents, _, told: Told<'_>| {
        if let Told::State(state) = told {
            states.push(state);
        }
    };
    read(file.as_slice(), Wanted::ALL, &mut take).expect("a recording");
    // The first was told before there was a tick.
    let playing = u64::try_from(playing).expect("few");
    assert_eq!(states, [0, playing, playing, playing]);
}
