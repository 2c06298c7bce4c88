//! A controller that speaks as the IMAX manual prints gets no frame and no write of any command.

use super::Folder;
use super::printed::PrintedImax;
use super::process::{Run, Sim, kinocue, play};

/// It was asked, and got nothing else; the command names the cause.
fn assert_only_asked(controller: &PrintedImax, run: &Run) {
    let said = format!("{}{}", run.stdout, run.stderr);
    assert!(said.contains("answers as the IMAX manual prints"), "{run:?}");
    assert_eq!((controller.frames(), controller.writes()), (0, 0), "{run:?}");
    assert!(controller.reads() > 0, "{run:?}");
}

#[test]
fn a_play_sends_no_frame_to_a_controller_that_answers_as_the_imax_manual_prints_nor_to_others() {
    for dialect in ["smc", "mbox"] {
        let (folder, sim, printed) = (Folder::new(), Sim::one(&[]), PrintedImax::start());
        let to = [sim.addresses[0].clone(), format!("{},dialect={dialect}", printed.address)];
        let run = play(&folder.nod(&[0.1]), &to, &[]);
        assert_eq!(run.code, Some(76), "{run:?}");
        assert_only_asked(&printed, &run);
        assert!(sim.end().rows.is_empty(), "nothing is played to the other");
    }
}

#[test]
fn no_other_command_sends_it_a_frame_or_a_write_and_each_names_the_cause() {
    for dialect in ["smc", "mbox"] {
        let bind = ["--bind", "127.0.0.1:0"];
        let of = |command: &[&str], code| {
            let printed = PrintedImax::start();
            let to = format!("{},axes=3,dialect={dialect}", printed.address);
            let run = kinocue(&[command, &["--to", &to], &bind].concat());
            assert_eq!(run.code, Some(code), "{run:?}");
            assert_only_asked(&printed, &run);
        };
        of(&["latency", "--seconds", "1"], 76);
        of(&["home", "--seats-empty"], 76);
        of(&["preflight"], 69);
        of(&["register", "read", "PA02"], 76);
        of(&["register", "write", "PA02=3", "--yes"], 76);
    }
}
